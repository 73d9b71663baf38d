"""The consensus of two coders: what both agree on is taken, a person decides every difference.

The consensus is the track of an author of its own. Every decision is an edit of it: stored at once,
kept for ever, to be undone. What is still undecided follows from the three tracks, and, for time
that was left unlabelled on purpose, from the effective edits of the consensus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Literal

from forcelab.errors import InputError
from forcelab.labels import Segment, Segments
from forcelab.project import Edit, Project
from forcelab.review.differences import (
    Difference,
    action_over,
    coder_differences,
    track_pieces,
)
from forcelab.segment_edits import SLIVER, erase, free_parts, overlapping, paint
from forcelab.text import counted

#: The default author of a consensus.
CONSENSUS = "consensus"
#: Seconds up to which edges may be set to their mean all at once.
TOLERANCE = 0.1

#: What is put in the place of a difference, by two edges that may be the same.
_Parts = list[tuple[float, float, str | None]]


def effective_edits(edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """The edits of a track that were not undone, or were redone, in order."""
    effective: dict[int, Edit] = {}
    undone: dict[int, Edit] = {}  # by the undo that took the edit back
    for edit in edits:
        if edit.kind == "undo":
            undone[edit.id] = effective.pop(edit.reverts or 0)
        elif edit.kind == "redo":
            back = undone[edit.reverts or 0]
            effective[back.id] = back
        else:
            effective[edit.id] = edit
    return tuple(effective.values())


class Consensus:
    """Two coders' tracks over a demonstration, and the track that is made from them.

    Every verb returns its edit, or None where there was nothing to change, and may raise what
    ``project.tracks.edit`` does; after a StaleTrackError :meth:`refresh` and repeat. An InputError
    says that the three authors are not three, or one of the coders labelled nothing.
    """

    def __init__(
        self, project: Project, demonstration: str, a: str, b: str, author: str = CONSENSUS
    ) -> None:
        author = author.strip()
        if len({a, b, author}) < 3:
            raise InputError(
                "A consensus is made from two coders under a third name; choose another name."
            )
        self.project, self.demonstration = project, demonstration
        self.a, self.b, self.author = a, b, author
        self.track_a: Segments = ()
        self.track_b: Segments = ()
        self.differences: tuple[Difference, ...] = ()
        self.refresh()
        for name, segments in ((a, self.track_a), (b, self.track_b)):
            if not segments:
                raise InputError(f"'{name}' labelled nothing here; choose another demonstration.")

    def refresh(self) -> None:
        """Read the three tracks again, and which stretches were left unlabelled on purpose."""
        tracks = self.project.tracks
        before = self.track_a, self.track_b
        self.track_a, self.track_b, self.segments = (
            tracks.get(self.demonstration, name).segments for name in (self.a, self.b, self.author)
        )
        if (self.track_a, self.track_b) != before:
            self.differences = coder_differences(self.demonstration, self.track_a, self.track_b)
        edits = effective_edits(tracks.history(self.demonstration, self.author))
        self._left = frozenset(edit.what for edit in edits)
        self.can_undo, self.can_redo = (
            tracks.can_revert(self.demonstration, self.author, kind) for kind in ("undo", "redo")
        )

    @property
    def begun(self) -> bool:
        """Whether the consensus holds a decision already."""
        return bool(self.segments) or bool(self._left)

    @property
    def undecided(self) -> tuple[Difference, ...]:
        """The differences that wait for a decision, in order of time."""
        return tuple(difference for difference in self.differences if not self.decided(difference))

    def decided(self, difference: Difference) -> bool:
        """Whether the consensus labels anything there, or was left unlabelled there on purpose."""
        labelled = overlapping(self.segments, difference.start, difference.end, SLIVER)
        return bool(self.segments[labelled]) or _left_text(difference) in self._left

    def begin(self) -> Edit | None:
        """Take what both agree on, wherever the consensus is still empty."""
        after = self.segments
        for part in free_parts(self.segments, self._agreed()):
            after = paint(after, part.start, part.end, part.action)
        return self._store(after, f"what {self.a} and {self.b} agree on taken")

    def take(self, difference: Difference, side: Literal["a", "b"]) -> Edit | None:
        """Decide for one of the two coders."""
        name = self.a if side == "a" else self.b
        action = difference.human if side == "a" else difference.predicted
        if action is None:
            return self.leave(difference)
        return self.put(difference, action, f"as {name}")

    def put(self, difference: Difference, action: str, why: str = "decided") -> Edit | None:
        """Decide for any action."""
        description = f"{action} {_span_text(difference)} {why}"
        return self._decide(
            [(difference, [(difference.start, difference.end, action)])], description
        )

    def leave(self, difference: Difference) -> Edit | None:
        """Decide that it is unlabelled."""
        parts: _Parts = [(difference.start, difference.end, None)]
        return self._decide([(difference, parts)], _left_text(difference), force=True)

    def mean(self, difference: Difference) -> Edit | None:
        """Set the boundary to the middle between the two coders' edges."""
        if difference.kind != "boundary":
            raise InputError("Only a boundary has a mean; here the actions differ.")
        description = f"edge in {_span_text(difference)} set to the mean"
        return self._decide([(difference, self._halves(difference))], description)

    def mean_all(self, tolerance: float = TOLERANCE) -> Edit | None:
        """Set every undecided boundary that differs by at most `tolerance` s to its mean."""
        near = [
            d for d in self.undecided if d.kind == "boundary" and d.duration <= tolerance + SLIVER
        ]
        if not near:
            return None
        edges = counted(len(near), "edge")
        description = f"{edges} up to {1000 * tolerance:g} ms apart set to the mean"
        return self._decide(
            [(difference, self._halves(difference)) for difference in near], description
        )

    def undo(self) -> Edit | None:
        """Take back the latest decision; reaches back past restarts."""
        return self._moved(self.project.tracks.undo)

    def redo(self) -> Edit | None:
        """Take back the latest undo."""
        return self._moved(self.project.tracks.redo)

    def _moved(self, verb: Callable[[str, str], Edit | None]) -> Edit | None:
        """Undo or redo, and refresh."""
        edit = verb(self.demonstration, self.author)
        self.refresh()
        return edit

    def _halves(self, difference: Difference) -> _Parts:
        """The action before up to the middle, the action after from there on."""
        middle = difference.start + difference.duration / 2
        before = action_over(self.track_a, difference.start - 3 * SLIVER, difference.start)
        after = difference.predicted if before == difference.human else difference.human
        return [(difference.start, middle, before), (middle, difference.end, after)]

    def _decide(
        self,
        decisions: Sequence[tuple[Difference, _Parts]],
        description: str,
        force: bool = False,
    ) -> Edit | None:
        """Write parts in the place of differences, as one edit.

        With `force` the edit is stored even if the track stays as it is, to remember the decision.
        """
        after = self.segments
        for difference, parts in decisions:
            after = erase(after, difference.start, difference.end)
            for start, end, action in parts:
                if action is not None:
                    after = paint(after, start, end, action)
        decided = all(self.decided(difference) for difference, _ in decisions)
        return self._store(after, description, force=force and not decided)

    def _store(self, after: Segments, description: str, force: bool = False) -> Edit | None:
        if after == self.segments and not force:
            return None
        edit = self.project.tracks.edit(
            self.demonstration, self.author, self.segments, after, description
        )
        self.refresh()
        return edit

    def _agreed(self) -> Segments:
        """The stretches on which both coders agree, in order."""
        pieces = track_pieces(self.demonstration, self.track_a, self.track_b)
        return tuple(
            Segment(piece.start, piece.end, piece.human)
            for piece in pieces
            if piece.human is not None and not piece.differs
        )


def _span_text(difference: Difference) -> str:
    """Its bounds in a line of history."""
    return f"{difference.start:.3f}-{difference.end:.3f} s"


def _left_text(difference: Difference) -> str:
    """The line of history of a stretch that was left unlabelled on purpose."""
    return f"{_span_text(difference)} decided: unlabelled"
