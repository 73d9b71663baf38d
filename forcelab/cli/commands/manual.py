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
from itertools import pairwise

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
    """Those of every command are all it has."""


def run(_: argparse.Namespace) -> None:
    """Print the page."""
    print(manual_page(), end="")


def manual_page() -> str:
    """The manual page of all commands as roff, written in the macros of man."""
    parser = build_parser()
    (commands,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    parsers: dict[str, Parser] = commands.choices
    lines = [
        f'.TH FORCELAB 1 {date.today()} "forcelab {__version__}" "User Commands"',
        *(".SH NAME", r"forcelab \- label and recognise force actions"),
        *(".SH SYNOPSIS", *_verbatim("forcelab [PROJECT]\nforcelab COMMAND [options] ...")),
        *(".SH DESCRIPTION", *_text(MANUAL)),
        *(".SH OPTIONS", "Of every command:", *_options(parsers["list"], only=GENERAL)),
    ]
    for title, names in grouped(parsers):
        lines.append(f'.SH "{title.upper()}"')
        for name in names:
            command = parsers[name]
            lines += [f".SS {_escaped(name)}", *_verbatim(_usage(command))]
            lines += [*_text(command.description or ""), *_options(command), *_text(command.epilog)]
    lines.append('.SH "EXIT STATUS"')
    for status, meaning in STATUS.items():
        lines += [".TP", status, meaning]
    # A heading begins a paragraph anyway.
    pairs = pairwise(["", *lines])
    lines = [line for last, line in pairs if line != ".PP" or last[:3] not in (".SH", ".SS")]
    return "\n".join(lines) + "\n"


def _usage(parser: Parser) -> str:
    return " ".join(parser.format_usage().removeprefix("usage: ").split())


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
            yield from (".TP", rf"\fB{words}\fR", *map(_escaped, _wrapped(help_)))


def _text(text: str | None) -> Iterator[str]:
    """Paragraphs; those with indented lines, which are tables or examples, line by line."""
    for block in re.split(r"\n\s*\n", (text or "").strip("\n")):
        if re.search(r"^ ", block, re.M):
            yield from _verbatim(block)
        elif block:
            yield from (".PP", *map(_escaped, _wrapped(block)))


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, 72, break_on_hyphens=False, break_long_words=False)


def _verbatim(text: str) -> Iterator[str]:
    yield from (".PP", ".nf", *map(_escaped, text.splitlines()), ".fi")


def _escaped(line: str) -> str:
    """A line in which roff reads no commands, and that is copied as it stands."""
    text = line.replace("\\", r"\e").replace("-", r"\-")
    text = re.sub(r"^(?=[.'])", r"\\&", text)
    return "".join(c if c.isascii() else rf"\[u{ord(c):04X}]" for c in text)
