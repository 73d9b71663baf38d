"""Renaming an action in the window: what has to be agreed to is asked in one question."""

from __future__ import annotations

from collections.abc import Collection

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QMessageBox, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.naming import verbatim
from forcelab.project.project import ActionRename

__all__ = ["rename"]


def rename(document: Document, name: str, new: str, parent: QWidget) -> bool:
    """Rename an action of the open demonstration's task in all of the coder's tracks.

    Asks first where it is merged into another action, and where the coder's segments in other
    tasks have it too. What cannot be is told in the status line.
    """
    project, demonstration = document.project, document.demonstration
    if project is None or demonstration is None:
        return False
    task = demonstration.task
    try:
        project.refuse_read_only()  # before anything is asked
        if name not in project.vocabulary(task) and name not in project.painted_actions(task):
            document.say(f"'{name}' is only predicted: train again, and it is gone.", True)
            return False
        here = project.renaming(document.author, name, new, (task,))
        everywhere = project.renaming(document.author, name, new)
    except ForcelabError as error:
        document.say(str(error), True)
        return False
    tasks: Collection[str] | None = here.tasks
    if everywhere.merges or everywhere.tasks != here.tasks:
        tasks = _asked(here, everywhere, parent)
    if tasks is None:
        return False
    return document.rename_action(name, new, tasks, merge=everywhere.merges)


def _asked(here: ActionRename, everywhere: ActionRename, parent: QWidget) -> Collection[str] | None:
    """Ask whether an action is to be renamed, and in which tasks; None where it is not."""
    box = QMessageBox(parent)
    box.setIcon(QMessageBox.Icon.Question)
    box.setTextFormat(Qt.TextFormat.PlainText)  # names are anybody's
    told = everywhere.sentences(done=False)
    if everywhere.merges:
        box.setWindowTitle("Merge actions")
        title = "Merge '{0}' into '{1}'?"
    else:
        box.setWindowTitle("Rename action")
        title = "Rename '{0}' to '{1}' in other tasks, too?"
    box.setText(title.format(everywhere.old, everywhere.new))
    box.setInformativeText(told)
    choices: dict[QAbstractButton, tuple[str, ...]] = {}
    if everywhere.tasks != here.tasks:
        task = here.tasks[0] or "no task"
        only = f"Only in {verbatim(task)}"
        choices[box.addButton(only, QMessageBox.ButtonRole.AcceptRole)] = here.tasks
        words = f"In all {len(everywhere.tasks)} tasks"
    else:
        words = "Merge"
    choices[box.addButton(words, QMessageBox.ButtonRole.AcceptRole)] = everywhere.tasks
    box.setDefaultButton(box.addButton(QMessageBox.StandardButton.Cancel))
    box.exec()
    chosen = box.clickedButton()
    box.deleteLater()
    return choices.get(chosen)
