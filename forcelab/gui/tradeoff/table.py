"""The table beside the plot: every setting with all its figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication

from forcelab.gui.review.rows import Column, Row
from forcelab.gui.tradeoff.points import named

if TYPE_CHECKING:
    from forcelab.measure.rows import Row as MeasuredRow

__all__ = ["columns", "rows_of", "sentence"]

translate = QCoreApplication.translate
#: What stands before the setting in use, and before those on the front.
IN_USE, FRONT = "●", "◆"


def columns() -> tuple[Column, ...]:
    """What the table tells of each setting."""
    cpu = translate("forcelab", "CPU seconds of all threads, for a minute of signal")
    return (
        Column(
            "",
            translate("forcelab", "{0} in use; {1} no other is both faster and better").format(
                IN_USE, FRONT
            ),
            number=False,
        ),
        Column(translate("forcelab", "Setting"), number=False),
        Column("F1@50", translate("forcelab", "Segments found, half of each overlapped (%)")),
        Column(translate("forcelab", "Accuracy"), translate("forcelab", "Samples right (%)")),
        Column(
            translate("forcelab", "Balanced"),
            translate("forcelab", "Mean over the actions of their samples right (%)"),
        ),
        Column(translate("forcelab", "Edit"), translate("forcelab", "Order of the segments (%)")),
        Column(
            translate("forcelab", "Boundary\nmedian (ms)"),
            translate("forcelab", "Half of the boundaries are no further off than this"),
        ),
        Column(
            translate("forcelab", "Boundary\n90 % (ms)"),
            translate("forcelab", "Nine in ten boundaries are no further off than this"),
        ),
        Column(translate("forcelab", "Recognise"), cpu),
        Column(translate("forcelab", "Train"), cpu),
        Column(
            translate("forcelab", "Memory"),
            translate("forcelab", "Peak while a demonstration is recognised (MB)"),
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
    told = translate(
        "forcelab",
        "{name}: F1@50 {f1} %, accuracy {accuracy} %, balanced {balanced} %, edit {edit} %; "
        "half of the boundaries at most {median} ms off, nine in ten {most} ms; {predict} s to "
        "recognise and {train} s to train on a minute, {memory} MB",
    )
    f1, accuracy, balanced, edit, median, most, predict, train, memory = _figures(row)
    return told.format(
        name=named(row),
        f1=f1,
        accuracy=accuracy,
        balanced=balanced,
        edit=edit,
        median=median,
        most=most,
        predict=predict,
        train=train,
        memory=memory,
    )


def _row(row: MeasuredRow, current: bool, front: bool) -> Row:
    """A row as texts."""
    mark = (IN_USE if current else "") + (FRONT if front else "")
    cells = ("–",) * 9 if row.refusal else _figures(row)
    return Row((mark, named(row), *cells), tip=sentence(row), bold=current)


def _figures(row: MeasuredRow) -> tuple[str, ...]:
    """All figures of a row that was not refused."""
    further = row.further
    train = further["features (s/min)"] + further["fit (s/min)"]
    return (
        *(_percent(further.get(name)) for name in ("F1@50", "accuracy", "balanced", "edit")),
        _milliseconds(further.get("boundary (ms)")),
        _milliseconds(further.get("boundary p90 (ms)")),
        f"{row.seconds:.2f}",
        f"{train:.2f}",
        f"{(row.peak_bytes or 0) / 1e6:.1f}",
    )


def _percent(share: float | None) -> str:
    """A share in percent."""
    return "–" if share is None else f"{100 * share:.1f}"


def _milliseconds(time: float | None) -> str:
    """How far boundaries are off."""
    return "–" if time is None else f"{time:.0f}"
