"""How a text table is written: encoding, separator, decimal mark, header, kinds of columns.

Lines are rows: a quoted cell may hold separators but no line break. Lines that are blank or
start with ``#``, ``%`` or ``//`` are comments.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import Enum
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.text import listed, unique_names

#: Words, in lower case, that stand for a missing sample.
MISSING = (
    frozenset(["", "nan", "+nan", "-nan", "na", "n/a", "<na>", "null", "none", "nil"])
    | {"-", "--", "?", "inf", "+inf", "-inf", "infinity", "+infinity", "-infinity"}
    | {"#n/a", "#num!", "#div/0!", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#qnan"}
    | {"1.#ind", "-1.#ind", "1.#inf", "-1.#inf"}
)

_POINT_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_COMMA_NUMBER = re.compile(r"[+-]?(?:\d+(?:,\d+)?|,\d+)(?:[eE][+-]?\d+)?", re.ASCII)

#: ISO 8601 date and time, also as rosbag_to_csv writes it (2024/05/31/12:00:00), one with its day
#: first and points (31.05.2024 12:00:00), or a time of the day alone, in 24 hours or with AM or PM,
#: before which some write a narrow blank, or one that has passed, as pandas writes it (0 days
#: 00:00:01.5). Of the named groups the date's are either all of one of the two or none.
STAMP = re.compile(
    r"(?:(?P<year>\d{4})[-/](?P<month>\d\d?)[-/](?P<day>\d\d?)(?:[T/]|\s+)"
    r"|(?P<first_day>\d\d?)\.(?P<then_month>\d\d?)\.(?P<last_year>\d{4}),?\s+"
    r"|(?P<days>\d+) days? )?"
    r"(?P<hour>\d\d?):(?P<minute>\d\d)(?::(?P<second>\d\d)(?:[.,](?P<fraction>\d+))?)?"
    r"(?:[\s\u00a0\u202f]*(?P<half>[AP])\.?M\.?)?\s*(?P<zone>Z|UTC|[+-]\d\d(?::?\d\d)?)?",
    re.ASCII | re.IGNORECASE,
)


class CellType(Enum):
    """What a cell, or most cells of a column, hold."""

    NUMBER = "number"
    STAMP = "stamp"
    MISSING = "missing"
    TEXT = "text"


#: What rows of data hold, unlike those of headers.
DATA = (CellType.NUMBER, CellType.STAMP)


class NotANumberError(ValueError):
    """The cell at this index of a column holds neither a number nor a word for a missing sample."""

    def __init__(self, index: int, cell: str) -> None:
        super().__init__(cell)
        self.index = index
        self.cell = cell


def cell_type(cell: str, decimal: str = ".") -> CellType:
    """Tell what a cell holds, where `decimal` is the decimal mark (``"."`` or ``","``)."""
    cell = cell.strip()
    if cell.lower() in MISSING:
        return CellType.MISSING
    if (_COMMA_NUMBER if decimal == "," else _POINT_NUMBER).fullmatch(cell):
        return CellType.NUMBER
    return CellType.STAMP if STAMP.fullmatch(cell) else CellType.TEXT


def numbers(cells: Sequence[str], decimal: str = ".") -> NDArray[np.float64]:
    """Read a column of cells as the nearest float64 numbers.

    NaN where a cell is empty, a word for a missing sample, infinity or a number beyond float64.
    """
    # float() alone would also take "1_000", and a point where the decimal mark is a comma.
    foreign = "_" if decimal == "." else "_."
    joined = "".join(cells)
    values = None
    if not any(mark in joined for mark in foreign):
        plain = cells if decimal == "." else [cell.replace(",", ".") for cell in cells]
        with suppress(ValueError):  # the careful way below tells missing samples from mistakes
            values = np.fromiter(map(float, plain), np.float64, len(plain))
    if values is None:
        values = np.array([_number(i, cell.strip(), decimal) for i, cell in enumerate(cells)])
    values[~np.isfinite(values)] = np.nan
    return values


def _number(index: int, cell: str, decimal: str) -> float:
    """One number, NaN for a missing sample."""
    kind = cell_type(cell, decimal)
    if kind is CellType.NUMBER:
        return float(cell.replace(",", "."))
    if kind is CellType.MISSING:
        return np.nan
    raise NotANumberError(index, cell)


#: Time units as they are written in headers, and how many of each make a second.
SECONDS_IN = {
    **dict.fromkeys(["s", "sec", "secs", "second", "seconds", "sekunden"], 1),
    **dict.fromkeys(["ms", "msec", "msecs", "millis", "millisecond", "milliseconds"], 1_000),
    **dict.fromkeys(["us", "usec", "usecs", "micros", "microsecond", "microseconds"], 1_000_000),
    **dict.fromkeys(["µs", "μs"], 1_000_000),
    **dict.fromkeys(["ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"], 1_000_000_000),
    **dict.fromkeys(["min", "minutes", "minuten"], 1 / 60),
    **dict.fromkeys(["h", "hours", "stunden"], 1 / 3600),
}
#: Of these none says by itself that a column holds stamps: distances, minima and heights.
_NO_NAMES = frozenset(["s", "min", "h"])

_TOKEN = (
    r"(?:(?:da|[kMGmcdnpµμu])?(?:N|gf|g|m|s|V|A|W|J|T|G|Pa|Hz|bar|Nm|Nmm|rad|deg|dps)"
    r"|[Nn]ewtons?|kp|lbf?|oz|°|°C|°F|%|min|h|°/s|C|K|in|ft|inch|psi|gauss|counts?|lsb|raw|px|dB"
    r"|a\.?u\.?|-)"
)
_UNIT = re.compile(rf"{_TOKEN}(?:\^?-?\d|²|³|⁻¹|⁻²)?(?:[ */·.]{_TOKEN}(?:\^?-?\d|²|³|⁻¹|⁻²)?)*")
_BRACKETS = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})\s*")
_SLASH = re.compile(r"(.+?)\s*/\s*(\S+)")

_TIME_WORD = re.compile(
    r"times?|timestamps?|stamp|t|ts|zeit|zeitstempel|uhrzeit|temps|heure|tiempo|hora|tempo|ora|clock"
    r"|epoch|unix(time)?|datetime|elapsed"
)
_TIME_PREFIX = re.compile(
    r"elapsed|sensor|sample|recording|record|system|sys|unix|epoch|rel|relative|abs|absolute|host"
    r"|device|local|utc|gps|ros|rosbag|header|field|stamp|time|date|datum"
)
#: In order of preference.
_LABEL_WORDS = (
    *("label", "labels", "action", "actions", "activity", "annotation", "annotations", "phase"),
    *("class", "tag", "tags", "behaviour", "behavior", "gesture"),
)
_INDEX_WORDS = frozenset(
    ["index", "idx", "unnamed", "row", "frame", "sample", "no", "nr", "seq", "id"]
)


@dataclass(frozen=True, slots=True)
class Column:
    name: str  #: unique within its table
    unit: str = ""  #: empty if unknown
    named: bool = True  #: others are called by their number


def is_unit(text: str) -> bool:
    """Whether a text reads as a physical or a time unit, such as ``m/s^2`` or ``msec``."""
    text = text.strip()
    return text.lower() in SECONDS_IN or _UNIT.fullmatch(text) is not None


def _name_and_unit(cell: str) -> tuple[str, str]:
    """Split ``Fx [N]``, ``time (ms)``, ``t/s`` into a name and a unit."""
    cell = cell.strip()
    for match in (_BRACKETS.fullmatch(cell), _SLASH.fullmatch(cell)):
        name, *units = match.groups("") if match else ("", "")
        unit = "".join(units).strip()  # which stands in brackets of one kind
        if name and is_unit(unit):
            return name, unit
    return cell, ""


def name_columns(
    header: Sequence[str], units: Sequence[str] = ()
) -> tuple[tuple[Column, ...], tuple[str, ...]]:
    """Make columns of the cells of a header and of the line of units below it, with remarks.

    A blank name becomes ``column 3``, a repeated one gets a number behind it (``fx 2``).
    """
    split = [_name_and_unit(cell) for cell in header]
    below = [unit.strip().strip("[](){}").strip() for unit in units] or [""] * len(split)
    names = unique_names([name or f"column {i}" for i, (name, _) in enumerate(split, start=1)])
    columns = tuple(
        Column(new, unit or lower, named=bool(name))
        for new, (name, unit), lower in zip(names, split, below, strict=True)
    )
    renamed = [
        f"'{new}' (column {number})"
        for number, (new, (name, _)) in enumerate(zip(names, split, strict=True), start=1)
        if name and new != name
    ]
    remark = f"Columns that repeat a name were renamed: {listed(renamed)}."
    return columns, (remark,) if renamed else ()


def spaced(name: str) -> str:
    """A name with its words apart, where capitals part them."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip())


