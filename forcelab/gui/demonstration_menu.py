"""What can be done with demonstrations of the list: their context menu, and what it asks for."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, QSize, Qt
from PySide6.QtGui import QKeyEvent, QKeySequence, QTextCursor
from PySide6.QtWidgets import QDialog, QInputDialog, QLineEdit, QMenu, QPlainTextEdit, QWidget

from forcelab.errors import ForcelabError
from forcelab.gui.demonstration_model import DemonstrationRow, TaskGroup
from forcelab.gui.document import Document
from forcelab.gui.file_dialogs import ask_file
from forcelab.gui.layout import dialog_buttons, label_of, page_layout, set_enabled_with_reason
from forcelab.gui.text import confirm, escape_ampersands, settle_name
from forcelab.gui.widgets import ENTER_KEYS
from forcelab.project import DemonstrationInfo, Project


class NoteDialog(QDialog):
    """Asks for a note of several lines; Ctrl+Return accepts it."""

    def __init__(self, name: str, text: str, parent: QWidget) -> None:
        super().__init__(parent)
        self.setWindowTitle(f"Note on {name}")
        self.text = QPlainTextEdit(text, tabChangesFocus=True)
        self.text.moveCursor(QTextCursor.MoveOperation.End)  # what is typed goes on
        label = label_of(self.text, "&Note for other coders (leave it empty for none):")
        buttons, save = dialog_buttons(self, "Save the note", "&Save")
        save.setToolTip(
            QKeySequence("Ctrl+Return").toString(QKeySequence.SequenceFormat.NativeText)
        )
        page_layout(self, label, self.text, buttons, growing=self.text, margin=10, spacing=8)

    def sizeHint(self) -> QSize:
        """About sixty letters wide and six lines high."""
        metrics = self.fontMetrics()
        lines = super().sizeHint().height() - self.text.sizeHint().height()
        return QSize(metrics.averageCharWidth() * 64, lines + metrics.lineSpacing() * 7)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Ctrl+Return comes here from the text, where Return alone begins a line."""
        if event.key() in ENTER_KEYS and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.accept()
        else:
            super().keyPressEvent(event)


