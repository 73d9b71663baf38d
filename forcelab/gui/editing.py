"""Painting in the window: each verb is in the store before the signal that makes views draw it."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from operator import attrgetter
from typing import Literal

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError, StaleTrackError
from forcelab.gui.looking import Looking
from forcelab.labels import Segment, Segments
from forcelab.project import Edit, Origin, Project
from forcelab.project.labelling import Labelling
from forcelab.vocabulary import Action, Vocabulary

__all__ = ["Editing", "Stroke"]

_start = attrgetter("start")


@dataclass(frozen=True, slots=True)
class Stroke:
    """A segment begun with a key and not ended yet; `start` in seconds."""

    action: str
    start: float


class Editing(Looking):
    """The part of the window's state that is painted: one coder's track.

    A verb gives whether it changed anything; what stands in its way is said in the status line.

    Attributes
    ----------
    project : Project or None
        The open project.
    id : str
        Of the open demonstration; ``""`` without one.
    author : str
        The coder whose track is painted.
    vocabulary : Vocabulary
        Of the open demonstration's task.
    selected : int or None
        Which of :attr:`segments` is selected.
    action : str or None
        The brush: what dragging on the track paints.
    stroke : Stroke or None
        What a key has begun.
    refused : bool
        Whether what was asked of the store last could not be done: it may be asked once more.
    said_here : str
        What was said last of the demonstration that was open then.
    copied_from : str
        The author whose segments were copied last.
    """

    tracks_changed = Signal()
    vocabulary_changed = Signal()
    selection_changed = Signal()
    stroke_changed = Signal()
    action_changed = Signal()
    store_failed = Signal(str)

    def __init__(self, author: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.author = author
        self.project: Project | None = None
        self.action: str | None = None
        self.refused = False
        self.said_here = self.copied_from = ""
        # A task, with its actions on either side of each renaming, both ways round.
        self._renamings: list[tuple[str, Vocabulary, Vocabulary]] = []
        self._list_actions(Vocabulary())
        self._take_up("", None)

    def _take_up(self, id_: str, labelling: Labelling | None) -> None:
        """Paint another track from now on; nobody is told yet."""
        self.id = id_
        self._labelling: Labelling | None = labelling
        self.selected: int | None = None
        self.stroke: Stroke | None = None

    @property
    def coding_blind(self) -> bool:
        """Whether everybody else's labels are hidden from the coder here."""
        if self.project is None or not self.id:
            return False
        return self.project.is_blind(self.id, self.author)

    def set_vocabulary(self, vocabulary: Vocabulary) -> bool:
        """Replace the actions of the open demonstration's task, unless others changed them."""
        if self.project is None or self.demonstration is None:
            return False
        task, done = self.demonstration.task, False
        with self._telling():
            done = self.project.set_vocabulary(task, vocabulary, before=self._listed)
            if done:
                self._list_actions(vocabulary)
            else:
                now = self.vocabulary
                self._list_actions(self.project.vocabulary(task), now.names, now)
                self.say(
                    self.tr("The actions were changed elsewhere; look at them and repeat it."), True
                )
            self.vocabulary_changed.emit()
        return done

    def add_actions(self, *names: str) -> bool:
        """Make sure that the vocabulary has these actions; those that others add stay."""
        if all(name in self.vocabulary for name in names):
            return True
        if self.project is None or self.demonstration is None:
            return False
        with self._telling() as told:
            wider = self.vocabulary.with_actions(*names)
            self._list_actions(self.project.add_actions(self.demonstration.task, wider.names))
            self.vocabulary_changed.emit()
        return not told

    def _list_actions(
        self, listed: Vocabulary, painted: tuple[str, ...] = (), like: Iterable[Action] = ()
    ) -> None:
        """Offer the actions that are stored, and painted ones besides; nobody is told yet."""
        self._listed = listed
        self.vocabulary = listed.with_actions(*painted, like=like)
        if self.action is not None and self.action not in self.vocabulary:
            self.set_action(None)

    # What is chosen

    def seek(self, time: float) -> None:
        """Move the cursor; the selection ends where the cursor leaves it, but not in playback."""
        super().seek(time)
        if not self.playing:
            self._leave_selection()

    def set_playing(self, playing: bool) -> None:
        """Say whether playback is on; where it ends, the selection may have been left."""
        super().set_playing(playing)
        if not playing:
            self._leave_selection()

    def select(self, index: int | None) -> None:
        """Select one of the coder's segments, or none."""
        if index is not None and not 0 <= index < len(self.segments):
            index = None
        if index != self.selected:
            self.selected = index
            self.selection_changed.emit()

    def set_action(self, name: str | None) -> None:
        """Take up a brush, or put it down."""
        if name != self.action:
            self.action = name
            self.action_changed.emit()

    # Painting

    @property
    def segments(self) -> Segments:
        """The coder's track."""
        return self._labelling.segments if self._labelling is not None else ()

    def index_of(self, segment: Segment) -> int | None:
        """Which of the coder's segments this one is; None if it is there no more."""
        index = bisect_left(self.segments, segment.start, key=_start)
        there = index < len(self.segments) and self.segments[index] == segment
        return index if there else None

    def paint(self, start: float, end: float, action: str) -> bool:
        """Paint an action over ``[start, end)``; an action that is new joins the vocabulary."""
        if not self.add_actions(action):
            return False
        return self._edit(lambda track: track.paint(start, end, action))

    def erase(self, start: float, end: float) -> bool:
        """Make a stretch unlabelled."""
        return self._edit(lambda track: track.erase(start, end))

    def move_edge(self, index: int, edge: Literal["start", "end"], time: float) -> bool:
        """Move one edge of a segment."""
        return self._edit(lambda track: track.move_edge(index, edge, time))

    def move_segment(self, index: int, start: float) -> bool:
        """Move a whole segment."""
        return self._edit(lambda track: track.move_segment(index, start))

    def split(self, time: float) -> bool:
        """Cut the segment at `time` in two."""
        return self._edit(lambda track: track.split(time))

    def merge(self, first: int, last: int) -> bool:
        """Make one segment of a run."""
        return self._edit(lambda track: track.merge(first, last))

    def relabel(self, index: int, action: str) -> bool:
        """Give a segment another action."""
        if not self.add_actions(action):
            return False
        return self._edit(lambda track: track.relabel(index, action))

    def delete(self, index: int) -> bool:
        """Take a segment away."""
        return self._edit(lambda track: track.delete(index))

    def fill_gaps(
        self, longest: float, action: str | None = None, within: tuple[float, float] | None = None
    ) -> bool:
        """Fill short gaps between segments."""
        return self._edit(lambda track: track.fill_gaps(longest, action, within))

    def copy_from(self, author: str, start: float, end: float) -> bool:
        """Take a stretch over from another track."""
        if self.coding_blind:
            self.say(self.tr("Other labels are hidden until you are done; nothing copied."), True)
            return False
        self.copied_from = author
        same = self.tr("Your labels are the same as {0}'s there; nothing copied.").format(author)
        return self._edit(lambda track: track.copy_from(author, start, end), same)

    def undo(self) -> bool:
        """Take back the latest edit."""
        return self._edit(lambda track: track.undo(), self.tr("There is nothing to undo."))

    def redo(self) -> bool:
        """Take back the latest undo."""
        return self._edit(lambda track: track.redo(), self.tr("There is nothing to redo."))

    def history(self) -> tuple[Edit, ...]:
        """Every edit of the coder's track, the first one first."""
        return self._labelling.history() if self._labelling is not None else ()

    def origins(self) -> Mapping[Segment, Origin]:
        """Which of the coder's segments a model proposed; looked up anew only after edits."""
        if self.project is None or self._labelling is None:
            return {}
        try:
            return self.project.origins(self.id, self.author)
        except ForcelabError:  # what keeps the store busy is told where labels are read or written
            return {}

    def say_here(self, sentence: str, trouble: bool = False) -> None:
        """Say a sentence about the open demonstration, which is not left standing for another."""
        self.said_here = sentence
        self.say(sentence, trouble)

    def begin_stroke(self, action: str, at: float) -> None:
        """Begin a segment that :meth:`end_stroke` ends."""
        low, high = self.bounds
        self.stroke = Stroke(action, min(max(at, low), high))
        self.stroke_changed.emit()

    def end_stroke(self, at: float) -> bool:
        """Paint what was begun, up to `at`, which may lie before its beginning.

        Where the store refuses, the stroke goes on, to be ended once more.
        """
        if self.stroke is None:
            return False
        stroke, self.stroke = self.stroke, None
        low, high = self.bounds
        at = min(max(at, low), high)
        self.stroke_changed.emit()
        if at == stroke.start:
            self.say(self.tr("A segment needs time: move the cursor before you end it."), True)
            return False
        done = self.paint(min(stroke.start, at), max(stroke.start, at), stroke.action)
        if not done and self.refused:
            self.begin_stroke(stroke.action, stroke.start)
        return done

    def cancel_stroke(self) -> None:
        """Forget what was begun."""
        if self.stroke is not None:
            self.stroke = None
            self.stroke_changed.emit()

    # Inside

    def _edit(self, verb: Callable[[Labelling], Edit | None], nothing: str = "") -> bool:
        """Carry out an edit; the store has it before a view hears of it."""
        if self._labelling is None:
            return False
        edit, chosen = None, None if self.selected is None else self.segments[self.selected]
        with self._telling() as told:
            edit = verb(self._labelling)
        if edit is None:
            if nothing and not told:
                self.say_here(nothing)
            return False
        if chosen is not None:
            self.select(self._followed(chosen, edit))
        # Undoing may bring back an action that has left the vocabulary since.
        if edit.reverts is None or not self._renamed_back(edit):
            self.add_actions(*(segment.action for segment in edit.inserted))
        self.tracks_changed.emit()
        self.say_here(edit.what)
        return True

    def _renamed_back(self, edit: Edit) -> bool:
        """Give actions the look and the key back that they had before a renaming was undone.

        Not where the task still needs those that it would take away.
        """
        project, demonstration = self.project, self.demonstration
        if project is None or demonstration is None:
            return False
        old, new = ({segment.action for segment in run} for run in (edit.removed, edit.inserted))
        for task, listed, other in self._renamings:
            gone, back = {*listed.names} - {*other.names}, new - {*listed.names}
            fits = gone <= old and back and new <= {*other.names}
            if not fits or (task, listed) != (demonstration.task, self._listed):
                continue
            with self._telling():
                if gone & project.painted_actions(task):
                    continue
                if project.set_vocabulary(task, other, before=listed):
                    shown = self.vocabulary
                    besides = tuple(name for name in shown.names if name not in listed)
                    self._list_actions(other, besides, shown)
                    self.vocabulary_changed.emit()
                    return True
        return False

    def _leave_selection(self) -> None:
        """Select nothing any more if the cursor is elsewhere."""
        if self.selected is not None:
            segment = self.segments[self.selected]
            if not segment.start - 1e-6 <= self.cursor <= segment.end + 1e-6:
                self.select(None)

    def _followed(self, chosen: Segment, edit: Edit) -> int | None:
        """Where a segment is after an edit, also one that another window had made before."""
        if (index := self.index_of(chosen)) is not None:
            return index
        before, after = set(edit.removed), set(edit.inserted)
        gone = [segment for segment in edit.removed if segment not in after]
        new = [segment for segment in edit.inserted if segment not in before]
        if chosen not in gone or len(gone) != len(new):
            return None
        return self.index_of(new[gone.index(chosen)])

    @contextmanager
    def _telling(self) -> Iterator[list[str]]:
        """Say in the status line what stands in the way; gives a list that holds it then."""
        told: list[str] = []
        self.refused = False
        try:
            yield told
        except ForcelabError as error:
            self.refused = True
            told.append(str(error))
            if isinstance(error, StaleTrackError) and self._labelling is not None:
                self._labelling.refresh()
                self.select(None)
                self.tracks_changed.emit()
            self.say(str(error), True)
            if error.__cause__ is not None:  # the disk or the store refused, not what was asked for
                self.store_failed.emit(str(error))
