"""What would be read from a table, told by its first lines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from forcelab.formats.recording import ReadOptions
from forcelab.formats.table.body import Words
from forcelab.formats.table.cells import Kind, kind_of, numbers
from forcelab.formats.table.columns import is_index
from forcelab.formats.table.layout import Layout, survey
from forcelab.formats.table.roles import Roles, choose_roles, counters, label_column

__all__ = ["ColumnUse", "Use", "preview", "rate_in"]

Use = Literal["signal", "times", "counter", "labels", "left out"]
#: What any column of a table can be made, besides what it is taken for.
ANY_USE: tuple[Use, ...] = ("signal", "times", "counter", "labels", "left out")


@dataclass(frozen=True, slots=True)
class ColumnUse:
    """A column and what it is read as.

    Parameters
    ----------
    name, unit : str
        As in the header; the unit is empty where there is none.
    use : "signal", "times", "counter", "labels" or "left out"
        A counter is no signal; where there are no times it stands in for them.
    cells : tuple of str
        Its first cells, as they stand in the file.
    choices : tuple
        What it can be made.
    """

    name: str
    unit: str
    use: Use
    cells: tuple[str, ...]
    choices: tuple[Use, ...] = ANY_USE


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """Tell what the columns of a table are read as, without reading all of it.

    Parameters
    ----------
    path : Path
        The table.
    options : ReadOptions
        As for reading it.

    Raises
    ------
    InputError
        If its first lines hold no table or the options do not fit.
    """
    layout, _ = survey(path)
    roles = choose_roles(layout, options, str(path))
    decimal = layout.dialect.decimal
    values = {index: _values(layout.cells(index), decimal) for index in roles.numeric}
    counting = set(counters(layout, roles, values, str(path)))
    words = {}
    for index in range(len(layout.columns)):
        if index not in values and index != roles.time:
            words[index] = Words()
            words[index].read(layout.cells(index))
            words[index].close()
    label = label_column(layout, roles, words, str(path))
    return tuple(
        ColumnUse(
            column.name,
            column.unit,
            "labels" if index == label else _use(layout, roles, counting, index),
            tuple(cell.strip() for cell in layout.cells(index)[:3]),
        )
        for index, column in enumerate(layout.columns)
    )


def rate_in(path: Path) -> float | None:
    """The samples a second that lines before a table tell, such as in a Vicon export.

    Raises
    ------
    InputError
        If its first lines hold no table.
    """
    return survey(path)[0].rate


def _values(cells: Sequence[str], decimal: str) -> NDArray[np.float64]:
    """The numbers of some cells; what is none is told with its line when the table is read."""
    kinds = (kind_of(cell, decimal) for cell in cells)
    pairs = zip(cells, kinds, strict=True)
    return numbers([cell if kind is Kind.NUMBER else "" for cell, kind in pairs], decimal)


def _use(layout: Layout, roles: Roles, counting: set[int], index: int) -> Use:
    """What one column is read as."""
    if index == roles.time:
        return "times"
    if index in roles.signals:
        return "signal"
    if index in roles.left_out or index in roles.clocks:
        return "left out"
    if index in counting:
        return "counter"
    if is_index(layout.columns[index], layout.cells(index)):
        return "left out"
    return "signal" if layout.kinds[index] is Kind.NUMBER else "left out"
