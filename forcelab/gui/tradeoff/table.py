"""The table beside the plot: every setting with all its figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from forcelab.gui.review.rows import Column, Row
from forcelab.gui.tradeoff.points import named

if TYPE_CHECKING:
    from forcelab.measure.rows import Row as MeasuredRow

__all__ = ["columns", "rows_of", "sentence"]

#: What stands before the setting in use, and before those on the front.
IN_USE, FRONT = "●", "◆"


def columns() -> tuple[Column, ...]:
    """What the table tells of each setting."""
    cpu = "CPU seconds of all threads, for a minute of signal"
    return (
        Column(
            "",
            f"{IN_USE} in use; {FRONT} no other is both faster and better",
            number=False,
        ),
        Column("Setting", number=False),
        Column("F1@50", "Segments found, half of each overlapped (%)"),
        Column("Accuracy", "Samples right (%)"),
        Column(
            "Balanced",
            "Mean over the actions of their samples right (%)",
        ),
        Column("Edit", "Order of the segments (%)"),
        Column(
            "Boundary\nmedian (ms)",
            "Half of the boundaries are no further off than this",
        ),
        Column(
            "Boundary\n90 % (ms)",
            "Nine in ten boundaries are no further off than this",
        ),
        Column("Recognise", cpu),
        Column("Train", cpu),
        Column(
            "Memory",
            "Peak while a demonstration is recognised (MB)",
        ),
    )


def rows_of(
    rows: Sequence[MeasuredRow], current: int | None, front: frozenset[int]
) -> tuple[Row, ...]:
    """The rows of the table.

    Parameters
    ----------
    rows : sequence of measured rows
    current : int or None
        Which one is in use.
    front : frozenset of int
        Which ones are on the front of what is drawn.
    """
    return tuple(_row(row, i == current, i in front) for i, row in enumerate(rows))


def sentence(row: MeasuredRow) -> str:
    """Everything about a row in words, for below the plot and for who cannot see it."""
    if row.refusal:
        return f"{named(row)}: {row.refusal}"
    return (
        "{name}: F1@50 {f1} %, accuracy {accuracy} %, balanced {balanced} %, edit {edit} %; "
        "half of the boundaries at most {median} ms off, nine in ten {most} ms; {predict} s to "
        "recognise and {train} s to train on a minute, {memory} MB"
    ).format(name=named(row), **_figures(row))


def _row(row: MeasuredRow, current: bool, front: bool) -> Row:
    """A row as texts."""
    mark = (IN_USE if current else "") + (FRONT if front else "")
    cells = ("–",) * 9 if row.refusal else tuple(_figures(row).values())
    return Row((mark, named(row), *cells), tip=sentence(row), bold=current)


def _figures(row: MeasuredRow) -> dict[str, str]:
    """All figures of a row that was not refused, in the order of the columns."""
    further = row.further

    def told(name: str, scale: float = 1.0, decimals: int = 0) -> str:
        value = further.get(name)
        return "–" if value is None else f"{scale * value:.{decimals}f}"

    return {
        "f1": told("F1@50", 100, 1),
        "accuracy": told("accuracy", 100, 1),
        "balanced": told("balanced", 100, 1),
        "edit": told("edit", 100, 1),
        "median": told("boundary (ms)"),
        "most": told("boundary p90 (ms)"),
        "predict": f"{row.seconds:.2f}",
        "train": f"{further['features (s/min)'] + further['fit (s/min)']:.2f}",
        "memory": f"{(row.peak_bytes or 0) / 1e6:.1f}",
    }
