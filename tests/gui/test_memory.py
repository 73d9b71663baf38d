"""A day in the window: what demonstrations, menus and workspaces leave behind is nothing."""

from __future__ import annotations

import gc
import os
import re
import shutil
import tempfile
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

import pytest
from factories import MEMORY_FOLDER, foam_demonstration, write_opencv_video
from PySide6.QtCore import QEventLoop, QObject, QPoint, QPropertyAnimation, Qt, QTimer
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractScrollArea, QApplication

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration, VideoReference
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import Window
from forcelab.labels import Interval, Segment, Track
from forcelab.project import Project
from forcelab.recognition.results import DemonstrationResult
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import RunResult
from forcelab.vocabulary import Vocabulary

ACTIONS = ("grab", "hold", "release")
HUMAN = (Segment(0, 2, "grab"), Segment(2, 6, "hold"), Segment(6, 8, "release"))
SEEN = (Segment(0, 2.1, "grab"), Segment(2.1, 3, "hold"), Segment(3, 8, "release"))
#: So many are opened; what is there after the first of them is all there ever is.
COUNT, FIRST = 48, 12


@pytest.fixture
def study(tmp_path):
    """A day's demonstrations, every fifth one filmed."""
    folder = tempfile.mkdtemp(dir=MEMORY_FOLDER or tmp_path)  # of this run alone
    path = Path(folder) / "day.forcelab"
    film = write_opencv_video(tmp_path / "film.avi", "MJPG", 10)
    plain = foam_demonstration()
    with Project.create(path) as project:
        project.actions.set_vocabulary("foam", Vocabulary().with_actions(*ACTIONS))
        for number in range(COUNT):
            videos = (VideoReference(film, ClockMap()),) if number % 5 == 0 else ()
            demonstration = replace(
                plain, name=f"{number:03d}", signals=plain.signals + number / COUNT, videos=videos
            )
            project.demonstrations.add(demonstration, [Track("Ann", HUMAN)])
    yield path
    shutil.rmtree(folder)


def drive(steps: Iterator[None]) -> None:
    """Take steps in a loop of events, one after the other: what is to be deleted goes there."""
    loop, errors = QEventLoop(), []

    def step() -> None:
        try:
            next(steps)
        except StopIteration:
            loop.quit()
        except BaseException as error:  # noqa: BLE001 - raised where the loop was begun
            errors.append(error)
            loop.quit()
        else:
            QTimer.singleShot(0, step)

    QTimer.singleShot(0, step)
    loop.exec()
    if errors:
        raise errors[0]


def store_handle(path: Path) -> str:
    """What `there_is` calls the handle of a project's store."""
    return "handle " + re.sub("[0-9]+", "", str(path / "project.sqlite"))


def count_live_objects(window: Window) -> Counter[str]:
    """How many Qt objects, demonstrations, decoders, threads, handles and megabytes there are."""
    gc.collect()
    found = Counter(part.metaObject().className() for part in window.findChildren(QObject))
    found["top-level widgets"] = len(QApplication.topLevelWidgets())
    for part in gc.get_objects():
        if isinstance(part, Demonstration | DemonstrationResult | VideoReference | Segment):
            found[type(part).__name__] += 1
    found["threads"] = len([*Path("/proc/self/task").iterdir()])
    for handle in Path("/proc/self/fd").iterdir():
        with suppress(FileNotFoundError):  # the one that lists them
            found[f"handle {re.sub('[0-9]+', '', str(handle.readlink()))}"] += 1
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[1])
    found["MB"] = pages * os.sysconf("SC_PAGE_SIZE") >> 20
    return found


def moving(window: Window) -> bool:
    """Whether Qt is moving a panel to its place."""
    running = QPropertyAnimation.State.Running
    return any(part.state() == running for part in window.findChildren(QPropertyAnimation))


def menu_at(widget) -> None:
    """Open a widget's menu as a right click does, and leave it."""
    at = QPoint(widget.width() // 2, widget.height() // 2)
    reason = QContextMenuEvent.Reason.Mouse
    target = widget.viewport() if isinstance(widget, QAbstractScrollArea) else widget
    QApplication.sendEvent(target, QContextMenuEvent(reason, at, widget.mapToGlobal(at)))
    if (menu := QApplication.activePopupWidget()) is not None:
        QTest.keyClick(menu, Qt.Key.Key_Escape)


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="what is open is counted in /proc")
def test_a_day_of_demonstrations_leaves_nothing_behind(app, study, until):
    window = Window("Ann")
    window.resize(900, 600)
    window.show()
    window.begin(LaunchOptions(project=study))
    until(lambda: window.settled)
    document, counts = window.document, []
    tested = tuple(
        DemonstrationResult(i.id, i.name, "foam", 0.0, 10.0, HUMAN, {"raw": SEEN, "filtered": SEEN})
        for i in document.infos
    )
    now = datetime.now(timezone.utc)
    document.review.set_run(
        RunResult(0, now, "foam", ("foam",), None, "Ann", False, Settings(), ACTIONS, (), tested)
    )
    window.show_workspace("review")
    until(lambda: not window.review.workspace.queue.reader.stale)

    def day() -> Iterator[None]:
        queue = window.review.workspace.queue
        for number, info in enumerate(document.infos):
            assert document.open_demonstration(info.id)
            yield
            assert document.editor.paint(8.0, 9.0, ACTIONS[number % 3])
            document.select(0)
            yield
            if number % 3 == 0:
                for part in (window.label.tracks, window.label.force, window.label.scalogram):
                    menu_at(part)
                window.label.vocabulary.menu("grab").deleteLater()
                yield
            if number % 6:
                continue
            window.show_workspace("review")
            document.review.examine(Interval(info.id, 3.0, 6.0, "hold", "release"))
            queue.judge("human")
            yield
            window.show_workspace("label")
            if number in (FIRST, COUNT - 6):
                document.open_demonstration(document.infos[0].id)
                for _ in range(20):
                    yield
                window.show_workspace("review")  # a hidden queue stays as it is
                until(lambda: window.settled and not queue.reader.stale)
                window.show_workspace("label")
                until(lambda: window.settled and not moving(window))
                for _ in range(20):  # what ended is deleted in this loop
                    yield
                counts.append(count_live_objects(window))

    drive(day())
    window.close()
    window.deleteLater()
    grown = counts[1] - counts[0]
    # The labels themselves are kept, by the store and the queue; and memory goes by pages.
    # SQLite closes a second connection's handle only when no other connection holds a lock.
    allowed = {"MB": 7, "Segment": 12 * (COUNT - FIRST), store_handle(study): 1}
    assert {what: more for what, more in grown.items() if more > allowed.get(what, 0)} == {}
