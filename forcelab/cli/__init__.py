"""The command line: words in, one call, words out."""

from __future__ import annotations

import argparse
import errno
import json
import os
import signal
import sys
from codecs import register_error
from collections.abc import Collection, Iterator, Sequence
from importlib import import_module
from importlib.abc import InspectLoader
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType

from forcelab.cli import commands
from forcelab.cli.interrupts import Interrupted, interruptible
from forcelab.cli.options import Formatter, Parser, UsageError
from forcelab.cli.output import printable, quietly
from forcelab.errors import ForcelabError, UnclearAuthorError, UnclearRateError
from forcelab.version import full_version

MANUAL = """\
Label and recognise force actions: coders label the segments of demonstrations, a recogniser
learns them, and human and predicted timelines come out as pairs.
"""

CLOSING = """\
to begin with:
  forcelab                                   (opens the window; the last project, if there is one)
  forcelab demo     sample.forcelab          (simulated demonstrations to try things on)
  forcelab import   lab.forcelab recordings/*.csv --task stylus --videos
  forcelab evaluate lab.forcelab --task stylus --preset best --figure pairs.svg

'forcelab help COMMAND' explains a command. Exit status: 0 done; 1 a file or project stands in
the way (one sentence says what, where and the cure); 2 the command line is wrong.
"""

