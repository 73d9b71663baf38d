"""What can be done with a demonstration or a task of the list, besides opening it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog, QInputDialog, QLineEdit, QMenu, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.listing_rows import Group, Row
from forcelab.gui.naming import settled_name
from forcelab.project import DemonstrationInfo, Project

__all__ = ["ListingMenu"]


class ListingMenu(QObject):
    """The context menu and its verbs; each verb is a call of the project and asks nothing."""

    def __init__(self, document: Document, parent: QWidget) -> None:
        super().__init__(parent)
        self._document, self._window = document, parent
        self._left: dict[str, str] = {}  # by id, the task that a demonstration was taken from

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

    def set_task(self, id_: str, task: str) -> bool:
        """Put a demonstration into another task; the menu offers the way back."""
        old = next((info.task for info in self._document.infos if info.id == id_), "")
        if not self._do(lambda project: project.set_task(id_, task), id_ == self._document.id):
            return False
        self._left[id_] = old
        return True

    def remove(self, id_: str, heads: Mapping[str, int]) -> bool:
        """Remove a demonstration for good, with the labels that have these heads."""
        here = id_ == self._document.id
        return self._do(lambda project: project.remove(id_, heads), here)

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
        menu.addAction(video, lambda: self.ask_video(info))
        menu.addAction(self.tr("Task…"), lambda: self._ask_task(row))
        before = self._left.get(info.id, info.task)
        if before != info.task:
            back = self.tr("Back to task '{0}'").format(before or self.tr("No task"))
            menu.addAction(back, lambda: self.set_task(info.id, before))
        menu.addSeparator()
        menu.addAction(self.tr("Remove from the project…"), lambda: self._ask_remove(row))

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
            self.assign(ids, settled_name(self._window, name, names))

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

    def _ask_task(self, row: Row) -> None:
        """Ask into which task a demonstration belongs."""
        project = self._document.project
        if project is None:
            return
        tasks = list(dict.fromkeys([row.info.task, *project.tasks()]))
        task, agreed = QInputDialog.getItem(
            self._window,
            self.tr("Task of {0}").format(row.info.name),
            self.tr("Labels stay; the task gets the actions it lacks.\nTask:"),
            tasks,
            0,
            True,
        )
        if agreed:
            self.set_task(row.info.id, settled_name(self._window, task, project.tasks()))

    def _ask_remove(self, row: Row) -> None:
        """Ask whether a demonstration is to go, and say what goes with it."""
        from forcelab.gui.removing import RemoveDialog

        project = self._document.project
        if project is None:
            return
        # Read before anything is asked: labels painted meanwhile are not among what was told.
        heads = {name: project.head(row.info.id, name) for name in row.info.authors}
        dialog = RemoveDialog(row, self._document.author, self._window)
        if dialog.exec() and self.remove(row.info.id, heads):
            self._document.say(self.tr("'{0}' was removed.").format(row.info.name))
        dialog.deleteLater()

    def ask_video(self, info: DemonstrationInfo) -> None:
        """Ask for a video of a demonstration."""
        path, _ = QFileDialog.getOpenFileName(
            self._window,
            self.tr("Video of {0}").format(info.name),
            "",
            self.tr("Videos ({0});;All files (*)").format("*.mp4 *.avi *.mkv *.mov *.webm *.m4v"),
        )
        if path:
            self.attach_video(info.id, Path(path))
