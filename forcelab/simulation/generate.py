"""From tasks and seeds to demonstrations as a project takes them, all of them or none."""

from __future__ import annotations

import tempfile
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import groupby
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.jobs import Progress, finish, job
from forcelab.parallel import map_in_processes
from forcelab.project import AddResult, NewDemonstration, Project
from forcelab.project.records import segments_to_json
from forcelab.simulation.coder_model import CODERS, Coding, code
from forcelab.simulation.origin import Origin
from forcelab.simulation.scene import TASKS, Performance
from forcelab.simulation.sensor import CHANNELS, Sensor, SensorRecord, record
from forcelab.simulation.tasks import perform_job, vocabulary

#: Random streams of a demonstration, beside those of its choreography.
NOISE, CAMERA, CODER = range(1, 4)
#: Demonstrations are integrated in batches of this size: 1 to 6, 7 to 12, ... Always whole ones,
#: asked for or not: the last digits of a motion may depend on what is integrated beside it, and
#: six take hardly longer than one.
BATCH = 6
#: Demonstrations whose motion is held in memory at a time.
HELD = 24


@dataclass(frozen=True)
class Order:
    """A demonstration that is to be made."""

    origin: Origin
    #: Names of the simulated coders who label it.
    coders: tuple[str, ...] = tuple(coder.name for coder in CODERS)
    video: bool = True  # whether it is filmed; that changes no force
    #: Whether the video's clock is known, or is as the camera left it: started by hand.
    synchronised: bool = True


def produce_demonstrations(
    orders: Sequence[Order], scratch: Path, jobs: int = 1
) -> Generator[Progress, None, tuple[NewDemonstration, ...]]:
    """Make demonstrations; the same orders give the same bytes, whatever the number of jobs.

    A demonstration depends on its own order alone, not on those beside it.

    `orders`: no two with the same task, seed and number; `scratch`: an empty folder for the videos,
    until the demonstrations are in a project; `jobs`: processes that share the work. They come in
    the order of `orders`, each with its truth.

    The truth is what no recording tells; times are seconds on the force clock::

        actions    [start, end, action] of everything that was done
        events     [time, kind] of every contact, slip and snap
        taps       times of the taps
        saturated  by channel, how many samples were beyond what the sensor can tell
        mistakes   by coder, [start, end, action, taken for, or null where it was overlooked]
        video      offset and rate of the file's clock; frames: when each was really taken;
                   late: the numbers of those that came late. Absent without a video.
    """
    portions = [orders[first : first + HELD] for first in range(0, len(orders), HELD)]
    total = len(orders) + sum(len(list(_batches(portion))) for portion in portions)
    done = 0
    incoming_demonstrations: list[NewDemonstration] = []
    for portion in portions:
        batches = list(_batches(portion))
        yield Progress(done, total, _progress_text(batches))
        performances: dict[Origin, Performance] = {}
        # Closed at once when the job is cancelled: the processes end then.
        with closing(map_in_processes(_perform, batches, jobs)) as coming:
            for number, moved in enumerate(coming, start=1):
                performances.update(zip(batches[number - 1], moved, strict=True))
                done += 1
                yield Progress(done, total, _progress_text(batches[number:]))
        parts = ((order, performances[order.origin], scratch) for order in portion)
        with closing(map_in_processes(_record, parts, jobs)) as finished:
            for incoming in finished:
                incoming_demonstrations.append(incoming)
                done += 1
                yield Progress(done, total, f"recording {incoming.demonstration.name}")
    return tuple(incoming_demonstrations)


