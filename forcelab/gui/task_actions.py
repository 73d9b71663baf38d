"""The actions that can be painted in the window: those of the open demonstration's task."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError
from forcelab.gui.looking import ViewState
from forcelab.project import Project, UndoResult
from forcelab.vocabulary import Action, Vocabulary

__all__ = ["TaskActions"]


class TaskActions(ViewState):
    """The part of the window's state that says what can be painted.

    Attributes
    ----------
    project : Project or None
        The open project.
    vocabulary : Vocabulary
        Of the open demonstration's task.
    action : str or None
        The brush: what dragging on the track paints.
    refused : bool
        Whether what was asked of the store last could not be done: it may be asked once more.
    """

    vocabulary_changed = Signal()
    action_changed = Signal()
    store_failed = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.project: Project | None = None
        self.action: str | None = None
        self.refused = False
        # A task, with its actions on either side of each renaming, both ways round.
        self._renamings: list[tuple[str, Vocabulary, Vocabulary]] = []
        self._list_actions(Vocabulary())

    def set_action(self, name: str | None) -> None:
        """Take up a brush, or put it down."""
        if name != self.action:
            self.action = name
            self.action_changed.emit()

    def set_vocabulary(self, vocabulary: Vocabulary) -> bool:
        """Replace the actions of the open demonstration's task, unless others changed them."""
        if self.project is None or self.demonstration is None:
            return False
        task, done = self.demonstration.task, False
        with self._reporting_errors():
            done = self.project.actions.set_vocabulary(task, vocabulary, before=self._listed)
            if done:
                self._list_actions(vocabulary)
            else:
                now = self.vocabulary
                self._list_actions(self.project.actions.vocabulary(task), now.names, now)
                self.say("The actions were changed elsewhere; look at them and repeat it.", True)
            self.vocabulary_changed.emit()
        return done

    def add_actions(self, *names: str) -> bool:
        """Make sure that the vocabulary has these actions; those that others add stay."""
        if all(name in self.vocabulary for name in names):
            return True
        if self.project is None or self.demonstration is None:
            return False
        with self._reporting_errors() as errors:
            wider = self.vocabulary.with_actions(*names)
            self._list_actions(self.project.actions.add(self.demonstration.task, wider.names))
            self.vocabulary_changed.emit()
        return not errors

    # Inside

    def _list_actions(
        self, listed: Vocabulary, painted: tuple[str, ...] = (), like: Iterable[Action] = ()
    ) -> None:
        """Offer the actions that are stored, and painted ones besides; nobody is told yet."""
        self._listed = listed
        self.vocabulary = listed.with_actions(*painted, like=like)
        if self.action is not None and self.action not in self.vocabulary:
            self.set_action(None)

    def _bring_back(self, reverted: UndoResult) -> None:
        """Offer what an undo or a redo brought back, which may have left the list since.

        Where a renaming was reverted, actions get back the look and the key that they had.
        """
        project = self.project
        if project is None:
            return
        here = None if self.demonstration is None else self.demonstration.task
        with self._reporting_errors():
            for task, (gone, back) in reverted.actions.items():
                listed = project.actions.vocabulary(task)  # which others may have changed just now
                now = self._before_renaming(task, listed, gone, back, reverted)
                if now is None or not project.actions.set_vocabulary(task, now, before=listed):
                    wider = listed.with_actions(*sorted(back))
                    now = listed if wider == listed else project.actions.add(task, wider.names)
                if task == here and now != self._listed:
                    shown, listed = self.vocabulary, self._listed
                    besides = tuple(name for name in shown.names if name not in listed)
                    self._list_actions(now, besides, shown)
                    self.vocabulary_changed.emit()

    def _before_renaming(
        self, task: str, listed: Vocabulary, gone: set[str], back: set[str], done: UndoResult
    ) -> Vocabulary | None:
        """The actions of a task on the other side of a renaming that was reverted.

        None where there was none, or the task still needs an action that it would take away. Where
        nothing comes back, as others kept the old action, what was `done` tells that there was one.
        """
        assert self.project is not None
        # Who codes the task blind would learn from what leaves the list whether others use it.
        blind = task in self.project.coding.blind_tasks(done.edits[0].author)
        for one, now, other in self._renamings:
            leaving, coming = {*now.names} - {*other.names}, back - {*now.names}
            fits = leaving <= gone and (coming or done.renames) and back <= {*other.names}
            if not fits or (one, now) != (task, listed):
                continue
            if not leaving or not (blind or leaving & self.project.actions.painted(task)):
                return other
        return None

    @contextmanager
    def _reporting_errors(self) -> Iterator[list[str]]:
        """Say in the status line what stands in the way; gives a list that holds it then."""
        errors: list[str] = []
        self.refused = False
        try:
            yield errors
        except ForcelabError as error:
            self.refused = True
            errors.append(str(error))
            self.say(str(error), True)
            if error.__cause__ is not None:  # the disk or the store refused, not what was asked for
                self.store_failed.emit(str(error))
