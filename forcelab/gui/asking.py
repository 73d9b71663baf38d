"""The dialogs that commands open; each is loaded when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from PySide6.QtCore import QCoreApplication
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget

from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.shortcuts import keys

__all__ = ["handlers"]

translate = QCoreApplication.translate


def handlers(
    document: Document, jobs: Jobs, window: QWidget, commands: Callable[[], Mapping[str, QAction]]
) -> dict[str, Callable[[], object]]:
    """What the commands that open a dialog do, by their id.

    Parameters
    ----------
    document : Document
        What the dialogs are about.
    jobs : Jobs
        Works in the background for them.
    window : QWidget
        Over which they appear.
    commands : callable
        Gives the actions that the window has, by the command's id.
    """
    return {
        "synchronise": partial(_synchronise, document, jobs, window),
        "change_keys": lambda: _change_keys(document, window, commands()),
        "help": lambda: _help(document, window, commands()),
    }


def _synchronise(document: Document, jobs: Jobs, window: QWidget) -> None:
    """Let the user synchronise video and forces, with the panels at hand."""
    from forcelab.gui.label.synchronising import SynchroniseDialog

    demonstration = document.demonstration
    if demonstration is None or demonstration.video is None:
        document.say(translate("forcelab", "There is no video to synchronise here."), True)
        return
    SynchroniseDialog(document, jobs, window).show()


def _change_keys(document: Document, window: QWidget, commands: Mapping[str, QAction]) -> None:
    """Let the user change keys."""
    from forcelab.gui.keys import KeysDialog

    dialog = KeysDialog(document, keys(), window, commands)
    dialog.exec()
    dialog.deleteLater()


def _help(document: Document, window: QWidget, commands: Mapping[str, QAction]) -> None:
    """Show the page of keys and gestures."""
    from forcelab.gui.help import HelpPage

    page = HelpPage(document, keys(), window, commands)
    page.exec()
    page.deleteLater()
