"""Simulate demonstrations with a physical model of the tongs.

They are added to a project, which is created if need be, with labels by two simulated
coders. The same task and seed give the same demonstrations: number 2 is the same
whether 3 or 30 are simulated, with or without video.

for example:
  forcelab simulate --task marker --count 3 --seed 7 --out made.forcelab
"""

from __future__ import annotations

import argparse
from collections import Counter

from joblib import cpu_count

from forcelab.cli.options import PROJECT, UsageError, add_json, name_of, path_of
from forcelab.cli.output import print_result, printable, progress_bar
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.simulation.generate import simulate_job
from forcelab.simulation.origin import origins, task_named
from forcelab.text import counted


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--task",
        type=name_of,
        required=True,
        help="LEGO, cartridge, stylus, marker or foam (whatever the case)",
    )
    parser.add_argument(
        "--count", metavar="N", type=int, required=True, help="number of demonstrations"
    )
    parser.add_argument("--seed", metavar="S", type=int, required=True, help="of everything random")
    parser.add_argument("--out", metavar="PROJECT", type=path_of, required=True, help=PROJECT)
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=float,
        default=1000.0,
        help="samples a second, 50 to 4000 (1000)",
    )
    parser.add_argument(
        "--no-video", dest="video", action="store_false", help="forces and labels only"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    try:
        task = task_named(arguments.task)
        recipes = origins(task, arguments.count, arguments.seed, arguments.rate)
    except InputError as error:
        raise UsageError(str(error)) from error
    with progress_bar() as watch:
        job = simulate_job(arguments.out, recipes, video=arguments.video, jobs=cpu_count())
        added = finish(job, watch)
    content = {
        "project": str(arguments.out),
        "demonstrations": [
            {"id": result.id, "name": result.name, "status": result.status} for result in added
        ],
    }
    lines = []
    for result in added:
        lines += [f"{result.status:<9}  {printable(result.name)}", *map(printable, result.remarks)]
    counts = Counter(result.status for result in added)
    numbers = ", ".join(f"{counts[status]} {status}" for status in ("new", "updated", "unchanged"))
    lines.append(f"{counted(len(added), 'demonstration')}: {numbers}.")
    print_result(arguments.json, content, "\n".join(lines))
