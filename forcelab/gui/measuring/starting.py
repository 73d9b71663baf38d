"""From the call of the program to its first painted window."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Generator
from pathlib import Path

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.latency import Bound, Latency

__all__ = ["measuring_start"]

EMPTY, OPEN = Bound("median", 1.5), Bound("median", 2.5)
PATIENCE = 120.0


def measuring_start(
    folder: Path, project: Path, *, times: int
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Start the program, with and without a project; see :mod:`forcelab.gui.measuring`.

    Parameters
    ----------
    folder : Path
        Where its settings are kept.
    project : Path
        What is opened.
    times : int
        Of each.
    """
    environment = {**os.environ, "FORCELAB_SETTINGS": str(folder / "started.ini")}
    # So that the start without a project is not the first one ever, which makes the sample project.
    Path(environment["FORCELAB_SETTINGS"]).write_text("[window]\nbegun=true\n", "utf-8")
    cases: dict[str, tuple[list[str], Bound]] = {
        "no project": ([], EMPTY),
        "a demonstration open": ([str(project)], OPEN),
    }
    painted: dict[str, list[float]] = {name: [] for name in cases}
    complete: dict[str, list[float]] = {name: [] for name in cases}
    for number in range(times):
        for i, (name, (arguments, _)) in enumerate(cases.items()):
            yield Progress(len(cases) * number + i, len(cases) * times, f"start, {name}")
            first, all_ = _started(arguments, environment)
            painted[name].append(first)
            complete[name].append(all_)
    return tuple(
        row
        for name, (_, bound) in cases.items()
        for row in (
            Latency("start to the first painted window", name, tuple(painted[name]), bound),
            Latency("start until everything is there", name, tuple(complete[name])),
        )
    )


def _started(arguments: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Seconds from the call of a new process to its two stamps."""
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "forcelab.gui.measuring.started", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    stamps = done.stdout.split()
    if done.returncode or len(stamps) != 2:
        raise InputError(
            f"The program that was started for the measurement ended with {done.returncode}: "
            f"{done.stderr.strip()[-300:]}"
        )
    return float(stamps[0]) - begin, float(stamps[1]) - begin
