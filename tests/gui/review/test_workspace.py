"""The Review workspace in the whole window, with the real trainer and a project of two tasks."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from factories import BAYES_SETTINGS, synthetic_set, write_opencv_video
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from window_helpers import painted_once

from forcelab.cli import main
from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.gui import settings
from forcelab.gui.label.workspace import LAYOUT
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import WORKSPACES
from forcelab.jobs import finish
from forcelab.labels import Track
from forcelab.project import Project
from forcelab.recognition.dataset import DataSelection
from forcelab.review.training import review_job


@pytest.fixture(scope="module")
def reviewed_project(tmp_path_factory):
    """Three foams by Ada, the first one filmed, two soft ones, and one nobody labelled; one run."""
    folder = tmp_path_factory.mktemp("review")
    film = write_opencv_video(folder / "film.avi", "MJPG", 20)
    path = folder / "study.forcelab"
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(6, 100.0)):
            task = "foam" if number < 4 else "soft"
            videos = (VideoReference(film, ClockMap()),) if number == 0 else ()
            tracks = [Track("Ada", segments)] if number != 3 else []
            project.demonstrations.add(replace(demonstration, task=task, videos=videos), tracks)
    finish(review_job(path, BAYES_SETTINGS.replace(seed=1), DataSelection(("foam",)), "foam"))
    return path


@pytest.fixture
def study(reviewed_project, tmp_path):
    """A copy of it."""
    return Path(shutil.copytree(reviewed_project, tmp_path / "study.forcelab"))


@pytest.fixture
def open_window(window_of_file, until):
    """Open a project in the window of the test before, if it was not closed."""

    def open_(path, workspace="label", demonstration=""):
        start = LaunchOptions(project=path, workspace=workspace, demonstration=demonstration)
        window = window_of_file(start, "Ada", (780, 700))  # a wide one lets the next be smaller
        window.activateWindow()
        runs = window.document.project.runs.summaries()
        with painted_once(window):
            until(lambda: bool(window.document.review.run) == bool(runs))
            until(lambda: window.isActiveWindow() and window.settled and not window.jobs.busy)
        return window

    return open_


@pytest.fixture
def rested(until):
    """Wait until nothing in a window moves any more."""

    def wait(window):
        label, sizes = window.label, []

        def calm():
            places = (window, label, label.tracks, label.video, label.vocabulary)
            sizes.append(tuple((place.width(), place.height()) for place in places))
            return window.settled and len(sizes) > 20 and len(set(sizes[-20:])) == 1

        with painted_once(window):
            until(calm)

    return wait


def rows(segments):
    """Segments as `forcelab evaluate` keeps them."""
    return [[s.start, s.end, s.action] for s in segments]


def test_the_pairs_on_screen_are_those_of_evaluate(
    study, open_window, until, tmp_path, monkeypatch
):
    # It begins sooner than in a process of its own.
    monkeypatch.setattr("forcelab.process.run_in_process", lambda work, *given: work(*given))
    window = open_window(study, "review")
    trainer = window.review.trainer
    trainer.set_settings(BAYES_SETTINGS)
    assert trainer.train()
    until(lambda: not trainer.training)
    assert not trainer.trouble
    until(lambda: not window.jobs.busy)
    entries = {entry.id: entry for entry in window.review.workspace.pairs.area.entries}
    options = ("--task", "foam", "--classifier", "naive-bayes", "--max-scale", "32", "--jobs", "1")
    assert not main(["evaluate", str(study), *options, "--json", str(tmp_path / "scores.json")])
    scores = json.loads((tmp_path / "scores.json").read_text())
    with Project.open(study) as project:
        evaluated = project.runs.all()[-1].result
    assert {which: evaluated[which] for which in ("raw", "filtered")} == {
        which: scores[which] for which in ("raw", "filtered")
    }
    assert len(evaluated["tracks"]) == 3
    for track, score in zip(evaluated["tracks"], scores["filtered"]["demonstrations"], strict=True):
        entry = entries[track["demonstration"]]
        assert rows(entry.human) == track["human"]
        assert rows(entry.reviewed.predicted) == track["filtered"]
        assert rows(entry.reviewed.stages["raw"]) == track["raw"]
        assert entry.share == score["accuracy"]
        assert not entry.edited


def test_timeline_and_video_are_lent_and_come_back(study, open_window, until, rested):
    window = open_window(study, demonstration="foam 01")
    label = window.label
    window.resize(1000, 700)  # a window with too little room for Review grows, and stays so
    label.toggles["scalogram"].setChecked(False)
    label.toggles["segments"].setChecked(False)
    rested(window)
    places = (label.tracks, label.force, label.video, label.vocabulary)
    before = [(place.isVisible(), place.window(), place.width()) for place in places]

    window.show_workspace("review")
    until(label.tracks.isVisible)
    rested(window)
    review = window.review
    assert all(review.isAncestorOf(panel) for panel in (label.tracks, label.force, label.video))
    assert label.tracks.isVisible()
    assert label.video.isVisible()
    assert label.video.shown_index == 0
    assert not label.scalogram.isVisible()
    window.document.editor.paint(0.0, 0.5, "hold")
    assert rows(window.document.editor.segments)[0] == [0.0, 0.5, "hold"]

    window.show_workspace("label")
    rested(window)
    assert not any(review.isAncestorOf(panel) for panel in places)
    assert [(place.isVisible(), place.window(), place.width()) for place in places] == before
    assert not label.scalogram.isVisible()
    assert not label.segments.isVisible()


def test_the_layout_is_remembered_whichever_workspace_is_in_front(study, open_window, rested):
    first = open_window(study, demonstration="foam 01")
    first.label.toggles["history"].setChecked(False)
    rested(first)
    # Not its width: a window that wants more room than the screen has is not as wide again.
    docks, before = first.label._docks, first.label.video.height()
    first.label.resizeDocks([docks["video"]], [400], Qt.Orientation.Vertical)
    rested(first)
    height = first.label.video.height()
    assert height > before + 20
    whole = bytes(first.label.saveState(LAYOUT).data())
    first.show_workspace("review")
    rested(first)
    first.review.workspace.lists.setCurrentIndex(2)
    first.close()
    assert "history" in settings.strings("label/hidden")
    # Nor the layout that the lists have among themselves while timeline and video are lent.
    assert settings.data("label/layout") == whole
    second = open_window(study, demonstration="foam 01")
    rested(second)
    assert not second.label.history.isVisible()
    assert second.label.video.isVisible()
    assert second.label.video.height() == height


@pytest.mark.parametrize("workspace", ["label", "review"])
def test_an_empty_list_is_remembered_with_the_room_that_it_gave_away(
    study, open_window, rested, workspace
):
    first = open_window(study, demonstration="foam 01")  # labelled, the next one is not
    rested(first)
    heights = [first.label._docks[name].height() for name in ("video", "actions", "segments")]
    first.document.set_author("Ben")
    rested(first)
    assert first.label._docks["segments"].height() < heights[2] - 20
    first.show_workspace(workspace)
    rested(first)
    first.close()
    second = open_window(study, demonstration="foam 01")
    second.document.set_author("Ada")
    rested(second)
    again = [second.label._docks[name].height() for name in ("video", "actions", "segments")]
    assert again == pytest.approx(heights, abs=2)


def test_a_window_that_opens_on_a_filmed_demonstration_without_segments_has_a_small_list(
    study, open_window, rested
):
    with Project.open(study) as project:
        id_ = project.demonstrations.id_of("foam 01")
        project.tracks.edit(id_, "Ada", project.tracks.get(id_, "Ada").segments, (), "erased")
    window = open_window(study, demonstration="foam 01")
    rested(window)
    docks = window.label._docks
    assert docks["video"].isVisible()
    assert docks["segments"].height() == docks["segments"].minimumSizeHint().height()
    window.commands["reset_layout"].trigger()
    rested(window)
    assert docks["segments"].height() == docks["segments"].minimumSizeHint().height()


def test_without_a_run_the_timeline_has_the_room_of_the_pairs(study, open_window, rested):
    window = open_window(study, "review", demonstration="foam 01")
    rested(window)
    review, splitter = window.review.workspace, window.review.workspace._left
    run, sizes = window.document.review.run, splitter.sizes()
    window.document.review.set_run(None)
    rested(window)
    assert splitter.sizes()[0] == review.pairs.maximumHeight() < sizes[0] - 20
    assert splitter.sizes()[1] > sizes[1] + 20
    review.remember_layout()
    review.restore_layout()
    window.document.review.set_run(run)
    rested(window)
    assert splitter.sizes() == sizes
    window.document.review.set_run(None)
    review.reset_layout()
    window.document.review.set_run(run)
    rested(window)
    assert splitter.sizes() == pytest.approx(sizes, abs=2)


def test_in_a_low_window_lists_have_more_room_than_the_video_until_it_is_dragged(
    study, open_window, rested
):
    window = open_window(study, "review", demonstration="foam 01")
    right = window.review.workspace._right

    def heights(width, height):
        window.resize(width, height)
        rested(window)
        return right.sizes()

    lists, video = heights(1024, 640)
    assert lists > 2.2 * video > 180  # a picture is still seen
    lists, video = large = heights(1600, 1000)
    assert lists == pytest.approx(1.5 * video, abs=8)
    assert heights(1024, 640)[0] > 2.2 * right.sizes()[1]
    handle = right.handle(1)
    QTest.mousePress(handle, Qt.MouseButton.LeftButton)
    QTest.mouseMove(handle, handle.rect().center() - QPoint(0, 110))
    QTest.mouseRelease(handle, Qt.MouseButton.LeftButton, pos=QPoint(1, 1))
    rested(window)
    dragged = right.sizes()
    assert dragged[1] > video / 2 + 50
    assert heights(1600, 1000)[1] > large[1]
    assert heights(1024, 640) == pytest.approx(dragged, abs=4)
    window.close()
    again = open_window(study, "review", demonstration="foam 01")
    window = again
    right = window.review.workspace._right
    assert heights(1024, 640) == pytest.approx(dragged, abs=8)


def test_a_video_is_large_once_the_window_fills_a_large_screen(study, open_window, until):
    """At first it had the room of a small window; a width that was dragged stays."""
    window = open_window(study, demonstration="foam 01")
    window.setUpdatesEnabled(False)  # sizes alone are looked at
    video, panels = window.label._docks["video"], window.label._splitter
    window.resize(1200, 1000)
    until(lambda: video.width() < 300)
    tracks, forces, scalogram = panels.sizes()
    panels.setSizes([tracks, scalogram, forces])  # as somebody drags them
    window.resize(1900, 1000)
    until(lambda: video.width() > 600)
    assert panels.sizes()[2] > panels.sizes()[1] + 50
    window.resize(1200, 1000)
    until(lambda: video.width() < 300)
    border = video.geometry().topLeft() + QPoint(-3, 200)
    QTest.mousePress(window.label, Qt.MouseButton.LeftButton, pos=border)
    QTest.mouseMove(window.label, border - QPoint(30, 0))
    QTest.mouseRelease(window.label, Qt.MouseButton.LeftButton, pos=border - QPoint(30, 0))
    until(lambda: window.label._widths[video] == video.width())
    dragged = video.width()
    window.resize(1900, 1000)
    until(lambda: window.label.width() > 1400)
    assert video.width() == dragged


def test_a_demonstration_without_video_has_no_room_for_one(study, open_window, until):
    window = open_window(study, "review", "foam 02")
    assert not window.label.video.isVisible()
    assert window.label.tracks.isVisible()
    assert window.document.open_demonstration(window.document.infos[0].id)
    until(lambda: window.settled)
    assert window.label.video.isVisible()


def test_opening_a_project_shows_its_last_run_and_another_task_has_its_own(
    study, open_window, until
):
    window = open_window(study, "review")
    run, trainer = window.document.review.run, window.review.trainer
    assert (run.number, run.tasks) == (1, ("foam",))
    assert run.settings.seed == 1
    assert run.proposer in window.document.other_tracks
    pairs = window.review.workspace.pairs
    assert len(pairs.area.entries) == 4
    trainer.set_task("soft")
    until(lambda: window.settled)
    assert window.document.review.run is None
    assert not pairs.area.entries
    obstacle = window.review.obstacles()["next_review"]
    assert obstacle() == "There is nothing to review yet; train first, with F5."
    window.document.review.set_training(True)
    sentence = "A recogniser is being trained; when that is done, there is something to review."
    assert obstacle() == sentence
    window.document.review.set_training(False)
    trainer.set_task("foam")
    until(lambda: window.document.review.run is not None and not window.jobs.busy)
    assert len(pairs.area.entries) == 4


def test_undo_goes_back_to_the_last_verdict_and_then_to_what_was_painted_here(
    study, open_window, until
):
    window = open_window(study, "review")
    document = window.document
    queue = window.review.workspace.queue
    first, second = (result.id for result in document.review.run.tested[:2])

    def stored():
        return [rows(document.project.tracks.get(id_, "Ada").segments) for id_ in (first, second)]

    document.open_demonstration(second)
    document.editor.paint(0.0, 0.3, "hold")  # something that is not to be undone
    until(lambda: not queue.reader.stale)
    before = stored()
    place = next(p for p in queue.queue.open if p.demonstration == first)
    document.review.examine(place)
    window.commands["verdict_model"].trigger()
    assert stored() != before
    document.open_demonstration(second)
    window.commands["undo"].trigger()
    assert stored() == before
    assert document.id == first
    # Painted after the verdict, it is what is undone first.
    document.review.examine(place)
    window.commands["verdict_model"].trigger()
    judged = stored()
    document.open_demonstration(second)
    document.editor.paint(0.0, 0.3, "grab")
    window.commands["undo"].trigger()
    assert stored() == judged
    assert document.id == second


def test_a_window_on_a_demonstration_without_video_loads_nothing_that_it_does_not_need(study):
    script = f"""
