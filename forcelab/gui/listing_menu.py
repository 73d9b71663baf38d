"""What can be done with a demonstration or a task of the list, besides opening it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog, QInputDialog, QLineEdit, QMenu, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.listing_rows import Group, Row
from forcelab.project import Project

__all__ = ["ListingMenu"]


class ListingMenu(QObject):
    """The context menu and its verbs; each verb is a call of the project and asks nothing."""

    def __init__(self, document: Document, parent: QWidget) -> None:
        super().__init__(parent)
        self._document, self._window = document, parent

    def made_for(self, item: Row | Group) -> QMenu:
        """The menu of a demonstration or a task; it deletes itself once it is closed."""
        menu = QMenu(self._window)
        menu.aboutToHide.connect(menu.deleteLater)
        project = self._document.project
        if isinstance(item, Group):
            ids = [row.info.id for row in item.rows]
            many = self.tr("Assign these {0} blind…").format(len(ids))
            menu.addAction(many, lambda: self._ask_assign(ids))
        else:
            self._fill(menu, item)
        if project is None or project.read_only:
            for action in menu.actions():
                action.setEnabled(action.data() == "open")
        return menu

    # Verbs

    def assign(self, ids: list[str], author: str, blind: bool = True) -> bool:
        """Assign demonstrations to a coder; gives whether that could be done."""

        def carry_out(project: Project) -> None:
            for id_ in ids:
                project.assign(id_, author, blind)

        return self._do(carry_out, self._document.id in ids)

    def unassign(self, id_: str, author: str) -> bool:
        """Take an assignment back."""
        here = id_ == self._document.id
        return self._do(lambda project: project.unassign(id_, author), here)

    def set_done(self, id_: str, done: bool) -> bool:
        """Mark a demonstration as done by the coder, or as not done after all."""
        author = self._document.author

        def carry_out(project: Project) -> None:
            if all(one.demonstration != id_ for one in project.assignments(author)):
                project.assign(id_, author, blind=False)
            project.set_done(id_, author, done)

        return self._do(carry_out, id_ == self._document.id)

    def rename(self, id_: str, name: str) -> bool:
        """Give a demonstration another name."""
        return self._do(lambda project: project.rename(id_, name), id_ == self._document.id)

    def attach_video(self, id_: str, path: Path) -> bool:
        """Copy a video into the project; its clock is set by synchronising."""
        here = id_ == self._document.id
        return self._do(lambda project: project.attach_video(id_, path), here)

    # Inside

    def _fill(self, menu: QMenu, row: Row) -> None:
        """The menu of a demonstration."""
        info, document = row.info, self._document
        first = menu.addAction(self.tr("Open"), lambda: document.open_demonstration(info.id))
        first.setData("open")
        first.setEnabled(info.id != document.id)
        menu.addSeparator()
        if row.done:
            menu.addAction(self.tr("Not done after all"), lambda: self.set_done(info.id, False))
        else:
            menu.addAction(self.tr("Mark as done"), lambda: self.set_done(info.id, True))
        menu.addAction(self.tr("Assign blind…"), lambda: self._ask_assign([info.id]))
        own = () if row.assignment is None else (row.assignment,)
        for one in (*own, *row.assigned_to):
            taking = self.tr("Take the assignment of {0} back").format(one.author)
            menu.addAction(taking, self._taking(info.id, one.author))
        menu.addSeparator()
        menu.addAction(self.tr("Rename…"), lambda: self._ask_name(row))
        video = self.tr("Replace video…") if info.has_video else self.tr("Attach video…")
        menu.addAction(video, lambda: self._ask_video(row))

    def _taking(self, id_: str, author: str) -> Callable[[], object]:
        """A call that takes this assignment back."""
        return lambda: self.unassign(id_, author)

    def _do(self, verb: Callable[[Project], None], here: bool) -> bool:
        """Change the project, and let everybody see it; `here` is the open demonstration."""
        project = self._document.project
        if project is None:
            return False
        try:
            verb(project)
        except ForcelabError as error:
            self._document.say(str(error), True)
            return False
        finally:
            self._document.reread() if here else self._document.refresh_listing()
        return True

    def _ask_assign(self, ids: list[str]) -> None:
        """Ask to whom demonstrations are assigned."""
        project, document = self._document.project, self._document
        if project is None:
            return
        coders = [author.name for author in project.authors() if author.kind == "coder"]
        coders += [one.author for one in project.assignments()]
        names = list(dict.fromkeys([document.author, *coders]))
        name, agreed = QInputDialog.getItem(
            self._window,
            self.tr("Assign blind"),
            self.tr(
                "Until it is done, the coder sees nobody else's labels and no predictions.\nCoder:"
            ),
            names,
            0,
            True,
        )
        if agreed:
            self.assign(ids, name.strip())

    def _ask_name(self, row: Row) -> None:
        """Ask for a demonstration's new name."""
        name, agreed = QInputDialog.getText(
            self._window,
            self.tr("Rename demonstration"),
            self.tr("Name:"),
            QLineEdit.EchoMode.Normal,
            row.info.name,
        )
        if agreed and name.strip() != row.info.name:
            self.rename(row.info.id, name)

    def _ask_video(self, row: Row) -> None:
        """Ask for a video."""
        path, _ = QFileDialog.getOpenFileName(
            self._window,
            self.tr("Video of {0}").format(row.info.name),
            "",
            self.tr("Videos ({0});;All files (*)").format("*.mp4 *.avi *.mkv *.mov *.webm *.m4v"),
        )
        if path:
            self.attach_video(row.info.id, Path(path))
