"""What can be done with a demonstration or a task of the list, besides opening it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QInputDialog, QLineEdit, QMenu, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.asking import unveiling_agreed
from forcelab.gui.choosing import ask_file
from forcelab.gui.document import Document
from forcelab.gui.listing_rows import Group, Row
from forcelab.gui.naming import settled_name, verbatim
from forcelab.project import DemonstrationInfo, Project

__all__ = ["ListingMenu"]

#: A note has so many pixels' room while it is written.
NOTE_WIDTH = 480


class ListingMenu(QObject):
    """The context menu and its verbs; each verb is a call of the project and asks nothing."""

    def __init__(self, document: Document, parent: QWidget) -> None:
        super().__init__(parent)
        self._document, self._window = document, parent
        self._left: dict[str, str] = {}  # by id, the task that a demonstration was taken from

    def made_for(self, item: Row | Group, several: Sequence[Row] = ()) -> QMenu:
        """The menu of a demonstration, of several, or of a task; once closed it deletes itself."""
        menu = QMenu(self._window)
        menu.aboutToHide.connect(menu.deleteLater)
        project = self._document.project
        if several or isinstance(item, Group):
            self._fill_many(menu, item.rows if isinstance(item, Group) else several)
        else:
            self._fill(menu, item)
        if project is None or project.read_only:
            for action in menu.actions():
                action.setEnabled(action.data() == "open")
        return menu

    # Verbs

    def assign(self, ids: list[str], author: str) -> bool:
        """Assign demonstrations to a coder, blind; gives whether that could be done."""
        return self._each(ids, lambda project, id_: project.assign(id_, author))

    def unassign(self, ids: list[str], author: str) -> bool:
        """Take a coder's assignments of some demonstrations back."""
        return self._each(ids, lambda project, id_: project.unassign(id_, author))

    def set_done(self, ids: list[str], done: bool) -> bool:
        """Mark demonstrations as done by the coder, or as not done."""
        author = self._document.author

        return self._each(ids, lambda project, id_: project.set_done(id_, author, done))

    def rename(self, id_: str, name: str) -> bool:
        """Give a demonstration another name."""
        return self._each([id_], lambda project, id_: project.rename(id_, name))

    def set_note(self, id_: str, text: str) -> bool:
        """Write the coder's note on a demonstration; ``""`` takes it away."""
        author = self._document.author
        return self._each([id_], lambda project, id_: project.set_note(id_, author, text))

    def set_task(self, ids: list[str], task: str) -> bool:
        """Put demonstrations into another task; the menu of each offers the way back."""
        old = {info.id: info.task for info in self._document.infos}

        def carry_out(project: Project, id_: str) -> None:
            project.set_task(id_, task)
            self._left[id_] = old.get(id_, "")

        done = self._each(ids, carry_out)
        if done and self._document.id not in ids:
            self._document.reread()  # both tasks may list other actions now
        return done

    def remove(self, heads: Mapping[str, Mapping[str, int]]) -> bool:
        """Remove demonstrations for good, by their ids, with the labels that have these heads."""
        return self._do(heads, lambda project: project.remove_all(heads))

    def attach_video(self, id_: str, path: Path) -> bool:
        """Copy a video into the project; its clock is set by synchronising."""
        from forcelab.video.validate import check_video

        damage = ""

        def attach(project: Project, id_: str) -> None:
            nonlocal damage
            # What is no video is not copied, and takes no video's place.
            damage = check_video(path, project.info(id_).duration)
            project.attach_video(id_, path)

        done = self._each([id_], attach)
        if done and damage:
            self._document.say(damage, True)
        return done

    # Inside

    def _fill(self, menu: QMenu, row: Row) -> None:
        """The menu of a demonstration."""
        info, document = row.info, self._document
        first = menu.addAction("Open", lambda: document.open_demonstration(info.id))
        first.setData("open")
        first.setEnabled(info.id != document.id)
        menu.addSeparator()
        if row.done:
            menu.addAction("Mark as not done", lambda: self.set_done([info.id], False))
        else:
            menu.addAction("Mark as done", lambda: self._ask_done([info.id]))
        menu.addAction("Assign blind…", lambda: self._ask_assign([info.id]))
        for one in row.assignments:
            taking = f"Withdraw the assignment ({verbatim(one.author)})"
            menu.addAction(taking, self._taking([info.id], one.author))
        menu.addSeparator()
        menu.addAction("Note…", lambda: self.ask_note(row))
        menu.addAction("Rename…", lambda: self._ask_name(row))
        video = "Replace video…" if info.has_video else "Attach video…"
        menu.addAction(video, lambda: self.ask_video(info))
        menu.addAction("Task…", lambda: self._ask_task([row]))
        before = self._left.get(info.id, info.task)
        if before != info.task:
            back = "Back to task '{}'".format(verbatim(before) or "No task")
            menu.addAction(back, lambda: self.set_task([info.id], before))
        menu.addSeparator()
        menu.addAction("Remove from the project…", lambda: self._ask_remove([row]))

    def _fill_many(self, menu: QMenu, rows: Sequence[Row]) -> None:
        """The menu of several demonstrations: what is of use to all of them at once."""
        ids = [row.info.id for row in rows]
        done = [row.info.id for row in rows if row.done]
        undone = [row.info.id for row in rows if not row.done]
        if undone:
            text = f"Mark {len(undone)} as done"
            menu.addAction(text, lambda: self._ask_done(undone))
        if done:
            text = f"Mark {len(done)} as not done"
            menu.addAction(text, lambda: self.set_done(done, False))
        text = f"Assign {len(ids)} blind…"
        menu.addAction(text, lambda: self._ask_assign(ids))
        held: dict[str, list[str]] = {}
        for row in rows:
            for one in row.assignments:
                held.setdefault(one.author, []).append(row.info.id)
        for author, of in held.items():
            text = f"Withdraw {len(of)} assignments ({verbatim(author)})"
            if len(of) == 1:
                text = f"Withdraw the assignment ({verbatim(author)})"
            menu.addAction(text, self._taking(of, author))
        menu.addSeparator()
        text = f"Move {len(ids)} to another task…"
        menu.addAction(text, lambda: self._ask_task(rows))
        menu.addSeparator()
        text = f"Remove {len(ids)} from the project…"
        menu.addAction(text, lambda: self._ask_remove(rows))

    def _taking(self, ids: list[str], author: str) -> Callable[[], object]:
        """A call that takes these assignments back."""
        return lambda: self.unassign(ids, author)

    def _each(self, ids: list[str], verb: Callable[[Project, str], object]) -> bool:
        """Change demonstrations one after the other."""
        return self._do(ids, lambda project: [verb(project, id_) for id_ in ids])

    def _do(self, ids: Collection[str], verb: Callable[[Project], object]) -> bool:
        """Change demonstrations of the project, and let everybody see it."""
        project = self._document.project
        if project is None:
            return False
        try:
            verb(project)
        except ForcelabError as error:
            self._document.say(str(error), True)
            return False
        finally:
            here = self._document.id in ids
            self._document.reread() if here else self._document.refresh_listing()
        return True

    def _ask_done(self, ids: list[str]) -> None:
        """Mark demonstrations as done, once the coder agrees to what that shows of others."""
        if unveiling_agreed(self._document, ids, self._window):
            self.set_done(ids, True)

    def _ask_assign(self, ids: list[str]) -> None:
        """Ask to whom demonstrations are assigned."""
        project, document = self._document.project, self._document
        if project is None:
            return
        names = list(dict.fromkeys([document.author, *project.people()]))
        name, agreed = QInputDialog.getItem(
            self._window,
            "Assign blind",
            (
                "Until it is done, the coder sees nobody else's labels or notes, and no "
                "predictions.\nCoder:"
            ),
            names,
            0,
            True,
        )
        coder = settled_name(self._window, name, names) if agreed else ""
        if agreed and self.assign(ids, coder):  # of which nothing is seen but by that coder
            one = "The demonstration is assigned to {1}."
            many = "{0} demonstrations are assigned to {1}."
            document.say((one if len(ids) == 1 else many).format(len(ids), coder))

    def _ask_name(self, row: Row) -> None:
        """Ask for a demonstration's new name."""
        name, agreed = QInputDialog.getText(
            self._window,
            "Rename demonstration",
            "Name:",
            QLineEdit.EchoMode.Normal,
            row.info.name,
        )
        if agreed and name.strip() != row.info.name:
            self.rename(row.info.id, name)

    def ask_note(self, row: Row) -> QInputDialog | None:
        """Ask for the coder's note on a demonstration; nothing waits for the answer."""
        if not self._do((), Project.refuse_read_only):
            return None
        author = self._document.author
        dialog = QInputDialog(self._window)
        dialog.setWindowTitle(f"Note on {row.info.name}")
        dialog.setLabelText("What others should know; leave it empty for no note.")
        dialog.setTextValue(next((note.text for note in row.notes if note.author == author), ""))
        dialog.resize(NOTE_WIDTH, dialog.sizeHint().height())

        def write() -> None:
            if self.set_note(row.info.id, dialog.textValue()):
                dialog.deleteLater()
            else:
                dialog.open()  # what was typed is not lost

        dialog.accepted.connect(write)
        dialog.rejected.connect(dialog.deleteLater)
        dialog.open()
        for line in dialog.findChildren(QLineEdit):
            line.deselect()  # what is typed first must not replace all of it
        return dialog

    def _ask_task(self, rows: Sequence[Row]) -> None:
        """Ask into which task demonstrations belong."""
        project = self._document.project
        if project is None:
            return
        tasks = list(dict.fromkeys([rows[0].info.task, *project.tasks()]))
        title = f"Task of {rows[0].info.name}"
        if len(rows) > 1:
            title = f"Task of these {len(rows)}"
        task, agreed = QInputDialog.getItem(
            self._window,
            title,
            "Labels stay; the task gets the actions it lacks.\nTask:",
            tasks,
            0,
            True,
        )
        if agreed:
            name = settled_name(self._window, task, project.tasks())
            self.set_task([row.info.id for row in rows], name)

    def _ask_remove(self, rows: Sequence[Row]) -> None:
        """Ask whether demonstrations are to go, and say what goes with them."""
        from forcelab.gui.removing import removal_agreed

        agreed: dict[str, dict[str, int]] = {}

        def ask(project: Project) -> None:
            # Read before anything is asked: labels painted meanwhile are not among what was told.
            heads = {
                row.info.id: {name: project.head(row.info.id, name) for name in row.info.authors}
                for row in rows
            }
            if removal_agreed(rows, self._document.author, project, self._window):
                agreed.update(heads)

        if self._do((), ask) and agreed and self.remove(agreed):
            told = f"'{rows[0].info.name}' was removed."
            if len(rows) > 1:
                told = f"{len(rows)} demonstrations were removed."
            self._document.say(told)

    def ask_video(self, info: DemonstrationInfo) -> None:
        """Ask for a video of a demonstration."""
        path = ask_file(
            self._window,
            f"Video of {info.name}",
            "video",
            "Videos ({});;All files (*)".format("*.mp4 *.avi *.mkv *.mov *.webm *.m4v"),
        )
        if path is not None and self.attach_video(info.id, path):
            self._document.say(
                f"'{info.name}' has its video; Labelling > Synchronise the video puts it in time."
            )
