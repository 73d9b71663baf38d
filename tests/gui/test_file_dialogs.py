"""Where pictures are saved."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QFileDialog, QWidget

from forcelab.gui import settings
from forcelab.gui.file_dialogs import ask_picture


@pytest.fixture
def dialog(monkeypatch):
    """Answers the dialog: what it began with, and what is chosen."""
    questions = []

    def name_file(_parent, _title, suggested, _kinds):
        questions.append(Path(suggested))
        return name_file.chosen, ""

    monkeypatch.setattr(QFileDialog, "getSaveFileName", name_file)
    name_file.questions = questions
    return name_file


def test_it_begins_beside_the_project_and_then_where_the_last_picture_went(app, dialog, tmp_path):
    project, elsewhere = tmp_path / "here" / "study.forcelab", tmp_path / "figures"
    project.mkdir(parents=True)
    elsewhere.mkdir()
    settings.remember_project(project)
    widget = QWidget()
    dialog.chosen = ""
    assert ask_picture(widget, "Export", "pairs.svg") is None
    dialog.chosen = str(elsewhere / "pairs")
    assert ask_picture(widget, "Export", "pairs.svg") == elsewhere / "pairs.svg"
    dialog.chosen = str(elsewhere / "two.pdf")
    assert ask_picture(widget, "Export", "pairs.svg") == elsewhere / "two.pdf"
    assert dialog.questions == [
        project.parent / "pairs.svg",
        project.parent / "pairs.svg",
        elsewhere / "pairs.svg",
    ]
    elsewhere.rename(tmp_path / "gone")
    ask_picture(widget, "Export", "pairs.svg")
    assert dialog.questions[-1] == project.parent / "pairs.svg"