def _words(name: str) -> list[str]:
    """The words of a name in lower case: ``sensorTime_ms`` is sensor, time, ms."""
    return [word for word in re.split(r"[\W_]+", spaced(name).lower()) if word]


def is_time_name(name: str) -> bool:
    """Whether a column's name says that it holds stamps, such as ``t``, ``time_ms``, ``Zeit``."""
    words = _words(name)
    if len(words) > 1 and (words[-1] in SECONDS_IN or words[-1].isdecimal()):
        words.pop()
    if len(words) == 1 and words[0] in SECONDS_IN.keys() - _NO_NAMES:
        return True
    return bool(
        words
        and _TIME_WORD.fullmatch(words[-1])
        and all(_TIME_PREFIX.fullmatch(word) for word in words[:-1])
    )


def unit_of_time(column: Column) -> str:
    """The time unit that a column's header names, in lower case; empty where it names none."""
    words = _words(column.name)
    for text in (column.unit.lower(), words[-1] if words else ""):
        if text in SECONDS_IN and not (text in _NO_NAMES and text == column.name.lower()):
            return text
    return ""


def is_label_name(name: str) -> int:
    """Rank of a name that says that its column holds labels, 1 for the surest; 0 for others."""
    words = _words(name)
    if not words or len(words) > 2:
        return 0
    if words[-1] in {"id", "name", "names"} and len(words) == 2:
        words.pop()
    return _LABEL_WORDS.index(words[-1]) + 1 if words[-1] in _LABEL_WORDS else 0


