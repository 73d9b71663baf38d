"""What modules and videos cost to load, in processes of their own.

Run as ``python -m forcelab.measure.loading STAGE ...`` it loads one stage after the other and
prints a JSON list of CPU seconds and bytes of resident memory of each; a stage is a module, or
``video:`` and a path, of which the first frame is read.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from statistics import median

from forcelab.errors import ForcelabError, InputError
from forcelab.jobs import Progress

__all__ = ["VIDEO", "Loaded", "loading"]

#: Begins a stage that opens a video.
VIDEO = "video:"
PATIENCE = 300.0


@dataclass(frozen=True, slots=True)
class Loaded:
    """What a stage cost on top of those before it.

    Parameters
    ----------
    seconds : float or None
        CPU time, s; None where it could not be loaded.
    resident : int or None
        Bytes of memory that the process holds more than before it.
    refusal : str
        Why it could not be loaded; empty otherwise.
    """

    seconds: float | None = None
    resident: int | None = None
    refusal: str = ""


def loading(
    stages: Sequence[str], repetitions: int
) -> Generator[Progress, None, tuple[Loaded, ...]]:
    """Load stages in fresh processes, one after the other.

    Parameters
    ----------
    stages : sequence of str
        Modules, or ``video:PATH``; each pays for what it needs and no stage before has loaded.
    repetitions : int
        Processes; medians are given.

    Returns
    -------
    tuple of Loaded, length of `stages`

    Raises
    ------
    InputError
        If the process ends badly.
    """
    runs = []
    for repetition in range(repetitions):
        yield Progress(repetition, repetitions, "modules")
        runs.append(_run(stages))
    return tuple(_median(found) for found in zip(*runs, strict=True))


def _run(stages: Sequence[str]) -> list[Loaded]:
    """Load the stages in one fresh process."""
    try:
        done = subprocess.run(
            [sys.executable, "-m", __name__, *stages],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(
            f"Loading modules takes more than {PATIENCE:g} s; measure when the machine does less."
        ) from error
    if done.returncode:
        raise InputError(
            f"The process that loaded modules for the measurement ended with {done.returncode}: "
            f"{done.stderr.strip()[-300:]}"
        )
    # What a library prints when it is loaded comes before.
    return [Loaded(*one) for one in json.loads(done.stdout.splitlines()[-1])]


def _median(found: Sequence[Loaded]) -> Loaded:
    """What one stage cost in several processes."""
    seconds = [one.seconds for one in found if one.seconds is not None]
    resident = [one.resident for one in found if one.resident is not None]
    if len(seconds) < len(found) or not resident:
        return next(one for one in found if one.seconds is None)
    return Loaded(median(seconds), int(median(resident)))


def _load(stage: str) -> None:
    """Load one stage."""
    if not stage.startswith(VIDEO):
        import_module(stage)
        return
    from forcelab.video.reader import VideoReader

    with VideoReader(Path(stage.removeprefix(VIDEO))) as video:
        video.frame(0)


def _loaded(stage: str) -> Loaded:
    """Load one stage, and tell what it cost."""
    from psutil import Process

    process = Process()
    before, began = process.memory_info().rss, time.process_time()
    try:
        _load(stage)
    except (ImportError, ForcelabError) as error:
        return Loaded(refusal=str(error))
    spent = time.process_time() - began
    return Loaded(spent, max(0, process.memory_info().rss - before))


def _run_as_program(stages: Sequence[str]) -> None:
    """What this module does as a program."""
    # Paid for by no stage: Python, this measurement, and numpy, which everything loads.
    import numpy  # noqa: F401
    import psutil  # noqa: F401

    found = [_loaded(stage) for stage in stages]
    print(json.dumps([(one.seconds, one.resident, one.refusal) for one in found]))


if __name__ == "__main__":
    _run_as_program(sys.argv[1:])
