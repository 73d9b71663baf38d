"""``forcelab measure``."""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable, Generator
from importlib import import_module
from pathlib import Path

from forcelab.cli.files import check_outputs
from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_path, printable, progress_bar, report, table
from forcelab.errors import ForcelabError
from forcelab.jobs import Progress, finish
from forcelab.measure.latency import Latencies
from forcelab.measure.rows import FRONT, Table

#: What is measured by which module, each loaded only when it is asked for.
MODULES = {
    "contact": "forcelab.measure.contact",
    "cwt": "forcelab.measure.cwt",
    "stream": "forcelab.measure.stream",
    "live": "forcelab.measure.live",
    "capture": "forcelab.measure.capture",
    "scalogram": "forcelab.measure.scalogram",
    "recognition": "forcelab.measure.recognition_tasks",
    "view": "forcelab.gui.measuring.scenes",
    "training": "forcelab.gui.measuring.training",
}
#: What measures how long a person waits, with bounds instead of errors: nothing to trade off.
WAITS = ("view", "training")
RECOGNITION, ALL = "recognition", "all"
#: What measures something else of recognition than presets and settings.
OTHERWISE = ("--next", "--swapped")


def run(arguments: argparse.Namespace) -> None:
    """Measure, print the table, and write what was asked for."""
    figure: Path | None = arguments.figure
    check_outputs([json_path(arguments.json), figure], [arguments.project])
    _check(arguments)
    if arguments.extremes:
        _extremes(arguments)
        return
    if arguments.what == ALL:
        _everything(arguments)
        return
    with progress_bar("measuring") as watch:
        measured = finish(_job(arguments.what, arguments), watch)
    report(_told(measured), measured.to_json(), arguments.json)
    if figure is not None and isinstance(measured, Table):
        from forcelab.gui.figures.tradeoff import Tradeoff

        Tradeoff(measured).save(figure)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what does not go together, before the work and not after it."""
    what, figure = arguments.what, arguments.figure
    if figure is not None and what in (*WAITS, ALL):
        raise WrongWordError(f"There is no figure of '{what}'; leave --figure away.")
    if figure is not None:
        from forcelab.gui.figures.canvas import check_suffix

        check_suffix(figure)
    asked = {
        "PROJECT": arguments.project,
        "--task": arguments.task,
        "--author": arguments.author,
        "--thorough": arguments.thorough,
        "--next": arguments.next,
        "--swapped": arguments.swapped,
    }
    given = [name for name, value in asked.items() if value]
    # Of all there is the usual measurement of recognition.
    other = [name for name in OTHERWISE if name in given]
    wrong = given if what not in (RECOGNITION, ALL) else other if what == ALL else []
    if wrong:
        raise WrongWordError(f"{wrong[0]} goes with '{RECOGNITION}', not with '{what}'.")
    if len(other) > 1:
        raise WrongWordError(f"{' and '.join(other)} are two measurements; ask for one at a time.")
    if other and arguments.thorough:
        raise WrongWordError(f"--thorough changes nothing of {other[0]}; leave it away.")


def _job(what: str, arguments: argparse.Namespace) -> Generator[Progress, None, Table | Latencies]:
    """What measures one thing."""
    if what == RECOGNITION:
        return _recognition(arguments)
    job: Generator[Progress, None, Table | Latencies] = import_module(MODULES[what]).tabulate(
        quick=arguments.quick
    )
    return job


def _recognition(arguments: argparse.Namespace) -> Generator[Progress, None, Table]:
    """Measure a project; without one, the sample project."""
    from forcelab.measure.recognition_tasks import Question, measured_tasks
    from forcelab.project import Project

    question: Question = "recognition"
    if arguments.next or arguments.swapped:
        question = "next" if arguments.next else "swapped"
    quick, thorough = arguments.quick, arguments.thorough
    with tempfile.TemporaryDirectory(prefix="forcelab-") as scratch:
        path = arguments.project
        if path is None:
            path = yield from _sample(Path(scratch))
        with Project.open(path) as project:
            tasks, author = arguments.task or (), arguments.author
            job = measured_tasks(project, tasks, author, question, quick=quick, thorough=thorough)
            return (yield from job)


def _sample(scratch: Path) -> Generator[Progress, None, Path]:
    """The sample project of this user, or one made for as long as it is measured."""
    from forcelab.gui.opening import sample_place
    from forcelab.project import Project
    from forcelab.sample import making

    place = sample_place()
    if not Project.vacant(place):
        return place
    made = scratch / place.name
    yield from making(made)
    return made


def _everything(arguments: argparse.Namespace) -> None:
    """Measure one thing after the other; what cannot be measured here is told by its name."""
    told, plain, skipped = [], {}, {}
    for what in MODULES:
        if why := _missing(what):
            skipped[what] = why
            continue
        with progress_bar(f"measuring {what}") as watch:
            measured, why = _tried(_job(what, arguments), watch)
        if measured is None:
            skipped[what] = why
            continue
        told.append(_told(measured))
        plain[what] = measured.to_json()
    told += [f"Skipped: {what}: {why}" for what, why in skipped.items()]
    report("\n\n".join(told), {"tables": plain, "skipped": skipped}, arguments.json)


def _missing(what: str) -> str:
    """Why something cannot be measured on this machine; empty where it can."""
    if what not in WAITS:
        return ""
    wanted = os.environ.get("QT_QPA_PLATFORM", "offscreen").partition(":")[0]
    displays = {"xcb": "DISPLAY", "wayland": "WAYLAND_DISPLAY"}
    if wanted in displays and not os.environ.get(displays[wanted]):
        return f"QT_QPA_PLATFORM asks for {wanted} and there is no display; unset it."
    return ""


def _tried(
    job: Generator[Progress, None, Table | Latencies], watch: Callable[[Progress], None]
) -> tuple[Table | Latencies | None, str]:
    """What was measured, or why it could not be."""
    try:
        return finish(job, watch), ""
    except ForcelabError as error:
        return None, str(error)


def _extremes(arguments: argparse.Namespace) -> None:
    """Judge extreme inputs and print a word for each."""
    from forcelab.measure.extremes import tabulate_extremes

    if arguments.what != "cwt" or arguments.figure is not None:
        raise WrongWordError("--extremes goes with 'cwt', and there is no figure of it.")
    with progress_bar("measuring") as watch:
        verdicts = finish(tabulate_extremes(), watch)
    text = "\n".join([table(verdicts.cells()), *verdicts.left_out])
    report(text, verdicts.to_json(), arguments.json)


def _told(measured: Table | Latencies) -> str:
    """What was measured as text."""
    return _waited(measured) if isinstance(measured, Latencies) else _tabled(measured)


def _tabled(measured: Table) -> str:
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