def is_index(
    column: Column, cells: Sequence[str], values: NDArray[np.float64] | None = None
) -> bool:
    """Whether a column only counts its rows: nameless or called so, and whole numbers in step.

    `cells` are its first ones; all its `values` must go on so. In one that is called so rows may
    have been taken out since; without a name, what does not go on by one measures something.
    """
    named = column.named and not _INDEX_WORDS.intersection(_words(column.name))
    if named or len(cells) < 3:
        return False
    if not all(cell_type(cell) is CellType.NUMBER and cell.strip().isdigit() for cell in cells):
        return False
    counts = [int(cell) for cell in cells]
    if counts != list(range(counts[0], counts[0] + len(counts))):
        return False
    steps = np.diff([] if values is None else values[~np.isnan(values)])
    return bool((steps > 0).all() if column.named else (steps == 1).all())


def find_column(columns: Sequence[Column], text: str, role: str, where: str) -> int:
    """The index of a column by its name, whatever its case and unit, else by 1-based number."""
    names = [column.name for column in columns]
    folded = [name.casefold() for name in names]
    bare = _name_and_unit(text)[0]
    for known, name in ((names, text), (names, bare), (folded, bare.casefold())):
        if name in known:
            return known.index(name)
    if text.strip().isdecimal() and 1 <= int(text) <= len(columns):
        return int(text) - 1
    raise InputError(
        f"{where} has no column '{text}' of {role}; name one of {', '.join(names)}, "
        f"or give a number from 1 to {len(columns)}."
    )


