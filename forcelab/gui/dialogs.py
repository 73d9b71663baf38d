"""The dialogs that commands open; each is loaded when first opened, to start faster."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QApplication, QDialog, QWidget

from forcelab.demonstration import VideoReference
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import ask

if TYPE_CHECKING:
    from forcelab.gui.project_actions import ProjectActions
    from forcelab.gui.review.trainer import Trainer


def handlers(
    document: Document,
    jobs: Jobs,
    window: QWidget,
    commands: Callable[[], Mapping[str, QAction]],
    shown: Callable[[], Iterable[str]],
    video: Callable[[], VideoReference | None],
    *,
    remembering: bool = True,
) -> dict[str, Callable[[], object]]:
    """The handlers of the commands that open a dialog, by command id.

    `commands` returns the window's actions by command id, `shown` the ids of the listed
    demonstrations, `video` what is shown of the open one. Places of dialogs are kept if
    `remembering`.
    """
    return {
        "export_labels": lambda: _export(document, jobs, window, tuple(shown())),
        "save": partial(_report_stored, document),
        "done": partial(_toggle_done, document, window),
        "synchronise": lambda: _synchronise(document, jobs, window, video(), remembering),
        "help": lambda: _help(document, window, commands()),
        "about": lambda: _about(window),
    }


def confirm_reveal(
    document: Document, ids: Collection[str], window: QWidget, *, withdrawing: bool = False
) -> bool:
    """Ask whether to end blind coding of these demonstrations; True if there is nothing to ask.

    It ends as they are marked as done, or by `withdrawing` the coder's assignments.
    """
    project = document.project
    hidden = set() if project is None else project.coding.blind_to(document.author) & set(ids)
    if not hidden:
        return True
    names = [f"'{info.name}'" for info in document.infos if info.id in hidden]
    which = names[0] if len(names) == 1 else f"{len(names)} demonstrations"
    step = f"Withdraw your assignment of {which}" if withdrawing else f"Mark {which} as done"
    text = f"{step} and end blind coding?"
    detail = (
        "You will see the labels and notes of others and the predictions. What has been seen "
        "cannot be hidden again."
    )
    answers = "Withdraw" if withdrawing else "Mark as done", "Cancel"
    answer = ask(window, "End blind coding", text, detail, answers, default=1, escape=1)
    return answer == answers[0]


def _toggle_done(document: Document, window: QWidget) -> None:
    """Mark the open demonstration as done, once the coder agrees to what that shows."""
    if confirm_reveal(document, {document.id}, window):
        document.set_done()


def _report_stored(document: Document) -> None:
    """Say that everything is saved already."""
    document.show_message("Everything is saved already: each change is, as it is made.")


def _export(document: Document, jobs: Jobs, window: QWidget, shown: Sequence[str]) -> None:
    from forcelab.gui.export_dialog import ExportDialog

    _run(ExportDialog(document, jobs, shown, window))


def _synchronise(
    document: Document,
    jobs: Jobs,
    window: QWidget,
    video: VideoReference | None,
    remembering: bool,
) -> None:
    """Synchronise video and forces, with the panels at hand."""
    from forcelab.gui.label.video_sync import SynchroniseDialog

    SynchroniseDialog(document, jobs, window, video, remembering=remembering).show()


def show_preferences(
    document: Document,
    trainer: Trainer,
    opening: ProjectActions,
    window: QWidget,
    commands: Mapping[str, QAction],
    page: str,
) -> None:
    """Show the preferences beside the window; with a page of them in front, if one is named."""
    from forcelab.gui.preferences_dialog import PreferencesDialog

    dialog = window.findChild(PreferencesDialog)
    if dialog is None:
        dialog = PreferencesDialog(document, trainer, opening, keys(), window, commands)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    if page:
        dialog.show_page(page)
    dialog.show()
    dialog.activateWindow()


def _help(document: Document, window: QWidget, commands: Mapping[str, QAction]) -> None:
    from forcelab.gui.help import HelpPage

    _run(HelpPage(document, keys(), window, commands))


def _about(window: QWidget) -> None:
    from forcelab.gui.help import AboutDialog

    _run(AboutDialog(window))


def _run(dialog: QDialog) -> None:
    """Show a dialog until it is closed."""
    dialog.exec()
    dialog.deleteLater()


def show_guide(window: QWidget, place: str, *, remembering: bool = True) -> None:
    """Show a place in the guide beside the window, or beside the dialog that is open."""
    from forcelab.gui.guide import GuideWindow

    guide = window.findChild(GuideWindow)
    if guide is None:
        guide = GuideWindow(window, remembering=remembering)
    guide.show()
    guide.open(place)
    dialog = QApplication.activeModalWidget()
    guide.belong_to(dialog or window)  # or a modal dialog would keep mouse and keys from it
    if isinstance(dialog, QDialog):
        dialog.finished.connect(partial(guide.belong_to, window))
    guide.raise_()
    guide.activateWindow()
