"""One coder at work on one demonstration: each verb is one edit, stored when it returns.

The window's edits go through here, and a script's may as well; the line of history that people
read is written here, so that it is the same for both.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable
from functools import wraps
from operator import attrgetter
from typing import Any, Concatenate, Literal, ParamSpec, TypeVar

from forcelab.errors import InputError
from forcelab.labels import Segment, Segments
from forcelab.project.project import Project
from forcelab.project.records import Edit
from forcelab.project.tracks import UndoResult
from forcelab.segment_edits import (
    SLIVER,
    delete,
    erase,
    fill_gaps,
    free_parts,
    merge,
    move_edge,
    move_segment,
    paint,
    paint_all,
    relabel,
    splice,
    spliced,
    split,
)

Params = ParamSpec("Params")
Result = TypeVar("Result", Edit | None, UndoResult | None)

#: A line of history names so many accepted predictions, and only counts further ones.
NAMED = 3


def _segment_text(segment: Segment) -> str:
    """A segment in a line of history, such as ``grab 1.250-1.730 s``."""
    return f"{segment.action} {_interval_text(segment.start, segment.end)}"


def _verb(
    method: Callable[Concatenate[TrackEditor, Params], Result],
) -> Callable[Concatenate[TrackEditor, Params], Result]:
    """Let the editor's owner, if it has one, carry out a method."""

    @wraps(method)
    def perform(self: TrackEditor, /, *args: Params.args, **kwargs: Params.kwargs) -> Result:
        self.unchanged = ""
        if self._perform is None:
            return method(self, *args, **kwargs)
        result: Result = self._perform(lambda: method(self, *args, **kwargs))
        return result

    return perform