def _batches(orders: Sequence[Order]) -> Iterator[tuple[Origin, ...]]:
    """The origins of orders, in groups that are integrated at once.

    The tasks that take longest come last, so that progress is seen soon.
    """
    ordered = sorted(
        (order.origin for order in orders),
        key=lambda origin: (-TASKS.index(origin.task), origin.seed, origin.number),
    )
    for _, batch in groupby(ordered, key=lambda o: (o.task, o.seed, (o.number - 1) // BATCH)):
        yield tuple(batch)


def _progress_text(batches: Sequence[tuple[Origin, ...]]) -> str:
    """What is still being simulated; it may take seconds until the next batch is done."""
    tasks = dict.fromkeys(batch[0].task for batch in batches)
    return f"simulating {', '.join(tasks)}" if tasks else "recording"


def _perform(batch: Sequence[Origin]) -> tuple[Performance, ...]:
    """What the tongs did in those demonstrations of a batch that are asked for."""
    first = 1 + (batch[0].number - 1) // BATCH * BATCH
    numbers = range(first, first + BATCH)
    moved = finish(perform_job(batch[0].task, batch[0].seed, numbers, taps=True))
    return tuple(moved[numbers.index(origin.number)] for origin in batch)


def _record(part: tuple[Order, Performance, Path]) -> NewDemonstration:
    """A performance as it comes out of sensors, coders and camera."""
    order, performance, scratch = part
    origin = order.origin
    # A seed is a day in the laboratory: all of its demonstrations are made with one pair of tongs.
    sensor = Sensor.drawn(np.random.default_rng(origin.seed))
    recorded = record(
        performance.forces, performance.rate, origin.rate, sensor, origin.stream(NOISE)
    )
    codings = [
        code(performance, coder, origin.stream(CODER, number))
        for number, coder in enumerate(CODERS)
        if coder.name in order.coders
    ]
    truth = _truth(performance, recorded, codings)
    videos = []
    if order.video:
        path, frames, clock = _film(performance, origin, scratch)
        truth["video"] = frames
        videos.append(VideoReference(path, clock if order.synchronised else ClockMap()))
    demonstration = Demonstration(
        name=origin.name,
        task=origin.task,
        times=recorded.times,
        signals=recorded.signals,
        channels=tuple(Channel(name, "N") for name in CHANNELS),
        videos=tuple(videos),
    )
    return NewDemonstration(
        demonstration,
        tracks=tuple(coding.track for coding in codings),
        source=str(origin),
        vocabulary=vocabulary(origin.task),
        truth=truth,
    )


def _truth(
    performance: Performance, recorded: SensorRecord, codings: Sequence[Coding]
) -> dict[str, Any]:
    """What happened, and what sensors and coders got wrong."""
    beyond = recorded.saturated.sum(axis=0).tolist()
    return {
        "actions": segments_to_json(performance.actions),
        "events": [[event.time, event.kind] for event in performance.events],
        "taps": list(performance.taps),
        "saturated": dict(zip(CHANNELS, beyond, strict=True)),
        "mistakes": {
            coding.track.author: [
                [*segments_to_json((mistake.segment,))[0], mistake.taken_for]
                for mistake in coding.mistakes
            ]
            for coding in codings
        },
    }


def _film(
    performance: Performance, origin: Origin, scratch: Path
) -> tuple[Path, dict[str, Any], ClockMap]:
    """Film a performance; gives the file, the truth about its frames, and its clock."""
    from forcelab.simulation.rendering import Camera, render  # loads OpenCV

    path = scratch / f"{origin.name}.mp4"
    camera = Camera.drawn(origin.stream(CAMERA))
    force, late = render(performance, path, camera)
    clock = camera.clock
    frames = {
        "offset": clock.offset,
        "rate": clock.rate,
        "frames": force.tolist(),
        "late": late.tolist(),
    }
    return path, frames, clock


@job
def simulate_job(
    path: str | PathLike[str], origins: Sequence[Origin], *, video: bool = True, jobs: int = 1
) -> Generator[Progress, None, tuple[AddResult, ...]]:
    """Simulate demonstrations, labelled by every simulated coder, and add them to a project.

    To stop iterating cancels it; nothing is written before all of them are made.

    Parameters
    ----------
    path : path-like
        The project's folder; made if there is none.
    origins : sequence of Origin
        What to make.
    video : bool
        Whether to film them; without, OpenCV is never loaded.
    jobs : int
        Processes that share the work.

    Returns
    -------
    tuple of AddResult
        What became of each; one that is there already is unchanged.

    Raises
    ------
    InputError
        If the folder is no project or may not be written, or the disk is full. The project is as
        it was then, and one that did not exist does not exist afterwards either.

    Examples
    --------
    >>> from forcelab.simulation.origin import Origin
    >>> job = forcelab.simulate_job("simulated.forcelab", [Origin("foam", 7, 1)], video=False)
    >>> [result.name for result in forcelab.finish(job)]
    ['foam-7-01']
    """
    path = Path(path)
    new = Project.vacant(path)
    if not new:
        with Project.open(path) as project:
            project.refuse_read_only()  # before the work and not after it
    orders = [Order(origin, video=video) for origin in origins]
    with tempfile.TemporaryDirectory(prefix="forcelab-") as scratch:
        demonstrations = yield from produce_demonstrations(orders, Path(scratch), jobs)
        yield Progress(len(orders), len(orders), f"writing {path.name}")
        with Project.creating(path) if new else Project.open(path) as project:
            return project.demonstrations.add_all(demonstrations)
