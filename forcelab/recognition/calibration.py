"""Reliability: whether 0.8 means 0.8.

Sources
-------
Brier, "Verification of forecasts expressed in terms of probability", Monthly Weather Review 78(1),
1950: the score in its form for several actions, from 0 to 2. Naeini, Cooper and Hauskrecht,
"Obtaining well calibrated probabilities using Bayesian binning", AAAI 2015: the expected
calibration error over bins of equal width.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Bins of equal width of the most probable action's probability.
BINS = 10


@dataclass(frozen=True, eq=False)
class Reliability:
    """Sums over human-labelled time steps that give the Brier score and the reliability curve."""

    #: Sum of squared differences between probabilities and truth, over steps and actions
    squares: float
    #: steps, right: (b,); steps, and those recognised right, by the probability of the most
    #: probable action
    steps: NDArray[np.int64]
    right: NDArray[np.int64]
    sure: NDArray[np.float64]  # (b,); sums of that probability

    @classmethod
    def of(
        cls,
        probabilities: NDArray[np.float64],
        predicted_actions: Sequence[str],
        human: NDArray[np.int64],
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
        own = np.where(code >= 0, P[rows, code], 0.0)
        # Summed over actions, (p - 1)^2 of the right one beside p^2 of all others.
        squares = float((P**2).sum() + (1.0 - 2.0 * own).sum())
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