#: Bytes looked at to find out how a table is written; no line may be longer.
HEAD = 65_536

#: Lines looked at to find out how a table is written.
_SAMPLE_LINES = 400

#: Tried in this order; of separators that explain the lines equally well the first is taken.
#: None stands for any run of blanks.
_SEPARATORS: tuple[str | None, ...] = ("\t", ";", ",", "|", None)

_BLOCK = 1 << 20
_COMMENT = re.compile(r"\s*(?:$|#|%|//)")
_QUOTED = re.compile(r'"(?:[^"]|"")*"|\S+')
#: Control characters that no text file holds; tab, line ends, form feed and Ctrl-Z are no sign.
_BINARY = re.compile(rb"[\x00-\x08\x0e-\x19\x1c-\x1f]")
_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)

#: A line of a file with its 1-based number.
Line = tuple[int, str]


@dataclass(frozen=True, slots=True)
class Dialect:
    """How the rows of a table are written."""

    separator: str | None  #: None: any run of blanks
    decimal: str  #: the decimal mark, "." or ","
    width: int  #: cells in a row

    def split(self, rows: Sequence[str]) -> list[list[str]]:
        """Split rows into cells; a ValueError if a quoted cell does not end on its line."""
        mark = self.separator
        if mark is None:
            if not any('"' in row for row in rows):
                return [row.split() for row in rows]
            cells = ([re.sub(r'^"(.*)"$', r"\1", c) for c in _QUOTED.findall(row)] for row in rows)
            return [[cell.replace('""', '"') for cell in row] for row in cells]
        try:
            table = list(csv.reader(rows, delimiter=mark, skipinitialspace=mark != "\t"))
        except csv.Error as error:
            raise ValueError(str(error)) from error
        if len(table) != len(rows):
            raise ValueError("a quote is not closed")
        return table


