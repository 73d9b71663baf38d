"""Samples as a table: a row each with its time, the channels, the action of each author.

Columns are called ``labels of AUTHOR``, where a cell is empty while unlabelled; of what a run
predicted there is a ``probability of MODEL`` beside it, that of the action in its row.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.track_text import quoted_text
from forcelab.labels import Segment, Segments, Track, to_codes

#: What the names of the files end in, before their suffix, as recordings may lie beside them.
SAMPLES: Final = ".samples"
#: What the names of columns of labels and of probabilities begin with.
LABELS_OF: Final = "labels of "
PROBABILITY_OF: Final = "probability of "
#: Rows that are in memory as text, or as a row group of Parquet, at a time.
BLOCK = 50_000


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a run predicts for one demonstration."""

    author: str  #: the model's name, as of :func:`forcelab.labels.model_author`
    segments: Segments
    #: Probability of an action at some times (s); None where the run kept none
    probabilities: Callable[[str, NDArray[np.float64]], NDArray[np.float64]] | None = None

    def probability(self, segment: Segment) -> float | None:
        """Mean probability of a segment's action over it, at some times; None if unknown."""
        if self.probabilities is None:
            return None
        times = np.linspace(segment.start, segment.end, 20, endpoint=False)
        values = self.probabilities(segment.action, times)
        known = values[~np.isnan(values)]
        return float(known.mean()) if known.size else None


class SampleTable:
    """A demonstration's samples with the labels of some authors and perhaps a prediction."""

    def __init__(
        self, demonstration: Demonstration, tracks: Sequence[Track], prediction: Prediction | None
    ) -> None:
        self._demonstration = demonstration
        tracks = [track for track in tracks if not prediction or track.author != prediction.author]
        if prediction is not None:
            tracks.append(Track(prediction.author, prediction.segments))
        self._labels = {f"{LABELS_OF}{track.author}": track for track in tracks}
        self._probabilities = prediction.probabilities if prediction is not None else None
        channels = demonstration.channels
        self._signals = [f"{c.name} ({c.unit})" if c.unit else c.name for c in channels]
        actions = (action for track in tracks for action in track.actions)
        for name in (*self._signals, *self._labels, *actions):
            if not name.isprintable():
                raise InputError(
                    f"The name {name!a} holds a character that a table of samples cannot; "
                    f"rename it."
                )
        self.columns = ("time (s)", *self._signals, *self._labels)
        if prediction is not None and self._probabilities is not None:
            self.columns += (f"{PROBABILITY_OF}{prediction.author}",)
        if len(set(self.columns)) < len(self.columns):
            twice = next(name for name in self.columns if self.columns.count(name) > 1)
            raise InputError(
                f"Two columns would be called '{twice}'; rename the channel or author."
            )

    def write_csv(self, stream: BinaryIO) -> None:
        """Write the table as CSV (RFC 4180), numbers with as many digits as tell them exactly."""
        text = io.TextIOWrapper(stream, "utf-8", newline="")
        writer = csv.writer(text)
        writer.writerow(map(quoted_text, self.columns))
        for numbers, words, probability in self._blocks():
            cells: list[list[Any]] = [column.tolist() for column in numbers]
            for values, column in zip(cells, numbers, strict=True):
                for missing in np.flatnonzero(~np.isfinite(column)):
                    values[missing] = ""
            for codes, actions in words:
                names = [*map(quoted_text, actions), ""]  # the last one is UNLABELLED, -1
                cells.append([names[code] for code in codes.tolist()])
            if probability is not None:
                cells.append(["" if np.isnan(p) else f"{p:.4f}" for p in probability])
            writer.writerows(zip(*cells, strict=True))
        text.detach()  # which flushes; the file goes on to its name

    def write_parquet(self, stream: BinaryIO) -> None:
        """Write the table as Parquet: labels are words, null while unlabelled."""
        arrow = load_extra("pyarrow", "parquet", "A Parquet file")
        parquet = load_extra("pyarrow.parquet", "parquet", "A Parquet file")
        words_type = arrow.dictionary(arrow.int32(), arrow.string())
        types = [arrow.float64()] * (1 + len(self._signals)) + [words_type] * len(self._labels)
        types += [arrow.float32()] * (self._probabilities is not None)
        schema = arrow.schema(list(zip(self.columns, types, strict=True)))
        with parquet.ParquetWriter(stream, schema) as writer:
            for numbers, words, probability in self._blocks():
                arrays = [arrow.array(column) for column in numbers]
                for codes, actions in words:
                    indices = arrow.array(codes.astype(np.int32), mask=codes < 0)
                    names = arrow.array(actions, arrow.string())
                    arrays.append(arrow.DictionaryArray.from_arrays(indices, names))
                if probability is not None:
                    unknown = np.isnan(probability)
                    arrays.append(arrow.array(probability.astype(np.float32), mask=unknown))
                writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))

    def _blocks(self) -> Iterator[_Block]:
        """Some rows after the other: numbers, the codes of labels, and a probability."""
        times, signals = self._demonstration.times, self._demonstration.signals
        for first in range(0, len(times), BLOCK):
            rows = slice(first, first + BLOCK)
            block = times[rows]
            words = [
                (to_codes(track.segments, block, track.actions), track.actions)
                for track in self._labels.values()
            ]
            probability = None
            if self._probabilities is not None:
                codes, actions = words[-1]  # a prediction comes last among the labels
                probability = np.full(len(block), np.nan)
                for code, action in enumerate(actions):
                    if (mask := codes == code).any():
                        probability[mask] = self._probabilities(action, block[mask])
            yield [block, *signals[rows].T], words, probability


_Block = tuple[
    list[NDArray[np.float64]],
    list[tuple[NDArray[np.int64], tuple[str, ...]]],
    NDArray[np.float64] | None,
]