import json, sys, threading, time
from pathlib import Path
from PySide6.QtWidgets import QApplication
app = QApplication([])
from forcelab.gui.launch_options import LaunchOptions as Start
from forcelab.gui.window import WORKSPACES, Window
at_first = list(sys.modules)
window = Window("Ada", remembering=False)
window.show()
window.begin(Start(project=Path({str(study)!r}), demonstration="foam 02"))
# Of its own time: on a machine with much else to do 30 s may pass before it has had one.
end = time.process_time() + 10
while not (window.settled and window.document.review.run) and time.process_time() < end:
    app.processEvents()
    time.sleep(0.001)
runs = len(window.document.project.runs.all())
assert window.document.review.run is not None, (runs, window.statusBar().currentMessage())
threads = [thread.name for thread in threading.enumerate()]
shown = window.label.video.isVisible()
window.close()
print(json.dumps([at_first, list(sys.modules), threads, shown]))
"""
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    at_first, loaded, threads, shown = json.loads(done.stdout)
    assert not {"scipy", "scipy.fft"} & set(at_first), "no transform before it is to be seen"
    never = {"cv2", "sklearn", "serial", "joblib", "scipy.signal", "scipy.optimize"}
    unseen = {
        "forcelab.gui.review.workspace",
        "forcelab.review.explanation",
        "forcelab.capture.recorder",
    }
    assert not (never | unseen) & set(loaded)
    assert not [name for name in threads if "video" in name or "decod" in name]
    assert not shown


def test_who_comes_back_to_the_queue_can_press_n_at_once(study, open_window, until):
    window = open_window(study, "review")
    workspace = window.review.workspace
    workspace.lists.setCurrentIndex(1)
    workspace.confusion.switches.unit_box.setFocus()
    workspace.lists.setCurrentIndex(0)
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_N)
    until(lambda: window.document.review.examined is not None)
    assert workspace.queue.filter.text() == ""


def test_who_comes_back_to_the_review_has_the_keyboard_where_it_was(study, windows, until):
    window = windows(LaunchOptions(project=study), "Ada")
    window.show_workspace("review")
    assert window.label.tracks.hasFocus()
    queue = window.review.workspace.queue.list
    until(queue.isVisible)
    for part in (window.label.tracks, queue):
        part.setFocus()
        for name in ("capture", "label", "review"):
            window.show_workspace(name)
        assert part.hasFocus()


@pytest.mark.parametrize("elsewhere", [False, True])
def test_keys_that_decide_a_consensus_paint_nothing(study, open_window, until, elsewhere):
    """Nor where another demonstration was open, whose track has the keyboard when it opens."""
    with Project.open(study) as project:
        first, second = project.demonstrations.infos("foam")[:2]
        track = project.tracks.get(first.id, "Ada").segments
        other = (replace(track[0], action="release"), *track[1:])
        project.tracks.edit(first.id, "Ben", (), other, "made")
    window = open_window(study, "review", (second if elsewhere else first).name)
    workspace = window.review.workspace
    window.label.tracks.setFocus()
    titles = [workspace.lists.tabText(at) for at in range(workspace.lists.count())]
    workspace.lists.setCurrentIndex(titles.index("Coders"))
    coders = workspace.coders
    until(coders.pages.isVisible)
    coders.pages.setCurrentIndex(1)
    bar = coders.consensus
    until(lambda: bar.consensus is not None and not window.jobs.busy)
    workspace.lists.setCurrentIndex(0)
    window.label.tracks.setFocus()
    workspace.lists.setCurrentIndex(titles.index("Coders"))
    assert bar.hasFocus()
    window.label.tracks.setFocus()
    coders.pages.setCurrentIndex(0)
    coders.pages.setCurrentIndex(1)
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_B)
    document = window.document
    assert "2" in [action.key for action in document.vocabulary]
    place, before = bar.current, document.editor.segments
    keyboard = QApplication.focusWidget()
    assert keyboard is not None
    assert bar.isAncestorOf(keyboard)
    QTest.keyClick(keyboard, Qt.Key.Key_2)
    assert document.stroke is None
    assert document.editor.segments == before
    assert document.project.tracks.get(first.id, "Ada").segments == before
    decided = document.project.tracks.get(first.id, "consensus").segments
    assert (place.start, "release") in [(s.start, s.action) for s in decided]
    # Anywhere else the same key paints as ever.
    window.label.tracks.setFocus()
    QTest.keyClick(window.label.tracks, Qt.Key.Key_2)
    assert document.stroke is not None or document.editor.segments != before


def test_without_recordings_it_says_what_comes_first(tmp_path, open_window, until):
    path = tmp_path / "empty.forcelab"
    Project.create(path).close()
    window = open_window(path, "review")
    workspace = window.review.workspace
    workspace.lists.setCurrentIndex(0)
    assert workspace.hint.isVisible()
    assert "Import" in workspace.hint.text()
    assert not workspace.queue.isVisible()  # which would say "Train"
    (demonstration, segments), *_ = synthetic_set(1, 100.0)
    window.document.project.demonstrations.add(demonstration, [Track("Ada", segments)])
    window.document.refresh_listing()
    assert workspace.queue.isVisible()
    assert not workspace.hint.isVisible()


def test_every_workspace_fits_a_full_hd_screen_at_twice_the_size(study, open_window, until):
    window = open_window(study, "review")
    window.setUpdatesEnabled(False)  # sizes alone are looked at
    lists = window.review.workspace.lists
    for place in range(lists.count()):
        lists.setCurrentIndex(place)
    for name in WORKSPACES:
        window.show_workspace(name)
        until(lambda: window.settled)
        window.resize(960, 540)
        assert (window.width(), window.height()) == (960, 540), "it grows to what it needs"


def test_arrows_move_in_the_list_that_has_the_keyboard_and_elsewhere_the_cursor(study, open_window):
    window = open_window(study, "review", "foam 01")
    document, area = window.document, window.review.workspace.pairs.area
    cursor, row = document.view.cursor, area.row
    window.activateWindow()
    area.setFocus()
    for key in (Qt.Key.Key_Down, Qt.Key.Key_Right):
        QTest.keyClick(area, key)
    assert (area.row, area.mark) == (row + 1, 0)
    assert document.view.cursor == cursor
    window.label.tracks.setFocus()
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Right)
    assert document.view.cursor > cursor


def test_accuracy_and_speed_is_a_page_that_its_key_and_the_old_name_open(open_window, study):
    window = open_window(study, "tradeoff")
    lists = window.review.workspace.lists
    assert window.commands["workspace_review"].isChecked()
    assert lists.tabText(lists.currentIndex()) == "Accuracy and speed"
    assert window.review.workspace.tradeoff.isVisible()
    lists.setCurrentIndex(0)
    window.show_workspace("label")
    window.commands["workspace_tradeoff"].trigger()
    assert window.review.workspace.tradeoff.isVisible()


def test_without_a_run_and_a_demonstration_the_bar_stays_at_the_top(app, open_window, tmp_path):
    path = tmp_path / "new.forcelab"
    with Project.create(path) as project:
        ((demonstration, segments),) = synthetic_set(1, 100.0)
        project.demonstrations.add(demonstration, [Track("Ada", segments)])
    window = open_window(path, "review", "a name of none")
    app.processEvents()
    workspace = window.review.workspace
    assert window.document.demonstration is None
    assert workspace.bar.height() <= workspace.bar.sizeHint().height() + 2
    assert workspace.lists.height() > workspace.height() / 2
    heights = []
    for name in (demonstration.name, "none again", demonstration.name):
        window.begin(LaunchOptions(project=path, workspace="review", demonstration=name))
        app.processEvents()
        heights.append(workspace.pairs.height())
    assert heights[0] == heights[2] < heights[1]
