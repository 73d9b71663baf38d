"""Predictions in the window: the outcome that is reviewed, and what is taken over from it."""

from __future__ import annotations

import math
from bisect import bisect_right
from operator import attrgetter
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from forcelab.gui.editing import Editing
from forcelab.labels import Segment, Segments
from forcelab.review.differences import Interval
from forcelab.segment_edits import SLIVER

if TYPE_CHECKING:
    from forcelab.review.run_result import DemonstrationResult, RunResult

__all__ = ["Reviewing"]


class Reviewing(Editing):
    """The part of the window's state that comes from a recogniser; never a coder's track.

    Attributes
    ----------
    outcome : RunResult or None
        What is reviewed.
    examined : Place or None
        The place that is being looked at.
    training : bool
        Whether a recogniser is being trained.
    """

    outcome_changed = Signal()
    examined_changed = Signal()
    training_changed = Signal()

    def __init__(self, author: str, parent: QObject | None = None) -> None:
        super().__init__(author, parent)
        self.outcome: RunResult | None = None
        self.examined: Interval | None = None
        self.training = False

    def set_training(self, training: bool) -> None:
        """Tell everybody whether a recogniser is being trained."""
        if training != self.training:
            self.training = training
            self.training_changed.emit()

    @property
    def reviewed(self) -> DemonstrationResult | None:
        """The open demonstration in the outcome; None while coding blind, or if it is not there."""
        if self.outcome is None or not self.id or self.coding_blind:
            return None
        return self.outcome.find(self.id)

    @property
    def prediction(self) -> Segments:
        """What is predicted for the open demonstration; empty while coding blind."""
        reviewed = self.reviewed
        return () if reviewed is None else reviewed.predicted

    def accept_here(self) -> bool:
        """Take the predicted segment at the cursor over, and go to the next one to accept."""
        here = self.cursor
        done = self.accept(here, math.nextafter(here, math.inf))
        if done and not self.playing:
            self.seek(self._next_to_accept(here))
        return done

    def accept_in_view(self) -> bool:
        """Take all predictions in view over, wherever the coder has labelled nothing."""
        return self.accept(self.start, self.end, replace=False)

    def accept(
        self, start: float, end: float, at_least: float = 0.0, *, replace: bool = True
    ) -> bool:
        """Take predicted segments over into the coder's track, as one edit that can be undone.

        Parameters
        ----------
        start, end : float
            Seconds; every predicted segment that overlaps ``[start, end)`` is taken as a whole.
        at_least : float
            Only those whose mean probability is that high.
        replace : bool
            Whether what the coder has labelled there is painted over.
        """
        reviewed, outcome = self.reviewed, self.outcome
        if reviewed is None or outcome is None:
            blind = "Predictions are hidden until you are done; nothing accepted."
            none = "There is no prediction to accept here; train a recogniser."
            self.say(blind if self.coding_blind else none, True)
            return False
        from forcelab.review.active_learning import acceptable_segments
        from forcelab.review.differences import as_coded

        if at_least and reviewed.probability_trace is None:
            self.say("This run kept no probabilities; train again to have them.", True)
            return False
        chosen = acceptable_segments(reviewed, start, end, at_least)
        if not chosen:
            self.say("Nothing is predicted here that could be accepted.")
            return False
        return self.adopt(*as_coded(chosen, outcome, reviewed), replace=replace)

    def _next_to_accept(self, time: float) -> float:
        """Where the next prediction begins that the track is not like; else where this one ends."""
        reviewed, outcome = self.reviewed, self.outcome
        if reviewed is None or outcome is None:
            return time
        from forcelab.review.differences import as_coded

        end = time
        for segment in as_coded(reviewed.predicted, outcome, reviewed):
            if segment.start > time and not self._is_labelled(segment):
                return segment.start
            if segment.start <= time < segment.end:
                end = segment.end
        return end

    def _is_labelled(self, segment: Segment) -> bool:
        """Whether the coder's track has this action all along."""
        index = bisect_right(self.segments, segment.start + SLIVER, key=attrgetter("end"))
        there = self.segments[index] if index < len(self.segments) else None
        return (
            there is not None
            and there.action == segment.action
            and there.start <= segment.start + SLIVER
            and segment.end <= there.end + SLIVER
        )

    def adopt(self, *segments: Segment, replace: bool = True) -> bool:
        """Paint what the recogniser proposes, in the coder's spelling.

        Each segment remembers which recogniser it was.
        """
        outcome = self.outcome
        if outcome is None or not self.add_actions(*dict.fromkeys(s.action for s in segments)):
            return False
        proposer = outcome.proposer
        return self._edit(
            lambda track: track.accept(segments, proposer, replace=replace),
            "It is labelled like this already.",
        )