class TrackEditor:
    """A coder's track over one demonstration, and the verbs that change it.

    Every verb gives the edit that it made, or None where there was nothing to change.

    Parameters
    ----------
    project : Project
        Where the track is stored.
    demonstration : str
        The demonstration's id.
    author : str
        The coder; a model's name is refused by the first edit.
    perform : callable, optional
        Carries out each verb, which it gets as a function without arguments, and returns its
        result; the window's reports errors and shows what was changed. By default verbs are just
        called.

    Attributes
    ----------
    segments : tuple of Segment
        The track as it was when it was last read or changed here.
    unchanged : str
        Why the latest verb found nothing to change; ``""`` where it is plain.

    Raises
    ------
    InputError
        Every verb: as of the function of :mod:`forcelab.segment_edits` that bears its name, and of
        ``project.tracks.edit``; nothing was written then.
    StaleTrackError
        Every verb: if another window or process changed the track; :meth:`refresh` and repeat.

    Examples
    --------
    >>> cleo = forcelab.TrackEditor(project, project.demonstrations.id_of("foam 04"), "Cleo")
    >>> edit = cleo.paint(0.5, 2.0, "grab")
    >>> [segment.action for segment in cleo.segments]
    ['grab']
    >>> edit = cleo.undo()
    >>> cleo.segments
    ()
    """

    unchanged = ""

    def __init__(
        self,
        project: Project,
        demonstration: str,
        author: str,
        perform: Callable[[Callable[[], Any]], Any] | None = None,
    ) -> None:
        self.project = project
        self.demonstration = demonstration
        self.author = author
        self._perform = perform
        self.segments: Segments = ()
        self.refresh()

    def refresh(self) -> bool:
        """Read the track again; gives whether it had changed."""
        before = self.segments
        self.segments = self.project.tracks.get(self.demonstration, self.author).segments
        return self.segments is not before and self.segments != before

    def history(self) -> tuple[Edit, ...]:
        """Every edit of the track, the first one first."""
        return self.project.tracks.history(self.demonstration, self.author)

    def index_of(self, segment: Segment) -> int | None:
        """Which of the segments this one is; None if the track has it no more."""
        index = bisect_left(self.segments, segment.start, key=attrgetter("start"))
        exists = index < len(self.segments) and self.segments[index] == segment
        return index if exists else None

    @_verb
    def paint(self, start: float, end: float, action: str) -> Edit | None:
        """Paint an action over ``[start, end)``, in seconds."""
        after = paint(self.segments, start, end, action)
        return self._store(after, f"{action} {_interval_text(start, end)} painted")

    @_verb
    def erase(self, start: float, end: float) -> Edit | None:
        """Make ``[start, end)`` unlabelled."""
        after = erase(self.segments, start, end)
        return self._store(after, f"{_interval_text(start, end)} made unlabelled")

    @_verb
    def move_edge(
        self, index: int, edge: Literal["start", "end"], time: float, replacing: Edit | None = None
    ) -> Edit | None:
        """Move the start or the end of a segment, and of a neighbour that shares it.

        In place of the track's latest edit, if that is given: `index` is then as before it.
        """
        before = self._before(replacing)
        after = move_edge(before, index, edge, time)
        description = f"{edge} of {_segment_text(before[index])} moved to {time:.3f}"
        return self._store(after, description, replacing=replacing)

    @_verb
    def move_segment(self, index: int, start: float, replacing: Edit | None = None) -> Edit | None:
        """Move a segment to another start; what lies there is painted over.

        In place of the track's latest edit, if that is given: `index` is then as before it.
        """
        before = self._before(replacing)
        after = move_segment(before, index, start)
        description = f"{_segment_text(before[index])} moved to {start:.3f}"
        return self._store(after, description, replacing=replacing)

    @_verb
    def split(self, time: float) -> Edit | None:
        """Cut the segment at `time` into two."""
        after = split(self.segments, time)
        _, (old, *_), _ = splice(self.segments, after)
        return self._store(after, f"{_segment_text(old)} split at {time:.3f}")

    @_verb
    def merge(self, first: int, last: int, action: str | None = None) -> Edit | None:
        """Make one segment of the run from `first` to `last`; `action`, or that of the first."""
        after = merge(self.segments, first, last, action)
        whole = after[first]
        return self._store(after, f"{last - first + 1} segments merged into {_segment_text(whole)}")

    @_verb
    def relabel(self, index: int, action: str) -> Edit | None:
        """Give a segment another action."""
        after = relabel(self.segments, index, action)
        return self._store(after, f"{_segment_text(self.segments[index])} is now {action}")

    @_verb
    def delete(self, index: int) -> Edit | None:
        """Take a segment away; its time becomes unlabelled."""
        after = delete(self.segments, index)
        return self._store(after, f"{_segment_text(self.segments[index])} deleted")

    @_verb
    def fill_gaps(
        self, longest: float, action: str | None = None, within: tuple[float, float] | None = None
    ) -> Edit | None:
        """Fill unlabelled stretches of at most `longest` s between two segments.

        They are filled with `action`; by default both neighbours grow to the middle. With `within`,
        a start and an end in seconds, only between segments that overlap or touch that.
        """
        low, high = within or (float("-inf"), float("inf"))
        inside = [i for i, s in enumerate(self.segments) if s.end >= low and s.start <= high]
        if not inside:
            return None
        first, last = inside[0], inside[-1] + 1
        filled = fill_gaps(self.segments[first:last], longest, action)
        after = self.segments[:first] + filled + self.segments[last:]
        with_what = f" with {action}" if action else ""
        return self._store(after, f"gaps up to {longest:g} s filled{with_what}")

    @_verb
    def copy_from(self, author: str, start: float, end: float) -> Edit | None:
        """Make ``[start, end)`` of the track what another author's is there.

        Segments of the other track that reach over a bound are cut at it; what is unlabelled there
        becomes unlabelled here.

        Raises
        ------
        InputError
            Also while the coder labels the demonstration blind.
        """
        if self.project.coding.is_blind(self.demonstration, self.author):
            raise InputError("Other labels are hidden until you are done; nothing copied.")
        other = self.project.tracks.get(self.demonstration, author).segments
        after = list(erase(self.segments, start, end))
        for segment in other:
            left, right = max(segment.start, start), min(segment.end, end)
            if right - left > SLIVER:
                # Placed, not painted: touching segments of one action stay as many as they were.
                after.append(Segment(left, right, segment.action))
        description = f"{_interval_text(start, end)} copied from {author}"
        unchanged = f"Your labels are the same as {author}'s there; nothing copied."
        return self._store(tuple(sorted(after)), description, unchanged=unchanged)

    @_verb
    def accept(self, segments: Segments, proposer: str, replace: bool = True) -> Edit | None:
        """Paint what a model predicts, as one edit that remembers which model it was.

        Time that no given segment covers stays as it is. As with :meth:`paint`, what overlaps or
        touches a segment of the same action becomes one with it.

        Parameters
        ----------
        segments : tuple of Segment
            Never overlapping.
        proposer : str
            The model, such as ``"model paper 12"``.
        replace : bool
            Whether they are painted over what is there; otherwise they are cut down to the time
            that no segment covers.
        """
        chosen = segments if replace else free_parts(self.segments, segments)
        after, painted = paint_all(self.segments, chosen)
        unchanged = "It is labelled like this already."
        return self._store(after, _accepted_text(painted, proposer), proposer, unchanged=unchanged)

    @_verb
    def undo(self) -> Edit | None:
        """Take back the latest edit that was not taken back yet; reaches back past restarts."""
        return self._reverted(self.project.tracks.undo(self.demonstration, self.author), "undo")

    @_verb
    def redo(self) -> Edit | None:
        """Take back the latest undo, unless another edit came after it."""
        return self._reverted(self.project.tracks.redo(self.demonstration, self.author), "redo")

    @_verb
    def undo_everywhere(self) -> UndoResult | None:
        """Take back the latest edit, and a renaming in all of the coder's tracks."""
        return self._reverted(
            self.project.tracks.undo_everywhere(self.demonstration, self.author), "undo"
        )

    @_verb
    def redo_everywhere(self) -> UndoResult | None:
        """Take back the latest undo, and that of a renaming in all of the coder's tracks."""
        return self._reverted(
            self.project.tracks.redo_everywhere(self.demonstration, self.author), "redo"
        )

    def _before(self, edit: Edit | None) -> Segments:
        """The track as it was before its latest edit; as it is without one."""
        if edit is None:
            return self.segments
        return spliced(self.segments, edit.position, edit.inserted, edit.removed)

    def _store(
        self,
        after: Segments,
        description: str,
        proposer: str | None = None,
        replacing: Edit | None = None,
        unchanged: str = "",
    ) -> Edit | None:
        """Write the edit; only then is the track here the new one."""
        if after == self.segments:
            self.unchanged = unchanged
            return None
        edit = self.project.tracks.edit(
            self.demonstration,
            self.author,
            self.segments,
            after,
            description,
            proposed_by=proposer,
            replacing=None if replacing is None else replacing.id,
        )
        self.segments = after
        return edit

    def _reverted(self, result: Result, verb: str) -> Result:
        """Follow an undo or a redo."""
        if result is None:
            self.unchanged = f"There is nothing to {verb}."
        else:
            self.refresh()
        return result


def _accepted_text(painted: Segments, proposer: str) -> str:
    """Accepted predictions in a line of history."""
    # What tells one line from the next comes first: a narrow list cuts their ends off.
    named = ", ".join(_segment_text(segment) for segment in painted[:NAMED])
    more = f" and {len(painted) - NAMED} more" if len(painted) > NAMED else ""
    return f"{named}{more} accepted from {proposer}"


def _interval_text(start: float, end: float) -> str:
    """A stretch of time in a line of history."""
    return f"{start:.3f}-{end:.3f} s"
