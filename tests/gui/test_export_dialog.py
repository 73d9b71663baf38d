"""Labels leave the project by the window, and hidden ones do not."""

from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QWidget
from window_helpers import open_painted_document

from forcelab.demonstration import Channel, Demonstration
from forcelab.formats.export import FORMATS
from forcelab.gui import settings
from forcelab.gui.export_dialog import ExportDialog
from forcelab.gui.jobs import Jobs
from forcelab.gui.menus import RecentProjects
from forcelab.labels import Segment

GRAB = (Segment(0.0, 0.1, "grab"),)


@pytest.fixture
def document(app, tmp_path):
    with open_painted_document(tmp_path) as document:
        project = document.project
        for info in document.infos:
            for author in (document.author, "Zoe"):
                before = project.tracks.get(info.id, author).segments
                project.tracks.edit(info.id, author, before, GRAB, "painted")
        document.reread()
        yield document


@pytest.fixture
def dialog(document):
    window = QWidget()
    jobs = Jobs(window)
    dialog = ExportDialog(document, jobs, [info.id for info in document.infos], window)
    dialog.author.setCurrentIndex(0)
    dialog.format.setCurrentIndex(dialog.format.findData("csv"))
    yield dialog
    dialog.reject()
    jobs.close()
    window.deleteLater()


