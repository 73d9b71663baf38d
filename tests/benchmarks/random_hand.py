"""A random hand in the window: what grows with keys, clicks, drags, wheel, menus and training.

Run by hand: ``python tests/benchmarks/random_hand.py --actions 200000 --seconds 3600``. It prints a
line a minute. After the first minute and at the end the window comes to rest in the same state: no
menu, no dialog, no job, the same demonstration in Label. It ends with status 1 if there was an
exception, or if the second time memory is more than 150 MB above the first, or more threads or
handles are open.
"""

from __future__ import annotations

import argparse
import gc
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages
from typing import NamedTuple

from PySide6.QtCore import (
    QEvent,
    QMimeDatabase,
    QObject,
    QPoint,
    QPointF,
    Qt,
    QTimer,
    qInstallMessageHandler,
)
from PySide6.QtGui import (
    QContextMenuEvent,
    QDesktopServices,
    QKeySequence,
    QMouseEvent,
    QWheelEvent,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QMenu, QWidget

import forcelab as forcelab_package
from forcelab.cli import main as forcelab
from forcelab.gui import window as window_module
from forcelab.project.database import FILE

#: Megabytes that the window may have grown by since its first minute.
ALLOWED = 150
LEFT, NONE = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
PLAIN = Qt.KeyboardModifier.NoModifier
#: Commands that would end the program or leave its folder.
LEFT_OUT = {"quit", "close", "new_window", "full_screen"}
PLACES = ("label", "review", "capture", "tradeoff")
#: Seconds between trainings, and between opening demonstrations.
TRAIN, OPEN = 60.0, 0.7


def megabytes() -> float:
    """Memory that this process holds."""
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def handles() -> Counter[str]:
    """What is open, by the name of the file, pipe or socket; numbers of the kernel left out."""
    names: Counter[str] = Counter()
    for handle in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):
            names[handle.readlink().name.partition(":")[0]] += 1
    # SQLite keeps a closed connection's handle of the store for the next one while any is open.
    # Each connection that is open shows by its handle of the write-ahead log.
    names[FILE] = min(names[FILE], 1)
    return names


def threads() -> Counter[str]:
    """The threads by their names as the kernel has them."""
    names: Counter[str] = Counter()
    for task in Path("/proc/self/task").iterdir():
        with suppress(FileNotFoundError):
            names[(task / "comm").read_text("utf-8").strip()] += 1
    return names


class State(NamedTuple):
    """What the window holds at rest: Qt's objects by their classes, Python's by their types."""

    megabytes: float
    threads: Counter[str]
    handles: Counter[str]
    classes: Counter[str]
    objects: Counter[str]


