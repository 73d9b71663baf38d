"""``forcelab measure``."""

from __future__ import annotations

import argparse
import os
from importlib import import_module
from pathlib import Path

from forcelab.cli.files import check_outputs
from forcelab.cli.output import json_path, printable, progress_bar, report, table
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.measure.latency import Latencies
from forcelab.measure.rows import FRONT, Table

#: What is measured by which module, each loaded only when it is asked for.
MODULES = {
    "contact": "forcelab.measure.contact",
    "cwt": "forcelab.measure.cwt",
    "stream": "forcelab.measure.stream",
    "live": "forcelab.measure.live",
    "view": "forcelab.gui.measuring",
    "training": "forcelab.gui.measuring.training",
}
#: What measures how long a person waits, with bounds instead of errors: nothing to trade off.
WAITS = ("view", "training")


def run(arguments: argparse.Namespace) -> None:
    """Measure, print the table, and write what was asked for."""
    figure: Path | None = arguments.figure
    check_outputs([json_path(arguments.json), figure], [])
    if figure is not None and arguments.what in WAITS:
        raise InputError(f"There is no figure of '{arguments.what}'; leave --figure away.")
    if figure is not None:
        from forcelab.gui.figures.canvas import check_suffix

        check_suffix(figure)
    if arguments.extremes:
        _extremes(arguments)
        return
    module = import_module(MODULES[arguments.what])
    with progress_bar("measuring") as watch:
        measured: Table | Latencies = finish(module.tabulate(quick=arguments.quick), watch)
    if isinstance(measured, Latencies):
        report(_waited(measured), measured.to_json(), arguments.json)
        return
    report(_told(measured), measured.to_json(), arguments.json)
    if figure is not None:
        from forcelab.gui.figures.tradeoff import Tradeoff

        Tradeoff(measured).save(figure)


def _extremes(arguments: argparse.Namespace) -> None:
    """Judge extreme inputs and print a word for each."""
    from forcelab.measure.extremes import tabulate_extremes

    if arguments.what != "cwt" or arguments.figure is not None:
        raise InputError("--extremes goes with 'cwt', and there is no figure of it.")
    with progress_bar("measuring") as watch:
        verdicts = finish(tabulate_extremes(), watch)
    text = "\n".join([table(verdicts.cells()), *verdicts.left_out])
    report(text, verdicts.to_json(), arguments.json)


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


def _waited(measured: Latencies) -> str:
    """All latencies as text, with what was refused and how busy the machine was."""
    cells = measured.cells()
    sentences = [
        f"Refused: {row.name}, {row.setting}: {row.refusal}" for row in measured.rows if row.refusal
    ]
    if measured.loads:
        loads = ", ".join(f"{load:.1f}" for load in measured.loads)
        sentences.append(f"Load of the machine's {os.cpu_count()} cores before and after: {loads}.")
    kept = [row.kept for row in measured.rows if row.kept is not None]
    kept += [level.kept for level in measured.levels]
    sentences.append(f"{sum(kept)} of {len(kept)} bounds are kept.")
    lines = [table(cells, right=range(2, 8))]
    if measured.levels:
        lines += ["", table(measured.level_cells(), right=[2]), ""]
    lines += [printable(sentence) for sentence in (*measured.remarks, *sentences)]
    return f"{measured.title}.\n" + "\n".join(lines)