def written(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_the_open_demonstration_or_all_that_are_shown(dialog, document, tmp_path, until):
    document.open_demonstration(document.infos[0].id)
    assert dialog.which.currentText() == "All in the list (2)"  # what is wanted most
    dialog.which.setCurrentIndex(0)
    dialog.export(tmp_path / "one")
    until(dialog.go.isEnabled)
    [(name, text)] = written(tmp_path / "one").items()
    assert document.demonstration.name in name
    assert f"grab,{document.author}" in text
    assert "grab,Zoe" in text
    dialog.which.setCurrentIndex(1)
    dialog.format.setCurrentIndex(dialog.format.findData("audacity"))
    dialog.export(tmp_path / "all")
    until(dialog.go.isEnabled)
    assert len(written(tmp_path / "all")) == 2 * len(document.infos)


def test_it_is_told_how_many_of_all_have_no_labels(dialog, document, tmp_path, until):
    dialog.which.setCurrentIndex(dialog.which.findText("All", Qt.MatchFlag.MatchStartsWith))
    dialog.export(tmp_path / "full")
    until(dialog.go.isEnabled)
    assert not any("no labels" in label.text() for label in dialog.findChildren(QLabel))
    times, channels = np.arange(9) / 100, (Channel("fz1", "N"),)
    bare = Demonstration("bare", "stylus", times, np.zeros((9, 1)), channels)
    document.project.demonstrations.add(bare)
    document.reread()
    other = ExportDialog(document, dialog._jobs, [info.id for info in document.infos])
    authors = [other.author.itemText(i) for i in range(other.author.count())]
    assert authors == ["All coders", document.author, "Zoe"]
    other.author.setCurrentIndex(0)
    other.which.setCurrentIndex(other.which.findText("All", Qt.MatchFlag.MatchStartsWith))
    other.export(tmp_path / "all")
    until(other.go.isEnabled)
    told = "\n1 demonstration has no labels yet."
    assert any(label.text().endswith(told) for label in other.findChildren(QLabel))
    other.author.setCurrentIndex(other.author.findText("Zoe"))
    other.export(tmp_path / "hers")
    until(other.go.isEnabled)
    assert "1 demonstration has no labels by Zoe yet." in other._report_label.text()
    texts = written(tmp_path / "hers").values()
    assert all("Zoe" in text and document.author not in text for text in texts)
    other.reject()
    other.deleteLater()


def test_the_whole_project_is_offered_beside_what_a_search_has_left(document, tmp_path, until):
    document.open_demonstration(document.infos[0].id)
    jobs, ids = Jobs(), [info.id for info in document.infos]
    searched, vain, all_ = (ExportDialog(document, jobs, ids[:n]) for n in (1, 0, None))
    offered = [
        [dialog.which.itemText(i) for i in range(dialog.which.count())]
        for dialog in (searched, vain)
    ]
    assert offered[0][1:] == ["All in the list (1)", "The whole project (2)"]
    assert offered[1][1:] == ["The whole project (2)"]
    assert all_.which.count() == 2
    searched.which.setCurrentIndex(2)
    searched.format.setCurrentIndex(searched.format.findData("csv"))
    searched.export(tmp_path / "all")
    until(searched.go.isEnabled)
    assert len(written(tmp_path / "all")) == len(ids)
    for dialog in (searched, vain, all_):
        dialog.reject()
        dialog.deleteLater()
    jobs.close()


def test_a_blind_coder_exports_only_what_is_not_hidden(dialog, document, tmp_path, until):
    document.project.coding.assign(document.infos[0].id, document.author)
    dialog.which.setCurrentIndex(0)
    dialog.export(tmp_path / "blind")
    until(dialog.go.isEnabled)
    [text] = written(tmp_path / "blind").values()
    assert "Zoe" not in text
    dialog.format.setCurrentIndex(dialog.format.findData("archive"))
    dialog.export(tmp_path / "archive")
    until(dialog.go.isEnabled)
    assert "hidden from" in dialog._report_label.text()
    assert not (tmp_path / "archive").exists()


def test_files_that_are_there_are_replaced_only_on_demand(dialog, tmp_path, until):
    how = dialog.replacing.text().lower()  # the refusal names the box to tick
    for replacing, messages in ((False, "Written"), (False, how), (True, "Written")):
        dialog.replacing.setChecked(replacing)
        dialog.export(tmp_path / "out")
        until(dialog.go.isEnabled)
        assert messages in dialog._report_label.text()


def test_recent_projects_are_opened_from_the_menu(app, tmp_path):
    opened_ = []
    menu = RecentProjects(opened_.append)
    menu.aboutToShow.emit()
    assert [action.isEnabled() for action in menu.actions()] == [False]
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        settings.remember_project(tmp_path / name)
    menu.aboutToShow.emit()
    assert [action.text() for action in menu.actions()] == ["two", "one"]
    menu.actions()[1].trigger()
    assert opened_ == [tmp_path / "one"]


def test_it_begins_with_the_own_labels_as_one_table_and_then_with_the_last_format(
    dialog, document, tmp_path, until
):
    shown = [info.id for info in document.infos]
    first = ExportDialog(document, dialog._jobs, shown)
    assert (first.author.currentText(), first.format.currentData()) == (document.author, "table")
    first.format.setCurrentIndex(first.format.findData("textgrid"))
    first.export(tmp_path)
    until(first.go.isEnabled)
    assert first._report_label.text().startswith("Written: ")
    first.format.setCurrentIndex(first.format.findData("archive"))
    assert first._report_label.text() == ""  # what was written is no archive
    second = ExportDialog(document, dialog._jobs, shown)
    assert second.format.currentData() == "textgrid"
    for other in (first, second):
        other.reject()
        other.deleteLater()


def test_models_are_named_where_they_have_tracks_and_predictions_where_a_format_holds_them(
    dialog, document
):
    for name, format_ in FORMATS.items():
        dialog.format.setCurrentIndex(dialog.format.findData(name))
        assert ("predictions" in format_.label) == format_.predictions
        assert ("and predictions" in dialog.author.itemText(0)) == format_.predictions
        assert ("(no predictions)" in dialog.author.itemText(1)) == format_.predictions
    first = document.infos[0].id
    document.project.tracks.edit(first, "model live", (), GRAB, "predicted", kind="predict")
    document.reread()
    other = ExportDialog(document, dialog._jobs, [first])
    assert other.author.itemText(0) == "All coders and models"
    other.reject()
    other.deleteLater()


def test_labels_go_into_the_dataset_that_was_imported(dialog, tmp_path, until):
    pytest.importorskip("pyarrow")
    dialog.format.setCurrentIndex(dialog.format.findData("lerobot"))
    assert dialog.go.text() == "Write into dataset…"
    assert not dialog.replacing.isEnabled()
    dialog.export(tmp_path / "none")
    until(dialog.go.isEnabled)
    assert "a frame has one subtask; choose one of them (Labels by)" in dialog._report_label.text()
    dialog.author.setCurrentIndex(1)
    dialog.export(tmp_path / "none")
    until(dialog.go.isEnabled)
    assert "is no LeRobot dataset" in dialog._report_label.text()


def test_formats_of_a_kind_stand_together(dialog):
    shown = [dialog.format.itemData(i) for i in range(dialog.format.count())]
    assert [name for name in shown if name] == list(FORMATS)
    # A line, which is no format, only between two kinds.
    for before, after in pairwise(name for name in shown if name):
        apart = shown.index(after) - shown.index(before) > 1
        assert apart == (FORMATS[before].group != FORMATS[after].group)
    assert len(shown) == len(FORMATS) + 2
