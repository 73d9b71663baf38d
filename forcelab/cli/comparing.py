"""``forcelab realism``."""

from __future__ import annotations

import argparse
from dataclasses import asdict

from joblib import cpu_count

from forcelab.cli.files import check_outputs
from forcelab.cli.output import json_path, progress_bar, report, table
from forcelab.jobs import finish
from forcelab.measure.beside import Beside, comparing
from forcelab.measure.realism import FACTOR, MARK, cells
from forcelab.wording import counted


def run(arguments: argparse.Namespace) -> None:
    """Compare, print the tables, and write what was asked for."""
    check_outputs([json_path(arguments.json)], [arguments.project])
    job = comparing(
        arguments.project,
        author=arguments.author,
        count=arguments.count,
        seed=arguments.seed,
        jobs=cpu_count(),
    )
    with progress_bar("comparing") as watch:
        compared = finish(job, watch)
    report(_told(compared), [_plain(one) for one in compared], arguments.json)


def _told(compared: tuple[Beside, ...]) -> str:
    """The tables for people."""
    parts = [
        f"{one.task}: {counted(one.simulated, 'simulated demonstration')} beside {one.real} real\n"
        + table(cells(one.rows), right=(3, 4, 5))
        for one in compared
    ]
    return "\n\n".join([*parts, f"{MARK} marks what is more than a factor of {FACTOR:g} apart."])


def _plain(one: Beside) -> dict[str, object]:
    """One task's comparison as plain values."""
    return {
        "task": one.task,
        "simulated": one.simulated,
        "real": one.real,
        "rows": [asdict(row) | {"ratio": row.ratio, "alike": row.alike} for row in one.rows],
    }