class DemonstrationMenu(QObject):
    """The context menu; its verbs change the project at once, `ask_…` asks for what they need."""

    def __init__(self, document: Document, parent: QWidget) -> None:
        super().__init__(parent)
        self._document, self._window = document, parent
        self._previous_tasks: dict[str, str] = {}  # from which demonstrations were taken, by id

    def menu_for(
        self, item: DemonstrationRow | TaskGroup, several: Sequence[DemonstrationRow] = ()
    ) -> QMenu:
        """The menu of a demonstration, of several, or of a task; deletes itself once closed."""
        menu = QMenu(self._window)
        menu.aboutToHide.connect(menu.deleteLater)
        project = self._document.project
        if isinstance(item, TaskGroup):
            self._fill(menu, item.rows, single=False)
        else:
            self._fill(menu, several or (item,), single=not several)
        if project is None or project.read_only:
            for action in menu.actions():
                if action.data() != "open":
                    set_enabled_with_reason(action, "The project can only be read.")
        return menu

    # Verbs

    def assign(self, ids: list[str], author: str) -> bool:
        """Assign demonstrations to a coder, blind."""
        return self._each(ids, lambda project, id_: project.coding.assign(id_, author))

    def unassign(self, ids: list[str], author: str) -> bool:
        """Withdraw a coder's assignments."""
        return self._each(ids, lambda project, id_: project.coding.unassign(id_, author))

    def set_done(self, ids: list[str], done: bool) -> bool:
        """Mark demonstrations as done by the coder, or as not done."""
        document = self._document
        if done and document.id in ids and not document.finish_stroke():
            return False
        author = document.author
        return self._each(ids, lambda project, id_: project.coding.set_done(id_, author, done))

    def rename(self, id_: str, name: str) -> bool:
        return self._each([id_], lambda project, id_: project.demonstrations.rename(id_, name))

    def set_note(self, id_: str, text: str) -> bool:
        """Write the coder's note on a demonstration; ``""`` removes it."""
        author = self._document.author
        return self._each([id_], lambda project, id_: project.coding.set_note(id_, author, text))

    def set_task(self, ids: list[str], task: str) -> bool:
        """Move demonstrations to another task; the menu of each offers the way back."""
        old = {info.id: info.task for info in self._document.infos}

        def carry_out(project: Project, id_: str) -> None:
            project.demonstrations.set_task(id_, task)
            self._previous_tasks[id_] = old.get(id_, "")

        done = self._each(ids, carry_out)
        if done and self._document.id not in ids:
            self._document.reread()  # both tasks may list other actions now
        return done

    def remove(self, heads: Mapping[str, Mapping[str, int]]) -> bool:
        """Remove demonstrations for good: by id, the track heads the coder has agreed to lose."""
        return self._do(heads, lambda project: project.demonstrations.remove_all(heads))

    def attach_video(self, id_: str, path: Path, name: str | None = None) -> bool:
        """Copy a video into the project, in place of the one of that name; by default the first.

        Its clock is set by synchronising.
        """
        from forcelab.formats import naming_recording
        from forcelab.video.validate import check_video

        damage = ""

        def attach(project: Project, id_: str) -> None:
            nonlocal damage
            # What is no video is not copied, and takes no video's place.
            with naming_recording(path):
                damage = check_video(path, project.demonstrations.info(id_).duration)
            project.media.attach_video(id_, path, name=name)

        done = self._each([id_], attach)
        if done and damage:
            self._document.show_message(damage, True)
        return done

    # Inside

    def _fill(self, menu: QMenu, rows: Sequence[DemonstrationRow], *, single: bool) -> None:
        """What can be done with a demonstration, or with all of several at once."""

        def count(ids: Sequence[str]) -> str:
            return "" if single else f"{len(ids)} "

        ids = [row.info.id for row in rows]
        done_ids = [row.info.id for row in rows if row.done]
        undone_ids = [row.info.id for row in rows if not row.done]
        if single:
            first = menu.addAction("Open", lambda: self._document.open_demonstration(ids[0]))
            first.setData("open")
            set_enabled_with_reason(first, "It is open." if ids[0] == self._document.id else "")
            menu.addSeparator()
        if undone_ids:
            menu.addAction(f"Mark {count(undone_ids)}as done", lambda: self._ask_done(undone_ids))
        if done_ids:
            text = f"Mark {count(done_ids)}as not done"
            menu.addAction(text, lambda: self.set_done(done_ids, False))
        menu.addAction(f"Assign {count(ids)}for blind coding…", lambda: self.ask_assign(rows))
        assigned: dict[str, list[str]] = {}
        for row in rows:
            for assignment in row.assignments:
                assigned.setdefault(assignment.author, []).append(row.info.id)
        for author, assigned_ids in assigned.items():
            several = len(assigned_ids) > 1
            which = f"{len(assigned_ids)} assignments" if several else "the assignment"
            text = f"Withdraw {which} ({escape_ampersands(author)})"
            menu.addAction(text, partial(self._ask_withdraw, assigned_ids, author))
        menu.addSeparator()
        if single:
            self._add_changes(menu, rows[0])
        menu.addAction(f"Move {count(ids)}to another task…", lambda: self.ask_task(rows))
        before = self._previous_tasks.get(ids[0], rows[0].info.task)
        if single and before != rows[0].info.task:
            back = f"Back to task '{escape_ampersands(before) or 'No task'}'"
            menu.addAction(back, lambda: self.set_task(ids, before))
        menu.addSeparator()
        menu.addAction(f"Remove {count(ids)}from the project…", lambda: self._ask_remove(rows))

    def _add_changes(self, menu: QMenu, row: DemonstrationRow) -> None:
        """Note, name and videos of one demonstration."""
        info = row.info
        menu.addAction("Note…", lambda: self.ask_note(row))
        menu.addAction("Rename…", lambda: self.ask_name(row))
        if len(info.videos) < 2:
            video = "Replace video…" if info.has_video else "Attach video…"
            menu.addAction(video, lambda: self.ask_video(info, *info.videos))
        else:
            self._add_videos(menu.addMenu("Replace video"), info, self.ask_video)
        if info.has_video:
            menu.addAction("Add another video…", lambda: self.ask_video(info))
            self._add_videos(menu.addMenu("Remove video"), info, self._ask_remove_video)

    def _add_videos(
        self, menu: QMenu, info: DemonstrationInfo, ask: Callable[[DemonstrationInfo, str], object]
    ) -> None:
        for name in info.videos:
            menu.addAction(escape_ampersands(name) + "…", partial(ask, info, name))

    def _each(self, ids: list[str], verb: Callable[[Project, str], object]) -> bool:
        """Change demonstrations one after the other."""
        return self._do(ids, lambda project: [verb(project, id_) for id_ in ids])

    def _do(self, ids: Collection[str], verb: Callable[[Project], object]) -> bool:
        """Change demonstrations, then read them again; returns whether that succeeded."""
        project = self._document.project
        if project is None:
            return False
        try:
            verb(project)
        except ForcelabError as error:
            self._document.refuse(str(error))
            return False
        finally:
            is_open = self._document.id in ids
            self._document.reread() if is_open else self._document.refresh_listing()
        return True

    def _ask_done(self, ids: list[str]) -> None:
        """Mark as done, once the coder agrees to see what others labelled."""
        if confirm_reveal(self._document, ids, self._window):
            self.set_done(ids, True)

    def _ask_withdraw(self, ids: list[str], author: str) -> None:
        """Withdraw assignments, once the coder agrees to what that shows."""
        own = ids if author == self._document.author else ()
        if confirm_reveal(self._document, own, self._window, withdrawing=True):
            self.unassign(ids, author)

    def _choose(self, title: str, text: str, names: Iterable[str]) -> str | None:
        """Ask for one of these names, or another one; None if cancelled."""
        offered = list(dict.fromkeys(names))
        name, agreed = QInputDialog.getItem(self._window, title, text, offered, 0, True)
        return name if agreed else None

    def ask_assign(self, rows: Sequence[DemonstrationRow]) -> None:
        project, document = self._document.project, self._document
        if project is None:
            return
        # Mostly somebody else: a second coder who must not see what this one has labelled.
        others = [name for name in project.coding.people() if name != document.author]
        names = [*others, document.author]
        text = (
            "Until it is done, the coder sees nobody else's labels or notes, and no predictions.\n"
            "Coder:"
        )
        name = self._choose("Assign for blind coding", text, names)
        if name is None:
            return
        coder = settle_name(self._window, name, names)
        ids = [row.info.id for row in rows]
        if self.assign(ids, coder):  # of which nothing is seen but by that coder
            what = "The demonstration is" if len(ids) == 1 else f"{len(ids)} demonstrations are"
            document.show_message(f"{what} assigned to {coder}.")

    def ask_name(self, row: DemonstrationRow) -> None:
        name, agreed = QInputDialog.getText(
            self._window, "Rename demonstration", "Name:", QLineEdit.EchoMode.Normal, row.info.name
        )
        if agreed and name.strip() != row.info.name:
            self.rename(row.info.id, name)

    def ask_note(self, row: DemonstrationRow) -> None:
        """Edit the coder's note on a demonstration in a dialog that blocks nothing."""
        if not self._do((), Project.refuse_read_only):
            return
        author = self._document.author
        text = next((note.text for note in row.notes if note.author == author), "")
        dialog = NoteDialog(row.info.name, text, self._window)

        def write() -> None:
            if self.set_note(row.info.id, dialog.text.toPlainText()):
                dialog.deleteLater()
            else:
                dialog.open()  # what was typed is not lost

        dialog.accepted.connect(write)
        dialog.rejected.connect(dialog.deleteLater)
        dialog.open()

    def ask_task(self, rows: Sequence[DemonstrationRow]) -> None:
        project = self._document.project
        if project is None:
            return
        tasks = project.demonstrations.tasks()
        title = f"Move {rows[0].info.name if len(rows) == 1 else len(rows)} to another task"
        text = "Labels are kept; missing actions are added to the task.\nTask:"
        task = self._choose(title, text, (rows[0].info.task, *tasks))
        if task is not None:
            name = settle_name(self._window, task, tasks)
            self.set_task([row.info.id for row in rows], name)

    def _ask_remove(self, rows: Sequence[DemonstrationRow]) -> None:
        """Remove demonstrations, once the coder agrees to what goes with them."""
        from forcelab.gui.removal_dialog import confirm_removal

        agreed: dict[str, dict[str, int]] = {}

        def ask(project: Project) -> None:
            # Read before anything is asked: labels painted meanwhile are not among what was told.
            heads = {
                row.info.id: {
                    name: project.tracks.head(row.info.id, name) for name in row.info.authors
                }
                for row in rows
            }
            if confirm_removal(rows, self._document.author, project, self._window):
                agreed.update(heads)

        if self._do((), ask) and agreed and self.remove(agreed):
            message = f"'{rows[0].info.name}' was removed."
            if len(rows) > 1:
                message = f"{len(rows)} demonstrations were removed."
            self._document.show_message(message)

    def _ask_remove_video(self, info: DemonstrationInfo, name: str) -> None:
        question = f"Remove the video '{name}' of '{info.name}' for good?"
        detail = "The file that it was attached from stays, and so do all labels."
        if confirm(self._window, "Remove video", question, detail, "Remove"):
            self._each([info.id], lambda project, id_: project.media.remove_video(id_, name))

    def ask_video(self, info: DemonstrationInfo, name: str | None = None) -> None:
        """Attach a video in place of the one of that name; a further one is asked for its name."""
        path = ask_file(
            self._window,
            f"Video of {info.name}",
            "video",
            "Videos (*.mp4 *.avi *.mkv *.mov *.webm *.m4v);;All files (*)",
        )
        if path is not None and name is None and info.has_video:
            own = path.stem.removeprefix(info.name).strip("._- ") or path.stem
            title = f"Add another video to {info.name}"
            text = "A video of the same name is replaced.\nName:"
            name = self._choose(title, text, (own, *info.videos))
            path = None if name is None else path
        if path is not None and self.attach_video(info.id, path, name):
            self._document.show_message(
                f"'{info.name}' has its video; Demonstration > Synchronise the video puts it in "
                "time."
            )


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
    verb = "Withdraw" if withdrawing else "Mark as done"
    return confirm(window, "End blind coding", text, detail, verb)
