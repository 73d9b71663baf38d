"""The command line: words in, one call, words out."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module

from forcelab.cli.output import printable
from forcelab.cli.parser import build_parser
from forcelab.errors import ForcelabError

__all__ = ["main"]


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; the process's own by default.

    Returns
    -------
    int
        0 when all went well, 1 when the data or a setting stands in the way, 2 when the command
        line itself is wrong, 130 after Ctrl+C.
    """
    try:
        arguments = build_parser().parse_args(argv)
    except SystemExit as stop:  # argparse has printed its sentence, or the help
        return stop.code if isinstance(stop.code, int) else 2
    try:
        # Each command imports what it needs when it runs: listing a project loads no scikit-learn.
        command = import_module(f"forcelab.cli.{arguments.module}")
        status = command.run(arguments)
        if sys.stdout is not None:  # it is None when the program was started with it closed
            sys.stdout.flush()
    except ForcelabError as error:
        print(f"forcelab: {printable(str(error))}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("forcelab: stopped; nothing was left half done.", file=sys.stderr)
        return 130
    except BrokenPipeError:
        _drop_output()  # the reader (head, less) has seen enough
        return 0
    except OSError as error:
        print(f"forcelab: {error.filename or 'the output'}: {error.strerror}.", file=sys.stderr)
        _drop_output()
        return 1
    return int(status or 0)


def _drop_output() -> None:
    """Let what is still to be written go nowhere; Python would complain again when it closes."""
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
