"""``forcelab simulate``."""

from __future__ import annotations

import argparse

from joblib import cpu_count

from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text, printable, progress_bar
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.simulation.generate import simulating
from forcelab.simulation.origin import origins, task_named
from forcelab.text import counted


def run(arguments: argparse.Namespace) -> None:
    """Simulate demonstrations into a project and tell what became of them."""
    try:
        task = task_named(arguments.task)
        wanted = origins(task, arguments.count, arguments.seed, arguments.rate)
    except InputError as error:
        raise WrongWordError(str(error)) from error
    with progress_bar() as watch:
        job = simulating(arguments.out, wanted, video=arguments.video, jobs=cpu_count())
        added = finish(job, watch)
    if arguments.json:
        told = [{"id": one.id, "name": one.name, "status": one.status} for one in added]
        print(json_text({"project": str(arguments.out), "demonstrations": told}))
        return
    for one in added:
        print(f"{one.status:<9}  {printable(one.name)}")
        for remark in one.remarks:
            print(printable(remark))
    counts = [(s, sum(one.status == s for one in added)) for s in ("new", "updated", "unchanged")]
    total = counted(len(added), "demonstration")
    print(f"{total}: {', '.join(f'{number} {status}' for status, number in counts)}.")