class Hand(QObject):
    """Does one random thing whenever the program is idle."""

    def __init__(self, window, actions: int, seconds: float, seed: int) -> None:
        super().__init__(window)
        self.window, self.actions, self.seconds = window, actions, seconds
        self.chance = random.Random(seed)
        self.done = 0
        self.kinds: Counter[str] = Counter()
        self.troubles: list[str] = []
        self.began = time.monotonic()
        self.minute = self.opened = self.began
        self.trained = self.began - TRAIN
        self.places = list(PLACES)
        self.first: State | None = None
        self.last: State | None = None
        self.keys = [
            QKeySequence(key)[0]
            for name, command in window.commands.items()
            if name not in LEFT_OUT
            for key in command.shortcuts()
        ]
        self.call_after(0.0, self.act)

    def call_after(self, seconds: float, call: Callable[[], object]) -> None:
        """Call it then, by a timer of its own, which fires in the loop of a menu as well."""
        # Without a receiver: PySide would keep a weak reference to it for each call.
        QTimer.singleShot(int(1000 * seconds), call)

    def act(self) -> None:
        """One action, and a line a minute."""
        now = time.monotonic()
        if now - self.minute >= 60:
            self.minute += 60
            self.report()
            if self.first is None:
                self.rest(self.begin_to_compare)
                return
        if self.done >= self.actions or now - self.began >= self.seconds:
            self.rest(self.end)
            return
        # Even over the time, so that trainings and timers come in between as with people; a
        # little ahead of it, so that what delays it at the end does not cost the last actions.
        due = self.began + self.done * 0.95 * self.seconds / self.actions
        self.call_after(max(0.0, due - now), self.act)
        if now < due:
            return
        self.done += 1
        if (popup := QApplication.activePopupWidget()) is not None:
            self.in_menu(popup)
        elif (dialog := QApplication.activeModalWidget()) is not None:
            self.in_dialog(dialog)
        elif now - self.trained > TRAIN:
            self.trained = now
            self.press(QKeySequence("F5")[0])
        elif self.places and self.done % 200 == 100:
            self.window.show_workspace(self.places.pop())
        elif now - self.opened > OPEN:
            self.opened = now
            self.open_another()
        else:
            weights = {"key": 40, "click": 20, "drag": 15, "wheel": 15, "menu": 4, "switch": 2}
            kind = self.chance.choices(list(weights), list(weights.values()))[0]
            self.kinds[kind] += 1
            getattr(self, kind)()

    # What it does

    def in_menu(self, menu: QWidget) -> None:
        """Mostly leave it; what is chosen is nothing that ends the program."""
        self.kinds["in menu"] += 1
        QTest.keyClick(menu, Qt.Key.Key_Down)
        if isinstance(menu, QMenu) and self.chance.random() < 0.3:
            chosen = menu.activeAction()
            if chosen is not None and chosen not in map(self.window.commands.get, LEFT_OUT):
                QTest.keyClick(menu, Qt.Key.Key_Return)
                return
        QTest.keyClick(menu, Qt.Key.Key_Escape)

    def in_dialog(self, dialog: QWidget) -> None:
        """Type and go through it, then leave it without its consequences."""
        self.kinds["in dialog"] += 1
        if self.chance.random() < 0.5 and not isinstance(dialog, QFileDialog):
            key = self.chance.choice((Qt.Key.Key_Tab, Qt.Key.Key_Down, Qt.Key.Key_A))
            QTest.keyClick(QApplication.focusWidget() or dialog, key)
        else:
            QTest.keyClick(dialog, Qt.Key.Key_Escape)

    def open_another(self) -> None:
        document = self.window.document
        if document.infos:
            document.open_demonstration(self.chance.choice(document.infos).id)

    def switch(self) -> None:
        self.window.show_workspace(self.chance.choice(PLACES))

    def key(self) -> None:
        document = self.window.document
        if self.chance.random() < 0.3 and document.vocabulary.names:
            self.press(QKeySequence(str(self.chance.randint(1, 6)))[0])
        else:
            self.press(self.chance.choice(self.keys))

    def press(self, combination) -> None:
        target = QApplication.focusWidget() or self.window
        QTest.keyClick(target, combination.key(), combination.keyboardModifiers())

    def spot(self) -> tuple[QWidget, QPoint]:
        """A widget and a point in it, anywhere in the window but its menus and its frame."""
        window = self.window
        top = window.menuBar().height()
        at = QPoint(
            self.chance.randrange(window.width()), self.chance.randrange(top, window.height())
        )
        widget = window.childAt(at) or window.centralWidget()
        return widget, widget.mapFrom(window, at)

    def mouse(self, kind, widget: QWidget, at: QPoint, button, held) -> None:
        there = QPointF(widget.mapToGlobal(at))
        event = QMouseEvent(kind, QPointF(at), there, button, held, PLAIN)
        QApplication.sendEvent(widget, event)

    def click(self) -> None:
        widget, at = self.spot()
        QTest.mouseClick(widget, LEFT, PLAIN, at)

    def drag(self) -> None:
        widget, at = self.spot()
        if self.chance.random() < 0.6 and self.window.label.tracks.isVisible():
            widget = self.window.label.tracks.viewport()
            at = QPoint(
                self.chance.randrange(widget.width()), self.chance.randrange(widget.height())
            )
        self.mouse(QEvent.Type.MouseButtonPress, widget, at, LEFT, LEFT)
        for _ in range(3):
            at += QPoint(self.chance.randint(-60, 60), self.chance.randint(-5, 5))
            self.mouse(QEvent.Type.MouseMove, widget, at, NONE, LEFT)
        self.mouse(QEvent.Type.MouseButtonRelease, widget, at, LEFT, NONE)

    def wheel(self) -> None:
        widget, at = self.spot()
        held = self.chance.choice((PLAIN, PLAIN, Qt.KeyboardModifier.ControlModifier))
        turn = QPoint(0, self.chance.choice((-120, 120)))
        phase = Qt.ScrollPhase.NoScrollPhase
        there = QPointF(widget.mapToGlobal(at))
        event = QWheelEvent(QPointF(at), there, QPoint(), turn, NONE, held, phase, False)
        QApplication.sendEvent(widget, event)

    def menu(self) -> None:
        widget, at = self.spot()
        event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, at, widget.mapToGlobal(at))
        QApplication.sendEvent(widget, event)

    # What it reports

    def report(self) -> None:
        """A line on what the window holds now."""
        print(
            f"{(time.monotonic() - self.began) / 60:5.1f} min {self.done:7d} actions "
            f"{megabytes():6.0f} MB {len(gc.get_objects()):7d} objects "
            f"{len(self.window.findChildren(QObject)):6d} QObjects "
            f"{len(QApplication.allWidgets()):5d} widgets {threads().total():3d} threads "
            f"{handles().total():3d} handles {len(self.troubles):3d} troubles",
            flush=True,
        )

    def rest(self, then: Callable[[], object]) -> None:
        """Leave what is open, show the first demonstration in Label, and wait for the jobs."""
        open_now = QApplication.activePopupWidget() or QApplication.activeModalWidget()
        if open_now is not None:
            QTest.keyClick(open_now, Qt.Key.Key_Escape)
            self.call_after(0.1, lambda: self.rest(then))
            return
        self.window.review.trainer.cancel()
        self.window.show_workspace("label")
        document = self.window.document
        if document.infos:
            document.open_demonstration(document.infos[0].id)
        self.await_jobs(then)

    def await_jobs(self, then: Callable[[], object]) -> None:
        """Three seconds after the last job: by then timers have fired and threads have ended."""
        busy = bool(self.window.jobs.busy)
        self.call_after(*((0.5, lambda: self.await_jobs(then)) if busy else (3.0, then)))

    def state(self) -> State:
        gc.collect()
        classes = Counter(o.metaObject().className() for o in self.window.findChildren(QObject))
        objects = Counter(type(o).__name__ for o in gc.get_objects())
        return State(megabytes(), threads(), handles(), classes, objects)

    def begin_to_compare(self) -> None:
        self.first = self.state()
        self.act()

    def end(self) -> None:
        self.report()
        self.last = self.state()
        QApplication.exit(0)


