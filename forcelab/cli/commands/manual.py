"""Print the manual page, which describes all commands.

'forcelab install-launcher' puts it on Linux where 'man forcelab' finds it.

for example:
  forcelab manual > ~/.local/share/man/man1/forcelab.1
"""

from __future__ import annotations

import argparse
import re
import textwrap
from collections.abc import Iterator
from datetime import date
from itertools import groupby, pairwise

from forcelab.cli import GENERAL, MANUAL, build_parser, grouped
from forcelab.cli.options import Parser
from forcelab.version import __version__

#: What the program's exit status means, as `forcelab.cli.main` gives it.
STATUS = {
    "0": "All went well.",
    "1": "A file or a project stands in the way; one sentence says what, where and the cure.",
    "2": "The command line is wrong.",
    "130": "Ctrl+C; after another signal it is 128 and the signal's number.",
}


def add_options(_: argparse.ArgumentParser) -> None:
    """Add nothing: it has only the options that every command has."""


def run(_: argparse.Namespace) -> None:
    print(manual_page(), end="")


def manual_page() -> str:
    """The manual page of all commands as roff, written in the macros of man."""
    parser = build_parser()
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    parsers: dict[str, Parser] = commands.choices
    lines = [
        f'.TH FORCELAB 1 {date.today()} "forcelab {__version__}" "User Commands"',
        # Names are copied from it: none is hyphenated, and no line is stretched.
        *(".nh", ".ad l"),
        *(".SH NAME", r"forcelab \- label and recognise force actions"),
        *(".SH SYNOPSIS", "forcelab [PROJECT]", ".br", "forcelab COMMAND [options] ..."),
        *(".SH DESCRIPTION", *_text(MANUAL)),
        *(".SH OPTIONS", "Of every command:", *_options(parsers["list"], only=GENERAL)),
    ]
    for title, names in grouped(parsers):
        lines.append(f'.SH "{title.upper()}"')
        for name in names:
            command = parsers[name]
            lines += [f".SS {_escaped(name)}", _usage(command)]
            lines += [*_text(command.description or ""), *_options(command), *_text(command.epilog)]
    lines.append('.SH "EXIT STATUS"')
    for status, meaning in STATUS.items():
        lines += [".TP", status, meaning]
    # A heading begins a paragraph anyway.
    pairs = pairwise(["", *lines])
    lines = [line for last, line in pairs if line != ".PP" or last[:3] not in (".SH", ".SS")]
    return "\n".join(lines) + "\n"


def _usage(parser: Parser) -> str:
    words = " ".join(parser.format_usage().removeprefix("usage: ").split())
    # A line is not broken between an option and its value.
    return re.sub(r"\[[^]]*\]", lambda match: match[0].replace(" ", r"\ "), _escaped(words))


def _options(parser: Parser, only: str | None = None) -> Iterator[str]:
    """The arguments and options of a command, group by group; its general ones only if named."""
    formatter = parser._get_formatter()
    for group in parser._action_groups:
        if not group._group_actions or (only or group.title) != group.title:
            continue
        if only is None:
            if group.title == GENERAL:
                continue
            yield from (".PP", rf"\fI{_escaped(group.title or '')}\fR")
            yield from _text(group.description or "")
        for action in group._group_actions:
            words = _escaped(formatter._format_action_invocation(action))
            help_ = formatter._expand_help(action) if action.help else ""
            yield from (".TP", re.sub(r"\S+", _in_face, words), *map(_escaped, _wrapped(help_)))


def _in_face(word: re.Match[str]) -> str:
    """Options in bold and their values underlined, as in other pages; a long list may be broken."""
    face = "B" if word[0].startswith(r"\-") else "I"
    breakable = re.sub(",(?=.)", r",\\:", word[0])
    return rf"\f{face}{breakable}\fR"


def _text(text: str | None) -> Iterator[str]:
    """Paragraphs and tables; other indented lines, which are examples, stay as they are."""
    for block in re.split(r"\n\s*\n", (text or "").strip("\n")):
        above = False
        for indented, group in groupby(block.splitlines(), lambda line: line.startswith(" ")):
            lines = list(group)
            if indented and "  " in lines[0].strip():
                yield from _table(lines)
            elif indented:
                yield from (*(() if above else (".PP",)), ".nf", *map(_escaped, lines), ".fi")
            else:
                yield from (".PP", *map(_escaped, _wrapped("\n".join(lines))))
            above = True


def _table(lines: list[str]) -> Iterator[str]:
    """Rows of a word and what it means, in lines as short as the terminal's."""
    for line in lines:
        word, _, meaning = line[2:].partition("  ")
        if word:
            yield from (".TP", rf"\fB{_escaped(word)}\fR")
        yield from [_escaped(meaning.strip())] * bool(meaning)


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, 72, break_on_hyphens=False, break_long_words=False)


def _escaped(line: str) -> str:
    """A line in which roff reads no commands, and that is copied as it stands."""
    text = line.replace("\\", r"\e").replace("-", r"\-")
    text = re.sub(r"^(?=[.'])", r"\\&", text)
    return "".join(c if c.isascii() else rf"\[u{ord(c):04X}]" for c in text)
