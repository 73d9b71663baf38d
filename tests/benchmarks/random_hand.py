"""A random hand in the window: what grows with keys, clicks, drags, wheel, menus and training.

Run by hand: ``python tests/benchmarks/random_hand.py --actions 200000 --seconds 3600``. It prints a
line a minute, and ends with status 1 if there was an exception, if memory is more than 150 MB above
what it was after the first minute, or if threads or handles are left that were not there then.
"""

from __future__ import annotations

import argparse
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, Qt, QTimer, qInstallMessageHandler
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


def handles() -> int:
    return len([*Path("/proc/self/fd").iterdir()])


def threads() -> int:
    return len([*Path("/proc/self/task").iterdir()])


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
        # What is loaded once is loaded in the first minute, or it would count as growth.
        load_packages()
        self.trained = self.began - TRAIN
        self.places = list(PLACES)
        self.first: tuple[float, int, int] | None = None
        self.last = self.first
        self.classes = self.classes_first = Counter[str]()
        self.keys = [
            QKeySequence(key)[0]
            for name, command in window.commands.items()
            if name not in LEFT_OUT
            for key in command.shortcuts()
        ]
        self.ending = False
        self.go_on(0.0)

    def go_on(self, seconds: float) -> None:
        """Act again then, by a timer of its own, which fires in the loop of a menu as well."""
        QTimer.singleShot(int(1000 * seconds), self, self.act)

    def act(self) -> None:
        """One action, and a line a minute."""
        now = time.monotonic()
        if now - self.minute >= 60:
            self.minute += 60
            self.report()
        if self.done >= self.actions or now - self.began >= self.seconds:
            self.end()
            return
        # Even over the time, so that trainings and timers come in between as with people.
        due = self.began + self.done * self.seconds / self.actions
        self.go_on(max(0.0, due - now))
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
            widget = self.window.label.tracks
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
        self.last = (megabytes(), threads(), handles())
        self.classes = Counter(
            o.metaObject().className() for o in self.window.findChildren(QObject)
        )
        if self.first is None:
            self.first, self.classes_first = self.last, self.classes
        print(
            f"{(time.monotonic() - self.began) / 60:5.1f} min {self.done:7d} actions "
            f"{self.last[0]:6.0f} MB {self.classes.total():6d} QObjects "
            f"{len(QApplication.allWidgets()):5d} widgets "
            f"{self.last[1]:3d} threads {self.last[2]:3d} handles {len(self.troubles):3d} troubles",
            flush=True,
        )

    def end(self) -> None:
        """Let what runs come to rest, and report once more."""
        if not self.ending:
            self.ending = True
            self.window.review.trainer.cancel()
            self.window.jobs.close()
            self.go_on(5.0)
            return
        self.report()
        QApplication.exit(0)


def make_project(folder: Path) -> Path:
    """The program's own sample project, made elsewhere: what that takes is not the window's."""
    path = folder / "sample.forcelab"
    command = [sys.executable, "-m", "forcelab", "demo", str(path)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return path


def load_packages() -> None:
    """Import all of forcelab, and what it imports of SciPy and scikit-learn when it trains."""
    for module in walk_packages(forcelab_package.__path__, "forcelab."):
        if not module.name.endswith("__main__"):
            import_module(module.name)
    for name in ("ensemble", "linear_model", "neural_network", "svm", "tree", "calibration"):
        import_module(f"sklearn.{name}")


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
        threading.excepthook = lambda a: noticed(a.exc_type, a.exc_value, a.exc_traceback)
        sys.excepthook = noticed
        qInstallMessageHandler(warned)
        forcelab(["gui", str(path), "--author", "Nora"])
        hand = hands[0]
        print(dict(hand.kinds))
        if hand.first is None or hand.last is None:
            print("It ended before its first minute.")
            return 1
        more = (hand.classes - hand.classes_first).most_common(8)
        print("more of:", ", ".join(f"{name} {count:+d}" for name, count in more))
        grown = [after - before for before, after in zip(hand.first, hand.last, strict=True)]
        print(
            f"{hand.done} actions: {grown[0]:+.0f} MB, {grown[1]:+.0f} threads, "
            f"{grown[2]:+.0f} handles since the first minute, {len(troubles)} troubles"
        )
        os.chdir("/")
        return int(grown[0] > ALLOWED or grown[1] > 0 or grown[2] > 0 or bool(troubles))


if __name__ == "__main__":
    sys.exit(main())
