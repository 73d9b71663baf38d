"""The first start, with mouse and keys: nothing is written unasked, and each way to begin works."""

from __future__ import annotations

from pathlib import Path

import pytest
from factories import (
    BAYES_SETTINGS,
    add_foam_demonstration,
    make_foam_project,
    perform_grips,
    render_placeholder,
)
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QCommandLinkButton, QLineEdit
from window_helpers import answer_dialog, named

from forcelab.gui import settings
from forcelab.gui.guide import GuideWindow
from forcelab.gui.import_dialog import ImportDialog
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.review import training_preferences
from forcelab.gui.welcome import HintBar
from forcelab.jobs import Progress
from forcelab.project import Project
from forcelab.simulation import generate, rendering

ASSETS = Path(__file__).parents[2] / "assets"
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Where the sample project would lie."""
    folder = tmp_path / "documents"
    folder.mkdir()
    monkeypatch.setattr("forcelab.gui.welcome.sample_place", lambda: folder / "sample.forcelab")
    return folder / "sample.forcelab"


@pytest.fixture
def start(windows, place):
    """Start the program anew."""
    return lambda: windows(size=(1024, 640))


@pytest.fixture
def window(start):
    return start()


@pytest.fixture
def start_page(window_of_file):
    """A window without a project."""
    return window_of_file(LaunchOptions(), size=(1024, 640))


def way(window, text):
    """The button of the start page whose text begins so."""
    buttons = window._welcome.findChildren(QCommandLinkButton)
    return next(button for button in buttons if button.text().startswith(text))


def test_the_ways_to_begin_stand_in_the_middle(start_page):
    button = way(start_page, "Read the guide")
    page = button.parentWidget().parentWidget()
    centre = button.mapTo(page, button.rect().center()).x()
    assert centre == pytest.approx(page.width() / 2, abs=2)


def click(widget, where=None):
    QTest.mouseClick(widget, LEFT, Qt.KeyboardModifier.NoModifier, where or QPoint())


def hint(window):
    """What is hinted at on the screen."""
    (bar,) = window.findChildren(HintBar)
    return bar._text.text() if bar.isVisible() else ""


def paint(window, start, end):
    """Drag along the coder's track."""
    tracks = window.label.tracks
    spots = [QPoint(round(tracks.x_at(time)), tracks.height() // 4) for time in (start, end)]
    QTest.mousePress(tracks.viewport(), LEFT, Qt.KeyboardModifier.NoModifier, spots[0])
    QTest.mouseMove(tracks.viewport(), (spots[0] + spots[1]) / 2)
    QTest.mouseMove(tracks.viewport(), spots[1])
    QTest.mouseRelease(tracks.viewport(), LEFT, Qt.KeyboardModifier.NoModifier, spots[1])


def test_nothing_is_written_before_it_is_asked_for(window, place, until):
    assert window._welcome.isVisible()
    assert str(place.parent) in way(window, "Try the sample").description()
    assert not window.jobs.busy
    assert list(place.parent.iterdir()) == []
    assert hint(window) == ""


def test_the_sample_waits_to_be_labelled_with_hints_and_has_a_review(
    start, window, place, until, monkeypatch
):
    monkeypatch.setattr(generate, "perform_job", perform_grips)
    monkeypatch.setattr(rendering, "render", render_placeholder)
    monkeypatch.setattr("forcelab.sample.TASKS", ("LEGO", "foam"))
    monkeypatch.setattr("forcelab.sample.SMALL", ("foam",))
    # With these it is trained within seconds; a process of low priority may wait for minutes.
    monkeypatch.setattr("forcelab.process.run_in_process", lambda work, *given: work(*given))
    training_preferences.remember_settings(place, "foam", BAYES_SETTINGS)
    monkeypatch.setattr("os.cpu_count", lambda: 1)  # another process would not know of these
    click(way(window, "Try the sample"))
    until(lambda: window.document.id)
    document, trainer = window.document, window.review.trainer
    assert document.project.path == place
    assert document.demonstration.name == "foam-1-06"
    assert document.project.tracks.of(document.id) == ()

    # Each hint goes once it was followed.
    assert trainer.training
    assert "press Space" in hint(window)
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Space)
    until(lambda: hint(window).startswith("Paint"))
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Space)
    until(lambda: not document.view.playing)
    document.set_action("grab")
    paint(window, 0.2, 0.3)
    assert document.editor.segments
    assert "Ctrl+Return" in hint(window)
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Return, Qt.KeyboardModifier.ControlModifier)
    assert document.demonstration.name != "foam-1-06"
    assert hint(window) == ""

    # There is a run as any other: pairs, and a first mistake to go to.
    until(lambda: not trainer.training)
    assert trainer.trouble == ""
    [summary] = document.project.runs.summaries()
    assert summary.kind == "evaluate"
    assert summary.tasks == ("foam",)
    window.show_workspace("review")
    trainer.set_task("foam")
    until(lambda: document.review.run is not None)
    assert len(document.review.run.tested) == 5
    window.commands["next_review"].trigger()
    until(lambda: document.review.examined is not None)
    assert document.review.examined.human != document.review.examined.predicted

    # The next time it goes on where it was, without hints, and trains nothing.
    last = document.id
    window.close()
    again = start()
    assert again.document.id == last
    assert hint(again) == ""
    assert not again.review.trainer.training


