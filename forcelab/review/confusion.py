"""The confusion matrix: seconds or segments in each cell, and the intervals that they lie in."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.recognition.metrics import TICKS, overlay_segments
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.run_result import RunResult

#: What a cell counts: seconds, or human segments by what covers most of each.
Unit = Literal["time", "segments"]
#: What a cell is a share of: nothing, its row (human), its column (predicted).
Share = Literal["counts", "row", "column"]

#: As many of the longest places in a cell have their confidence looked up, at 10 us each.
MOST_PLACES = 1000


@dataclass(frozen=True, eq=False)
class _Parts:
    """Stretches of human-labelled time with what is predicted there; p of them."""

    owners: NDArray[np.int64]
    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    ticks: NDArray[np.int64]
    human: NDArray[np.int64]
    #: The number of actions stands for unlabelled.
    predicted: NDArray[np.int64]

    @classmethod
    def joined(cls, parts: Sequence[_Parts]) -> _Parts:
        """All parts after one another."""
        names = ("owners", "starts", "ends", "ticks", "human", "predicted")
        empty = [np.empty(0, dtype=np.float64 if n in ("starts", "ends") else int) for n in names]
        return cls(
            *(
                np.concatenate([blank, *(getattr(part, name) for part in parts)])
                for blank, name in zip(empty, names, strict=True)
            )
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
    _pieces: _Parts
    _segments: _Parts

    def matrix(self, unit: Unit = "time") -> NDArray[np.float64]:
        """Seconds or numbers of human segments, shape (k, k + 1)."""
        parts = self._parts(unit)
        amounts = parts.ticks / TICKS if unit == "time" else np.ones(len(parts.ticks))
        return self._summed(parts, amounts)

    def numbers(self, unit: Unit = "time") -> NDArray[np.int64]:
        """Number of stretches in each cell, shape (k, k + 1)."""
        parts = self._parts(unit)
        return self._summed(parts, np.ones(len(parts.ticks))).astype(np.int64)

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
        chosen = np.flatnonzero(
            (parts.human == self.actions.index(human)) & (parts.predicted == column)
        )
        longest = chosen[np.argsort(-parts.ticks[chosen], kind="stable")][:most]
        intervals = [self._place(parts, number, human, predicted) for number in longest.tolist()]
        return tuple(sorted(intervals, key=lambda interval: interval.score, reverse=True))

    def _place(self, parts: _Parts, number: int, human: str, predicted: str | None) -> Interval:
        """One stretch with the model's confidence in what it predicts."""
        item = self.demonstrations[parts.owners[number]]
        start, end = float(parts.starts[number]), float(parts.ends[number])
        confidence = item.confidence(predicted, start, end)
        return Interval(item.id, start, end, human, predicted, confidence)

    def _parts(self, unit: Unit) -> _Parts:
        """The stretches that a unit counts."""
        return self._pieces if unit == "time" else self._segments

    def _summed(self, parts: _Parts, amounts: NDArray[np.float64]) -> NDArray[np.float64]:
        """The sum of amounts in each cell."""
        k = len(self.actions)
        cells = parts.human * (k + 1) + parts.predicted
        sums = np.bincount(cells, amounts, k * (k + 1)).astype(np.float64)
        return sums.reshape(k, k + 1)


def count_confusion(
    run: RunResult, stage: str = "filtered"
) -> Generator[Progress, None, ConfusionCounts]:
    """Count a stage of a run's predictions against the human tracks."""
    demonstrations = tuple(item for item in run.tested if stage in item.stages)
    pieces, segments = [], []
    for number, item in enumerate(demonstrations):
        piece, segment = _count_demonstration(number, item, stage, run.actions)
        pieces.append(piece)
        segments.append(segment)
        yield Progress(number + 1, len(demonstrations), item.name)
    return ConfusionCounts(
        run.actions, demonstrations, stage, _Parts.joined(pieces), _Parts.joined(segments)
    )


def normalise(matrix: NDArray[np.float64], share: Share) -> NDArray[np.float64]:
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
) -> tuple[_Parts, _Parts]:
    """The pieces and the human segments of one demonstration."""
    over = overlay_segments(item.human, item.stages[stage], actions)
    pieces, human, k = over.pieces, over.human, len(actions)
    predicted = np.where(over.predicted_codes < 0, k, over.predicted_codes)
    covered = np.zeros((len(human), k + 1), dtype=np.int64)
    np.add.at(covered, (human.holding(pieces.firsts), predicted), pieces.samples)
    majority = covered.argmax(axis=1)  # of two that cover as much the first, unlabelled last
    return (
        _Parts(
            np.full(len(pieces), number),
            pieces.starts,
            pieces.ends,
            pieces.samples,
            over.human_codes,
            predicted,
        ),
        _Parts(
            np.full(len(human), number),
            human.starts,
            human.ends,
            human.samples,
            human.codes,
            majority,
        ),
    )
