"""What measures forcelab for its makers: ``python -m tests.benchmarks WHAT``, from the checkout.

view      the window, painted into memory: panning, scalograms, videos, painting, start, opening
training  the window's event loop while a recogniser is trained
scalogram first and exact image of spans of 4,000 to 1e7 samples
live      live recognition: its share of a core, time from force to label, agreement with offline
capture   ten minutes of two DAQs and a camera through pseudo-terminals (--quick: 30 s)
peers     logistic regression, a linear chain, MiniRocket, LightGBM, a 1-D CNN and an MS-TCN on the
          tasks of PROJECT, settings chosen and calibrated on inner folds
next      whether it pays to label what a review proposes next, on the tasks of PROJECT
swapped   what wrong labels cost, and how many of them a review lists first, on those of PROJECT
realism   the simulated tasks beside the real recordings of PROJECT
"""

from __future__ import annotations

import argparse
import os
from importlib import import_module
from pathlib import Path

from forcelab.cli.commands.measure import table_text
from forcelab.cli.output import printable, progress_bar, table
from forcelab.errors import ForcelabError
from forcelab.jobs import finish
from forcelab.measure.recognition import FOLDS, rows_of_tasks
from forcelab.measure.rows import Table, with_front
from forcelab.project import Project
from forcelab.recognition.presets import PRESETS
from forcelab.text import counted
from tests.benchmarks import label_next, swapped
from tests.benchmarks.latency import Latencies
from tests.benchmarks.realism import FACTOR, MARK, cells, comparing
from tests.benchmarks.recognition_peers import measuring_peers

ALONE = ("view", "training", "scalogram", "live", "capture")
OF_PROJECTS = ("peers", "next", "swapped", "realism")
#: Partings and draws of the quick form.
FEW = 2


def waits_text(measured: Latencies) -> str:
    """All latencies as text, with what was refused and how busy the machine was."""
    cells = measured.cells()
    sentences = [
        f"Refused: {row.name}, {row.setting}: {row.refusal}" for row in measured.rows if row.refusal
    ]
    if measured.loads:
        loads = ", ".join(f"{load:.1f}" for load in measured.loads)
        sentences.append(f"Load of the machine's {os.cpu_count()} cores before and after: {loads}.")
    held = [row.holds for row in measured.rows if row.holds is not None]
    held += [level.holds for level in measured.levels]
    sentences.append(f"{sum(held)} of {len(held)} bounds are kept.")
    lines = [table(cells, right=range(2, 8))]
    if measured.levels:
        lines += ["", table(measured.level_cells(), right=[2]), ""]
    lines += [printable(sentence) for sentence in (*measured.remarks, *sentences)]
    return f"{measured.title}.\n" + "\n".join(lines)


def table_of_tasks(what: str, project: Project, author: str | None, *, quick: bool) -> Table:
    """Measure what depends on labels on each task of a project."""

    def of_peers(labelled, size):
        return measuring_peers(labelled, size, FOLDS)

    def of_next(labelled, size):
        return label_next.measuring_next(labelled, size, turns=FEW if quick else label_next.TURNS)

    def of_swapped(labelled, size):
        rows = []
        for name in swapped.MEASURED[:1] if quick else swapped.MEASURED:
            draws = FEW if quick else swapped.DRAWS
            rows.append(
                (yield from swapped.measuring_swapped(labelled, size, PRESETS[name], draws))
            )
        return with_front(rows)

    error, seconds = {
        "peers": ("1 - F1@50", "CPU s"),
        "next": (label_next.ERROR_NEXT, label_next.SECONDS_NEXT),
        "swapped": (swapped.ERROR_SWAPPED, swapped.SECONDS_SWAPPED),
    }[what]
    measure = {"peers": of_peers, "next": of_next, "swapped": of_swapped}[what]
    with progress_bar("measuring") as watch:
        rows = finish(rows_of_tasks(project, (), author, what, measure), watch)
    return Table(what, error, seconds, rows, ".3f")


def realism_text(path: Path, author: str | None) -> str:
    """The tables of the simulation beside real recordings."""
    with progress_bar("comparing") as watch:
        job = comparing(path, author=author, jobs=os.cpu_count())
        compared = finish(job, watch)
    parts = [
        f"{task.task}: {counted(task.simulated, 'simulated demonstration')} beside "
        f"{task.real} real\n" + table(cells(task.rows), right=(3, 4, 5))
        for task in compared
    ]
    return "\n\n".join([*parts, f"{MARK} marks what is more than a factor of {FACTOR:g} apart."])


def text_of(what: str, path: Path | None, author: str | None, *, quick: bool) -> str:
    """Measure, and write it as tables."""
    if what == "realism":
        return realism_text(path, author)
    if what in OF_PROJECTS:
        with Project.open(path) as project:
            return table_text(table_of_tasks(what, project, author, quick=quick))
    with progress_bar(f"measuring {what}") as watch:
        measured = finish(import_module(f"tests.benchmarks.{what}").tabulate(quick=quick), watch)
    return waits_text(measured) if isinstance(measured, Latencies) else table_text(measured)


def main() -> None:
    parser = argparse.ArgumentParser(
        prog="python -m tests.benchmarks",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("what", choices=(*ALONE, *OF_PROJECTS))
    parser.add_argument("project", type=Path, nargs="?")
    parser.add_argument("--author", help="whose labels, where a project has several coders")
    parser.add_argument("--quick", action="store_true", help="less of it")
    options = parser.parse_args()
    if (options.what in OF_PROJECTS) != (options.project is not None):
        parser.error(f"PROJECT goes with {', '.join(OF_PROJECTS)}, and with these only.")
    try:
        print(text_of(options.what, options.project, options.author, quick=options.quick))
    except ForcelabError as error:
        parser.exit(1, f"{error}\n")


if __name__ == "__main__":
    main()
