"""What a text table looks like before its rows are read: preamble, header, kinds of columns."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from forcelab.errors import InputError
from forcelab.formats.table.cells import Kind, kind_of
from forcelab.formats.table.columns import Column, is_index, is_unit, name_columns
from forcelab.formats.table.dialect import (
    HEAD,
    Dialect,
    Line,
    detect,
    encoding_of,
    head_lines,
    is_comment,
    lines,
)

__all__ = ["Layout", "lay_out", "survey"]

#: A column is numeric where at least this share of its words in the head are numbers; the others
#: are mistakes, named with their line when they are read.
_MOSTLY = 0.8
#: The names of the columns with which each table in a Vicon export begins.
_VICON = re.compile(r"\s*Frame\s*[,;\t]\s*Sub Frame\b", re.IGNORECASE)
#: How LabVIEW's measurement files begin, and how each of their headers ends.
_LABVIEW, _LABVIEW_END = "LabVIEW Measurement", "***End_of_Header***"


@dataclass(frozen=True, slots=True)
class Layout:
    """How a table is to be read.

    Parameters
    ----------
    dialect : Dialect
        Separator, decimal mark and width of its rows.
    columns : tuple of Column
        As many as the dialect is wide.
    kinds : tuple of Kind
        What each column holds in the sample; MISSING where nothing.
    skip : int
        Lines before the first row of data.
    sample : tuple of tuple of str
        The first rows of data, as cells.
    remarks : tuple of str
        On what stands before the data.
    rate : float or None
        Samples a second, where lines before the data tell them.
    sections : bool
        Whether a blank line ends the table, as what follows is another one.
    """

    dialect: Dialect
    columns: tuple[Column, ...]
    kinds: tuple[Kind, ...]
    skip: int
    sample: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...] = ()
    rate: float | None = None
    sections: bool = False

    def cells(self, index: int) -> list[str]:
        """The sample's cells of one column."""
        return [row[index] for row in self.sample]


