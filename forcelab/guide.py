"""The user guide: pages of Markdown in ``assets/guide``, their sections, and a search over them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from forcelab.errors import InputError
from forcelab.resources import asset
from forcelab.text import unknown_word

__all__ = [
    "CONTENTS",
    "Match",
    "Page",
    "Section",
    "plain",
    "read_page",
    "read_pages",
    "search",
    "word_pattern",
]

#: The pages in reading order.
CONTENTS = (
    "index",
    "first-hour-sample",
    "first-hour-own",
    "label",
    "review",
    "capture",
    "formats",
    "recognise",
    "method",
    "python",
    "command-line",
    "questions",
    "glossary",
    "changes",
)
#: A line that begins or ends a block of code, and a heading.
_FENCE, _HEADING = re.compile(r"\s*```"), re.compile(r"(#{1,6}) +(.*?)[ #]*$")
#: Pictures and links, of which the words stay, and what else is no word.
_LINK, _MARKS = re.compile(r"!?\[([^\]]*)\]\([^)]*\)"), re.compile(r"[*`]|\\(?=\W)")
#: How an item of a list begins; and a line of a table that only separates its head.
_BULLET, _RULE = re.compile(r"^\s*(?:[-*+>]|\d+\.) "), re.compile(r"[\s|:-]*")
#: So many letters are shown of a line in which something was found.
_EXCERPT = 90


@dataclass(frozen=True, slots=True)
class Section:
    """A heading of a page and what is below it, up to the next one.

    `title` and `lines` are plain text; `anchor` is what links to the heading call it.
    """

    page: str
    level: int
    title: str
    anchor: str
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Page:
    """A page of the guide, as Markdown."""

    name: str
    text: str

    @property
    def title(self) -> str:
        """Its first heading."""
        return self.sections[0].title if self.sections else self.name

    @cached_property
    def sections(self) -> tuple[Section, ...]:
        """Its sections in order; what looks like a heading in a block of code is none."""
        found: list[tuple[int, str, list[str]]] = []
        code = False
        for line in self.text.splitlines():
            if _FENCE.match(line):
                code = not code
            elif not code and (heading := _HEADING.match(line)):
                found.append((len(heading[1]), plain(heading[2]), []))
            elif found and not _RULE.fullmatch(line):
                found[-1][2].append(line if code else plain(_BULLET.sub("", line)))
        names = anchors(title for _, title, _ in found)
        return tuple(
            Section(self.name, level, title, name, tuple(lines))
            for (level, title, lines), name in zip(found, names, strict=True)
        )


@dataclass(frozen=True, slots=True)
class Match:
    """A section in which all words of a search are, and the line that has most of them."""

    section: Section
    excerpt: str


def anchors(titles: Iterable[str]) -> list[str]:
    """What GitHub calls headings in links, in order: lower case, hyphens for blanks, numbered."""
    counts, names = Counter[str](), []
    for title in titles:
        name = re.sub(r"[^\w -]", "", title).lower().replace(" ", "-")
        names.append(f"{name}-{counts[name]}" if counts[name] else name)
        counts[name] += 1
    return names


def plain(line: str) -> str:
    """A line of Markdown without its marks; cells of a table are apart by two blanks."""
    if line.lstrip().startswith("|"):
        line = re.sub(r"\s*(?<!\\)\|\s*", "  ", line)
    return _MARKS.sub("", _LINK.sub(r"\1", line)).strip()


def read_page(name: str) -> Page:
    """Read a page of the guide.

    Raises
    ------
    InputError
        If there is no page of that name.
    """
    if name not in CONTENTS:
        raise InputError(unknown_word("page", name, CONTENTS))
    return Page(name, asset("guide", f"{name}.md").read_text("utf-8"))


def read_pages() -> tuple[Page, ...]:
    """Read all pages, in reading order."""
    return tuple(map(read_page, CONTENTS))


def picture_folder() -> Path:
    """Where the pictures of the guide lie."""
    return asset("guide", "index.md").parent / "pictures"


def search(pages: Sequence[Page], query: str) -> list[Match]:
    """Find the sections that contain all words; those with most of them in the heading first."""
    words = [re.compile(word_pattern(word), re.IGNORECASE) for word in query.split()]
    if not words:
        return []

    def hits(text: str) -> int:
        return sum(word.search(text) is not None for word in words)

    found = [
        Match(section, _shorten(max(section.lines, key=hits, default=""), words))
        for page in pages
        for section in page.sections
        if hits("\n".join((section.title, *section.lines))) == len(words)
    ]
    return sorted(found, key=lambda match: -hits(match.section.title))


def word_pattern(word: str) -> str:
    """What finds a word, or one that begins with it."""
    return rf"(?<!\w){re.escape(word)}"


def _shorten(line: str, words: Sequence[re.Pattern[str]]) -> str:
    """As much of a line as shows the first of the words in it."""
    places = [match.start() for word in words if (match := word.search(line))]
    start = max(min(places, default=0) - _EXCERPT // 3, 0)
    start = line.find(" ", start) + 1 if start else 0
    excerpt = line[start : start + _EXCERPT]
    if start + _EXCERPT < len(line):
        excerpt = f"{excerpt.rpartition(' ')[0] or excerpt}…"
    return f"…{excerpt}" if start else excerpt