def encoding_of(path: Path) -> str:
    """Tell the encoding of a text file by its byte order mark, else by what it holds.

    Without a mark it is UTF-16 where every other byte of the head is zero, UTF-8 where the whole
    file is valid UTF-8, and Latin-1 otherwise. A file that is empty or no text is refused.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
        if not head:
            raise InputError(f"{path} is empty (0 bytes); record or export it again.")
        encoding = _wide(head)
        if encoding:
            return encoding
        encoding = "utf-8-sig" if head.startswith(codecs.BOM_UTF8) else "utf-8"
        decoder = codecs.getincrementaldecoder("utf-8")()
        offset, block = 0, head
        while True:
            if binary := _BINARY.search(block):
                raise InputError(
                    f"{path} is not a text table: byte {offset + binary.start()} is "
                    f"0x{block[binary.start()]:02x}; export it as CSV."
                )
            try:
                if encoding != "latin-1":
                    decoder.decode(block, final=not block)
            except UnicodeDecodeError:
                encoding = "latin-1"
            if not block:
                return encoding
            offset += len(block)
            block = file.read(_BLOCK)


def _wide(head: bytes) -> str | None:
    """The encoding if it is a 16-bit one."""
    if head.startswith(_WIDE_MARKS):
        return "utf-16"
    pairs = head[: len(head) // 2 * 2]
    if len(pairs) >= 8:
        if not any(pairs[:512:2]) and all(pairs[1:512:2]):
            return "utf-16-be"
        if not any(pairs[1:512:2]) and all(pairs[:512:2]):
            return "utf-16-le"
    return None


def head_lines(head: bytes) -> list[Line]:
    """The lines of a file's first :data:`HEAD` bytes, or none if they are not text.

    A last line that the head cuts off is left out, and nothing stands behind the last line end.
    """
    encoding = _wide(head)
    if not is_text(head):
        return []
    if encoding is None:
        encoding = "utf-8-sig"
        try:
            codecs.getincrementaldecoder(encoding)().decode(head)
        except UnicodeDecodeError:
            encoding = "latin-1"
    text = head.decode(encoding, errors="ignore").replace("\r\n", "\n").replace("\r", "\n")
    rows = text.split("\n")
    if len(head) >= HEAD or (len(rows) > 1 and not rows[-1]):
        rows.pop()
    return list(enumerate(rows[:_SAMPLE_LINES], start=1))


def is_text(head: bytes) -> bool:
    """Whether the start of a file holds no byte that text never holds."""
    return _wide(head) is not None or not _BINARY.search(head)


def is_comment(line: str) -> bool:
    """Whether a line is blank or starts with a comment mark."""
    return _COMMENT.match(line) is not None


def lines(
    path: Path, encoding: str, skip: int, *, sections: bool = False
) -> Iterator[tuple[list[int], list[str]]]:
    """Read a file's rows in blocks of about a megabyte: 1-based line numbers, and lines.

    Blank lines, comments and the first `skip` lines are left out. With `sections` the first blank
    line after those is the end.
    """
    number, rest = 1, ""
    try:
        with path.open(encoding=encoding) as file:
            while True:
                block = file.read(_BLOCK)
                rows = (rest + block).split("\n")
                rest = rows.pop() if block else ""
                if len(rest) > HEAD:
                    raise InputError(
                        f"{path}, line {number + len(rows)} is longer than {HEAD} characters; "
                        "a table needs one sample a line."
                    )
                end = _first_blank(rows, max(0, skip + 1 - number)) if sections else None
                if end is not None:
                    del rows[end:]
                # Letters and digits come after the slash; most rows need no closer look.
                line_numbers = [
                    k
                    for k, row in enumerate(rows, number)
                    if k > skip and (row[:1] > "/" or not is_comment(row))
                ]
                if line_numbers:
                    yield line_numbers, [rows[k - number] for k in line_numbers]
                if not block or end is not None:
                    return
                number += len(rows)
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path} cannot be decoded as {encoding} after line {number}; save it as UTF-8."
        ) from error


def _first_blank(rows: Sequence[str], first: int) -> int | None:
    """The index of the first row from one on that holds nothing, if there is any."""
    return next((k for k in range(first, len(rows)) if not rows[k].strip(" ,;\t\r")), None)


def detect(rows: Sequence[str], separators: Sequence[str | None] = _SEPARATORS) -> Dialect | None:
    """The separator and decimal mark that explain most cells as numbers or stamps, if any do."""
    best: tuple[tuple[int, int], Dialect] | None = None
    for separator in separators:
        if separator and len(separators) > 1 and not any(separator in row for row in rows):
            continue
        if separator is None and best and best[1].separator == "\t":
            continue  # blanks between tabs are in names and labels
        try:
            table = Dialect(separator, ".", 0).split(rows)
        except ValueError:
            continue
        # Where commas separate, only a quoted cell can hold a decimal comma.
        quoted = any('"' in row for row in rows)
        for decimal in ".," if separator != "," or quoted else ".":
            explained = _explain(table, separator, decimal)
            if explained and (best is None or explained[0] > best[0]):
                best = explained
    return best[1] if best else None


def _explain(
    table: Sequence[Sequence[str]], separator: str | None, decimal: str
) -> tuple[tuple[int, int], Dialect] | None:
    """The dialect of the row width with most numbers, and (its numbers, minus its words).

    Words count in the second half only, where there is no header.
    """
    data_cells: Counter[int] = Counter()
    text_cells: Counter[int] = Counter()
    for place, row in enumerate(table):
        kinds = [cell_type(cell, decimal) for cell in row]
        if separator == "\t" and _numbers_between_blanks(row, kinds, decimal):
            return None
        data_cells[len(row)] += sum(map(kinds.count, DATA))
        text_cells[len(row)] += kinds.count(CellType.TEXT) if 2 * place >= len(table) else 0
    if not data_cells:
        return None
    rows = Counter(map(len, table))
    width, score = max(data_cells.items(), key=lambda item: (item[1], rows[item[0]]))
    return ((score, -text_cells[width]), Dialect(separator, decimal, width)) if score else None


def _numbers_between_blanks(row: Sequence[str], kinds: Sequence[CellType], decimal: str) -> bool:
    """Whether a row has cells that are no numbers only because blanks separate, too."""
    return any(
        all(cell_type(part, decimal) is CellType.NUMBER for part in cell.split())
        for cell, kind in zip(row, kinds, strict=True)
        if kind is CellType.TEXT
    )


#: A column is numeric where at least this share of its words in the head are numbers; the others
#: are mistakes, named with their line when they are read.
_MOSTLY = 0.8
#: The names of the columns with which each table in a Vicon export begins.
_VICON = re.compile(r"\s*Frame\s*[,;\t]\s*Sub Frame\b", re.IGNORECASE)
#: How LabVIEW's measurement files begin, and how each of their headers ends.
_LABVIEW, _LABVIEW_END = "LabVIEW Measurement", "***End_of_Header***"
#: How the header of OpenSim's files (MOT, STO) ends, and the units of what is called so there.
_OPENSIM_END = "endheader"
_OPENSIM_UNITS = (
    (re.compile(r".*force.*_v[xyz]", re.IGNORECASE), "N"),
    (re.compile(r".*force.*_p[xyz]", re.IGNORECASE), "m"),  # where it acts
    (re.compile(r".*(?:torque|moment).*_m?[xyz]", re.IGNORECASE), "Nm"),
)


@dataclass(frozen=True, slots=True)
class Layout:
    """How a table is to be read."""

    dialect: Dialect
    columns: tuple[Column, ...]
    kinds: tuple[CellType, ...]  #: what each column holds in the sample; MISSING where nothing
    skip: int  #: lines before the first row of data
    sample: tuple[tuple[str, ...], ...]  #: the first rows of data, as cells
    remarks: tuple[str, ...] = ()  #: on what stands before the data
    rate: float | None = None  #: samples a second, where lines before the data tell them
    sections: bool = False  #: a blank line ends the table, and another one follows
    path: Path = Path()  #: the file, where all of it was looked at
    line: str = "line"  #: what the number of a row counts, as in "line 5"
    encoding: str = ""

    def cells(self, index: int) -> list[str]:
        """The sample's cells of one column."""
        return [row[index] for row in self.sample]


