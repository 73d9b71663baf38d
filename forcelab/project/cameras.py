"""The cameras that filmed a recording: the first one's video is its own, others lie beside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.project.database import Database
from forcelab.project.loading import home_of, known_id
from forcelab.project.stamps import files_beside, stamps

__all__ = ["Camera", "camera_stamps", "cameras"]

_NAMES, _FILES, _CLOCKS = "video_names", "video_files", "video_clocks"
#: Stamps of every recording: when time 0 was, and of each camera when its frames arrived.
_START, _FRAMES = "start", "frames_"
#: Cameras that are looked for.
MOST = 8


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera's name, and its video of one recording."""

    name: str
    video: VideoReference


def camera_stamps(filmed: Sequence[Camera]) -> dict[str, NDArray[Any]]:
    """What tells the cameras of a recording apart, to be kept with its raw stamps.

    Parameters
    ----------
    filmed : sequence of Camera
        The first one's video is the demonstration's; the others are in the folder by now.

    Returns
    -------
    dict of str to ndarray
        ``video_names``; ``video_files``, the name of each file (of the first one nothing); and
        ``video_clocks``, shape (n, 2): offset (s) and rate, from each video's clock to the force's.
    """
    return {
        _NAMES: np.array([one.name for one in filmed], dtype=np.str_),
        _FILES: np.array(["", *(one.video.path.name for one in filmed[1:])], dtype=np.str_),
        _CLOCKS: np.array([(one.video.clock.offset, one.video.clock.rate) for one in filmed]),
    }


def cameras(database: Database, id_: str, first: VideoReference | None) -> tuple[Camera, ...]:
    """The cameras whose videos there are; nothing is read where no file lies beside."""
    beside = files_beside(database, id_)
    if first is None or not beside:
        return ()
    found = stamps(database, id_, (_NAMES, _FILES, _CLOCKS)) or {}
    if _NAMES not in found:
        return _told_by_frames(database, id_, first, beside)
    home = home_of(database, known_id(database, id_))
    try:
        made = [
            Camera(
                str(name),
                VideoReference(
                    home / Path(str(file)).name, ClockMap(float(clock[0]), float(clock[1]))
                ),
            )
            for name, file, clock in zip(found[_NAMES], found[_FILES], found[_CLOCKS], strict=True)
        ]
    except (KeyError, ValueError, IndexError) as error:
        raise InputError(
            f"The stamps of '{id_}' do not say what its cameras filmed ({error})."
        ) from error
    there = [camera for camera in made[1:] if camera.video.path in beside]
    return (Camera(made[0].name, first), *there) if there else ()


def _told_by_frames(
    database: Database, id_: str, first: VideoReference, beside: Sequence[Path]
) -> tuple[Camera, ...]:
    """The cameras of a recording of which only the arrivals of frames are kept.

    That was so before their names were. Of two cameras the film beside is the second one's, and
    its time 0 is when its first frame arrived; of more of them nothing tells which is whose.
    """
    wanted = {_START, *(f"{_FRAMES}{number}" for number in range(MOST))}
    found = stamps(database, id_, wanted) or {}
    frames = [found.get(f"{_FRAMES}{number}", np.empty((0, 2))) for number in range(MOST)]
    arrived = [each[:, 0] for each in frames if each.ndim == 2 and len(each)]
    start = found.get(_START, np.empty(0))
    if len(beside) != 1 or len(arrived) != 2 or start.shape != ():
        return ()
    video = VideoReference(beside[0], ClockMap(float(arrived[1][0] - start)))
    return Camera("first camera", first), Camera("second camera", video)
