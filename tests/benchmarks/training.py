"""How long the window's event loop waits while a recogniser is trained beside it.

The window's own job trains on two demonstrations of 200,000 samples, leaving out one and then the
other, so that each fit has 200,000 samples of 96 features (4 channels, 12 scales, log magnitude
and phase). Meanwhile the window pans the open demonstration.
"""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Generator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
import psutil
from PySide6.QtCore import QTimer

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.gui.jobs import Job
from forcelab.gui.review.training_backend import Backend
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.review.run_result import RunResult
from tests.benchmarks import view
from tests.benchmarks.latency import Bound, Latencies, Latency, Level, load
from tests.benchmarks.view import AUTHOR, Lateness, rest, settle, shown, stage, until

TASK, KEY = "measured", "measured training"
#: Of the window, in pixels.
SIZE = (1280, 800)
#: With 4 recognition channels these are 12 scales, so 96 features.
WIDEST = 4096.0
LATE, IDLE = Bound("p99", 0.016), Bound("worst", 0.200)
#: Megabytes by which the window may differ after all trainings.
MEMORY = 50.0
#: Seconds visible while panning, their share by which a frame moves on, and from one to the next.
VISIBLE, MOVED, PACE = 10.0, 0.01, 1 / 60
#: What Linux calls the threads of Qt's pool.
POOLED = "Thread (pooled)"
#: Seconds after its start in which a training is cancelled.
SOON = 6.0


@dataclass(frozen=True, slots=True)
class Amount:
    """How much is measured."""

    samples: int = 200_000  # of each of the two demonstrations
    seconds: float = 30.0  # how long the window pans
    cancels: int = 20  # of each classifier
    trainings: int = 10  # after which memory, threads and processes are looked at


FULL = Amount()
QUICK = Amount(seconds=10.0, cancels=4, trainings=3)


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Latencies]:
    """Measure everything: some minutes."""
    chosen = QUICK if quick else FULL
    before = load()
    with stage() as folder:
        yield Progress(0, 4, "making the recordings")
        path = _make_project(folder, chosen.samples)
        with shown(path, SIZE) as window:
            bench = _Bench(window, path, chosen)
            rows = list((yield from bench.panning()))
            rows += yield from bench.cancelling()
            levels = yield from bench.remaining()
    width, height = SIZE
    return Latencies(
        f"The window, {width} x {height} pixels, while it trains on 2 x {chosen.samples:,} samples "
        f"of 96 features; times in ms",
        tuple(rows),
        (before, load()),
        (
            "Memory: against the window that has panned, but never trained. Processes: besides the "
            "one that starts trainings and the one that tidies up after it, which stay with the "
            "window. CPU time is that of the thread that paints, so other programs are not in it.",
        ),
        levels,
    )


def _make_project(folder: Path, samples: int) -> Path:
    """A project of two demonstrations, labelled from end to end."""
    actions = view.ACTIONS
    with Project.create(folder / "training.forcelab") as project:
        for number in range(2):
            base = view.recording(samples, f"{number + 1:02d}", seed=number)
            demonstration = Demonstration(base.name, TASK, base.times, base.signals, base.channels)
            edges = np.linspace(base.start, base.end, 101).tolist()
            track = tuple(
                Segment(start, end, actions[i % len(actions)])
                for i, (start, end) in enumerate(pairwise(edges))
            )
            project.demonstrations.add(demonstration, [Track(AUTHOR, track)])
        return project.path


