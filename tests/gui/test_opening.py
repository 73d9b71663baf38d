"""Opening projects: what is opened by itself, and what is not."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QCommandLinkButton, QInputDialog, QMessageBox, QWidget
from window_helpers import status_messages

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.author_choice import AuthorChoice
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.preferences import SAMPLE_FOLDER
from forcelab.gui.project_actions import ProjectActions
from forcelab.gui.welcome import SampleProgress
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.project import Project


@pytest.fixture
def make(app):
    """Make what opens projects into a document."""
    windows = []

    def created(document, *, remembering=True, author=""):
        windows.append(QWidget())
        jobs = Jobs(windows[-1])
        return ProjectActions(document, jobs, windows[-1], remembering=remembering, author=author)

    yield created
    for window in windows:
        window.deleteLater()


def test_the_demonstration_of_last_time_is_opened_but_not_for_a_picture(document, make):
    path, (first, second) = document.project.path, document.infos
    opening = make(document)
    document.open_demonstration(second.id)
    opening.remember_demonstration()
    assert opening.open(path)
    assert document.id == second.id
    assert make(document, remembering=False).open(path)
    assert document.id == first.id


def test_the_start_page_says_why_a_project_did_not_open_and_where_the_sample_goes(app, tmp_path):
    window = Window("Ann", remembering=False)
    window.begin(LaunchOptions(project=tmp_path / "nwe.forcelab"))
    trouble = window._welcome._trouble
    assert not trouble.isHidden()
    assert f"There is no project '{tmp_path / 'nwe.forcelab'}'" in trouble.text()
    assert "create it, or check the name" in trouble.text()
    Project.create(tmp_path / "new.forcelab").close()
    assert window.opening.open(tmp_path / "new.forcelab")
    assert trouble.isHidden()
    SAMPLE_FOLDER.set_value(tmp_path)
    sample = window._welcome.findChildren(QCommandLinkButton)[0]
    assert sample.description().endswith(f", in {tmp_path}.")
    window.close()


def test_a_sample_project_that_is_ready_late_does_not_close_another(
    document, make, tmp_path, monkeypatch, until
):
    def making(path, *_):
        yield Progress(0, 1, "")
        Project.create(path).close()

    monkeypatch.setattr("forcelab.sample.make_sample_job", making)
    for busy, shown in ((document, document.project.path), (Document("Eve"), tmp_path / "sample")):
        opening, over = make(busy), []
        opening.sampling.connect(over.append)
        opening.make_sample(tmp_path / ("other" if busy is document else "sample"))
        until(lambda over=over: over[-1] is None)
        assert busy.project.path == shown
    assert settings.recent_projects() == (tmp_path / "sample",)
    busy.close()


def test_a_new_project_does_not_label_as_the_coder_of_another(make, tmp_path, monkeypatch):
    monkeypatch.setattr("getpass.getuser", lambda: "ada")
    document = Document("Ada")
    sample, study = tmp_path / "sample.forcelab", tmp_path / "study.forcelab"
    for path in (sample, study):
        Project.create(path).close()
    opening = make(document)
    opening.open(sample)
    choice = AuthorChoice(document)
    monkeypatch.setattr(QInputDialog, "getText", lambda *_: (" Ines ", True))
    choice._chosen(choice._box.count() - 1)
    assert document.author == "Ines"
    opening.open(study)
    assert (document.author, choice._box.currentText()) == ("Ada", "Ada")
    opening.open(sample)
    assert (document.author, choice._box.currentText()) == ("Ines", "Ines")
    choice.deleteLater()
    document.close()


def test_a_key_offers_the_coders(app, document, make, tmp_path):
    choice = AuthorChoice(document)
    make(document).open(tmp_path / "study.forcelab")
    choice.show()
    choice.choose()
    assert choice._box.view().isVisible()
    choice._box.hidePopup()
    choice.close()
    document.close()


def test_who_is_to_label_blind_is_found_under_the_name_that_was_assigned_to(
    document, make, monkeypatch
):
    """A new name, one letter apart, would see all that is to be hidden."""
    path, project, (info, _) = document.project.path, document.project, document.infos
    choice = AuthorChoice(document)
    project.coding.assign(info.id, "Bert")
    document.refresh_listing()
    assert choice._box.findText("Bert") >= 0
    questions = []
    monkeypatch.setattr(QInputDialog, "getText", lambda *_: ("bert", True))
    monkeypatch.setattr(QMessageBox, "exec", lambda box: questions.append(box.text()))
    choice._chosen(choice._box.count() - 1)
    assert questions == ["'Bert' already exists."]
    assert document.author == "Bert"
    messages = status_messages(document)
    make(document, author="bert").open(path)
    assert messages == [("'bert' is a new coder beside 'Bert'.", False)]
    choice.deleteLater()


def test_a_list_of_coders_that_cannot_be_read_stays_as_it_was(document, monkeypatch):
    choice, faults = AuthorChoice(document), []
    existing = [choice._box.itemText(at) for at in range(choice._box.count())]

    def fail():
        raise ForcelabError("the disk is gone")

    monkeypatch.setattr("sys.excepthook", lambda *fault: faults.append(fault))
    monkeypatch.setattr(document.project.coding, "assignments", fail)
    document.refresh_listing()
    assert [choice._box.itemText(at) for at in range(choice._box.count())] == existing
    choice.deleteLater()
    assert not faults


def test_a_long_name_of_a_coder_ends_in_an_ellipsis_and_is_told_whole(document):
    name = "Maximiliane Friederike von Hohenstein-Waldburg"
    document.set_author(name)
    choice = AuthorChoice(document)
    choice.resize(choice.minimumSizeHint())
    choice.show()
    assert choice._box.shown_text.endswith("…")
    assert name in choice._box.toolTip()
    choice.close()
    document.close()


@pytest.mark.parametrize(
    ("typed", "created"),
    [("pens", "pens.forcelab"), ("pens.forcelab", "pens.forcelab"), ("a.b", "a.b")],
)
def test_a_new_project_gets_its_ending(document, make, tmp_path, monkeypatch, typed, created):
    where = str(tmp_path / typed)
    monkeypatch.setattr("PySide6.QtWidgets.QFileDialog.getSaveFileName", lambda *_: (where, ""))
    make(document).ask_new()
    assert document.project.path == tmp_path / created


def test_a_new_project_is_suggested_beside_the_others_and_not_in_one(
    document, make, tmp_path, monkeypatch
):
    """In a folder that is there already a file dialog would open."""
    suggested = []
    monkeypatch.setattr("forcelab.gui.project_actions.last_folder", lambda _: tmp_path)
    monkeypatch.setattr(
        "PySide6.QtWidgets.QFileDialog.getSaveFileName",
        lambda *questions: (suggested.append(Path(questions[2])) or questions[2], ""),
    )
    assert document.project.path == tmp_path / "study.forcelab"
    for _ in range(2):
        make(document).ask_new()
    assert suggested == [tmp_path / "study-2.forcelab", tmp_path / "study-3.forcelab"]


def test_who_was_asked_for_labels_in_the_first_project_alone(make, tmp_path, monkeypatch):
    monkeypatch.setattr("getpass.getuser", lambda: "ada")
    document = Document("Ines")
    for name in ("a", "b"):
        Project.create(tmp_path / name).close()
    opening = make(document, author="Ines")
    opening.open(tmp_path / "a")
    assert document.author == "Ines"
    opening.open(tmp_path / "b")
    assert document.author == "Ada"
    document.close()


def endless(ended):
    def making(path, *_):
        try:
            while True:
                yield Progress(1, 30, "LEGO")
        finally:
            ended.append(path)

    return making


def test_a_sample_project_goes_on_when_another_project_is_opened(
    make, tmp_path, monkeypatch, until
):
    ended, shown, study = [], [], tmp_path / "study.forcelab"
    monkeypatch.setattr("forcelab.sample.make_sample_job", endless(ended))
    Project.create(study).close()
    document = Document("Ann")
    opening = make(document)
    opening.sampling.connect(shown.append)
    opening.make_sample(tmp_path / "sample")
    until(lambda: len(shown) > 1)
    opening.open(study)
    assert shown[-1] is not None
    opening.cancel_sample()
    assert shown[-1] is None
    until(lambda: ended)
    document.close()


def test_making_the_sample_project_can_be_cancelled_wherever_it_is_shown(
    app, tmp_path, monkeypatch, until, hovered
):
    ended, study = [], tmp_path / "study.forcelab"
    monkeypatch.setattr("forcelab.sample.make_sample_job", endless(ended))
    monkeypatch.setattr("forcelab.gui.welcome.sample_place", lambda: tmp_path / "sample")
    Project.create(study).close()
    window = Window("Ann")
    window.show()
    window.begin(LaunchOptions())
    (here,) = window._welcome.findChildren(SampleProgress)
    QTest.mouseClick(window._welcome.findChildren(QCommandLinkButton)[0], Qt.MouseButton.LeftButton)
    until(lambda: here.isVisible() and "LEGO" in here.bar.format())
    sample = window._welcome.findChildren(QCommandLinkButton)[0]
    assert not sample.isEnabled()
    assert hovered(sample) == "The sample project is being made."
    tasks = "simulating marker, stylus, cartridge, LEGO, foam"  # too long for its line
    here.show_progress(Progress(1, 4, tasks))
    assert here.bar.fontMetrics().horizontalAdvance(here.bar.text()) < here.bar.width()
    assert here.bar.text().startswith("25 %")
    assert tasks in hovered(here.bar)
    here.cancel.click()
    until(lambda: ended)
    assert not here.isVisible()
    assert sample.isEnabled()
    window.opening.make_sample(tmp_path / "sample")
    window.opening.open(study)
    (progress,) = window.statusBar().findChildren(SampleProgress)
    until(progress.isVisible)
    progress.cancel.click()
    until(lambda: len(ended) == 2)
    assert not progress.isVisible()
    window.close()
