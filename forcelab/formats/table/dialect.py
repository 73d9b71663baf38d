"""How a text table is written: its encoding, its separator, its decimal mark.

Lines are rows: a quoted cell may hold separators but no line break. Lines that are blank or
start with ``#``, ``%`` or ``//`` are comments.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from forcelab.errors import InputError
from forcelab.formats.table.cells import Kind, kind_of

__all__ = [
    "HEAD",
    "Dialect",
    "Line",
    "detect",
    "encoding_of",
    "head_lines",
    "is_comment",
    "is_text",
    "lines",
]

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
    """How the rows of a table are written.

    Parameters
    ----------
    separator : str or None
        What stands between cells; None for any run of blanks.
    decimal : str
        The decimal mark, ``"."`` or ``","``.
    width : int
        Cells in a row.
    """

    separator: str | None
    decimal: str
    width: int

    def split(self, rows: Sequence[str]) -> list[list[str]]:
        """Split rows into cells.

        Raises
        ------
        ValueError
            If a quoted cell does not end on its line.
        """
        return _split(rows, self.separator)


def _split(rows: Sequence[str], separator: str | None) -> list[list[str]]:
    """Split rows at a separator, quoted cells kept together."""
    if separator is None:
        if any('"' in row for row in rows):
            return [
                [re.sub(r'^"(.*)"$', r"\1", cell).replace('""', '"') for cell in _QUOTED.findall(r)]
                for r in rows
            ]
        return [row.split() for row in rows]
    try:
        cells = list(csv.reader(rows, delimiter=separator, skipinitialspace=separator != "\t"))
    except csv.Error as error:
        raise ValueError(str(error)) from error
    if len(cells) != len(rows):
        raise ValueError("a quote is not closed")
    return cells


def encoding_of(path: Path) -> str:
    """Tell the encoding of a text file by its byte order mark, else by what it holds.

    Without a mark it is UTF-16 where every other byte of the head is zero, UTF-8 where the whole
    file is valid UTF-8, and Latin-1 otherwise.

    Raises
    ------
    InputError
        If the file is empty, is not text, or holds a NUL byte.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
        if not head:
            raise InputError(f"{path} is empty (0 bytes); record or export it again.")
        encoding = _wide(head)
        if encoding:
            return encoding
        decoder = codecs.getincrementaldecoder("utf-8")()
        utf8, offset, block = True, 0, head
        while block:
            binary = _BINARY.search(block)
            if binary:
                raise InputError(
                    f"{path} is not a text table: byte {offset + binary.start()} is "
                    f"0x{block[binary.start()]:02x}; export it as CSV."
                )
            try:
                if utf8:
                    decoder.decode(block)
            except UnicodeDecodeError:
                utf8 = False
            offset += len(block)
            block = file.read(_BLOCK)
        try:
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            utf8 = False
    if not utf8:
        return "latin-1"
    return "utf-8-sig" if head.startswith(codecs.BOM_UTF8) else "utf-8"


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
    """Read a file's rows in blocks of about a megabyte, without blank lines and comments.

    Parameters
    ----------
    path : Path
        The file.
    encoding : str
        As of :func:`encoding_of`.
    skip : int
        Number of lines to leave out at the start.
    sections : bool
        Whether the first blank line after those is the end.

    Yields
    ------
    numbers, rows : list of int, list of str
        1-based line numbers, and the lines without their line ends.

    Raises
    ------
    InputError
        If a line is longer than :data:`HEAD` characters, or the text cannot be decoded.
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
                kept = [
                    k
                    for k, row in enumerate(rows, number)
                    if k > skip and (row[:1] > "/" or not is_comment(row))
                ]
                if kept:
                    yield kept, [rows[k - number] for k in kept]
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


def detect(rows: Sequence[str]) -> Dialect | None:
    """Find the separator and the decimal mark that explain most cells as numbers or stamps.

    Parameters
    ----------
    rows : sequence of str
        Lines from the start of a file, without comments.

    Returns
    -------
    Dialect or None
        None where no line holds a number.
    """
    best: tuple[tuple[int, int], Dialect] | None = None
    for separator in _SEPARATORS:
        if separator and not any(separator in row for row in rows):
            continue
        if separator is None and best and best[1].separator == "\t":
            continue  # blanks between tabs are in names and labels
        try:
            table = _split(rows, separator)
        except ValueError:
            continue
        # Where commas separate, only a quoted cell can hold a decimal comma.
        quoted = any('"' in row for row in rows)
        for decimal in ".," if separator != "," or quoted else ".":
            found = _explain(table, separator, decimal)
            if found and (best is None or found[0] > best[0]):
                best = found
    return best[1] if best else None


def _explain(
    table: Sequence[Sequence[str]], separator: str | None, decimal: str
) -> tuple[tuple[int, int], Dialect] | None:
    """The dialect of the row width with most numbers, and (its numbers, minus its words).

    Words count in the second half only, where there is no header.
    """
    good: Counter[int] = Counter()
    bad: Counter[int] = Counter()
    for place, row in enumerate(table):
        kinds = [kind_of(cell, decimal) for cell in row]
        if separator == "\t" and _numbers_between_blanks(row, kinds, decimal):
            return None
        good[len(row)] += sum(kind in (Kind.NUMBER, Kind.STAMP) for kind in kinds)
        bad[len(row)] += kinds.count(Kind.TEXT) if 2 * place >= len(table) else 0
    if not good:
        return None
    rows = Counter(map(len, table))
    width, score = max(good.items(), key=lambda item: (item[1], rows[item[0]]))
    return ((score, -bad[width]), Dialect(separator, decimal, width)) if score else None


def _numbers_between_blanks(row: Sequence[str], kinds: Sequence[Kind], decimal: str) -> bool:
    """Whether a row has cells that are no numbers only because blanks separate, too."""
    return any(
        all(kind_of(part, decimal) is Kind.NUMBER for part in cell.split())
        for cell, kind in zip(row, kinds, strict=True)
        if kind is Kind.TEXT
    )
