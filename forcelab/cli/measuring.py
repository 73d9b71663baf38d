"""``forcelab measure``."""

from __future__ import annotations

import argparse
from importlib import import_module
from pathlib import Path

from forcelab.cli.files import check_outputs
from forcelab.cli.output import json_path, printable, progress_bar, report, table
from forcelab.jobs import finish
from forcelab.measure.rows import FRONT, Table


def run(arguments: argparse.Namespace) -> None:
    """Measure, print the table, and write what was asked for."""
    figure: Path | None = arguments.figure
    check_outputs([json_path(arguments.json), figure], [])
    if figure is not None:
        from forcelab.gui.figures.canvas import check_suffix

        check_suffix(figure)
    # Each thing is measured by a module of its name, loaded only when it is asked for.
    module = import_module(f"forcelab.measure.{arguments.what}")
    with progress_bar("measuring") as watch:
        measured: Table = finish(module.tabulate(quick=arguments.quick), watch)
    report(_told(measured), measured.to_json(), arguments.json)
    if figure is not None:
        from forcelab.gui.figures.tradeoff import Tradeoff

        Tradeoff(measured).save(figure)


def _told(measured: Table) -> str:
    """All rows as text, size by size, with what they were compared with and what was refused."""
    parts = [f"{measured.title}. {FRONT} no other is both faster and more exact."]
    for size in measured.sizes:
        rows = measured.of(size)
        cells = measured.cells(size)
        sentences = [
            f"Error against {words}." for words in dict.fromkeys(r.reference for r in rows)
        ]
        sentences += [f"Refused: {r.name}, {r.setting}: {r.refusal}" for r in rows if r.refusal]
        lines = [printable(size), table(cells, right=range(3, len(cells[0])))]
        parts.append("\n".join([*lines, *(printable(sentence) for sentence in sentences)]))
    return "\n\n".join(parts)