def test_a_hint_that_is_closed_does_not_come_back(start, window, place, monkeypatch, until):
    def making(path, _jobs):
        yield Progress(0, 1, "")
        with Project.create(path) as project:
            add_foam_demonstration(project, "foam-1-06")
        return True

    monkeypatch.setattr("forcelab.sample.make_sample_job", making)
    monkeypatch.setattr("forcelab.sample.first_to_label", lambda infos: infos[-1].id)
    monkeypatch.setattr(window.review.trainer, "train", lambda: None)
    click(way(window, "Try the sample"))
    until(lambda: "press Space" in hint(window))
    (bar,) = window.findChildren(HintBar)
    click(bar.close_button)
    assert hint(window).startswith("Paint")
    window.close()
    again = start()
    assert hint(again).startswith("Paint")
    (bar,) = again.findChildren(HintBar)
    for _ in range(2):
        click(bar.close_button)
    assert hint(again) == ""
    again.close()
    assert hint(start()) == ""


def test_a_sample_from_the_command_line_opens_there_too_and_trains_nothing(
    start, window, place, monkeypatch
):
    monkeypatch.setattr("forcelab.sample.first_to_label", lambda infos: infos[-1].id)
    make_foam_project(place, ())
    with Project.open(place) as project:
        other = project.demonstrations.infos()[0].id
        add_foam_demonstration(project, "foam-1-06")
    window.begin(LaunchOptions(project=place))
    assert window.document.demonstration.name == "foam-1-06"
    assert "press Space" in hint(window)
    assert not window.review.trainer.training
    window.close()
    again = start()
    again.document.open_demonstration(other)
    again.close()
    assert start().document.id == other


def test_a_sample_that_cannot_be_made_is_told_on_the_page(window, place, until):
    place.write_text("in the way")
    click(way(window, "Try the sample"))
    until(lambda: "sample.forcelab" in window._welcome._trouble.text())
    assert window._welcome._trouble.isVisible()
    assert "sample.forcelab" in window.statusBar().currentMessage()
    assert window.document.project is None
    assert place.read_text() == "in the way"


@pytest.fixture
def recordings(tmp_path, monkeypatch):
    """Ten recordings, which the file dialog gives."""
    folder = tmp_path / "pulls"
    folder.mkdir()
    files = [folder / f"pull-{number:02d}.csv" for number in range(10)]
    for number, file in enumerate(files):
        lines = (ASSETS / "foam-01.csv").read_text().splitlines()
        file.write_text("\n".join([*lines[: 300 + number], ""]))
    names = [str(file) for file in files]
    monkeypatch.setattr("PySide6.QtWidgets.QFileDialog.getOpenFileNames", lambda *_: (names, ""))
    return folder