#: The commands by what one wants, as the manual lists them; others follow by name.
GROUPS = {
    "begin": ("gui", "demo", "guide"),
    "import and export": ("import", "labels", "attach", "sync", "export"),
    "label": ("list", "assign", "note", "agree", "rename", "remove", "actions"),
    "recognise and review": ("evaluate", "train", "predict", "runs", "review", "why", "plan"),
    "capture": ("capture", "replay"),
    "simulate and measure": ("simulate", "figures", "measure"),
    "this machine": ("doctor", "install-launcher", "completion", "manual"),
}
#: The heading of the options that every command has.
GENERAL = "general"
#: The options that cure errors which cannot know of them.
CURES = {UnclearAuthorError: "--author", UnclearRateError: "--rate"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; gives the exit status.

    No arguments at all, or a project's folder first, mean the window. The status is 0 when all went
    well, 1 when a file or a project stands in the way, 2 when the command line itself is wrong, 130
    after Ctrl+C, 128 and the signal's number after another one.
    """
    _open_streams()
    try:
        status = _run(_for_the_window(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except ForcelabError as error:
        return _fail(_sentence(error), 2 if isinstance(error, UsageError) else 1)
    except ImportError as error:
        if (sentence := _qt_sentence(error)) is None:
            raise
        return _fail(sentence)
    except MemoryError:
        return _fail(
            "this takes more memory than there is; take fewer or shorter recordings at once, or "
            "fewer and smaller scales."
        )
    except KeyboardInterrupt as stop:
        number = stop.number if isinstance(stop, Interrupted) else signal.SIGINT
        return _fail("stopped; nothing was left half done.", 128 + number)
    except OSError as error:
        if _reader_left(error):
            status = 0
        else:
            nameless = "this folder" if isinstance(error, FileNotFoundError) else "the output"
            status = _fail(f"{error.filename or nameless}: {error.strerror}.")
        _drop_output()
    return status


def _fail(sentence: str, status: int = 1) -> int:
    """Say what went wrong; gives the exit status."""
    print(f"forcelab: {printable(sentence)}", file=sys.stderr)
    return status


def _run(argv: Sequence[str]) -> int:
    """Run what the arguments say; gives the exit status."""
    with interruptible():
        try:
            arguments = build_parser(argv).parse_args(argv)
        except SystemExit as stop:  # argparse has printed its sentence, or the help
            return stop.code if isinstance(stop.code, int) else 2
        with quietly(arguments.quiet):
            return int(arguments.command(arguments) or 0)


def build_parser(argv: Sequence[str] | None = None) -> Parser:
    """The parser of the whole command line, with the options of the command that `argv` names.

    Only that command's module is imported: listing a project loads no scikit-learn. Without `argv`
    the parser knows the options of all commands.
    """
    parser = Parser(prog="forcelab", description=MANUAL, epilog=CLOSING, formatter_class=FrontPage)
    parser.add_argument(
        *("-V", "--version"),
        action=_PrintVersion,
        nargs=0,
        default=argparse.SUPPRESS,
        help="show the version, and of a checkout its commit",
    )
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    named = next((word for word in argv or () if not word.startswith("-")), None)
    for name, module in command_modules().items():
        if argv is None or name == named:
            _add_command(subparsers, name, import_module(module))
        else:
            subparsers.add_parser(name, help=_summary(module), add_help=False)
    if argv is None:  # what is made of it is not for a terminal
        for each in (parser, *subparsers.choices.values()):
            each.color = False
    return parser


class _PrintVersion(argparse.Action):
    """Prints the version; a checkout's is only looked up when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        print(f"forcelab {full_version()}")
        parser.exit()


class FrontPage(Formatter):
    """The help of the whole program, which lists the commands group by group."""

    def _format_action(self, action: argparse.Action) -> str:
        if not isinstance(action, argparse._SubParsersAction):
            return super()._format_action(action)
        summaries = {command.dest: command.help for command in action._get_subactions()}
        width = max(map(len, summaries))
        lines = []
        for title, names in grouped(summaries):
            lines.append(f"  {title}")
            lines += [f"    {name:<{width}}  {summaries[name]}" for name in names]
        return "\n".join(lines) + "\n"


def command_modules() -> dict[str, str]:
    """The module of each command, in the order of the manual."""
    modules = {
        info.name.rstrip("_").replace("_", "-"): f"{commands.__name__}.{info.name}"
        for info in iter_modules(commands.__path__)
    }
    return {name: modules[name] for _, names in grouped(modules) for name in names}


def grouped(names: Collection[str]) -> Iterator[tuple[str, list[str]]]:
    """The titles of groups, and which of the named commands stand in each."""
    listed = {name for group in GROUPS.values() for name in group}
    for title, group in (*GROUPS.items(), ("others", sorted(set(names) - listed))):
        if present := [name for name in group if name in names]:
            yield title, present


def _summary(module: str) -> str:
    """The first line of a module's docstring, without importing the module."""
    loader = getattr(find_spec(module), "loader", None)
    source = loader.get_source(module) if isinstance(loader, InspectLoader) else None
    line = (source or "").partition("\n")[0].removeprefix("r").strip('". ')
    return line[:1].lower() + line[1:]


def _add_command(
    subparsers: argparse._SubParsersAction[Parser], name: str, module: ModuleType
) -> None:
    """Add a command with its manual, which is its module's docstring, and its options."""
    manual, _, examples = (module.__doc__ or "").partition("for example:\n")
    parser = subparsers.add_parser(
        name,
        help=_summary(module.__name__),
        description=manual.strip(),
        epilog=f"for example:\n{examples.rstrip()}",
        formatter_class=Formatter,
        add_help=False,
    )
    parser._positionals.title = "arguments"
    module.add_options(parser)
    group = parser.add_argument_group(GENERAL)
    group.add_argument("-h", "--help", action="help", help="show this help")
    group.add_argument(
        "-q", "--quiet", action="store_true", help="show neither progress nor remarks"
    )
    parser.set_defaults(command=module.run)


def _for_the_window(argv: Sequence[str]) -> list[str]:
    """The arguments, with what stands for a command (a project, nothing, ``help``) spelt out."""
    if not argv:
        return ["gui"]
    first = argv[0]
    if first == "help":
        return [*argv[1:2], "--help"]
    names_a_folder = first.endswith(".forcelab") or "/" in first or os.sep in first
    return ["gui", *argv] if names_a_folder and not first.startswith("-") else list(argv)


def _sentence(error: ForcelabError) -> str:
    """An error's sentence, with the option that cures it where the error cannot know of one."""
    option = next((option for kind, option in CURES.items() if isinstance(error, kind)), None)
    return f"{str(error).removesuffix('.')} ({option})." if option else str(error)


def _qt_sentence(error: ImportError) -> str | None:
    """What a failed import of Qt means; None of another import.

    Modules that draw import Qt at their top, before anything can ask whether that will do.
    """
    if (error.name or "").partition(".")[0] != "PySide6" and "shared object" not in str(error):
        return None
    try:
        import_module("forcelab.gui.qt_check").require_qt()
    except ForcelabError as missing:
        return str(missing)
    return None


def _open_streams() -> None:
    """Make sure that everything can be printed.

    What goes to a stream that was closed from the beginning is dropped: Python leaves None there,
    and what is printed to None goes to standard output. A character that the terminal's encoding
    lacks is printed as JSON escapes it, so that JSON stays JSON.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            sink = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - until the end
            setattr(sys, name, sink)
    register_error("escaped", _escaped)
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="escaped")


def _escaped(error: UnicodeError) -> tuple[str, int]:
    """What to print in place of characters that cannot be, and where to go on."""
    assert isinstance(error, UnicodeEncodeError)
    return json.dumps(error.object[error.start : error.end])[1:-1], error.end


def _reader_left(error: OSError) -> bool:
    """Whether whoever read the output (head, less) has seen enough; Windows says it otherwise."""
    windows = sys.platform == "win32" and error.errno == errno.EINVAL and error.filename is None
    return isinstance(error, BrokenPipeError) or windows


def _drop_output() -> None:
    """Drop all further output; Python would complain again when it closes."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
