"""The user guide: pages of Markdown in ``assets/guide``, their sections, and a search over them."""

from __future__ import annotations

import math
import re
import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from forcelab.errors import InputError
from forcelab.resources import asset
from forcelab.text import unknown_word

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
_LINK, _MARKS = re.compile(r"!?\[([^][]*)\]\([^)]*\)"), re.compile(r"[*`]|\\(?=\W)")
#: How an item of a list or a row of a table begins; and what only separates a table's head.
_BULLET, _ROW, _RULE = re.compile(r"^\s*(?:[-*+>]|\d+\.) "), re.compile(r"\s*\|"), "|:- "
#: So many letters are shown of a section in which something was found, and about so many before it.
_EXCERPT, _BEFORE = 110, 20
#: Words that say nothing about what is searched for.
_STOP_WORDS = re.compile(
    "an?|and|are|as|at|be|but|by|can(not)?|could|did|do|does|for|from|get|ha[sd]|have|how|i|if|in|"
    "is|its?|me|my|no|not|of|on|or|our|so|that|the|their|them|there|they|this|to|up|was|we|what|"
    "when|where|which|who|why|will|with|your?"
)


@dataclass(frozen=True, slots=True)
class Section:
    """A heading of a page and what is below it, up to the next one.

    `title` and `lines` (paragraphs, items, rows) are plain text; links call the heading `anchor`.
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
        code = goes_on = False  # whether a line is of code, and goes on with the one before it
        for line in self.text.splitlines():
            words = line.strip(_RULE)
            if _FENCE.match(line):
                code = not code
            elif not code and (heading := _HEADING.match(line)):
                found.append((len(heading[1]), plain(heading[2]), []))
            elif found and words:
                if goes_on and not (_BULLET.match(line) or _ROW.match(line)):
                    words = f"{found[-1][2].pop()} {words}"
                else:
                    words = line if code else _BULLET.sub("", line)
                found[-1][2].append(words)
                goes_on = not code
                continue
            goes_on = False
        names = anchors(title for _, title, _ in found)
        return tuple(
            Section(self.name, level, title, name, tuple(map(plain, lines)))
            for (level, title, lines), name in zip(found, names, strict=True)
        )


@dataclass(frozen=True, slots=True)
class Match:
    """A section in which words of a search are, and a stretch of it that shows them."""

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
    """A line of Markdown without its marks; dashes separate the cells of a table."""
    if _ROW.match(line):
        line = " – ".join(filter(None, re.split(r"\s*(?<!\\)\|\s*", line)))
    return _MARKS.sub("", _LINK.sub(r"\1", line)).strip()


def read_page(name: str) -> Page:
    """Read a page of the guide; InputError if there is none of that name."""
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
    """Find the sections with most words of a query, at least half of them, the likeliest first.

    Words count more in a heading than at the beginning of a line, there more than elsewhere, near
    each other more than apart, and rare ones more than frequent ones.
    """
    words = [re.compile(word, re.IGNORECASE) for word in patterns(query)]
    sections = [section for page in pages for section in page.sections]

    def hits(text: str) -> set[re.Pattern[str]]:
        return {word for word in words if word.search(text)}

    found = [hits("\n".join((section.title, *section.lines))) for section in sections]
    rarity = {w: math.log(1 + len(sections) / (1 + sum(w in f for f in found))) for w in words}

    def score(section: Section, present: set[re.Pattern[str]]) -> tuple[int, float]:
        near = max(map(hits, _sentences(section)), key=len)
        first = {word for word in present for line in section.lines if word.match(line)}
        parts = (present, near, first, *4 * (hits(section.title),))
        return len(present), sum(rarity[word] for part in parts for word in part)

    likeliest = sorted(
        (pair for pair in zip(sections, found, strict=True) if 2 * len(pair[1]) >= len(words) > 0),
        key=lambda pair: score(*pair),
        reverse=True,
    )
    return [Match(section, _excerpt(section, words)) for section, _ in likeliest]


def patterns(query: str) -> list[str]:
    """What finds each word of a query, where a word begins with it, be it singular or plural."""
    words = [word.strip(".,;:?!'\"()") or word for word in query.lower().split()]
    words = [word for word in words if not _STOP_WORDS.fullmatch(word)] or words
    singular = (word[:-1] if re.search(r"[a-z]{2}[a-rt-z]s$", word) else word for word in words)
    return [rf"(?<!\w){re.escape(word)}" for word in dict.fromkeys(singular)]


def _sentences(section: Section) -> list[str]:
    return re.split(r"(?<=[.!?:]) (?=\W*[A-Z])|\n", "\n".join(section.lines))


def _excerpt(section: Section, words: Sequence[re.Pattern[str]]) -> str:
    """The sentence with most of the words that the heading lacks, from before them on."""
    words = [word for word in words if not word.search(section.title)]

    def merit(sentence: str) -> tuple[int, int]:
        return sum(word.search(sentence) is not None for word in words), min(len(sentence), 30)

    sentence = max(_sentences(section), key=merit)
    first = min((match.start() for word in words if (match := word.search(sentence))), default=0)
    start = min(first - _BEFORE, len(sentence) - _EXCERPT // 2)
    start = sentence.rfind(" ", 0, start) + 1 if first > 2 * _BEFORE and start > 0 else 0
    return ("…" if start else "") + textwrap.shorten(sentence[start:], _EXCERPT, placeholder="…")
