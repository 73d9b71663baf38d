"""``forcelab realism``."""

from __future__ import annotations

import argparse
from pathlib import Path

from joblib import cpu_count

from forcelab.atomic import write_atomically
from forcelab.cli.files import check_outputs
from forcelab.cli.output import counted, json_text, progress_bar, table
from forcelab.jobs import finish
from forcelab.measure.beside import Beside, comparing
from forcelab.measure.realism import FACTOR, MARK, cells


def run(arguments: argparse.Namespace) -> None:
    """Compare, print the tables, and write what was asked for."""
    json_file: Path | None = None if arguments.json == Path("-") else arguments.json
    check_outputs([json_file], [])
    job = comparing(
        arguments.project,
        author=arguments.author,
        count=arguments.count,
        seed=arguments.seed,
        jobs=cpu_count(),
    )
    with progress_bar("comparing") as watch:
        compared = finish(job, watch)
    content = json_text([_plain(one) for one in compared]) + "\n"
    if json_file is not None:
        write_atomically(json_file, content.encode())
    print(content if arguments.json == Path("-") else _told(compared) + "\n", end="")


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
        "rows": [
            {
                "name": row.name,
                "unit": row.unit,
                "simulated": row.simulated,
                "real": row.real,
                "ratio": row.ratio,
                "alike": row.alike,
            }
            for row in one.rows
        ],
    }
