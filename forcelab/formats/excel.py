"""Excel workbooks: each sheet that holds a table is a demonstration.

A sheet is read as the text that it would be as CSV, so that headers, units, times and labels are
found by the same rules (:mod:`~forcelab.formats.table`).
"""

from __future__ import annotations

import re
import warnings
import zipfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import datetime, time, timedelta
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final

from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats import boris
from forcelab.formats.label_tables import is_label_table
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import names_in_zip, naming_damage
from forcelab.formats.table import make_recordings, preview_layout, read_rows
from forcelab.formats.table_columns import choose_roles
from forcelab.formats.table_sniff import HEAD, Layout, Line, find_layout, is_comment
from forcelab.jobs import Progress

_WORKBOOK: Final = "xl/workbook.xml"
#: Rows looked at to find out how a sheet is filled, and rows read at a time.
_SAMPLE_ROWS, _BLOCK_ROWS = 400, 1 << 12
#: Rows of a sheet at most.
_MOST_ROWS: Final = 1 << 20
#: Columns up to which a sheet is believed what it says of its width.
_MOST_COLUMNS: Final = 256
#: Bytes, and times its packed size, that a part may always unpack to.
_ROOM, _MOST_TIMES = 1 << 25, 100
_CURE: Final = "open it in Excel or LibreOffice and save it again"


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is a workbook, whatever it is called."""
    return head.startswith(b"PK\x03\x04") and _WORKBOOK in names_in_zip(path)


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read each sheet that holds a table; called like the file, and the sheet if there are several.

    A sheet that cannot be read is left out with a remark if another one can, unless the options
    are strict.
    """
    recordings: list[Recording] = []
    failures: list[InputError] = []
    with _open(path) as book:
        layouts, left = _tables(path, book, options)
        for title, layout in layouts.items():
            name = path.stem if len(layouts) == 1 else f"{path.stem} {title}"
            try:
                roles = choose_roles(layout, options)
                rows = _blocks(_lines(book[title], layout.dialect.width), layout.skip)
                # What a sheet says of its size need not be true.
                table = yield from read_rows(layout, roles, rows, letters=0)
                recordings += make_recordings(name, table, options)
            except InputError as error:
                failures.append(error)
                left.append(f"Sheet '{title}' was left out: {error}")
    if failures and (options.strict or not recordings):
        raise failures[0]
    recordings[0] = replace(recordings[0], remarks=(*recordings[0].remarks, *left))
    return recordings


def _has_times(layout: Layout, options: ReadOptions) -> bool:
    """Whether the times of a sheet's rows are known, as far as its columns are those chosen."""
    try:
        time = choose_roles(layout, options).time
    except InputError:
        return False
    return time is not None or options.rate is not None or layout.rate is not None


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the columns of the first sheet that is read would be read as."""
    with _open(path) as book:
        layouts, _ = _tables(path, book, options)
    return preview_layout(next(iter(layouts.values())), options)


def _tables(path: Path, book: Any, options: ReadOptions) -> tuple[dict[str, Layout], list[str]]:
    """How each sheet to read is filled, by its title, and remarks on the others."""
    layouts: dict[str, Layout] = {}
    left: list[str] = []
    labels = ""  # the first sheet that holds some
    for sheet in book.worksheets:
        lines = list(islice(_lines(sheet, min(sheet.max_column or 0, _MOST_COLUMNS)), _SAMPLE_ROWS))
        layout = find_layout(lines, separators=("\t",))
        head = "\n".join(text for _, text in lines).encode()[:HEAD]
        events = boris.sniff_labels(path, head)
        if events or is_label_table(head):
            kind = "events of BORIS" if events else "labels (start, end, action)"
            labels = labels or f"Sheet '{sheet.title}' of '{path}' holds {kind}"
            left.append(f"Sheet '{sheet.title}' holds {kind} and was left out.")
        elif layout is not None:
            layouts[sheet.title] = layout
        elif lines:
            left.append(f"Sheet '{sheet.title}' holds no rows of numbers and was left out.")
    if labels and not layouts:
        raise InputError(
            f"{labels}, not a recording; save it as CSV or TSV, import the recording, then that "
            f"file as its labels (forcelab labels; in the window File > Import labels)."
        )
    if not layouts:
        raise InputError(
            f"'{path}' holds no sheet with rows of numbers; a table needs one sample a row."
        )
    timed = [title for title, layout in layouts.items() if _has_times(layout, options)]
    left += [
        f"Sheet '{title}' lacks the columns of a recording and was left out."
        for title in layouts
        if title not in timed
    ]
    read = timed or list(layouts)
    paths = [path / re.sub(r"[/\\:]", "_", title) for title in read] if len(read) > 1 else [path]
    return {
        title: replace(layouts[title], path=place, line="row")
        for title, place in zip(read, paths, strict=True)
    }, left


def _lines(sheet: Any, width: int) -> Iterator[Line]:
    """The rows of a sheet that are not empty, with their numbers, as lines of text.

    They have at least so many cells; a row of a sheet ends with the last one that is filled.
    """
    # What a sheet says of its size need not be true, and would be filled with empty rows.
    sheet.reset_dimensions()
    rows = enumerate(sheet.iter_rows(values_only=True), start=1)
    first = list(islice(rows, _SAMPLE_ROWS))
    width = max([width, *(len(row) for _, row in first)])
    for number, row in chain(first, rows):
        if number > _MOST_ROWS:
            raise ValueError(f"more than {_MOST_ROWS:,} rows in a sheet")
        cells = [_cell(value) for value in row]
        if any(cells):
            yield number, "\t".join(cells + [""] * (width - len(cells)))


def _cell(value: object) -> str:
    """What stands in a cell, as it would in a text table."""
    if isinstance(value, timedelta):
        value = value.total_seconds()
    if isinstance(value, bool | int | float):
        return repr(+value).removesuffix(".0")
    if isinstance(value, datetime | time):
        return value.isoformat()
    text = " ".join(str("" if value is None else value).split())
    return '"' + text.replace('"', '""') + '"' if '"' in text else text


def _blocks(lines: Iterator[Line], skip: int) -> Iterator[tuple[list[int], list[str]]]:
    """The rows behind the first ones, block by block."""
    while block := list(islice(lines, _BLOCK_ROWS)):
        rows = [(number, text) for number, text in block if number > skip and not is_comment(text)]
        if rows:
            yield [number for number, _ in rows], [text for _, text in rows]


@contextmanager
def _open(path: Path) -> Iterator[Any]:
    """The library's workbook, read as far as it is asked for."""
    load_extra("openpyxl", "excel", f"'{path}' is an Excel workbook, which")
    from openpyxl import load_workbook

    with naming_damage(path, "workbook", _CURE), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of styles and dates that mean nothing here
        _check_unpacked_size(path)
        # The library leaves a file open that it cannot read.
        with path.open("rb") as file:
            yield load_workbook(file, read_only=True, data_only=True, keep_links=False)


def _check_unpacked_size(path: Path) -> None:
    """Refuse parts that a small file cannot hold; no more is unpacked than is stated."""
    with zipfile.ZipFile(path) as archive:
        for part in archive.infolist():
            if part.file_size > max(_ROOM, _MOST_TIMES * part.compress_size):
                raise InputError(
                    f"'{path}': '{part.filename}' has {part.compress_size:,} bytes and unpacks to "
                    f"{part.file_size:,}, which no sheet does; {_CURE}."
                )