def survey(path: Path) -> tuple[Layout, str]:
    """Find out how a table is written.

    Returns
    -------
    layout : Layout
        How to read it.
    encoding : str
        For :func:`forcelab.formats.table.dialect.lines`.

    Raises
    ------
    InputError
        If the file is empty, binary, or holds no table of numbers.
    """
    encoding = encoding_of(path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    rows = head_lines(head)
    if not rows:
        raise InputError(
            f"{path}: no line ends within its first {HEAD} bytes; a table needs one sample a line."
        )
    layout = lay_out(rows)
    if layout is None:
        raise InputError(
            f"{path} holds no rows of numbers in its first "
            f"{'line' if len(rows) == 1 else f'{len(rows)} lines'}; a table needs one sample a "
            "line, with the same number of cells in each."
        )
    if layout.dialect.separator != "," and not any(
        mark in cell for row in layout.sample for cell in row for mark in ".,"
    ):
        decimal = _first_decimal_mark(path, encoding, layout.skip)
        layout = replace(layout, dialect=replace(layout.dialect, decimal=decimal))
    return layout, encoding


def _first_decimal_mark(path: Path, encoding: str, skip: int) -> str:
    """The first mark between two digits, for a table that starts with whole numbers only."""
    for _, rows in lines(path, encoding, skip):
        for row in rows:
            mark = re.search(r"\d([.,])\d", row)
            if mark:
                return mark[1]
    return "."


def lay_out(rows: Sequence[Line]) -> Layout | None:
    """Find preamble, header and columns in the first lines of a file.

    Data starts at the first row that is as wide as most and holds more numbers than words where
    most rows hold numbers; a word there is a mistake, to be named when the rows are read.
    The line before it is the header if it is as wide and holds words there; so is a comment
    directly before it (``# time fx fy``). A line of units may stand between. All before is
    preamble.

    Parameters
    ----------
    rows : sequence of (int, str)
        Lines with their numbers, comments included.

    Returns
    -------
    Layout or None
        None if there are no rows of numbers.
    """
    rows = _first_section(rows)
    plain = [row for row in rows if not is_comment(row[1])]
    ends = [k for k, (_, text) in enumerate(plain) if text.startswith(_LABVIEW_END)]
    # The numbers in LabVIEW's headers tell nothing of the rows below.
    dialect = detect([text for _, text in plain[ends[-1] + 1 if ends else 0 :]])
    if dialect is None:
        return None
    table = dialect.split([text for _, text in plain])
    whole = [row for row in table if len(row) == dialect.width]
    kinds = _kinds(whole[len(whole) // 2 :], dialect)
    fits = [_is_data(row, kinds, dialect) for row in table]
    if True not in fits:
        return None
    first = fits.index(True)
    sample = tuple(tuple(row) for row, fit in zip(table, fits, strict=True) if fit)
    kinds = _kinds([row for row in table[first:] if len(row) == dialect.width], dialect)
    above = [line for line in rows if line[0] < plain[first][0] and line[1].strip()]
    labview = bool(above) and above[0][1].startswith(_LABVIEW)
    header, units, used = (
        _labview_header(above, dialect) if labview else _header(above, dialect, kinds, sample)
    )
    columns, remarks = name_columns(header or [""] * dialect.width, units)
    if not header:
        remarks = ("There is no header; the columns are called by their numbers.", *remarks)
    skipped = [line for line in above[: len(above) - used] if not is_comment(line[1])]
    if skipped:
        were = "line before the table was" if len(skipped) == 1 else "lines before the table were"
        remarks = (f"{len(skipped)} {were} skipped.", *remarks)
    vicon = _vicon_rate(above, header)
    rate = _labview_rate(above) if labview else vicon
    skip = plain[first][0] - 1
    return Layout(dialect, columns, kinds, skip, sample, remarks, rate, vicon is not None)


def _first_section(rows: Sequence[Line]) -> Sequence[Line]:
    """The lines without further tables, where they are those of a Vicon export."""
    names = (k for k, (_, text) in enumerate(rows[:10]) if _VICON.match(text))
    first = next(names, None)
    if first is None:
        return rows
    end = next((k for k in range(first, len(rows)) if not rows[k][1].strip(" ,;\t")), len(rows))
    return rows[:end]


def _vicon_rate(above: Sequence[Line], header: Sequence[str]) -> float | None:
    """The samples a second in a Vicon export, whose second line they are; else None."""
    if not {"frame", "sub frame"} <= {name.strip().lower() for name in header} or len(above) < 2:
        return None
    return _positive(above[1][1].strip(" ,;\t"))


def _labview_header(above: Sequence[Line], dialect: Dialect) -> tuple[list[str], list[str], int]:
    """As :func:`_header`, of a LabVIEW measurement: behind the headers' last end.

    The comments at the end of its rows have a name, but most rows have none.
    """
    last = max((i for i, line in enumerate(above) if line[1].startswith(_LABVIEW_END)), default=-1)
    if not 0 <= last < len(above) - 1:
        return [], [], 0
    names = dialect.split([above[last + 1][1]])[0]
    if len(names) < dialect.width:
        return [], [], 0
    rows = dialect.split([text for _, text in above])
    units = next((row for row in rows if row[:1] == ["Y_Unit_Label"]), [])
    units = [*units, *[""] * dialect.width][: dialect.width]
    names = ["time" if name.strip() == "X_Value" else name for name in names[: dialect.width]]
    units = ["s" if name == "time" else unit for name, unit in zip(names, units, strict=True)]
    return names, units, len(above) - last - 1


def _labview_rate(above: Sequence[Line]) -> float | None:
    """The samples a second of a LabVIEW measurement, for one that holds no times."""
    for _, text in above:
        words = text.split()
        if len(words) > 1 and words[0] == "Delta_X":
            step = _positive(words[1].replace(",", "."))
            return 1 / step if step else None
    return None


def _positive(text: str) -> float | None:
    """A number above zero that a clock may have, if the text is one."""
    if kind_of(text) is not Kind.NUMBER:
        return None
    number = float(text)
    return number if 1e-9 < number < 1e9 else None


def _kinds(rows: Sequence[Sequence[str]], dialect: Dialect) -> tuple[Kind, ...]:
    """What each column mostly holds."""
    result = []
    for cells in zip(*rows, strict=True):
        kinds = [kind_of(cell, dialect.decimal) for cell in cells]
        present = [kind for kind in kinds if kind is not Kind.MISSING]
        result.append(Kind.TEXT if present else Kind.MISSING)
        for kind in (Kind.NUMBER, Kind.STAMP):
            if present and present.count(kind) >= _MOSTLY * len(present):
                result[-1] = kind
    return tuple(result)


def _is_data(row: Sequence[str], kinds: Sequence[Kind], dialect: Dialect) -> bool:
    """Whether a row holds more numbers than words where most rows hold numbers."""
    if len(row) != len(kinds):
        return False
    found = [
        kind_of(cell, dialect.decimal)
        for cell, kind in zip(row, kinds, strict=True)
        if kind in (Kind.NUMBER, Kind.STAMP)
    ]
    return found.count(Kind.TEXT) < sum(kind in (Kind.NUMBER, Kind.STAMP) for kind in found)


def _header(
    above: Sequence[Line],
    dialect: Dialect,
    kinds: Sequence[Kind],
    sample: Sequence[Sequence[str]],
) -> tuple[list[str], list[str], int]:
    """Names, units and the number of lines they take, from the lines above the data."""
    split = [_header_cells(text, dialect, kinds, sample) for _, text in above]
    last = len(above) - 1
    while last >= 0 and not split[last] and is_comment(above[last][1]):
        last -= 1
    if last < 0 or not split[last]:
        return [], [], 0
    words = [cell.strip() for cell in split[last]]
    units = [word.strip("[](){}").strip() for word in words]
    if last > 0 and split[last - 1] and all(not unit or is_unit(unit) for unit in units):
        return split[last - 1], words, len(above) - last + 1
    return split[last], [], len(above) - last


def _header_cells(
    text: str, dialect: Dialect, kinds: Sequence[Kind], sample: Sequence[Sequence[str]]
) -> list[str]:
    """The cells of a line that can be a header, else none."""
    bare = re.sub(r"^\s*(?:#+|%+|//+)\s*", "", text)
    splits = [dialect]
    if dialect.separator is None:
        # Above rows separated by blanks, names often stand between commas or wider blanks.
        splits = [Dialect(",", ".", dialect.width), Dialect("\t", ".", dialect.width), dialect]
        bare = re.sub(r"\s{2,}", "\t", bare.strip())
    for candidate in splits:
        try:
            cells = candidate.split([bare])[0]
        except ValueError:
            continue
        spare = len(cells) - dialect.width
        if spare == 1 and not cells[-1].strip():
            cells = cells[:-1]
        elif spare == -1 and not any(row[-1].strip() for row in sample):
            cells = [*cells, ""]
        elif spare == -1 and is_index(Column("", named=False), [row[0] for row in sample]):
            cells = ["", *cells]  # as R writes row numbers
        if _are_names(cells, dialect, kinds):
            return cells
    return []


def _are_names(cells: Sequence[str], dialect: Dialect, kinds: Sequence[Kind]) -> bool:
    """Whether cells stand one above each column, and hold no number above numbers."""
    if len(cells) != dialect.width or not any(cell.strip() for cell in cells):
        return False
    return all(
        kind is Kind.TEXT or kind_of(cell, dialect.decimal) in (Kind.TEXT, Kind.MISSING)
        for cell, kind in zip(cells, kinds, strict=True)
    )
