"""Rows of a comparison: metric, both runs, their difference, and how sure that is."""

from __future__ import annotations

from collections.abc import Collection

from forcelab.gui.review.metric_words import Metric
from forcelab.gui.review.rows import Column, Row
from forcelab.gui.review.settings_fields import FIELDS
from forcelab.gui.theme import colours
from forcelab.review.run_comparison import Comparison

#: What a run is asked for, by the words of the dialogs in which it is chosen.
_WORDS = {
    "preset": "Preset",
    "windows": "Windows in seconds",
    "tasks": "Train on",
    "test task": "Test on another task",
    "coder": "Whose labels",
    "apart": "Actions of the same name stay apart",
    "groups left out": "Groups left out",
}

__all__ = ["by_demonstration", "by_metric", "columns_of", "settings_text"]


def columns_of(comparison: Comparison, first: str, *, sure: bool) -> tuple[Column, ...]:
    """The columns' names; `first` is what the rows are, `sure` whether there are intervals."""
    run = "run {0}"
    columns = (
        Column(first, number=False),
        Column(run.format(comparison.one.number)),
        Column(run.format(comparison.other.number)),
        Column("difference"),
    )
    tip = "Of the difference, paired over the demonstrations both tested."
    return (*columns, Column("95 % interval", tip)) if sure else columns


def by_metric(comparison: Comparison, stage: str, metrics: Collection[Metric]) -> tuple[Row, ...]:
    """A row for each metric, pooled over what both tested."""
    one, other = comparison.pooled[stage]
    found = comparison.intervals[stage]
    rows = []
    for metric in metrics:
        ends = found[metric.path]
        values = metric.value(one), metric.value(other)
        row = _row(metric, metric.title, *values, sure=ends is None or not ends[0] <= 0 <= ends[1])
        cells = (*row.cells, metric.span(ends, signed=True))
        rows.append(Row(cells, tip=metric.tip, colours=row.colours))
    return tuple(rows)


def by_demonstration(
    comparison: Comparison, stage: str, metric: Metric, seen: Collection[str]
) -> tuple[tuple[Row, ...], tuple[str, ...]]:
    """A row for each demonstration that both tested and the coder may see; and their ids."""
    ids = tuple(id_ for id_ in comparison.shared if id_ in seen)
    rows = []
    for id_ in ids:
        one, other = comparison.each[stage][id_]
        rows.append(_row(metric, comparison.names[id_], metric.value(one), metric.value(other)))
    return tuple(rows), ids


def settings_text(comparison: Comparison) -> str:
    """What was asked for differently, in a line or two."""
    if not comparison.settings:
        text = "Both runs have the same settings."
    else:
        listed = "; ".join(_asked(*setting) for setting in comparison.settings)
        text = f"Different settings: {listed}."
    if number := len(comparison.relabelled):
        changed = "Labels of {0} of {1} demonstrations were changed between the runs."
        text = f"{text} {changed.format(number, len(comparison.shared))}"
    return text


def _asked(name: str, one: str, other: str) -> str:
    """What was asked for differently, as the dialog calls it in which it is chosen."""
    field = next((field for field in FIELDS if field.name == name), None)
    words = _WORDS.get(name, name) if field is None else field.label
    options = {} if field is None else dict(field.options)
    one, other = (options.get(value, value) for value in (one, other))
    return f"{words}: {one} → {other}"


def _row(
    metric: Metric, name: str, one: float | None, other: float | None, *, sure: bool = True
) -> Row:
    """Both numbers and their difference: better ones marked, in colour and in words.

    Not where it is not `sure` that there is a difference at all.
    """
    difference = None if one is None or other is None else other - one
    shown = metric.text(difference, signed=True)
    colour = None
    if difference is not None and metric.better and shown.strip("+\u22120.,"):
        better = (difference > 0) == (metric.better > 0)
        # Not the accent: text on it can be read, but hardly text in it on dark ground.
        colour = colours().range if better else colours().trouble
        words = "better" if better else "worse"
        if not sure:
            colour, words = colours().muted, "no clear difference"
        shown = f"{words}  {shown}"
    cells = (name, metric.text(one), metric.text(other), shown)
    return Row(cells, colours=(None, None, None, colour))
