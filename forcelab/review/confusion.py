"""The confusion matrix: seconds or segments in each cell, and the intervals that they lie in."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Real, Whole
from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.recognition.metrics import TICKS, overlay_segments
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.run_result import RunResult
from forcelab.sample_runs import Runs

#: What a cell counts: seconds, or human segments by what covers most of each.
Unit = Literal["time", "segments"]
#: What a cell is a share of: nothing, its row (human), its column (predicted).
Share = Literal["counts", "row", "column"]

#: As many of the longest places in a cell have their confidence looked up, at 10 us each.
MOST_PLACES = 1000


#: A stretch of human-labelled time, with what is predicted there; for unlabelled the number of
#: actions. `owner` is the place of its demonstration.
_STRETCH = np.dtype(
    [
        ("owner", np.int64),
        ("start", np.float64),
        ("end", np.float64),
        ("ticks", np.int64),
        ("human", np.int64),
        ("predicted", np.int64),
    ]
)


@dataclass(frozen=True, eq=False)
class ConfusionCounts:
    """A confusion matrix with the stretches that it was counted from; k actions.

    Rows are human and columns predicted actions; the last column is unlabelled: missed time.
    """

    actions: tuple[str, ...]  # length k
    demonstrations: tuple[DemonstrationResult, ...]
    #: The stage of prediction, ``"filtered"`` or ``"raw"``; demonstrations that did not keep it are
    #: left out
    stage: str
    _pieces: NDArray[np.void]
    _segments: NDArray[np.void]

    def matrix(self, unit: Unit = "time") -> Real:
        """Seconds or numbers of human segments, shape (k, k + 1)."""
        parts = self._parts(unit)
        return self._summed(parts, parts["ticks"] / TICKS if unit == "time" else None)

    def numbers(self, unit: Unit = "time") -> Whole:
        """Number of stretches in each cell, shape (k, k + 1)."""
        return self._summed(self._parts(unit)).astype(np.int64)

    def places(
        self, human: str, predicted: str | None, unit: Unit = "time", most: int = MOST_PLACES
    ) -> tuple[Interval, ...]:
        """The intervals of a cell, by duration times confidence, the largest first.

        `predicted` is None for unlabelled, which has no confidence: there duration decides. By unit
        they are stretches of the cell's time, or whole human segments; only the `most` longest are
        given.
        """
        parts = self._parts(unit)
        column = len(self.actions) if predicted is None else self.actions.index(predicted)
        row = self.actions.index(human)
        chosen = parts[(parts["human"] == row) & (parts["predicted"] == column)]
        longest = chosen[np.argsort(-chosen["ticks"], kind="stable")][:most]
        intervals = []
        for owner, start, end, *_ in longest.tolist():
            item = self.demonstrations[owner]
            confidence = item.confidence(predicted, start, end)
            intervals.append(Interval(item.id, start, end, human, predicted, confidence))
        return tuple(sorted(intervals, key=lambda interval: interval.score, reverse=True))

    def _parts(self, unit: Unit) -> NDArray[np.void]:
        """The stretches that a unit counts."""
        return self._pieces if unit == "time" else self._segments

    def _summed(self, parts: NDArray[np.void], amounts: Real | None = None) -> Real:
        """The sum of amounts in each cell, or the number of stretches."""
        k = len(self.actions)
        cells = parts["human"] * (k + 1) + parts["predicted"]
        sums = np.bincount(cells, amounts, k * (k + 1)).astype(np.float64)
        return sums.reshape(k, k + 1)


def count_confusion(
    run: RunResult, stage: str = "filtered"
) -> Generator[Progress, None, ConfusionCounts]:
    """Count a stage of a run's predictions against the human tracks."""
    demonstrations = tuple(item for item in run.tested if stage in item.stages)
    none = np.empty(0, dtype=_STRETCH)
    pieces, segments = [none], [none]
    for number, item in enumerate(demonstrations):
        piece, segment = _count_demonstration(number, item, stage, run.actions)
        pieces.append(piece)
        segments.append(segment)
        yield Progress(number + 1, len(demonstrations), item.name)
    return ConfusionCounts(
        run.actions, demonstrations, stage, np.concatenate(pieces), np.concatenate(segments)
    )


def normalise(matrix: Real, share: Share) -> Real:
    """A matrix over the sums of its rows or columns; of ``"counts"`` over its largest cell.

    Zero where there is nothing to have a share of.
    """
    if share == "row":
        total = matrix.sum(axis=1, keepdims=True)
    elif share == "column":
        total = matrix.sum(axis=0, keepdims=True)
    else:
        total = matrix.max(keepdims=True, initial=0.0)
    return np.divide(matrix, total, out=np.zeros(matrix.shape), where=total > 0)


def _count_demonstration(
    number: int, item: DemonstrationResult, stage: str, actions: Sequence[str]
) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """The pieces and the human segments of one demonstration."""
    over = overlay_segments(item.human, item.stages[stage], actions)
    pieces, human, k = over.pieces, over.human, len(actions)
    predicted = np.where(over.predicted_codes < 0, k, over.predicted_codes)
    covered = np.zeros((len(human), k + 1), dtype=np.int64)
    np.add.at(covered, (human.holding(pieces.firsts), predicted), pieces.samples)
    majority = covered.argmax(axis=1)  # of two that cover as much the first, unlabelled last

    def stretches(runs: Runs, coded: Codes, model: Codes) -> NDArray[np.void]:
        owner = np.full(len(runs), number)
        values = [owner, runs.starts, runs.ends, runs.samples, coded, model]
        return np.rec.fromarrays(values, dtype=_STRETCH)

    return stretches(pieces, over.human_codes, predicted), stretches(human, human.codes, majority)
