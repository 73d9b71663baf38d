"""The command line: words in, one call, words out."""

from __future__ import annotations

import json
import os
import signal
import sys
from codecs import register_error
from collections.abc import Sequence
from importlib import import_module
from io import TextIOWrapper
from pathlib import Path

from forcelab.cli.options import WrongWordError
from forcelab.cli.output import printable
from forcelab.cli.parser import build_parser
from forcelab.cli.stopping import Stopped, stoppable
from forcelab.errors import ForcelabError, UnclearAuthorError, UnclearRateError

__all__ = ["main"]

#: The options that cure errors which cannot know of them.
CURES = {UnclearAuthorError: "--author", UnclearRateError: "--rate"}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; the process's own by default. None at all, or a
        project's folder first, mean the window.

    Returns
    -------
    int
        0 when all went well, 1 when a file or a project stands in the way, 2 when the command
        line itself is wrong, 130 after Ctrl+C, 128 and the signal's number after another one.
    """
    _open_streams()
    try:
        status = _carried_out(_for_the_window(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except ForcelabError as error:
        print(f"forcelab: {printable(_sentence(error))}", file=sys.stderr)
        return 2 if isinstance(error, WrongWordError) else 1
    except ImportError as error:
        if (sentence := _qt_sentence(error)) is None:
            raise
        print(f"forcelab: {printable(sentence)}", file=sys.stderr)
        return 1
    except MemoryError:
        print(
            "forcelab: this takes more memory than there is; take fewer or shorter recordings at "
            "once, or fewer and smaller scales.",
            file=sys.stderr,
        )
        return 1
    except KeyboardInterrupt as stop:
        print("forcelab: stopped; nothing was left half done.", file=sys.stderr)
        return 128 + (stop.number if isinstance(stop, Stopped) else signal.SIGINT)
    except BrokenPipeError:
        _drop_output()  # the reader (head, less) has seen enough
        status = 0
    except OSError as error:
        nameless = "this folder" if isinstance(error, FileNotFoundError) else "the output"
        print(f"forcelab: {error.filename or nameless}: {error.strerror}.", file=sys.stderr)
        _drop_output()
        return 1
    return status


def _carried_out(argv: Sequence[str]) -> int:
    """Do what the words say; gives the exit status."""
    try:
        arguments = build_parser().parse_args(argv)
    except SystemExit as stop:  # argparse has printed its sentence, or the help
        return stop.code if isinstance(stop.code, int) else 2
    # Each command imports what it needs when it runs: listing a project loads no scikit-learn.
    with stoppable():
        command = import_module(f"forcelab.cli.{arguments.module}")
        return int(command.run(arguments) or 0)


def _for_the_window(argv: Sequence[str]) -> list[str]:
    """The arguments, where somebody names a project, nothing, or asks for help in another way."""
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
    except ForcelabError as told:
        return str(told)
    return None


def _open_streams() -> None:
    """Have streams that take whatever is said.

    What is said to one that was closed from the beginning goes nowhere: Python leaves None there,
    and what is printed to None goes to standard output. A character that the terminal's encoding
    has not got is printed as JSON escapes it, so that JSON stays JSON.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - until the end
            setattr(sys, name, nowhere)
    register_error("escaped", _escaped)
    if isinstance(sys.stdout, TextIOWrapper):
        sys.stdout.reconfigure(errors="escaped")


def _escaped(error: UnicodeError) -> tuple[str, int]:
    """What to print in place of characters that cannot be, and where to go on."""
    assert isinstance(error, UnicodeEncodeError)
    return json.dumps(error.object[error.start : error.end])[1:-1], error.end


def _drop_output() -> None:
    """Let what is still to be written go nowhere; Python would complain again when it closes."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
