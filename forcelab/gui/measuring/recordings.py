"""Made-up projects to measure on: long ones, many, and densely labelled ones."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.gui.measuring.stage import AUTHOR
from forcelab.labels import Segment, Track
from forcelab.project import Incoming, Project

__all__ = ["ACTIONS", "RATE", "long", "many", "recording", "refusal", "segmented"]

#: Samples a second, the channels, and what is labelled.
RATE = 1000.0
CHANNELS = tuple(Channel(f"f{axis}{sensor}", "N") for sensor in (1, 2) for axis in "xyz")
ACTIONS = ("grab", "hold", "pull", "release", "still")
#: Bytes of one sample of all channels and its stamp, and how many times they are there at once
#: while a project is made: in memory, and in its file.
SAMPLE = 8 * (len(CHANNELS) + 1)
HEADROOM = 3


def recording(
    count: int, name: str = "01", video: VideoReference | None = None, seed: int = 0
) -> Demonstration:
    """Six channels of noise, with a grip that comes and goes at all time scales.

    Parameters
    ----------
    count : int
        Number of samples.
    name : str
    video : VideoReference, optional
    seed : int
    """
    random = np.random.default_rng(seed)
    times = np.arange(count) / RATE
    signals = np.empty((count, len(CHANNELS)))
    for column in range(len(CHANNELS)):
        signals[:, column] = 0.02 * random.standard_normal(count)
        for period in (1.7, 23.0, 411.0):
            signals[:, column] += np.sin(2 * np.pi * (times / period + random.random()))
    times.flags.writeable = signals.flags.writeable = False
    return Demonstration(name, "measured", times, signals, CHANNELS, video=video)


def refusal(folder: Path, count: int) -> str:
    """Why a recording of so many samples cannot be made here; empty if it can."""
    import psutil

    needed = HEADROOM * SAMPLE * count
    free = shutil.disk_usage(folder).free, psutil.virtual_memory().available
    for what, there in zip(("free on the disk", "of free memory"), free, strict=True):
        if there < needed:
            return f"{count:.0e} samples need {needed / 1e9:.1f} GB {what}; {there / 1e9:.1f} are."
    return ""


def long(folder: Path, count: int) -> Path:
    """A project with one recording of so many samples, in six channels."""
    with Project.create(folder / f"long {count}.forcelab") as project:
        project.add(recording(count), [Track(AUTHOR, (Segment(0.5, 1.0, "grab"),))])
        return project.path


def segmented(folder: Path, segments: int, count: int = 1_000_000) -> Path:
    """A project with one recording whose track has so many segments, with gaps between them."""
    whole = recording(count)
    length = (whole.end - whole.start) / segments
    track = tuple(
        Segment(i * length, (i + 0.8) * length, ACTIONS[i % len(ACTIONS)]) for i in range(segments)
    )
    with Project.create(folder / f"segments {segments}.forcelab") as project:
        project.add(whole, [Track(AUTHOR, track)])
        return project.path


def many(folder: Path, count: int) -> Path:
    """A project with so many short demonstrations of ten tasks, by two coders."""

    def each() -> Iterator[Incoming]:
        for number in range(count):
            one = recording(200, f"{number:04d}", seed=number)
            there = Demonstration(
                one.name, f"task {number % 10}", one.times, one.signals, one.channels
            )
            track = (Segment(0.02, 0.08, "grab"), Segment(0.08, 0.15, "hold"))
            yield Incoming(there, (Track(AUTHOR, track), Track("Other", track)))

    with Project.create(folder / f"many {count}.forcelab") as project:
        project.add_all(each())
        return project.path
