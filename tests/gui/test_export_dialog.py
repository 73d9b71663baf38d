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
def open_dialog(document):
    """Open the dialog while the first so many demonstrations are listed, by default all."""
    window = QWidget()
    jobs = Jobs(window)

    def opened(shown=None):
        return ExportDialog(document, jobs, [info.id for info in document.infos][:shown], window)

    yield opened
    jobs.close()
    window.deleteLater()


@pytest.fixture
def dialog(open_dialog):
    dialog = open_dialog()
    dialog.author.setCurrentIndex(0)
    choose_format(dialog, "csv")
    return dialog


@pytest.fixture
def export(until):
    """Export into a folder; gives the folder."""

    def exported(dialog, folder):
        dialog.export(folder)
        until(dialog.go.isEnabled)
        return folder

    return exported


def choose_format(dialog, name):
    dialog.format.setCurrentIndex(dialog.format.findData(name))


def written(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_the_open_demonstration_or_all_that_are_shown(dialog, document, tmp_path, export):
    document.open_demonstration(document.infos[0].id)
    assert dialog.which.currentText() == "All in the list (2)"  # what is wanted most
    dialog.which.setCurrentIndex(0)
    [(name, text)] = written(export(dialog, tmp_path / "one")).items()
    assert document.demonstration.name in name
    assert f"grab,{document.author}" in text
    assert "grab,Zoe" in text
    dialog.which.setCurrentIndex(1)
    choose_format(dialog, "audacity")
    assert len(written(export(dialog, tmp_path / "all"))) == 2 * len(document.infos)


def test_it_is_told_how_many_of_all_have_no_labels(dialog, document, tmp_path, export, open_dialog):
    dialog.which.setCurrentIndex(dialog.which.findText("All", Qt.MatchFlag.MatchStartsWith))
    export(dialog, tmp_path / "full")
    assert not any("no labels" in label.text() for label in dialog.findChildren(QLabel))
    times, channels = np.arange(9) / 100, (Channel("fz1", "N"),)
    bare = Demonstration("bare", "stylus", times, np.zeros((9, 1)), channels)
    document.project.demonstrations.add(bare)
    document.reread()
    other = open_dialog()
    authors = [other.author.itemText(i) for i in range(other.author.count())]
    assert authors == ["All coders", document.author, "Zoe"]
    other.author.setCurrentIndex(0)
    other.which.setCurrentIndex(other.which.findText("All", Qt.MatchFlag.MatchStartsWith))
    export(other, tmp_path / "all")
    told = "\n1 demonstration has no labels yet."
    assert any(label.text().endswith(told) for label in other.findChildren(QLabel))
    other.author.setCurrentIndex(other.author.findText("Zoe"))
    export(other, tmp_path / "hers")
    assert "1 demonstration has no labels by Zoe yet." in other._report_label.text()
    texts = written(tmp_path / "hers").values()
    assert all("Zoe" in text and document.author not in text for text in texts)


def test_the_whole_project_is_offered_beside_what_a_search_has_left(
    document, tmp_path, export, open_dialog
):
    document.open_demonstration(document.infos[0].id)
    searched, vain, all_ = map(open_dialog, (1, 0, None))
    offered = [
        [dialog.which.itemText(i) for i in range(dialog.which.count())]
        for dialog in (searched, vain)
    ]
    assert offered[0][1:] == ["All in the list (1)", "The whole project (2)"]
    assert offered[1][1:] == ["The whole project (2)"]
    assert all_.which.count() == 2
    searched.which.setCurrentIndex(2)
    choose_format(searched, "csv")
    assert len(written(export(searched, tmp_path / "all"))) == len(document.infos)


def test_a_blind_coder_exports_only_what_is_not_hidden(dialog, document, tmp_path, export):
    document.project.coding.assign(document.infos[0].id, document.author)
    dialog.which.setCurrentIndex(0)
    [text] = written(export(dialog, tmp_path / "blind")).values()
    assert "Zoe" not in text
    choose_format(dialog, "archive")
    export(dialog, tmp_path / "archive")
    assert "hidden from" in dialog._report_label.text()
    assert not (tmp_path / "archive").exists()


def test_files_that_are_there_are_replaced_only_on_demand(dialog, tmp_path, export):
    how = dialog.replacing.text().lower()  # the refusal names the box to tick
    for replacing, messages in ((False, "Written"), (False, how), (True, "Written")):
        dialog.replacing.setChecked(replacing)
        export(dialog, tmp_path / "out")
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
    document, tmp_path, export, open_dialog
):
    first = open_dialog()
    assert (first.author.currentText(), first.format.currentData()) == (document.author, "table")
    choose_format(first, "textgrid")
    export(first, tmp_path)
    assert first._report_label.text().startswith("Written: ")
    choose_format(first, "archive")
    assert first._report_label.text() == ""  # what was written is no archive
    assert open_dialog().format.currentData() == "textgrid"


def test_models_are_named_where_they_have_tracks_and_predictions_where_a_format_holds_them(
    dialog, document, open_dialog
):
    for name, format_ in FORMATS.items():
        choose_format(dialog, name)
        assert ("predictions" in format_.label) == format_.predictions
        assert ("and predictions" in dialog.author.itemText(0)) == format_.predictions
        assert ("(no predictions)" in dialog.author.itemText(1)) == format_.predictions
    first = document.infos[0].id
    document.project.tracks.edit(first, "model live", (), GRAB, "predicted", kind="predict")
    document.reread()
    assert open_dialog(1).author.itemText(0) == "All coders and models"


def test_labels_go_into_the_dataset_that_was_imported(dialog, tmp_path, export):
    pytest.importorskip("pyarrow")
    choose_format(dialog, "lerobot")
    assert dialog.go.text() == "Write into dataset…"
    assert not dialog.replacing.isEnabled()
    export(dialog, tmp_path / "none")
    assert "a frame has one subtask; choose one of them (Labels by)" in dialog._report_label.text()
    dialog.author.setCurrentIndex(1)
    export(dialog, tmp_path / "none")
    assert "is no LeRobot dataset" in dialog._report_label.text()


def test_formats_of_a_kind_stand_together(dialog):
    shown = [dialog.format.itemData(i) for i in range(dialog.format.count())]
    assert [name for name in shown if name] == list(FORMATS)
    # A line, which is no format, only between two kinds.
    for before, after in pairwise(name for name in shown if name):
        apart = shown.index(after) - shown.index(before) > 1
        assert apart == (FORMATS[before].group != FORMATS[after].group)
    assert len(shown) == len(FORMATS) + 2