class _Bench:
    """The window, and the trainings in it."""

    def __init__(self, window: Window, path: Path, amount: Amount) -> None:
        self._window = window
        self._path = path
        self._amount = amount
        self._on = f"2 x {amount.samples:,} samples"
        self._memory = 0.0

    def panning(self) -> Generator[Progress, None, tuple[Latency, ...]]:
        """How late the event loop is while panning, alone and while a training is at work."""
        name, alone = "event loop's lateness, panning", "the same without training"
        own, own_alone = "window's own CPU time a step", "its CPU time without training"
        yield Progress(1, 4, alone)
        quiet, quiet_own = self._pan()
        # What panning has made and keeps, such as pixmaps, is no cost of trainings.
        self._memory = self._footprint()[0]
        yield Progress(1, 4, name)
        job, trail = self._train("mlp")
        self._until(lambda: any(step.phase == "fold" for step in trail))
        late, late_own = self._pan()
        if not job.running:
            raise InputError("The training was over before the panning; measure on more samples.")
        self._cancel(job)
        return (
            Latency(name, self._on, late, LATE, alternative=alone),
            Latency(alone, self._on, quiet),
            Latency(own, self._on, late_own, LATE, alternative=own_alone),
            Latency(own_alone, self._on, quiet_own),
        )

    def cancelling(self) -> Generator[Progress, None, tuple[Latency, ...]]:
        """How long it takes from Cancel until nothing works any more, at random moments."""
        random, rows = np.random.default_rng(6), []
        for classifier in ("mlp", "svm"):
            taken = []
            for number in range(self._amount.cancels):
                yield Progress(2, 4, f"cancel {classifier}, {number + 1} of {self._amount.cancels}")
                job, _ = self._train(classifier)
                rest(float(random.uniform(0.0, SOON)))
                taken.append(self._cancel(job))
            rows.append(Latency(f"cancel to idle, {classifier}", self._on, tuple(taken), IDLE))
        return tuple(rows)

    def remaining(self) -> Generator[Progress, None, tuple[Level, ...]]:
        """What trainings leave behind, all they show included."""
        number = self._amount.trainings
        yield Progress(3, 4, "training once")
        before = (self._memory, *self._footprint()[1:])
        for i in range(number):
            yield Progress(3, 4, f"training {i + 1} of {number}")
            self._train_and_show()
        after = self._footprint()
        where = f"{number} trainings, {self._on}"
        names = (("memory more", "MB", MEMORY), ("threads more", "", 0), ("processes more", "", 0))
        return tuple(
            Level(name, where, now - then, unit, most)
            for (name, unit, most), then, now in zip(names, before, after, strict=True)
        )

    def _train(self, classifier: str) -> tuple[Job, list[Any]]:
        """Begin a training just as the window does."""
        trail: list[Any] = []
        job = self._window.jobs.run(
            Backend().train(
                self._path, lambda: (_settings(classifier), DataSelection((TASK,))), TASK, trail
            ),
            lambda _: None,
            lambda _: None,
            lambda _: None,
            key=KEY,
        )
        return job, trail

    def _train_and_show(self) -> None:
        """Train to the end, and review what came of it."""
        job, _ = self._train("naive-bayes")
        self._until(lambda: not job.running)
        if job.error is not None:
            raise job.error
        self._window.document.review.set_run(cast(RunResult, job.result))

    def _cancel(self, job: Job) -> float:
        """Cancel a training; gives the seconds until it is gone."""
        begin = time.perf_counter()
        self._window.jobs.cancel(KEY)
        self._until(lambda: not job.running)
        return time.perf_counter() - begin

    def _pan(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Pan to and fro.

        Gives `late`: seconds that the event loop is late; `own`: CPU seconds that the window's
        thread takes for each step; whatever else the machine does is not in them.
        """
        document = self._window.document
        low, high = document.view.bounds
        start, step = low, MOVED * VISIBLE
        document.view.set_span(start, start + VISIBLE)
        rest(1.0)  # the window never settles while it trains
        end, own = time.perf_counter() + self._amount.seconds, []
        with Lateness() as lateness:
            while time.perf_counter() < end:
                begin, worked = time.perf_counter(), time.thread_time()
                if not low <= start + step <= high - VISIBLE:
                    step = -step
                start += step
                document.view.set_span(start, start + VISIBLE)
                rest(max(0.001, PACE - (time.perf_counter() - begin)))
                own.append(time.thread_time() - worked)
        return tuple(lateness.samples), tuple(own)

    def _until(self, holds: Any) -> None:
        """Run the event loop until something holds, and look every millisecond."""
        tick = QTimer()
        tick.start(1)
        until(holds)
        tick.stop()

    def _footprint(self) -> tuple[float, int, int]:
        """Megabytes, threads and processes of the window, once all is quiet."""
        settle(self._window)
        rest(1.0)
        gc.collect()
        process = psutil.Process()
        return (
            process.memory_info().rss / 1e6,
            _threads(),
            len(process.children(recursive=True)),
        )


def _threads() -> int:
    """Threads of this process, but for those of Qt's pool: idle, they end after half a minute."""
    tasks = Path("/proc/self/task")
    if not tasks.is_dir():
        return threading.active_count()
    return sum((task / "comm").read_text().strip() != POOLED for task in tasks.iterdir())


def _settings(classifier: str) -> Settings:
    """What is trained, with 96 features."""
    return preset("paper").replace(classifier=classifier, max_scale=WIDEST)
