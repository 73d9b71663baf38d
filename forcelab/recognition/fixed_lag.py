"""The decoder on a stream: each step is decided when so many steps after it have been seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.choreography import Choreography
from forcelab.recognition.decoding import best_code, best_codes, checked, runs_of
from forcelab.recognition.joining import Best
from forcelab.recognition.semimarkov import Scores, Use
from forcelab.recognition.sweep import Sweep

__all__ = ["FixedLag"]

Codes = NDArray[np.int64]


class FixedLag:
    """Decides each step `lag` steps later.

    The code of a step is what :func:`forcelab.recognition.decoding.decode` gives it from all steps
    up to `lag` after it and none later. Memory and time do not grow with the stream.

    Parameters
    ----------
    step : float
        Seconds between two steps.
    lag : int
        Steps to wait, 0 or more.
    choreography : Choreography
    use
        As of :func:`~forcelab.recognition.decoding.decode`.

    Raises
    ------
    InputError
        If the step is not above 0, the lag is negative or there is no such use.
    """

    def __init__(
        self,
        step: float,
        lag: int,
        choreography: Choreography,
        use: Use = "order",
    ) -> None:
        if lag < 0:
            raise InputError(f"The decoder can wait for 0 steps or more, not {lag}.")
        self.lag = lag
        self._choreography = choreography
        self._scores = Scores.of(choreography, step, use)
        self._sweep: Sweep | None = None
        self._begun = False

    def push(
        self, log_probabilities: NDArray[np.floating], valid: NDArray[np.bool_] | None = None
    ) -> Codes:
        """Take steps; give the codes of those that are now decided, in order and without a break.

        Parameters
        ----------
        log_probabilities : ndarray, shape (m, K)
        valid : ndarray of bool, shape (m,), optional
            False in gaps, which decide all that waits; all valid by default.

        Raises
        ------
        InputError
            If the numbers of steps or actions disagree.
        """
        m = len(log_probabilities)
        valid = np.ones(m, dtype=np.bool_) if valid is None else valid
        valid = checked(log_probabilities, valid, self._choreography)
        decided: list[Codes] = []
        done = 0
        for first, last in runs_of(valid):
            if first > done:
                decided.append(self._gap(first - done))
            decided.append(self._on(log_probabilities[first:last]))
            done = last
        if m > done or not decided:
            decided.append(self._gap(m - done))
        return np.concatenate(decided) if len(decided) > 1 else decided[0]

    def finish(self) -> Codes:
        """The codes that were waiting: nothing comes any more. What is pushed then is new."""
        sweep, self._sweep = self._sweep, None
        if sweep is None:
            return np.empty(0, dtype=np.int64)
        return best_codes(sweep, min(self.lag, sweep.now))

    def _gap(self, steps: int) -> Codes:
        """Decide what waits, then the steps of a gap."""
        if not steps:
            return np.empty(0, dtype=np.int64)
        self._begun = True
        return np.concatenate([self.finish(), np.full(steps, UNLABELLED, dtype=np.int64)])

    def _on(self, log_probabilities: NDArray[np.floating]) -> Codes:
        """Decide what `lag` steps of the same stretch have followed."""
        if self._sweep is None:
            scores = self._scores.anywhere() if self._begun else self._scores
            # Room for twice what must be kept.
            room = 2 * (max(int(scores.longest.max()), 64) + self.lag) + 64
            self._sweep, self._begun = Sweep(scores, Best(), room), True
        sweep = self._sweep
        evidence = self._scores.evidence(log_probabilities)
        decided: list[int] = []
        for step in range(len(evidence)):
            if not sweep.room:
                # Places that decisions to come look back upon.
                sweep.forget(sweep.margin + self.lag + 2)
            sweep.push(evidence[step : step + 1])
            if sweep.now > self.lag:
                decided.append(best_code(sweep, self.lag))
        return np.array(decided, dtype=np.int64)
