"""The rows of a text table, read block by block into one array a column."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.formats.table.cells import MISSING, Kind, NotANumberError, numbers
from forcelab.formats.table.clocks import ClockReader
from forcelab.formats.table.dialect import Dialect, lines
from forcelab.formats.table.layout import Layout

__all__ = ["Body", "Plan", "Words", "read_body"]

#: More rows with another number of cells than this share (and than one) are no slip of a logger.
_RAGGED_SHARE = 0.05
#: Rows read before that share is looked at.
_RAGGED_ROWS = 1000


class Words:
    """A column of words, each kept once.

    Attributes
    ----------
    codes : ndarray of int32, shape (n,)
        Index into `words`, once :meth:`close` has been called.
    words : list of str
        In the order of their first occurrence.
    """

    def __init__(self) -> None:
        self._index: dict[str, int] = {}
        self._blocks: list[NDArray[np.int32]] = []
        self.codes = np.empty(0, np.int32)
        self.words: list[str] = []

    def read(self, cells: Sequence[str]) -> None:
        """Append the cells of a block."""
        index = self._index
        codes = (index.setdefault(cell, len(index)) for cell in cells)
        self._blocks.append(np.fromiter(codes, np.int32, len(cells)))

    def close(self) -> None:
        """Join the blocks."""
        if self._blocks:
            self.codes = np.concatenate(self._blocks)
        self._blocks.clear()
        self.words = [word.strip() for word in self._index]

    @property
    def empty(self) -> bool:
        """Whether every cell is empty or a word for a missing sample."""
        return all(word.lower() in MISSING for word in self.words)


@dataclass(frozen=True, slots=True)
class Plan:
    """What the columns of a table are read as; those not named here are words.

    Parameters
    ----------
    numeric : collection of int
        Columns of numbers.
    time : int or None
        The column of stamps.
    clock : ClockReader or None
        Its reader.
    label : int or None
        The column of labels: words, whatever it holds.
    """

    numeric: Collection[int]
    time: int | None = None
    clock: ClockReader | None = None
    label: int | None = None


@dataclass(frozen=True, slots=True)
class Body:
    """All rows of a table.

    Parameters
    ----------
    values : dict of int to ndarray, shape (n,)
        The numbers of each numeric column, by its index.
    words : dict of int to Words
        The other columns, by index.
    stamps : ndarray, shape (n,), or None
        The values of the clock reader, if there is one.
    lines : ndarray of int, shape (n,)
        1-based line of each row.
    ragged : ndarray of bool, shape (n,)
        Rows with another number of cells: all their samples are missing.
    """

    values: dict[int, NDArray[np.float64]]
    words: dict[int, Words]
    stamps: NDArray[np.float64] | None
    lines: NDArray[np.int64]
    ragged: NDArray[np.bool_]


def read_body(path: Path, layout: Layout, encoding: str, plan: Plan) -> Body:
    """Read all rows of a table.

    Parameters
    ----------
    path : Path
        The file.
    layout : Layout
        How it is written.
    encoding : str
        How its text is encoded.
    plan : Plan
        What its columns are read as.

    Raises
    ------
    InputError
        With the line of the first cell that is not what its column holds, or if more than 5 % of
        the rows (and more than one) have another number of cells.
    """
    blocks: list[list[NDArray[np.float64]]] = [[] for _ in layout.columns]
    words = {i: Words() for i in range(len(blocks)) if i not in plan.numeric and i != plan.time}
    plain = [i for i in range(len(blocks)) if i in plan.numeric]
    if plan.clock and plan.time is not None and plan.clock.plain:
        plain = sorted([*plain, plan.time])
    rest = [i for i in range(len(blocks)) if i not in plain]
    at: list[NDArray[np.int64]] = []
    ragged: list[NDArray[np.bool_]] = []
    for line_numbers, rows in lines(path, encoding, layout.skip, sections=layout.sections):
        at.append(np.array(line_numbers, np.int64))
        quick = _numbers_at_once(rows, layout.dialect, plain)
        columns: dict[int, Sequence[str]]
        if quick is not None:
            ragged.append(np.zeros(len(rows), np.bool_))
            for place, index in enumerate(plain):
                blocks[index].append(quick[:, place])
            columns = {index: _one_column(rows, layout.dialect, index) for index in rest}
        else:
            table = _split(path, line_numbers, rows, layout.dialect)
            ragged.append(_even_out(table, layout.dialect))
            _refuse_ragged(path, layout.dialect.width, at, ragged, final=False)
            columns = dict(enumerate(zip(*table, strict=True)))
        index = 0
        try:
            for index, cells in columns.items():
                if index in words:
                    words[index].read(cells)
                elif plan.clock and index == plan.time:
                    blocks[index].append(plan.clock.read(cells))
                else:
                    blocks[index].append(numbers(cells, layout.dialect.decimal))
        except NotANumberError as error:
            shown = error.cell if len(error.cell) <= 40 else error.cell[:37] + "..."
            raise InputError(
                f"{path}, line {line_numbers[error.index]}: {shown!r} in column "
                f"'{layout.columns[index].name}' is not a "
                f"{'stamp' if index == plan.time else 'number'}; mend the cell or empty it."
            ) from error
    _refuse_ragged(path, layout.dialect.width, at, ragged, final=True)
    values = {i: np.concatenate(block) for i, block in enumerate(blocks) if block}
    stamps = values.pop(plan.time, None) if plan.time is not None else None
    for index, column in list(words.items()):
        column.close()
        if layout.kinds[index] is Kind.MISSING and index != plan.label and not column.empty:
            # The head of the table, all that was known so far, left this column empty.
            with suppress(NotANumberError):
                values[index] = numbers(column.words, layout.dialect.decimal)[column.codes]
                del words[index]
    return Body(values, words, stamps, np.concatenate(at), np.concatenate(ragged))


def _split(
    path: Path, line_numbers: Sequence[int], rows: Sequence[str], dialect: Dialect
) -> list[list[str]]:
    """The cells of a block."""
    try:
        return dialect.split(rows)
    except ValueError as error:
        raise InputError(
            f"{path}: {error} between lines {line_numbers[0]} and {line_numbers[-1]}; a cell must "
            "end on the line on which it starts."
        ) from error


def _numbers_at_once(
    rows: list[str], dialect: Dialect, columns: Sequence[int]
) -> NDArray[np.float64] | None:
    """The columns of plain numbers of a block, read three times as fast as cell by cell.

    None where a cell is missing or quoted, a row is ragged, or decimal marks are commas.
    """
    mark, others = dialect.separator, len(columns) < dialect.width
    if dialect.decimal != "." or not columns or (others and mark is None):
        return None
    if mark and not all(row.count(mark) == dialect.width - 1 for row in rows):
        return None
    if any('"' in row for row in rows):
        return None
    try:
        table = np.loadtxt(
            rows,
            delimiter=mark,
            comments=None,
            ndmin=2,
            usecols=columns if others else None,
        )
    except ValueError:
        return None
    if table.shape != (len(rows), len(columns)):
        return None
    table[~np.isfinite(table)] = np.nan
    return table


def _one_column(rows: list[str], dialect: Dialect, index: int) -> list[str]:
    """The cells of one column of rows without quotes, split from the nearer end."""
    mark, behind = dialect.separator, dialect.width - 1 - index
    if behind < index:
        return [row.rsplit(mark, behind + 1)[-behind - 1] for row in rows]
    return [row.split(mark, index + 1)[index] for row in rows]


def _even_out(table: list[list[str]], dialect: Dialect) -> NDArray[np.bool_]:
    """Make all rows equally wide; mark those that needed more than spare separators dropped."""
    ragged = np.zeros(len(table), np.bool_)
    if set(map(len, table)) == {dialect.width}:
        return ragged
    for i, row in enumerate(table):
        while len(row) > dialect.width and not row[-1].strip():
            row.pop()
        if len(row) != dialect.width:
            ragged[i] = True
            table[i] = [""] * dialect.width
    return ragged


def _refuse_ragged(
    path: Path,
    width: int,
    at: Sequence[NDArray[np.int64]],
    ragged: Sequence[NDArray[np.bool_]],
    *,
    final: bool,
) -> None:
    """Refuse a table once too many of its rows are ragged."""
    if not ragged[-1].any() and not final:
        return
    total = sum(block.size for block in ragged)
    bad = sum(int(block.sum()) for block in ragged)
    if bad > max(1.0, _RAGGED_SHARE * total) and (final or total >= _RAGGED_ROWS):
        line = next(int(a[np.argmax(r)]) for a, r in zip(at, ragged, strict=True) if r.any())
        raise InputError(
            f"{path}, line {line}: {bad:,} of {total:,} rows do not have {width} cells as most "
            "have; export the table again with one separator between cells."
        )
