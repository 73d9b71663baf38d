"""What lies beside a recording's signals: its videos, its raw stamps, and the truth of it."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration
from forcelab.project.arranging import attach_video, set_video_clock
from forcelab.project.cameras import Camera, cameras
from forcelab.project.folder import ProjectFolder
from forcelab.project.loading import truth
from forcelab.project.stamps import attach_beside, attach_stamps, files_beside, stamps

__all__ = ["ProjectRecorded"]


class ProjectRecorded(ProjectFolder):
    """The videos and stamps of a :class:`~forcelab.project.Project`."""

    def attach_stamps(self, demonstration: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Keep a recording's raw stamps beside it, in place of those there.

        Parameters
        ----------
        demonstration : str
            Its id.
        arrays : mapping of str to ndarray
            Numbers and names, such as of :class:`~forcelab.capture.gathering.Gathered`.

        Raises
        ------
        InputError
            If there is no such demonstration or they cannot be written.
        """
        attach_stamps(self._db, demonstration, arrays)

    def stamps(self, demonstration: str) -> dict[str, NDArray[Any]] | None:
        """The raw stamps beside a demonstration; None for all but recorded ones.

        Archives leave them out.

        Raises
        ------
        InputError
            If there is no such demonstration or the file is damaged.
        """
        return stamps(self._db, demonstration)

    def attach_beside(self, demonstration: str, path: str | PathLike[str]) -> Path:
        """Keep a file beside a recording, such as the video of a second camera; gives the copy.

        Archives leave it out; :meth:`beside` tells where it is.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            A file; what is in it is not looked at.

        Raises
        ------
        InputError
            If there is no such demonstration or it cannot be copied.
        """
        return attach_beside(self._db, demonstration, Path(path))

    def beside(self, demonstration: str) -> tuple[Path, ...]:
        """The files that are kept beside a recording, such as videos of further cameras.

        Raises
        ------
        InputError
            If there is no such demonstration.
        """
        return files_beside(self._db, demonstration)

    def cameras(self, demonstration: Demonstration) -> tuple[Camera, ...]:
        """The cameras that filmed a recording; none unless there are several.

        Parameters
        ----------
        demonstration : Demonstration
            As :meth:`load` gave it; its video is the first camera's.

        Raises
        ------
        InputError
            If there is no such demonstration or its stamps are damaged.
        """
        return cameras(self._db, demonstration.id, demonstration.video)

    def attach_video(
        self, demonstration: str, path: str | PathLike[str], clock: ClockMap | None = None
    ) -> None:
        """Copy a video into the project, in place of the one that the demonstration has.

        Parameters
        ----------
        demonstration : str
            Its id.
        path : path-like
            The video; what is in it is not looked at.
        clock : ClockMap, optional
            From the video's own timestamps to force time; by default both are the same.

        Raises
        ------
        InputError
            If there is no such demonstration or the video cannot be read; nothing was changed.
        """
        attach_video(self._db, demonstration, Path(path), clock or ClockMap())

    def set_video_clock(self, demonstration: str, clock: ClockMap) -> None:
        """Say how the clock of a demonstration's video maps onto the force clock.

        Raises
        ------
        InputError
            If there is no such demonstration or it has no video.
        """
        set_video_clock(self._db, demonstration, clock)

    def truth(self, demonstration: str) -> dict[str, Any] | None:
        """What was told as the truth when it was added; None for all but simulated ones.

        Raises
        ------
        InputError
            If there is no such demonstration or the file is damaged.
        """
        return truth(self._db, demonstration)
