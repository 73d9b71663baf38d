"""Predicted probabilities: kept over time for a screen, and compared with what is right.

Sources: Brier, "Verification of forecasts expressed in terms of probability", Monthly Weather
Review 78(1), 1950: the score in its form for several actions, from 0 to 2. Naeini, Cooper and
Hauskrecht, "Obtaining well calibrated probabilities using Bayesian binning", AAAI 2015: the
expected calibration error over bins of equal width.
"""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Flags, Real, Whole

#: Values a second that are kept.
RATE = 50.0
#: Steps between the probabilities 0 and 1 that are told apart.
STEPS = 255
#: What a time may be off by rounding, as a share of a bin.
ROUNDING = 1e-3


@dataclass(frozen=True)
class ProbabilityTrace:
    """Probabilities of each action over one demonstration, as coarse as a screen can show them.

    A reviewer sees them as certainty.
    """

    start: float  # seconds, of the first value
    rate: float  # values a second
    actions: tuple[str, ...]  # length K; the columns
    #: (n, K); probabilities in 255ths; value ``i`` is the mean over ``start + [i, i + 1) / rate``
    values: NDArray[np.uint8]

    @classmethod
    def from_probabilities(
        cls, times: Real, probabilities: NDArray[np.floating], actions: tuple[str, ...]
    ) -> ProbabilityTrace:
        """Mean probabilities of increasing `times` (n,), :data:`RATE` a second.

        Where time steps are farther apart than that, a bin is as long as a step. Bins without a
        time step, as in gaps, are zero throughout.
        """
        start, rate = float(times[0]), RATE
        if len(times) > 1:
            rate = min(rate, 1.0 / float(np.median(np.diff(times))))
        # A step that lies on the edge of a bin must not fall before it for its last bits.
        bins = np.floor((times - start) * rate + ROUNDING).astype(np.int64)
        count = int(bins[-1]) + 1
        firsts = np.flatnonzero(np.diff(bins, prepend=-1))
        means = np.add.reduceat(probabilities, firsts, axis=0, dtype=np.float64)
        means /= np.diff(firsts, append=len(bins))[:, None]
        values = np.zeros((count, len(actions)), dtype=np.uint8)
        values[bins[firsts]] = np.rint(means * STEPS)
        return cls(start, rate, actions, values)

    def to_json(self) -> dict[str, Any]:
        """Plain values: the array is compressed, then base64."""
        packed = zlib.compress(np.ascontiguousarray(self.values).tobytes())
        return {
            "start": self.start,
            "rate": self.rate,
            "actions": list(self.actions),
            "count": len(self.values),
            "values": base64.b64encode(packed).decode(),
        }

    @classmethod
    def from_json(cls, plain: Mapping[str, Any]) -> ProbabilityTrace:
        """The inverse of :meth:`to_json`; a ValueError where it is damaged."""
        actions, count = tuple(plain["actions"]), plain["count"]
        try:
            packed = base64.b64decode(plain["values"], validate=True)
            unpacking = zlib.decompressobj()
            # No more than there can be: a damaged count must not fill the memory.
            content = unpacking.decompress(packed, count * len(actions) + 1)
        except (binascii.Error, zlib.error) as error:
            raise ValueError(str(error)) from error
        values = np.frombuffer(content, dtype=np.uint8).reshape(count, len(actions))
        return cls(float(plain["start"]), float(plain["rate"]), actions, values)

    @property
    def times(self) -> Real:
        """The middle of each bin in seconds, shape (n,)."""
        middles = np.arange(len(self.values), dtype=np.float64) + 0.5
        return np.asarray(self.start + middles / self.rate, dtype=np.float64)

    @property
    def known(self) -> Flags:
        """In which bins anything is known, shape (n,); not so in gaps."""
        return np.asarray(self.values.any(axis=1))

    def mean(self, start: float, end: float) -> Real:
        """Mean probability of each action over ``[start, end)`` seconds, shape (K,).

        Of the bins in which anything is known; zero where there are none.
        """
        values = self._between(start, end)
        return np.asarray(values.sum(axis=0) / (STEPS * _known_bins(values)), dtype=np.float64)

    def of_action(self, action: str | None, start: float, end: float) -> float:
        """Mean probability of one action over ``[start, end)``; 0 for one that is not known."""
        if action not in self.actions:
            return 0.0
        values = self._between(start, end)
        column = values[:, self.actions.index(action)]  # alone: it is asked for in long lists
        return float(column.sum()) / (STEPS * _known_bins(values))

    def at(self, action: str, times: Real) -> Real:
        """Probability of one action at some times (s), shape (n,); NaN where nothing is known."""
        places = np.floor((times - self.start) * self.rate + ROUNDING).astype(np.int64)
        places = np.clip(places, 0, len(self.values) - 1)
        column = np.zeros(len(self.values))
        if action in self.actions:
            column = self.values[:, self.actions.index(action)] / STEPS
        return np.where(self.known, column, np.nan)[places]

    def _between(self, start: float, end: float) -> NDArray[np.uint8]:
        """The bins of ``[start, end)``, at least one, shape (m, K)."""
        begin, stop = (start - self.start) * self.rate, (end - self.start) * self.rate
        first = min(max(math.floor(begin + ROUNDING), 0), len(self.values) - 1)
        last = min(max(math.ceil(stop - ROUNDING), first + 1), len(self.values))
        return self.values[first:last]


