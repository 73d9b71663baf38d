"""Whether a video is whole, looked at before it is attached."""

from __future__ import annotations

from pathlib import Path
from time import monotonic

import numpy as np

from forcelab.errors import InputError
from forcelab.video.index import Index, indexing, open_video
from forcelab.video.reader import LEAD, VideoReader

#: Places that are decoded; a few frames at each, as they lie just behind a key frame.
PLACES = 16
#: Seconds that looking at a video may take, in all; what is not found by then is not told.
PATIENCE = 4.0
#: Of the recording; a video that lasts less may be cut, of a kind that does not tell its length.
SHORT = 0.5
#: Frames come evenly if this share of the steps between them is off the usual one by at most that
#: part of it, or by what files round to (s). Among such, nothing for longer than :data:`GAP`
#: seconds and so many steps is missing; where frames come as they like, that cannot be told.
EVEN, OFF, ROUNDED = 0.9, 0.2, 1.5e-3
GAP, STEPS = 0.4, 5


def check_video(path: Path, seconds: float) -> str:
    """Refuse a file that is no video, before it is copied; gives a sentence where one is damaged.

    The packets are listed and a few frames decoded, never a long film. `seconds` is how long the
    recording is that it shows.
    """
    if path.is_dir():
        raise InputError(f"'{path}' is a folder; name the video in it.")
    if not path.is_file():
        raise InputError(f"There is no file '{path}'; look at its name.")
    open_video(path, packets=True).release()  # for which no codec has to be there
    until = monotonic() + PATIENCE
    try:
        index = _read_index(path, until)
        if index is None:
            return ""
        remark = index.remark or _gap_remark(path, index) or _hole_remark(path, index, until)
    except InputError as error:  # such as a codec that this machine lacks
        return str(error)
    lasts = float(index.times[-1])
    if not remark and lasts < SHORT * seconds:
        remark = (
            f"'{path.name}' lasts {lasts:.2f} s, its recording {seconds:.2f} s; copy it again if "
            "there is a longer one."
        )
    return remark


def _read_index(path: Path, until: float) -> Index | None:
    """The index; None where finding it out takes too long."""
    job = indexing(path)
    try:
        while monotonic() < until:
            next(job)
    except StopIteration as stop:
        index: Index = stop.value
        return index
    return None


def _gap_remark(path: Path, index: Index) -> str:
    """What is said of a video that lacks a stretch, as Matroska files do that lost a part."""
    steps = np.diff(index.times)
    if len(steps) < PLACES:
        return ""
    usual, widest = float(np.median(steps)), int(np.argmax(steps))
    even = np.abs(steps - usual) <= max(OFF * usual, ROUNDED)
    if np.mean(even) < EVEN or steps[widest] <= max(GAP, STEPS * usual):
        return ""
    return (
        f"'{path.name}' has no frame between {index.times[widest]:.2f} s and "
        f"{index.times[widest + 1]:.2f} s, but elsewhere one every {usual:.3f} s; copy it again "
        "if there is a whole one."
    )


def _hole_remark(path: Path, index: Index, until: float) -> str:
    """What is said of a video with a place where nothing can be decoded; empty if none is found."""
    last = len(index.times) - 1
    spread = np.linspace(0, len(index.keys) - 1, PLACES).round().astype(int)
    with VideoReader(path, index) as reader:
        # So far behind a key frame nothing before that one is decoded.
        for number in np.unique(np.minimum(index.keys[spread] + LEAD + 2, last)).tolist():
            if monotonic() > until:
                break
            if not _can_decode(reader, number):
                return (
                    f"'{path.name}' is damaged: of {index.times[last]:.2f} s nothing can be shown "
                    f"around {index.times[number]:.2f} s, perhaps not elsewhere either; copy it "
                    "again if there is a whole one."
                )
    return ""


def _can_decode(reader: VideoReader, number: int) -> bool:
    try:
        reader.frame(number)
    except InputError:
        return False
    return True