def make_project(folder: Path) -> Path:
    """The program's own sample project, made elsewhere: what that takes is not the window's."""
    path = folder / "sample.forcelab"
    command = [sys.executable, "-m", "forcelab", "demo", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return path


def load_packages() -> None:
    """Load all of forcelab, what it needs of scikit-learn when it trains, and Qt's file types."""
    for module in walk_packages(forcelab_package.__path__, "forcelab."):
        if not module.name.endswith("__main__"):
            import_module(module.name)
    for name in ("ensemble", "linear_model", "neural_network", "svm", "tree", "calibration"):
        import_module(f"sklearn.{name}")
    QMimeDatabase().mimeTypeForName("text/csv")  # opens its table of types


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--actions", type=int, default=20_000)
    parser.add_argument("--seconds", type=float, default=360.0)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    hands: list[Hand] = []
    troubles: list[str] = []

    def begun(window, start) -> None:
        begin(window, start)
        hands.append(Hand(window, given.actions, given.seconds, given.seed))
        hands[0].troubles = troubles

    def noticed(kind, value, trace) -> None:
        troubles.append("".join(traceback.format_exception(kind, value, trace)))
        print(troubles[-1], flush=True)

    def warned(_, __, text: str) -> None:
        if "propagateSizeHints" not in text:
            troubles.append(text)
            print(text, flush=True)

    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    begin = window_module.Window.begin
    window_module.Window.begin = begun
    window_module.Window.closeEvent = lambda _, event: event.ignore()
    QDesktopServices.openUrl = staticmethod(lambda _: True)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["FORCELAB_SETTINGS"] = str(Path(folder) / "settings.ini")
        os.environ["HOME"] = os.environ["XDG_CACHE_HOME"] = folder
        os.chdir(folder)
        path = make_project(Path(folder))
        # What is loaded once, by and by, would count as growth.
        load_packages()
        threading.excepthook = lambda a: noticed(a.exc_type, a.exc_value, a.exc_traceback)
        sys.excepthook = noticed
        qInstallMessageHandler(warned)
        forcelab(["gui", str(path), "--author", "Nora"])
        hand = hands[0]
        print(dict(hand.kinds))
        if hand.first is None or hand.last is None:
            print("It ended before its first minute.")
            return 1
        threads_more = hand.last.threads.total() - hand.first.threads.total()
        handles_more = hand.last.handles.total() - hand.first.handles.total()
        megabytes_more = hand.last.megabytes - hand.first.megabytes
        for name in ("classes", "objects", "threads", "handles"):
            more = getattr(hand.last, name) - getattr(hand.first, name)
            counts = ", ".join(f"{key} {count:+d}" for key, count in more.most_common(8))
            print(f"more {name}: {counts or 'none'}")
        print(
            f"{hand.done} actions: {megabytes_more:+.0f} MB, {threads_more:+d} threads, "
            f"{handles_more:+d} handles since the first minute, {len(troubles)} troubles"
        )
        os.chdir("/")
        return int(
            megabytes_more > ALLOWED or threads_more > 0 or handles_more > 0 or bool(troubles)
        )


if __name__ == "__main__":
    sys.exit(main())
