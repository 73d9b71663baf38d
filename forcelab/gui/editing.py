"""Painting in the window: each verb is in the store before the signal that makes views draw it."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from operator import attrgetter
from time import monotonic
from typing import Literal

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError, StaleTrackError
from forcelab.gui.task_actions import TaskActions
from forcelab.labels import Segment, Segments
from forcelab.project import Edit, Origin, UndoResult
from forcelab.project.track_editor import Labelling

__all__ = ["Editing", "Stroke"]

#: Steps that follow each other within so many seconds are one edit.
IDLE_MS = 1.0
#: Float dust in sums of steps, in seconds, and the digits that are free of it.
DUST, DIGITS = 1e-9, 9

_start = attrgetter("start")
_end = attrgetter("end")


@dataclass(frozen=True, slots=True)
class Stroke:
    """A segment begun with a key and not ended yet; `start` in seconds."""

    action: str
    start: float


@dataclass(frozen=True, slots=True)
class _NudgeRun:
    """Steps of a segment that are one edit.

    Parameters
    ----------
    index : int
        Of the segment, before the first step.
    what : "start", "end" or "both"
    old : Segment
        As it was before the first step.
    time : float
        Where the latest step has brought it, in seconds.
    edit : Edit or None
        What has been stored of the run.
    moved : Segment or None
        What the segment is by now.
    until : float
        When the run is over, by the clock that never jumps.
    """

    index: int
    what: Literal["start", "end", "both"]
    old: Segment
    time: float
    edit: Edit | None = None
    moved: Segment | None = None
    until: float = 0.0


class Editing(TaskActions):
    """The part of the window's state that is painted: one coder's track.

    A verb gives whether it changed anything; what stands in its way is said in the status line.

    Attributes
    ----------
    id : str
        Of the open demonstration; ``""`` without one.
    author : str
        The coder whose track is painted.
    selected : int or None
        Which of :attr:`segments` is selected.
    stroke : Stroke or None
        What a key has begun.
    said_here : str
        What was said last of the demonstration that was open then.
    reverted : UndoResult or None
        What the latest undo or redo changed, in the demonstration that was open then and others.
    copied_from : str
        The author whose segments were copied last.
    """

    tracks_changed = Signal()
    selection_changed = Signal()
    stroke_changed = Signal()

    def __init__(self, author: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.author = author
        self.said_here = self.copied_from = ""
        self.reverted: UndoResult | None = None
        self._take_up("", None)

    def _take_up(self, id_: str, labelling: Labelling | None) -> None:
        """Paint another track from now on; nobody is told yet."""
        self.id = id_
        self._labelling: Labelling | None = labelling
        self.selected: int | None = None
        self.stroke: Stroke | None = None
        self._run: _NudgeRun | None = None
        self._made: Edit | None = None

    @property
    def coding_blind(self) -> bool:
        """Whether everybody else's labels are hidden from the coder here."""
        if self.project is None or not self.id:
            return False
        return self.project.coding.is_blind(self.id, self.author)

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

    def nudge(self, index: int, what: Literal["start", "end", "both"], step: float) -> bool:
        """Move an edge of a segment, or all of it, by a step in seconds; the cursor goes with it.

        Steps that follow each other are one edit: one undo takes all of them back.
        """
        run = self._run
        if run is None or not self._goes_on(run, index, what):
            old = self.segments[index]
            run = _NudgeRun(index, what, old, old.end if what == "end" else old.start)
        low, high = self.bounds
        high -= run.old.duration if what == "both" else 0
        time = min(max(round(run.time + step, DIGITS), low), high)
        number, replacing = run.index, run.edit

        def move(track: Labelling) -> Edit | None:
            if what == "both":
                return track.move_segment(number, time, replacing)
            return track.move_edge(number, what, time, replacing)

        if not self._edit(move):
            return False
        self.seek(time)
        # What it grew over may have gone, so that it has another number now.
        edge = _end if what == "end" else _start
        self.select(bisect_left(self.segments, time - DUST, key=edge))
        self._run = None
        if self._made is not None and self._made.kind == "paint" and self.selected is not None:
            moved, until = self.segments[self.selected], monotonic() + IDLE_MS
            self._run = replace(run, time=time, edit=self._made, moved=moved, until=until)
        return True

    def _goes_on(self, run: _NudgeRun, index: int, what: str) -> bool:
        """Whether a step is one more of a run: of the same kind, at once, and nothing between."""
        if self.project is None or run.edit is None:
            return False
        if (run.what, run.moved) != (what, self.segments[index]) or monotonic() > run.until:
            return False
        try:
            head = self.project.tracks.head(self.id, self.author)
        except ForcelabError:  # what keeps the store busy is told where labels are written
            return False
        return (run.edit.demonstration, run.edit.author, run.edit.id) == (
            self.id,
            self.author,
            head,
        )

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
            self.say("Other labels are hidden until you are done; nothing copied.", True)
            return False
        self.copied_from = author
        same = f"Your labels are the same as {author}'s there; nothing copied."
        return self._edit(lambda track: track.copy_from(author, start, end), same)

    def undo(self) -> bool:
        """Take back the latest edit; a renaming in all demonstrations that it changed."""
        nothing = "There is nothing to undo."
        return self._edit(lambda track: track.undo_everywhere(), nothing) and self._show_edit()

    def redo(self) -> bool:
        """Take back the latest undo; that of a renaming in all demonstrations."""
        nothing = "There is nothing to redo."
        return self._edit(lambda track: track.redo_everywhere(), nothing) and self._show_edit()

    def history(self) -> tuple[Edit, ...]:
        """Every edit of the coder's track, the first one first."""
        return self._labelling.history() if self._labelling is not None else ()

    def origins(self) -> Mapping[Segment, Origin]:
        """Which of the coder's segments a model proposed; looked up anew only after edits."""
        if self.project is None or self._labelling is None:
            return {}
        try:
            return self.project.tracks.origins(self.id, self.author)
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
            self.say("A segment needs time: move the cursor before you end it.", True)
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

    def _edit(
        self, verb: Callable[[Labelling], Edit | UndoResult | None], nothing: str = ""
    ) -> bool:
        """Carry out an edit; the store has it before a view hears of it."""
        if self._labelling is None:
            return False
        done, chosen = None, None if self.selected is None else self.segments[self.selected]
        with self._reporting_errors() as errors:
            done = verb(self._labelling)
        if done is None:
            if nothing and not errors:
                self.say_here(nothing)
            return False
        edit = self._made = done.edits[0] if isinstance(done, UndoResult) else done
        if chosen is not None:
            self.select(self._followed(chosen, edit))
        if isinstance(done, UndoResult):
            self.reverted = done
            self._bring_back(done)
        else:
            self.add_actions(*(segment.action for segment in edit.inserted))
        self.tracks_changed.emit()
        self.say_here(done.sentence() if isinstance(done, UndoResult) else done.what)
        return True

    def _show_edit(self) -> bool:
        """Bring what the latest edit changed into view, if none of it is."""
        assert self._made is not None
        changed = set(self._made.removed) ^ set(self._made.inserted)
        start = min((segment.start for segment in changed), default=self.start)
        end = max((segment.end for segment in changed), default=self.end)
        if end <= self.start or start >= self.end:
            rest = max(self.end - self.start - (end - start), end - start) / 2
            self.set_span(start - rest, end + rest)
        return True

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
    def _reporting_errors(self) -> Iterator[list[str]]:
        """Say what stands in the way; a track that others changed is read anew first."""
        with super()._reporting_errors() as errors:
            try:
                yield errors
            except StaleTrackError:
                if self._labelling is not None:
                    self._labelling.refresh()
                    self.select(None)
                    self.tracks_changed.emit()
                raise
