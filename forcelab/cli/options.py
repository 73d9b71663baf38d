"""The parser, and the options that several commands have in common."""

from __future__ import annotations

import argparse
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

from forcelab.cli.output import print_remark
from forcelab.cluster import join_cluster
from forcelab.errors import InputError
from forcelab.text import tidy_name


class UsageError(InputError):
    """An option's value that no file or project could make right; exit status 2."""


#: Options, of which a usage does not list more.
MOST_OPTIONS = 5
PROJECT = "project folder NAME.forcelab"


class Formatter(argparse.RawDescriptionHelpFormatter):
    """Texts keep their lines; options stand in a column wide enough for their values."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=30, width=100)

    def add_usage(
        self,
        usage: str | None,
        actions: Iterable[argparse.Action],
        groups: Iterable[Any],
        prefix: str | None = None,
    ) -> None:
        """Add the usage, which tells of many options only those that must be given."""
        actions = list(actions)
        needed = {a for group in groups if group.required for a in group._group_actions}
        optional = [a for a in actions if a.option_strings and not a.required and a not in needed]
        if len(optional) > MOST_OPTIONS:
            options = argparse.Action(["options"], "options", nargs=0)
            actions = [options, *(a for a in actions if a not in optional)]
            groups = [group for group in groups if group.required]
        super().add_usage(usage, actions, groups, prefix)

    def _split_lines(self, text: str, width: int) -> list[str]:
        """Lines of a help text, which break no name at its hyphen."""
        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)


#: What argparse says, and how it is said here.
_PLAINER = (
    (re.compile(r"invalid float value: (.*)"), r"\1 is no number"),
    (re.compile(r"invalid int value: (.*)"), r"\1 is no whole number"),
    (re.compile(r"the following arguments are required: (.*)"), r"\1 must be given"),
    (re.compile(r"one of the arguments (\S+) (\S+) is required"), r"\1 or \2 must be given"),
    (re.compile(r"unrecognized arguments: (.*)"), r"'\1' means nothing here"),
    (re.compile(r"^argument (\S+): "), r"\1: "),
)
_NO_CHOICE = re.compile(r"invalid choice: '(.*)' \(choose from (.*)\)")


class Parser(argparse.ArgumentParser):
    """Says in one sentence what is wrong, where a dozen lines of usage would bury it."""

    color: bool  #: whether the help has colours on a terminal, from Python 3.14 on

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """The arguments, and the words that mean nothing.

        Where there may be none of the last words, those behind an option are taken too, which
        argparse does not do: ``remove lab.forcelab --yes pull-03``.
        """
        self._arguments = list(sys.argv[1:] if args is None else args)
        parsed, words = super().parse_known_args(args, namespace)
        if (unknown := self._unknown(words)) is not None:
            self.error(unknown)
        last = next((a for a in reversed(self._actions) if not a.option_strings), None)
        if last is None or any(word.startswith("-") for word in words):
            return parsed, words
        value: Any = getattr(parsed, last.dest, None)
        convert = last.type if callable(last.type) else str
        if last.nargs == "*":
            setattr(parsed, last.dest, [*value, *map(convert, words)])
            words = []
        elif last.nargs == "?" and len(words) == 1 and value == last.default:
            setattr(parsed, last.dest, convert(words.pop()))
        return parsed, words

    def _print_message(self, message: str, file: Any = None) -> None:
        """Print; argparse alone would hide that standard output takes no more."""
        if file is sys.stdout:
            file.write(message)
        else:
            super()._print_message(message, file)

    def error(self, message: str) -> NoReturn:
        """End with status 2."""
        if "required" in message:  # it was perhaps given, but mistyped
            message = self._unknown(self._arguments) or message
        refusal = _NO_CHOICE.search(message)
        if refusal is not None:
            message = message.replace(refusal[0], _no_choice(refusal[1], refusal[2]))
            message = message.removeprefix("argument COMMAND: ")
        for pattern, replacement in _PLAINER:
            message = pattern.sub(replacement, message)
        self.exit(2, f"{self.prog}: {message}; see '{self.prog} --help'.\n")

    def _unknown(self, words: Sequence[str]) -> str | None:
        """What is wrong with the first word that looks like an option and is none."""
        options = list(self._option_string_actions)
        for word in words:
            name = word.partition("=")[0]
            looks_like_option = re.match(r"--?[^\W\d]", name)
            if looks_like_option and not any(option.startswith(name) for option in options):
                near = get_close_matches(name, options, n=1)
                cure = f"; did you mean '{near[0]}'" if near else ""
                return f"'{word}' means nothing here{cure}"
        return None


def _no_choice(word: str, choices: str) -> str:
    """The sentence for a word that is none of the choices."""
    allowed = [choice.strip("' ") for choice in choices.split(",")]
    near = get_close_matches(word, allowed, n=1)
    return f"there is no '{word}'; " + (
        f"did you mean '{near[0]}'" if near else f"choose from {', '.join(allowed)}"
    )


def add_project(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("project", metavar="PROJECT", type=path_of, help=PROJECT)


def add_demonstration(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")


def add_task(parser: argparse._ActionsContainer, help_: str, **options: Any) -> None:
    parser.add_argument("--task", metavar="TASK", type=name_of, help=help_, **options)


def add_author(parser: argparse._ActionsContainer, help_: str, **options: Any) -> None:
    parser.add_argument("--author", metavar="NAME", type=name_of, help=help_, **options)


def add_file(parser: argparse._ActionsContainer, option: str, help_: str) -> None:
    parser.add_argument(option, metavar="FILE", type=Path, help=help_)


def path_of(text: str) -> Path:
    """A file or folder from the command line; ``-``, standard input or output, is none."""
    if text == "-":
        raise argparse.ArgumentTypeError("'-' names no file or folder; give it a name")
    return Path(text)


def name_of(text: str) -> str:
    """A name from the command line, without needless spaces."""
    if name := tidy_name(text):
        return name
    raise argparse.ArgumentTypeError("a name cannot be empty")


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def add_scheduler(parser: argparse._ActionsContainer) -> None:
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="share the work among the workers of the Dask scheduler that runs there",
    )


@contextmanager
def join_scheduler(address: str | None) -> Iterator[None]:
    """Join a cluster, if one is named, and say in the end what was done there."""
    if address is None:
        yield
        return
    with join_cluster(address) as cluster:
        yield
        print_remark(f"forcelab: {cluster.report()}")


def parse_unit(text: str) -> tuple[str, str]:
    """A channel and its unit, as they are typed: ``fx=N``."""
    name, _, unit = (part.strip() for part in text.rpartition("="))
    if not name or not unit:
        raise argparse.ArgumentTypeError(f"'{text}' is no unit of a channel; write such as fx=N")
    return name, unit


def add_column_options(parser: argparse._ActionsContainer) -> None:
    """Options for the columns of a table: times, counters, signals."""
    parser.add_argument("--time", metavar="COL", help="name or number of the column of times")
    parser.add_argument(
        "--jitter",
        metavar="SECONDS",
        type=float,
        default=0.0,
        help="move times that run backwards by at most this much (such as 0.001), and report it",
    )
    parser.add_argument(
        "--counter",
        metavar="COL",
        help="name or number of the column that counts the samples, --rate of them a second, "
        "in place of times; lost samples become gaps",
    )
    parser.add_argument(
        "--leave-out",
        metavar="COL",
        action="append",
        default=[],
        help="name or number of a column to leave out; in a ROS bag /topic or /topic.field; may be "
        "repeated",
    )
    parser.add_argument(
        "--signal",
        metavar="COL",
        action="append",
        default=[],
        help="name or number of a column to use as a signal although it would be left out or "
        "taken for times or a counter; in a ROS bag /topic.field; may be repeated",
    )
    parser.add_argument(
        "--unit",
        metavar="CHANNEL=UNIT",
        type=parse_unit,
        action="append",
        default=[],
        help="unit of a channel whose file states none, such as fx=N; may be repeated",
    )


def columns_from(arguments: argparse.Namespace) -> dict[str, Any]:
    """What these options say, as `forcelab.formats.recording.ReadOptions` takes it."""
    return {
        "time": arguments.time,
        "jitter": arguments.jitter,
        "counter": arguments.counter,
        "leave_out": tuple(arguments.leave_out),
        "signals": tuple(arguments.signal),
        "units": tuple(arguments.unit),
    }
