"""Scores as a table for a paper: CSV, a line for each demonstration and stage."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.formats.track_text import quoted_text
from forcelab.io import write_atomically
from forcelab.recognition.experiments import Evaluated
from forcelab.recognition.intervals import METRICS, look_up
from forcelab.recognition.results import Evaluation

__all__ = ["check_table", "write_table"]

#: The columns before the metrics.
FIRST = ("evaluation", "stage", "row", "demonstration")


def check_table(path: Path) -> None:
    """Refuse a kind of table that there is not, before the work and not after it.

    Raises
    ------
    InputError
        If the name does not end with ``.csv``.
    """
    if path.suffix.lower() != ".csv":
        raise InputError(f"'{path}' is no table that can be written; name it '{path.stem}.csv'.")


def write_table(path: Path, evaluated: Evaluated) -> None:
    """Write all scores as CSV; rates are fractions, and what is not defined is left empty.

    The column ``row`` tells a ``demonstration`` from what is ``pooled`` and the ``lower`` and
    ``upper`` ends of its 95 % interval.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow((*FIRST, *METRICS))
    for _, evaluation in evaluated.evaluations:
        for stage in evaluation.kinds:
            for row, name, values in _rows(evaluation, stage):
                texts = map(quoted_text, (evaluation.title, stage, row, name))
                writer.writerow((*texts, *values))
    write_atomically(path, text.getvalue().encode())


def _rows(evaluation: Evaluation, stage: str) -> Iterator[tuple[str, str, list[Any]]]:
    """What a line is of, the demonstration's name, and the metrics."""
    pooled, each = evaluation.scores(stage)
    for scores in each:
        record = scores.to_json()
        yield "demonstration", scores.name, [look_up(record, metric) for metric in METRICS]
    record = pooled.to_json()
    yield "pooled", "", [look_up(record, metric) for metric in METRICS]
    ranges = evaluation.intervals(stage)
    for end, name in enumerate(("lower", "upper")):
        found = (ranges[metric] for metric in METRICS)
        yield name, "", [None if ends is None else ends[end] for ends in found]
