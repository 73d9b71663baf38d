"""The dialog that imports recordings: what goes in, and what is open afterwards."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

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
