"""TextGrids of Praat, long or short text: read, and written with a tier for each author.

In both kinds of text only strings in quotes, flags in angle brackets and numbers that stand alone
count; all other words, which tell people what a number is, and what follows ``!`` do not.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from forcelab.errors import InputError
from forcelab.formats.label_files import LabelOptions, LabelSet, own_stem
from forcelab.formats.tiers import Annotation, Tier, tracks_of_tiers
from forcelab.formats.track_text import plain_times
from forcelab.labels import Track
from forcelab.text import counted

#: Bytes of the longest file that is read: a million intervals.
LONGEST = 128_000_000
_TOKEN = re.compile(
    r'"(?P<text>[^"]*(?:""[^"]*)*)"'
    r"|(?<!\S)(?P<number>[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?)(?!\S)"
    r"|<(?P<flag>exists|absent)>"
    r"|(?<!\S)!.*"
    r'|(?P<open>")'
)
_WIDE_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def sniff_labels(_path: Path, head: bytes) -> bool:
    """Whether a file is a TextGrid, as text or binary."""
    start = head[:400].replace(b"\0", b"")
    return (b"ooTextFile" in start[:60] and b'"TextGrid"' in start) or b"BinaryFile" in start[:20]


def read_labels(path: Path, options: LabelOptions) -> list[LabelSet]:
    """Read the interval tiers of a TextGrid."""
    if path.stat().st_size > LONGEST:
        raise InputError(f"'{path}' is larger than any TextGrid of labels; check what it is.")
    content = _Content(path)
    if content.text() not in {"ooTextFile", "ooTextFile short"} or content.text() != "TextGrid":
        raise InputError(f"'{path}' is no TextGrid; open it in Praat and save it as text.")
    _, end = content.interval()
    count = content.count() if content.flag() == "exists" else 0
    tiers, left_out = [], []
    for _ in range(count):
        kind, name = content.text(), content.text()
        content.interval()
        number = content.count()
        if kind == "IntervalTier":
            intervals = ((content.interval(), content.text()) for _ in range(number))
            labelled = [Annotation(*times, text) for times, text in intervals if text.strip()]
            tiers.append(Tier(name.strip(), tuple(labelled)))
            if not labelled:
                left_out.append(f"The tier '{name}' has no text and was left out.")
        elif kind == "TextTier":
            for _ in range(number):
                content.number()
                content.text()
            left_out.append(
                f"The point tier '{name}' ({counted(number, 'point')}) was left out: points have "
                "no duration."
            )
        else:
            raise content.error(f"a tier is an IntervalTier or a TextTier, not '{kind[:40]}'")
    tracks, remarks = tracks_of_tiers(tiers, options)
    names = tuple(tier.name for tier in tiers)
    return [LabelSet(own_stem(path), tracks, end, (*left_out, *remarks), tiers=names)]


class _Content:
    """What counts in a TextGrid, in order."""

    def __init__(self, path: Path) -> None:
        self._path = path
        data = path.read_bytes()
        if data.startswith(b"ooBinaryFile"):
            raise InputError(
                f"'{path}' is a binary TextGrid; open it in Praat and save it as text."
            )
        try:
            self._text = data.decode("utf-16" if data.startswith(_WIDE_MARKS) else "utf-8-sig")
        except UnicodeDecodeError as error:
            if data.startswith((*_WIDE_MARKS, codecs.BOM_UTF8)) or b"\0" in data[:400]:
                raise InputError(
                    f"'{path}' is no text from byte {error.start} on; open it in Praat and save it "
                    "as text."
                ) from error
            self._text = data.decode("latin-1")
        self._matches = (match for match in _TOKEN.finditer(self._text) if match.lastgroup)
        self._at = 0

    def error(self, why: str) -> InputError:
        line = self._text.count("\n", 0, self._at) + 1
        return InputError(f"'{self._path}', line {line}: {why}; open it in Praat and save it anew.")

    def text(self) -> str:
        return self._next("text", "a text in quotes").replace('""', '"')

    def flag(self) -> str:
        return self._next("flag", "<exists>")

    def number(self) -> float:
        value = float(self._next("number", "a number"))
        if not math.isfinite(value):
            raise self.error("a time is not finite")
        return value

    def interval(self) -> tuple[float, float]:
        start, end = self.number(), self.number()
        if end < start:
            raise self.error(f"an interval goes from {start:g} back to {end:g} s")
        return start, end

    def count(self) -> int:
        number = self.number()
        if not 0 <= number <= LONGEST or number != int(number):
            raise self.error(f"{number:g} is no number of tiers or intervals")
        return int(number)

    def _next(self, kind: str, what: str) -> str:
        match = next(self._matches, None)
        self._at = len(self._text) if match is None else match.start()
        if match is None or match.lastgroup != kind:
            found = "the file ends" if match is None else f"there is {match[0][:40]!a}"
            raise self.error(f"{found} where {what} is expected")
        return str(match[kind])


def to_textgrid(tracks: Iterable[Track], duration: float) -> bytes:
    """All tracks of a demonstration as a TextGrid (long text, UTF-8), an interval tier each.

    Unlabelled time is intervals without text. Times are seconds as of
    :func:`~forcelab.formats.track_text.plain_times`, with as many digits as tell them exactly.
    """
    rows = [(track.author, plain_times(track)) for track in tracks]
    edges = [edge for _, segments in rows for _, times in segments for edge in times]
    start, end = min([0.0, *edges]), max([round(duration, 9), *edges])
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', ""]
    lines += [*_span(start, end, ""), "tiers? <exists>", f"size = {len(rows)}", "item []:"]
    for number, (author, segments) in enumerate(rows, start=1):
        intervals = list(_intervals(((*times, s.action) for s, times in segments), start, end))
        lines += [f"    item [{number}]:", '        class = "IntervalTier"']
        lines += [f"        name = {_quoted(author)}", *_span(start, end, " " * 8)]
        lines.append(f"        intervals: size = {len(intervals)}")
        for place, (left, right, text) in enumerate(intervals, start=1):
            lines += [f"        intervals [{place}]:", *_span(left, right, " " * 12)]
            lines.append(f"            text = {_quoted(text)}")
    return "\n".join([*lines, ""]).encode()


def _span(start: float, end: float, indent: str) -> list[str]:
    return [f"{indent}xmin = {start!r}", f"{indent}xmax = {end!r}"]


def _intervals(
    segments: Iterable[tuple[float, float, str]], start: float, end: float
) -> Iterator[tuple[float, float, str]]:
    """Segments, and the unlabelled time between them."""
    for left, right, action in segments:
        if start < left:
            yield start, left, ""
        yield left, right, action
        start = right
    if start < end:
        yield start, end, ""


def _quoted(text: str) -> str:
    if "\0" in text:
        raise InputError(f"The name {text!a} holds a NUL, which a TextGrid cannot hold; rename it.")
    return '"' + text.replace('"', '""') + '"'
