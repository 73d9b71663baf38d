"""The dialog that imports recordings: what goes in, and what is open afterwards."""

from pathlib import Path

import pytest
from painting_bench import demonstration
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox

from forcelab.gui.document import Document
from forcelab.gui.importing import ImportDialog
from forcelab.gui.jobs import Jobs
from forcelab.project import Project

FOAM = Path(__file__).parents[2] / "assets" / "foam-01.csv"


@pytest.fixture
def document(app, tmp_path):
    path = tmp_path / "study.forcelab"
    Project.create(path).close()
    document = Document("Ann")
    document.open_project(path)
    yield document
    document.close()


@pytest.fixture
def dialog(document):
    jobs = Jobs()
    dialog = ImportDialog(document, jobs, files=[FOAM, FOAM.with_name("none.csv")])
    dialog.show()
    yield dialog
    dialog.close()
    jobs.close()


def test_delete_leaves_a_file_out_and_the_first_import_is_opened(document, dialog, until):
    dialog._files.setCurrentRow(1)
    dialog._files.setFocus()
    dialog._files.actions()[0].trigger()
    assert dialog._files.count() == 1
    QTest.mouseClick(dialog._go, Qt.MouseButton.LeftButton)
    until(lambda: document.id, 20.0)
    assert document.demonstration.name == "foam-01"
    assert "1 new" in dialog._told.text()


def test_with_every_file_left_out_there_is_nothing_to_import(dialog):
    dialog._files.selectAll()
    dialog._files.actions()[0].trigger()
    assert not dialog._go.isEnabled()


def test_labels_are_the_files_own_unless_a_coder_is_chosen(document, dialog, until):
    dialog._files.item(1).setSelected(True)
    dialog._remove()
    assert dialog._author.currentText() == "coder"
    assert dialog._author.findText("Ann") > 0
    dialog._go.click()
    until(lambda: document.id, 20.0)
    assert [author.name for author in document.project.authors()] == ["coder"]


@pytest.mark.parametrize(("answer", "tasks"), [(0, ("foam",)), (1, ("Foam", "foam"))])
def test_a_task_that_differs_by_case_alone_is_asked_about(
    document, dialog, until, monkeypatch, answer, tasks
):
    with Project.open(document.project.path) as other:
        other.add(demonstration())  # of task foam
    asked = []

    def press(box):
        asked.append((box.text(), [button.text() for button in box.buttons()]))
        box.buttons()[answer].click()

    monkeypatch.setattr(QMessageBox, "exec", press)
    dialog._files.item(1).setSelected(True)
    dialog._remove()
    dialog._task.setCurrentText(" Foam ")
    dialog._go.click()
    until(lambda: "1 new" in dialog._told.text(), 20.0)
    assert asked == [("There is 'foam' already.", ["Use 'foam'", "Add 'Foam'"])]
    assert sorted(document.project.tasks()) == list(tasks)


def test_a_missing_task_is_warned_of_plainly(dialog):
    assert dialog._taskless.isVisible()
    assert dialog._go.text() == "Import without a task"
    dialog._task.setCurrentText("stylus")
    assert not dialog._taskless.isVisible()
    assert dialog._go.text() == "Import"