def sniff_layout(path: Path) -> Layout:
    """Find out how a table is written, and its encoding."""
    encoding = encoding_of(path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    rows = head_lines(head)
    if not rows:
        raise InputError(
            f"{path}: no line ends within its first {HEAD} bytes; a table needs one sample a line."
        )
    layout = find_layout(rows)
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
    return replace(layout, path=path, encoding=encoding)


def _first_decimal_mark(path: Path, encoding: str, skip: int) -> str:
    """The first mark between two digits, for a table that starts with whole numbers only."""
    rows = chain.from_iterable(rows for _, rows in lines(path, encoding, skip))
    marks = (re.search(r"\d([.,])\d", row) for row in rows)
    return next((mark[1] for mark in marks if mark), ".")


def find_layout(
    rows: Sequence[Line], separators: Sequence[str | None] = _SEPARATORS
) -> Layout | None:
    """Find preamble, header and columns in a file's first lines; None without rows of numbers.

    Data starts at the first row that is as wide as most and holds more numbers than words where
    most rows hold numbers; a word there is a mistake, to be named when the rows are read. The line
    before it is the header if it is as wide and holds words there; so is a comment directly before
    it (``# time fx fy``). A line of units may stand between. All before is preamble.
    """
    rows, rate = _vicon_table(rows)
    sections = rate is not None
    plain = [row for row in rows if not is_comment(row[1])]
    # The numbers and quotes in headers of LabVIEW and Vicon tell nothing of the rows below.
    below = [
        k + text.startswith(_LABVIEW_END)
        for k, (_, text) in enumerate(plain)
        if text.startswith(_LABVIEW_END) or _VICON.match(text)
    ]
    plain = plain[below[-1] if below else 0 :]
    texts = [text for _, text in plain]
    dialect = detect(texts, separators)
    if dialect is None:
        return None
    table = dialect.split(texts)
    complete = [row for row in table if len(row) == dialect.width]
    kinds = column_kinds(complete[len(complete) // 2 :], dialect)
    fits = [_is_data(row, kinds, dialect) for row in table]
    if True not in fits:
        return None
    first = fits.index(True)
    sample = tuple(tuple(row) for row, fit in zip(table, fits, strict=True) if fit)
    kinds = column_kinds([row for row in table[first:] if len(row) == dialect.width], dialect)
    above = [line for line in rows if line[0] < plain[first][0] and line[1].strip()]
    if above and above[0][1].startswith(_LABVIEW):
        header, units, used, rate = _labview_header(above, dialect)
    elif _VICON.match(plain[0][1]) and first == 2 and len(table[0]) == len(table[1]) == len(kinds):
        header, units, used = table[0], table[1], 2  # some channels are called by a number
    else:
        header, units, used = _header(above, dialect, kinds, sample)
        if not units and any(text.strip() == _OPENSIM_END for _, text in above):
            units = [_opensim_unit(name) for name in header]
    columns, remarks = name_columns(header or [""] * dialect.width, units)
    if not header:
        remarks = ("There is no header; the columns are called by their numbers.", *remarks)
    skipped = [line for line in above[: len(above) - used] if not is_comment(line[1])]
    if skipped:
        were = "line before the table was" if len(skipped) == 1 else "lines before the table were"
        remarks = (f"{len(skipped)} {were} skipped.", *remarks)
    skip = plain[first][0] - 1
    return Layout(dialect, columns, kinds, skip, sample, remarks, rate, sections)


def _vicon_table(rows: Sequence[Line]) -> tuple[Sequence[Line], float | None]:
    """Of a Vicon export the lines of its first table, and its samples a second.

    They are the number nearest above its names: before it there may be one of events, with the
    frames a second of the cameras.
    """
    first = next((k for k, (_, text) in enumerate(rows) if _VICON.match(text)), None)
    if first is None:
        return rows, None
    texts = [text for _, text in rows]
    rates = (_positive(text.strip(" ,;\t")) for text in reversed(texts[:first]))
    rate = next(filter(None, rates), None)
    return rows[: _first_blank(texts, first)], rate


def _labview_header(
    above: Sequence[Line], dialect: Dialect
) -> tuple[list[str], list[str], int, float | None]:
    """As :func:`_header`, of a LabVIEW measurement: behind the headers' last end.

    Also its samples a second, for one that holds no times. The comments at the end of its rows have
    a name, but most rows have none.
    """
    rows = [text.split(dialect.separator) for _, text in above]
    settings = {row[0]: row for row in rows if len(row) > 1}
    step = _positive(settings.get("Delta_X", ["", ""])[1].replace(",", "."))
    rate = 1 / step if step else None
    last = max((i for i, line in enumerate(above) if line[1].startswith(_LABVIEW_END)), default=-1)
    names = rows[last + 1] if 0 <= last < len(above) - 1 else []
    if len(names) < dialect.width:
        return [], [], 0, rate
    units = [*settings.get("Y_Unit_Label", []), *[""] * dialect.width][: dialect.width]
    names = ["time" if name.strip() == "X_Value" else name for name in names[: dialect.width]]
    units = ["s" if name == "time" else unit for name, unit in zip(names, units, strict=True)]
    return names, units, len(above) - last - 1, rate


def _opensim_unit(name: str) -> str:
    """The unit of a force, of where it acts or of a torque, by its name; empty of all else."""
    return next((unit for names, unit in _OPENSIM_UNITS if names.fullmatch(name.strip())), "")


def _positive(text: str) -> float | None:
    """A number above zero that a clock may have, if the text is one."""
    if cell_type(text) is not CellType.NUMBER:
        return None
    number = float(text)
    return number if 1e-9 < number < 1e9 else None


def column_kinds(rows: Sequence[Sequence[str]], dialect: Dialect) -> tuple[CellType, ...]:
    """What each column mostly holds."""
    kinds = []
    for cells in zip(*rows, strict=True):
        counts = Counter(cell_type(cell, dialect.decimal) for cell in cells)
        present = len(cells) - counts[CellType.MISSING]
        mostly = (kind for kind in DATA if counts[kind] >= _MOSTLY * present)
        kinds.append(next(mostly, CellType.TEXT) if present else CellType.MISSING)
    return tuple(kinds)


def _is_data(row: Sequence[str], kinds: Sequence[CellType], dialect: Dialect) -> bool:
    """Whether a row holds more numbers than words where most rows hold numbers."""
    if len(row) != len(kinds):
        return False
    pairs = zip(row, kinds, strict=True)
    found = [cell_type(cell, dialect.decimal) for cell, kind in pairs if kind in DATA]
    return found.count(CellType.TEXT) < sum(map(found.count, DATA))


def _header(
    above: Sequence[Line],
    dialect: Dialect,
    kinds: Sequence[CellType],
    sample: Sequence[Sequence[str]],
) -> tuple[list[str], list[str], int]:
    """Names, units and the number of lines they take, from the lines above the data."""
    split = [_header_cells(text, dialect, kinds, sample) for _, text in above]
    last = len(above) - 1
    while last >= 0 and not split[last] and is_comment(above[last][1]):
        last -= 1
    if last < 0 or not split[last]:
        return [], [], 0
    names, units, first = [cell.strip() for cell in split[last]], list[str](), last
    if last > 0 and (higher := split[last - 1]):
        if all(not (unit := name.strip("[](){} ")) or is_unit(unit) for name in names):
            names, units, first = higher, names, last - 1
        elif 2 * names.count("") >= len(names) and not any(
            not name and not high.strip() for name, high in zip(names, higher, strict=True)
        ):
            # As pandas writes columns of several levels, the index has its name on a line below.
            names = [name or high for name, high in zip(names, higher, strict=True)]
            first = last - 1
    if first > 0 and (grouped := _grouped_names(names, split[first - 1])):
        names, first = grouped, first - 1
    return names, units, len(above) - first


def _grouped_names(names: Sequence[str], groups: Sequence[str]) -> list[str]:
    """Names of which some repeat, those behind their group's; none where that does not mend it.

    A group's name stands above each of its columns, or above the first one alone.
    """
    counts = Counter(name.strip() for name in names)
    group, result = "", []
    for name, cell in zip(names, groups, strict=False):
        group = cell.strip() or group
        result.append(f"{group} {name}".strip() if name and counts[name.strip()] > 1 else name)
    named = [name for name in result if name]
    # In a Vicon export these are long: what the device is called, and how it is connected.
    vicon = {"frame", "sub frame"} <= {name.lower() for name in names}
    return [] if result == list(names) or vicon or len(set(named)) < len(named) else result


def _header_cells(
    text: str, dialect: Dialect, kinds: Sequence[CellType], sample: Sequence[Sequence[str]]
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


def _are_names(cells: Sequence[str], dialect: Dialect, kinds: Sequence[CellType]) -> bool:
    """Whether cells stand one above each column, and hold no number above numbers."""
    if len(cells) != dialect.width or not any(cell.strip() for cell in cells):
        return False
    return all(
        kind is CellType.TEXT
        or cell_type(cell, dialect.decimal) in (CellType.TEXT, CellType.MISSING)
        for cell, kind in zip(cells, kinds, strict=True)
    )
