"""Labels of other programs come in by the window, with what they belong to seen before."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDropEvent
from PySide6.QtTest import QTest
from window_helpers import open_painted_document

from forcelab.formats.textgrid import to_textgrid
from forcelab.formats.track_text import to_audacity, to_csv
from forcelab.gui import label_import_dialog
from forcelab.gui.label_import_dialog import LabelImportDialog
from forcelab.gui.launch_options import LaunchOptions
from forcelab.labels import Segment, Track

GRAB = (Segment(0.0, 0.1, "grab"),)
SLIP = (Segment(0.05, 0.2, "slip"),)


@pytest.fixture
def document(app, tmp_path):
    with open_painted_document(tmp_path) as document:
        id_ = document.infos[0].id
        before = document.project.tracks.get(id_, "Zoe").segments
        document.project.tracks.edit(id_, "Zoe", before, GRAB, "painted")
        document.open_demonstration(id_)
        yield document


@pytest.fixture
def dialog(document, jobs, until):
    dialog = LabelImportDialog(document, jobs)
    dialog.show()
    yield dialog
    dialog.reject()
    dialog.deleteLater()


@pytest.fixture
def look(dialog, jobs, until):
    """What each row says, once the files are read."""

    def look():
        until(lambda: not jobs.awaits("label import"))
        return [row.cells for row in dialog.table.model().rows]

    return look


@pytest.fixture
def files(tmp_path, document, monkeypatch):
    """Ben's and Zoe's labels of the open demonstration, and a file that is none."""
    name = document.infos[0].name
    labels, note = tmp_path / f"{name}.csv", tmp_path / "note.txt"
    labels.write_text(to_csv([Track("Ben", SLIP), Track("Zoe", SLIP)]))
    note.write_text("Dear all,\nno labels\n")
    monkeypatch.setattr(label_import_dialog, "ask_files", lambda *_: [labels, note])
    return [labels, note]


def click(widget):
    QTest.mouseClick(widget, Qt.MouseButton.LeftButton)


def choose(box, text):
    """Choose in a list by its keys."""
    box.setFocus()
    while text not in box.currentText():
        QTest.keyClick(box, Qt.Key.Key_Down)


def stored(document, author):
    return document.project.tracks.get(document.infos[0].id, author).segments


def test_an_observation_that_cannot_be_read_is_a_row_that_names_no_folder(
    dialog, document, files, look
):
    name = document.infos[0].name
    rows = [
        "Observation id,Observer,Behavior,Behavior type,Time",
        f"{name} - Kim,Kim,grab,STOP,1",
        *(f"{name} - Ida,Ida,grab,{kind}" for kind in ("START,1", "STOP,2")),
    ]
    files[0].write_text("\n".join(rows) + "\n")
    click(dialog.pick)
    left, read, _ = look()
    assert left[2] == "Kim"
    assert left[4].startswith(f"'{files[0].name}', line 2: 'grab' at 1 s never starts; pair")
    assert read == (files[0].name, name, "Ida", "1", "new")


def test_files_are_matched_before_they_are_imported_and_replace_only_on_demand(
    dialog, document, files, look
):
    assert not dialog.go.isEnabled()
    click(dialog.pick)
    name = document.infos[0].name
    rows = look()
    assert rows[0] == (files[0].name, name, "Ben", "1", "new")
    assert rows[1][:4] == (files[0].name, name, "Zoe", "1")
    assert "differ; replace them (Replace existing labels), or" in rows[1][4]
    assert rows[2][4].startswith("'note.txt' is no file of labels, but looks like text")
    assert stored(document, "Ben") == ()
    box = QPoint(8, dialog.replacing.height() // 2)
    QTest.mouseClick(dialog.replacing, Qt.MouseButton.LeftButton, pos=box)
    assert dialog.replacing.isChecked()
    assert look()[1][4] == "replaces labels: 2 edges moved, 1 segment renamed"
    assert "New action 'slip'" in dialog._text.text()
    click(dialog.go)
    assert [row[4] for row in look()][:2] == [
        "imported",
        "replaced: 2 edges moved, 1 segment renamed",
    ]
    assert stored(document, "Ben") == stored(document, "Zoe") == SLIP
    assert "2 tracks imported." in dialog._text.text()
    assert not dialog.go.isEnabled()
    assert "slip" in document.vocabulary.names
    document.project.tracks.undo(document.infos[0].id, "Zoe")
    assert stored(document, "Zoe") == GRAB


def test_what_is_added_during_an_import_is_read_after_it(dialog, document, files, look, tmp_path):
    later = tmp_path / f"{document.infos[0].name} - Kim.csv"
    later.write_text(to_csv([Track("Kim", SLIP)]))
    dialog.add_files(files[:1])
    look()
    click(dialog.go)
    dialog.add_files([later])
    dialog.offset.setValue(0.01)  # an import that runs is not begun anew by it
    look()
    assert stored(document, "Ben") == SLIP
    assert [(row[2], row[4]) for row in look()][-1] == ("Kim", "new")


def test_delete_removes_a_file_and_a_selected_row_tells_why_it_is_left_out(dialog, files, look):
    click(dialog.pick)
    look()
    rect = dialog.table.visualRect(dialog.table.model().index(2, 0))
    QTest.mouseClick(dialog.table.viewport(), Qt.MouseButton.LeftButton, pos=rect.center())
    assert dialog._text.text().startswith(
        "note.txt: 'note.txt' is no file of labels, but looks like text"
    )
    QTest.keyClick(dialog.table, Qt.Key.Key_Delete)
    assert [row[0] for row in look()] == [files[0].name] * 2


def test_a_file_of_any_name_can_be_of_the_open_demonstration(
    dialog, document, tmp_path, look, until
):
    path = tmp_path / "what.txt"
    path.write_text(to_audacity(Track("x", SLIP)))
    dialog.dropEvent(drop_of(path))
    assert look() == [("what.txt", "", "coder", "1", UNKNOWN)]
    assert not dialog.go.isEnabled()
    choose(dialog.demonstration, "This demonstration")
    dialog.author.setFocus()
    dialog.author.lineEdit().selectAll()
    QTest.keyClicks(dialog.author, "Ida")
    dialog.offset.setFocus()
    dialog.offset.selectAll()
    QTest.keyClicks(dialog.offset, "0.1")
    QTest.keyClick(dialog.offset, Qt.Key.Key_Tab)
    until(lambda: look() == [("what.txt", document.infos[0].name, "Ida", "1", "new")])
    dialog.go.setFocus()
    QTest.keyClick(dialog.go, Qt.Key.Key_Space)
    until(lambda: look()[0][4] == "imported")
    assert stored(document, "Ida") == (Segment(0.15, 0.3, "slip"),)


UNKNOWN = "No demonstration is called 'what'; rename the file, or choose one (Demonstration)."


def drop_of(path):
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path))])
    drop_of.data = data  # the event does not keep it
    copy, none = Qt.DropAction.CopyAction, Qt.KeyboardModifier.NoModifier
    return QDropEvent(QPointF(5, 5), copy, data, Qt.MouseButton.LeftButton, none)


def test_tiers_may_be_actions(dialog, document, tmp_path, look):
    path = tmp_path / f"{document.infos[0].name}.TextGrid"
    tracks = [Track("grab", (Segment(0.0, 0.1, "x"),)), Track("slip", (Segment(0.1, 0.2, "x"),))]
    path.write_bytes(to_textgrid(tracks, 0.5))
    dialog.add_files([path])
    assert [row[2] for row in look()] == ["grab", "slip"]
    assert "'grab'; if they are actions, say so (Tiers of ELAN and Praat: Actions)." in (
        dialog._text.text()
    )
    choose(dialog.tiers, "Actions")
    assert [row[2:] for row in look()] == [("coder", "2", "new")]
    assert "2 texts were left out" in dialog._text.text()


def test_a_blind_coder_sees_no_more_of_others_than_before(dialog, document, files, look):
    document.project.coding.assign(document.infos[0].id, document.author)
    click(dialog.pick)
    for row in look()[:2]:
        assert "are hidden from" in row[4]
    assert not dialog.go.isEnabled()


def test_the_menu_opens_it_on_the_open_project(windows, tmp_path, monkeypatch):
    with open_painted_document(tmp_path) as document:
        path = document.project.path
    window = windows(LaunchOptions(path))
    seen = []
    monkeypatch.setattr(LabelImportDialog, "exec", lambda d: seen.append(d.demonstration.count()))
    window.commands["import_labels"].trigger()
    assert seen == [2]  # by name, or the open demonstration