def in_dialog(window, use, menu=False):
    """Ask for one's own recordings by button or `menu`, and do something with the dialog."""

    def ask():
        if menu:
            actions = window.findChildren(QAction)
            next(a for a in actions if a.text().startswith("Import demonstrations")).trigger()
        else:
            click(way(window, "Label your own"))

    answer_dialog(window, ImportDialog, ask, use)


def test_ten_own_recordings_are_in_a_new_project_after_six_actions(start_page, recordings, until):
    actions = ["button", "select all files", "open"]

    def use(dialog):
        assert dialog.project_name.text() == "pulls.forcelab"
        assert dialog.project_folder.text() == str(recordings)
        assert sorted(path.suffix for path in recordings.iterdir()) == [".csv"] * 10
        QTest.keyClicks(dialog.focusWidget(), "pull")
        actions.append("task")
        QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
        actions.append("import")
        until(lambda: start_page.document.id)
        assert not dialog.project_name.isVisible()
        until(dialog._report.isVisible)
        assert "10 demonstrations imported." in dialog._report_labels[0].text()
        QTest.keyClick(dialog.focusWidget(), Qt.Key.Key_Return)
        actions.append("close")
        assert not dialog.isVisible()

    in_dialog(start_page, use)
    assert len(actions) == 6
    assert start_page.document.project.path == recordings / "pulls.forcelab"
    assert {info.task for info in start_page.document.infos} == {"pull"}
    assert len(start_page.document.infos) == 10
    assert settings.recent_projects()[0] == recordings / "pulls.forcelab"
    assert "press Space" in hint(start_page)
    assert not start_page.review.trainer.training


@pytest.mark.parametrize("menu", [True, False], ids=["menu", "button"])
def test_name_and_place_of_the_new_project_can_be_changed(
    start_page, recordings, tmp_path, until, menu
):
    (tmp_path / "mine").mkdir()
    (recordings / "pulls.forcelab").mkdir()  # then another name is proposed

    def use(dialog):
        assert dialog.project_name.text() == "pulls-2.forcelab"
        for field, text in (
            (named(dialog, QLineEdit, "Name of the new project"), "first"),
            (named(dialog, QLineEdit, "Folder in which the new project is made"), "mine"),
        ):
            field.selectAll()
            QTest.keyClicks(field, text if text == "first" else str(tmp_path / text))
        click(dialog._go)
        until(lambda: start_page.document.id)

    in_dialog(start_page, use, menu)
    assert start_page.document.project.path == tmp_path / "mine" / "first.forcelab"


@pytest.mark.parametrize("reason", ["closed", "unreadable", "no such folder"])
def test_nothing_is_made_where_nothing_is_imported(start_page, recordings, until, reason):
    before = sorted(recordings.iterdir())
    if reason == "unreadable":
        for file in before:
            file.write_text("no numbers at all")

    def use(dialog):
        if reason == "no such folder":
            dialog.project_folder.setText(str(recordings / "missing"))
        if reason != "closed":
            click(dialog._go)
            until(dialog._report.isVisible)
            words = "make it first" if reason == "no such folder" else "pull-00.csv"
            assert words in dialog._report_labels[1].text()

    in_dialog(start_page, use)
    assert start_page.document.project is None
    assert start_page._welcome.isVisible()
    assert sorted(recordings.iterdir()) == before
    assert hint(start_page) == ""


def test_what_is_dropped_on_the_page_goes_the_same_way(start_page, recordings):
    proposed, files = [], tuple(recordings.iterdir())
    answer_dialog(
        start_page,
        ImportDialog,
        lambda: start_page.opening.ask_import(files),
        lambda dialog: proposed.append(dialog.project_name.text()),
    )
    assert proposed == ["pulls.forcelab"]
    assert start_page.document.project is None


def test_the_first_page_leads_to_the_guide(start_page):
    way(start_page, "Read the guide").click()
    guide = start_page.findChild(GuideWindow)
    assert guide.isVisible()
    assert guide.place == "index"
