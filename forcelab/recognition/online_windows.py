"""What follows a stream where offline whole demonstrations are looked at: windows and a decoder."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import UNLABELLED
from forcelab.recognition.causal import StreamingWindows
from forcelab.recognition.decided import Decided
from forcelab.recognition.fixed_lag import FixedLag
from forcelab.recognition.live_part import hop_of
from forcelab.recognition.online_budget import Budget
from forcelab.recognition.recogniser import Recogniser

__all__ = ["PartStages"]

Real = NDArray[np.float64]
Flags = NDArray[np.bool_]


class PartStages:
    """Everything behind the grid: windows, classifier, decoder, and what waits between them.

    Time steps lie a hop of the grid's steps apart; each label is given to the steps around.

    Parameters
    ----------
    recogniser : Recogniser
        With parts for streams.
    budget : Budget
    period : float
        Seconds between two steps of the grid.
    """

    def __init__(self, recogniser: Recogniser, budget: Budget, period: float) -> None:
        self.budget = budget
        settings = recogniser.settings
        self._hop = hop = hop_of(settings, 1.0 / period)
        part = next(
            one for one in recogniser.live if round(one.windows.look / period) == budget.features
        )
        self._classifier, self._actions = part.classifier, len(recogniser.actions)
        self._windows = StreamingWindows(part.windows, 1.0 / period, hop)
        assert recogniser.choreography is not None
        self._decoder = FixedLag(
            hop * period,
            budget.decoder // hop,
            recogniser.choreography,
            settings.choreography,  # type: ignore[arg-type]  # checked when it was set
        )
        # Steps of the grid that wait for a label, and of which the first is number `_done`.
        self._times, self._valid = np.empty(0), np.empty(0, dtype=bool)
        self._done = 0
        # How many time steps there are, how many are left behind, and of the others their
        # probabilities, and the codes of those that are decided.
        self._asked = self._left = 0
        self._known = np.empty((0, self._actions))
        self._codes = np.empty(0, dtype=np.int64)

    def push(self, times: Real, rows: Real, valid: Flags) -> Decided:
        """Take steps of the grid, `rows` of shape (n, q)."""
        self._times = np.concatenate([self._times, times])
        self._valid = np.concatenate([self._valid, valid])
        self._decode(self._windows.push(rows))
        return self._given((self._left + len(self._codes)) * self._hop - self._done)

    def finish(self) -> Decided:
        """Give the steps that were waiting."""
        self._decode(self._windows.finish())
        self._codes = np.concatenate([self._codes, self._decoder.finish()])
        return self._given(len(self._times))

    def _decode(self, features: Real) -> None:
        """Take time steps."""
        m = len(features)
        if not m:
            return
        # In the middle of the steps around; at the end of a stream perhaps past its last one.
        places = (self._asked + np.arange(m)) * self._hop + self._hop // 2 - self._done
        valid = self._valid[np.minimum(places, len(self._valid) - 1)]
        known = np.zeros((m, self._actions))
        if valid.any():
            found = self._classifier.predict_proba(features[valid])
            known[np.ix_(valid, self._classifier.classes_)] = found
        self._asked += m
        self._known = np.concatenate([self._known, known])
        with np.errstate(divide="ignore"):
            codes = self._decoder.push(np.log(known), valid)
        self._codes = np.concatenate([self._codes, codes])

    def _given(self, count: int) -> Decided:
        """Give up to `count` steps of the grid the labels of the time steps around."""
        count = min(count, len(self._times))
        if count < 1:
            none = np.empty((0, self._actions))
            return Decided(np.empty(0), np.empty(0, dtype=np.int64), none)
        around = (self._done + np.arange(count)) // self._hop - self._left
        # At the end of a stream what lies behind the last time step belongs to it.
        around = np.minimum(around, len(self._codes) - 1)
        valid = self._valid[:count]
        codes = np.where(valid, self._codes[around], UNLABELLED)
        known = np.where(valid[:, None], self._known[around], 0.0)
        times, self._times = self._times[:count], self._times[count:]
        self._valid = self._valid[count:]
        self._done += count
        # The last one stays, in case that it is the last of all.
        gone = min(self._done // self._hop - self._left, len(self._codes) - 1)
        self._codes, self._known = self._codes[gone:], self._known[gone:]
        self._left += gone
        return Decided(times, codes, known)
