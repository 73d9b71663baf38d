"""All measurements of the window, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from forcelab.gui.measuring import recordings
from forcelab.gui.measuring.capturing import measuring_capture
from forcelab.gui.measuring.films import FILMS, Film
from forcelab.gui.measuring.opening import measuring_opening
from forcelab.gui.measuring.panning import measuring_panning
from forcelab.gui.measuring.scalograms import measuring_scalograms
from forcelab.gui.measuring.stage import SIZE, stage
from forcelab.gui.measuring.starting import measuring_start
from forcelab.gui.measuring.strokes import measuring_strokes
from forcelab.gui.measuring.videos import measuring_video
from forcelab.jobs import Progress
from forcelab.measure.latency import Latencies, Latency, load

__all__ = ["FULL", "QUICK", "Amount", "tabulate"]


@dataclass(frozen=True, slots=True)
class Amount:
    """How much is measured.

    Parameters
    ----------
    samples : tuple of int
        Lengths of the recordings that are panned.
    gestures : int
        For each recording and range of spans, of eight frames each.
    films : tuple of Film
    frames, moves : int
        Length of a video, and steps and jumps in it.
    segments, strokes : int
        Of the track that is painted on, and how many are painted at each zoom.
    starts, openings : int
        Of the program, and of each project.
    demonstrations : int
        In the project that has many.
    scalograms : int
        Of each span of the longest recording, in each way.
    live : int
        Frames of the Capture workspace, with each of what it can show.
    """

    samples: tuple[int, ...] = (1_000_000, 10_000_000)
    gestures: int = 10
    films: tuple[Film, ...] = FILMS
    frames: int = 1500
    moves: int = 500
    segments: int = 10_000
    strokes: int = 100
    starts: int = 9
    openings: int = 10
    demonstrations: int = 1000
    scalograms: int = 5
    live: int = 600


FULL = Amount()
QUICK = Amount(
    samples=(1_000_000,),
    gestures=4,
    frames=600,
    moves=60,
    strokes=20,
    starts=5,
    openings=5,
    scalograms=3,
    live=150,
)


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Latencies]:
    """Measure everything: some minutes, and 2 GB of disk for a while.

    With `quick` only recordings of 1e6 samples, and fewer repetitions.

    Yields
    ------
    Progress

    Returns
    -------
    Latencies
    """
    wanted = QUICK if quick else FULL
    before = load()
    rows: list[Latency] = []
    with stage() as folder:
        for scene in _scenes(folder, wanted):
            rows += yield from scene()
    width, height = SIZE
    return Latencies(
        f"The window, {width} x {height} pixels, scalogram and lists shown; times in ms",
        tuple(rows),
        (before, load()),
    )


def _scenes(
    folder: Path, wanted: Amount
) -> list[Callable[[], Generator[Progress, None, tuple[Latency, ...]]]]:
    """What is measured, in this order."""
    dense: list[Path] = []

    def start() -> Generator[Progress, None, tuple[Latency, ...]]:
        yield Progress(0, 1, "making a project")
        project = recordings.long(folder, 60_000)
        return (yield from measuring_start(folder, project, times=wanted.starts))

    def strokes() -> Generator[Progress, None, tuple[Latency, ...]]:
        yield Progress(0, 1, f"making a track of {wanted.segments} segments")
        dense.append(recordings.segmented(folder, wanted.segments))
        return (
            yield from measuring_strokes(
                dense[0], segments=wanted.segments, times=wanted.strokes, size=SIZE
            )
        )

    def opening() -> Generator[Progress, None, tuple[Latency, ...]]:
        yield Progress(0, 1, f"making {wanted.demonstrations} demonstrations")
        projects = {
            f"{wanted.demonstrations} demonstrations": recordings.many(
                folder, wanted.demonstrations
            ),
            f"{wanted.segments} segments": dense[0],
        }
        return (yield from measuring_opening(projects, times=wanted.openings, size=SIZE))

    def video(film: Film) -> Generator[Progress, None, tuple[Latency, ...]]:
        return measuring_video(folder, film, frames=wanted.frames, times=wanted.moves, size=SIZE)

    def panning(count: int) -> Generator[Progress, None, tuple[Latency, ...]]:
        return measuring_panning(folder, count, gestures=wanted.gestures, size=SIZE)

    def scalograms() -> Generator[Progress, None, tuple[Latency, ...]]:
        count, times = wanted.samples[-1], wanted.scalograms
        return measuring_scalograms(folder, count, times=times, size=SIZE)

    return [
        start,
        strokes,
        opening,
        partial(measuring_capture, folder, frames=wanted.live, size=SIZE),
        *(partial(video, film) for film in wanted.films),
        *(partial(panning, count) for count in wanted.samples),
        scalograms,
    ]