def _known_bins(values: NDArray[np.uint8]) -> int:
    """In how many bins anything is known; 1 where in none, as what is divided by it is 0 then."""
    return max(1, int(np.count_nonzero(values.any(axis=1))))


#: Bins of equal width of the most probable action's probability.
BINS = 10


@dataclass(frozen=True, eq=False)
class Reliability:
    """Sums over human-labelled time steps that give the Brier score and the reliability curve."""

    #: Sum of squared differences between probabilities and truth, over steps and actions
    squares: float
    #: steps, right: (b,); steps, and those recognised right, by the probability of the most
    #: probable action
    steps: Whole
    right: Whole
    sure: Real  # (b,); sums of that probability

    @classmethod
    def from_predictions(
        cls,
        probabilities: Real,
        predicted_actions: Sequence[str],
        human: Codes,
        actions: Sequence[str],
    ) -> Reliability:
        """Compare probabilities (n, K) with the human's codes (n,) of `actions`.

        Unlabelled steps do not count; an action that was not predicted had the probability 0.
        """
        labelled = human >= 0
        place = {action: code for code, action in enumerate(predicted_actions)}
        table = np.array([place.get(action, -1) for action in actions], dtype=np.int64)
        P, code = probabilities[labelled], table[human[labelled]]
        rows = np.arange(len(code))
        of_predicted = np.where(code >= 0, P[rows, code], 0.0)
        # Summed over actions, (p - 1)^2 of the right one beside p^2 of all others.
        squares = float((P**2).sum() + (1.0 - 2.0 * of_predicted).sum())
        top = P.argmax(axis=1)
        sure = P[rows, top]
        bins = np.minimum((sure * BINS).astype(np.int64), BINS - 1)
        return cls(
            squares,
            np.bincount(bins, minlength=BINS),
            np.bincount(bins, weights=top == code, minlength=BINS).astype(np.int64),
            np.bincount(bins, weights=sure, minlength=BINS).astype(np.float64),
        )

    def __add__(self, other: Reliability) -> Reliability:
        return Reliability(
            self.squares + other.squares,
            self.steps + other.steps,
            self.right + other.right,
            self.sure + other.sure,
        )

    @property
    def brier(self) -> float | None:
        """Brier score, 0 (best) to 2; None where nothing is labelled."""
        total = int(self.steps.sum())
        return self.squares / total if total else None

    @property
    def ece(self) -> float | None:
        """Expected calibration error, 0 (best) to 1: how far sureness is from being right."""
        total = int(self.steps.sum())
        return float(np.abs(self.sure - self.right).sum()) / total if total else None

    def to_json(self) -> dict[str, Any]:
        """Brier score, calibration error and the curve: a row for each bin that holds a step.

        ``bins`` are lists of how many steps, the mean probability and the share that is right.
        """
        rows = zip(self.steps.tolist(), self.sure.tolist(), self.right.tolist(), strict=True)
        return {
            "brier": self.brier,
            "ece": self.ece,
            "bins": [[n, sure / n, right / n] for n, sure, right in rows if n],
        }
