"""Measure error against run time.

Every row has its error and its reference, the median CPU time with its spread, and the
memory; * marks rows that no other beats in both error and time (Pareto front).

contact: the solvers of the simulated tongs.
cwt: the wavelet engine at all its tolerances, to log magnitude and phase, beside
PyWavelets, ssqueezepy and fCWT where they are installed (extra 'peers').
recognition: presets, scales, phase, classifiers, filters and decoders on each task of
PROJECT (the sample project): 1 - F1@50 and the other scores, with demonstrations left
out of training in four groups in turn, against the CPU time of features, training and
recognition. The page Accuracy and speed of the Review workspace draws it. With
--scheduler the variants are measured by the workers of a cluster, each by one alone.
all: all of these; what cannot be measured here is listed as skipped.

for example:
  forcelab measure cwt --quick
  forcelab measure recognition lab.forcelab --task stylus --figure tradeoff.svg
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Generator
from importlib import import_module
from pathlib import Path

from forcelab.cli.files import check_figure, check_outputs, save_figure
from forcelab.cli.options import (
    UsageError,
    add_author,
    add_file,
    add_scheduler,
    add_task,
    join_scheduler,
)
from forcelab.cli.output import STANDARD_OUTPUT, printable, progress_bar, report, table
from forcelab.errors import ForcelabError
from forcelab.jobs import Progress, finish
from forcelab.measure.rows import FRONT, Table

#: What is measured by which module, each loaded only when it is asked for.
MODULES = {
    "contact": "forcelab.measure.contact",
    "cwt": "forcelab.measure.cwt",
    "recognition": "forcelab.measure.recognition",
}
RECOGNITION, ALL = "recognition", "all"
MEASURED = (*MODULES, ALL)


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", metavar="WHAT", choices=MEASURED, help=", ".join(MEASURED))
    parser.add_argument(
        "project", metavar="PROJECT", type=Path, nargs="?", help="recognition: folder of a project"
    )
    group = parser.add_argument_group("recognition")
    add_task(group, "only this; may be repeated", action="append")
    add_author(group, "the coder whose labels to use (the one with the most)")
    add_scheduler(group)
    group.add_argument(
        "--thorough",
        action="store_true",
        help="leave out one demonstration at a time, however many there are",
    )
    group = parser.add_argument_group("output")
    add_file(group, "--json", "write the rows as JSON; - prints them")
    add_file(
        group,
        "--figure",
        "draw error against time, where it has errors (.svg, .pdf or .png); - prints the SVG",
    )
    parser.add_argument(
        "--extremes",
        action="store_true",
        help="cwt: which engines handle zeros, gaps, steps, huge and tiny numbers",
    )
    parser.add_argument(
        "--quick", action="store_true", help="less of it: some minutes instead of half an hour"
    )


def run(arguments: argparse.Namespace) -> None:
    figure: Path | None = arguments.figure
    check_outputs([arguments.json, figure], [arguments.project])
    _check(arguments)
    if arguments.extremes:
        _extremes(arguments)
        return
    with join_scheduler(arguments.scheduler):
        if arguments.what == ALL:
            _measure_all(arguments)
        else:
            _measure(arguments)


def _measure(arguments: argparse.Namespace) -> None:
    with progress_bar("measuring") as watch:
        measured = finish(_job(arguments.what, arguments), watch)
    figure: Path | None = arguments.figure
    aside = figure == STANDARD_OUTPUT
    report(table_text(measured), measured.to_json(), arguments.json, aside=aside)
    if figure is not None:
        from forcelab.gui.figures.tradeoff import Tradeoff

        save_figure(Tradeoff(measured), figure)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what does not go together, before the work and not after it."""
    module, figure = arguments.what, arguments.figure
    if figure is not None and module == ALL:
        raise UsageError(f"There is no figure of '{module}'; leave --figure away.")
    if figure is not None:
        check_figure(figure)
    recognition_only = {
        "PROJECT": arguments.project,
        "--task": arguments.task,
        "--author": arguments.author,
        "--thorough": arguments.thorough,
        "--scheduler": arguments.scheduler,
    }
    misplaced = [name for name, value in recognition_only.items() if value]
    if misplaced and module not in (RECOGNITION, ALL):
        raise UsageError(f"{misplaced[0]} goes with '{RECOGNITION}', not with '{module}'.")


def _job(module: str, arguments: argparse.Namespace) -> Generator[Progress, None, Table]:
    """What measures one thing."""
    if module == RECOGNITION:
        return _recognition(arguments)
    job: Generator[Progress, None, Table] = import_module(MODULES[module]).tabulate(
        quick=arguments.quick
    )
    return job


def _recognition(arguments: argparse.Namespace) -> Generator[Progress, None, Table]:
    """Measure a project; without one, the sample project."""
    from forcelab.measure.recognition import measure_tasks
    from forcelab.project import Project

    quick, thorough = arguments.quick, arguments.thorough
    with tempfile.TemporaryDirectory(prefix="forcelab-") as scratch:
        path = arguments.project
        if path is None:
            path = yield from _sample(Path(scratch))
        with Project.open(path) as project:
            tasks, author = arguments.task or (), arguments.author
            job = measure_tasks(project, tasks, author, quick=quick, thorough=thorough)
            return (yield from job)


def _sample(scratch: Path) -> Generator[Progress, None, Path]:
    """The sample project of this user, or one made for as long as it is measured."""
    from forcelab.gui.project_actions import sample_place
    from forcelab.project import Project
    from forcelab.sample import make_sample_job

    place = sample_place()
    if not Project.vacant(place):
        return place
    created = scratch / place.name
    yield from make_sample_job(created)
    return created


def _measure_all(arguments: argparse.Namespace) -> None:
    """Measure one thing after the other; what cannot be measured here is told by its name."""
    texts, tables, skipped = [], {}, {}
    for module in MODULES:
        try:
            with progress_bar(f"measuring {module}") as watch:
                measured = finish(_job(module, arguments), watch)
        except ForcelabError as error:
            skipped[module] = str(error)
            continue
        texts.append(table_text(measured))
        tables[module] = measured.to_json()
    texts += [f"Skipped: {module}: {why}" for module, why in skipped.items()]
    report("\n\n".join(texts), {"tables": tables, "skipped": skipped}, arguments.json)


def _extremes(arguments: argparse.Namespace) -> None:
    """Judge extreme inputs and print a word for each."""
    from forcelab.measure.extremes import tabulate_extremes

    if arguments.what != "cwt" or arguments.figure is not None:
        raise UsageError("--extremes goes with 'cwt', and there is no figure of it.")
    with progress_bar("measuring") as watch:
        verdicts = finish(tabulate_extremes(), watch)
    text = "\n".join([table(verdicts.cells()), *verdicts.left_out])
    report(text, verdicts.to_json(), arguments.json)


def table_text(measured: Table) -> str:
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
