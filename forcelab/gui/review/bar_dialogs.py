"""The dialogs that the training bar opens; each is loaded when it is first asked for."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from forcelab.gui.review.learning import Learning

__all__ = ["ask_choice", "ask_settings"]


def ask_choice(learning: Learning, window: QWidget) -> None:
    """Let the coder choose what is trained on and what is tested."""
    if not learning.ready:
        return
    from forcelab.gui.review.task_choice import TaskChoiceDialog

    dialog = TaskChoiceDialog(learning.document, learning.choice, window)
    dialog.accepted.connect(lambda: learning.set_choice(dialog.form.choice()))
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    dialog.open()


def ask_settings(learning: Learning, window: QWidget) -> None:
    """Let the coder choose how recognisers are trained."""
    if not learning.ready:
        return
    from forcelab.gui.review.settings_dialog import SettingsDialog
    from forcelab.gui.review.settings_facts import facts_of

    facts = facts_of(learning.document, learning.choice)
    dialog = SettingsDialog(learning.settings, facts, window)

    def take() -> None:
        if dialog.chosen is not None:
            learning.set_settings(dialog.chosen)

    dialog.accepted.connect(take)
    dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    dialog.open()
