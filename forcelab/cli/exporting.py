"""``forcelab export``."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text
from forcelab.formats.export import exporting
from forcelab.jobs import finish
from forcelab.project import Project


def run(arguments: argparse.Namespace) -> None:
    """Write tracks, or the whole project, into a folder."""
    some = arguments.task or arguments.demo or arguments.author
    if some and arguments.format == "archive":
        raise WrongWordError("An archive holds the whole project; leave out what chooses of it.")
    if arguments.out == Path("-"):
        _print(arguments)
        return
    written = _export(arguments, arguments.out)
    if arguments.json:
        print(json_text({"written": [str(path) for path in written]}))
        return
    for path in written:
        print(path)


def _export(arguments: argparse.Namespace, out: Path) -> tuple[Path, ...]:
    """Write what is asked for into a folder; gives the files."""
    ids = _ids(arguments) if arguments.task or arguments.demo else None
    return finish(
        exporting(arguments.project, out, arguments.format, ids, authors=arguments.author)
    )


def _print(arguments: argparse.Namespace) -> None:
    """Print what would be the only file."""
    if arguments.json or arguments.format in ("archive", "elan"):
        what = "what --json tells of" if arguments.json else f"the format {arguments.format}"
        raise WrongWordError(f"For {what} name a folder: --out - prints the text of one file.")
    with tempfile.TemporaryDirectory(prefix="forcelab-") as folder:
        texts = [path.read_bytes().decode() for path in _export(arguments, Path(folder))]
    if len(texts) > 1:
        raise WrongWordError(
            f"{len(texts)} files cannot be printed as one; name a folder, choose one of them, or "
            f"print all of it with --format table."
        )
    sys.stdout.write(texts[0])


def _ids(arguments: argparse.Namespace) -> set[str]:
    """The demonstrations of the tasks and names that are asked for."""
    with Project.open(arguments.project) as project:
        infos = project.demonstrations()
        for task in arguments.task or ():
            project.check_task(task)
        named = {project.id_of(name) for name in arguments.demo or ()}
    return named | {info.id for info in infos if info.task in (arguments.task or ())}
