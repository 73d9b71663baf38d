"""Videos, cameras and raw time stamps beside a demonstration."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.io import atomic_file
from forcelab.project import files
from forcelab.project.database import Database
from forcelab.project.files import DEMONSTRATIONS

#: Name of the file of raw stamps in a demonstration's folder.
STAMPS = "stamps.npz"
#: Prefix of further files in it, such as the video of a second camera.
_BESIDE = "beside-"
#: Bytes of stamps, unpacked, that are always read, and those for each sample of a demonstration.
_LARGEST, _EACH = 1 << 30, 1 << 10
_NAMES, _FILES, _CLOCKS = "video_names", "video_files", "video_clocks"
#: Stamps of every recording: when time 0 was, and of each camera when its frames arrived.
_START, _FRAMES = "start", "frames_"
#: Cameras that are looked for.
MOST_CAMERAS = 8
#: Names of files that are named after their content.
_STORED = re.compile(r"[a-z]+-[0-9a-f]{16}(\.[a-z0-9]{1,8})?")


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera's name, and its video of one recording."""

    name: str
    video: VideoReference


class MediaStore:
    """Videos and stamps of a project's demonstrations; ``project.media``.

    Every method raises InputError if there is no demonstration of the id.
    """

    def __init__(self, database: Database) -> None:
        self._db = database

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
        row = self._db.demonstration(demonstration)
        root = self._db.folder / DEMONSTRATIONS
        home = self._db.demonstration_folder(demonstration)
        self._db.refuse_read_only()
        with (
            files.file_errors(f"The video was not attached to '{row['name']}'"),
            files.staging(root) as staged,
        ):
            video = files.copy_named(Path(path), staged, "video-").name
            with self._db.writing():
                old = self._db.demonstration(demonstration)["video"]
                home.mkdir(exist_ok=True)
                files.move_into(home, staged)  # under the name of its content: over nothing else
                self._write_video(demonstration, video, clock or ClockMap())
        if old not in (None, video):
            files.remove_video(home, old)

    def set_video_clock(self, demonstration: str, clock: ClockMap) -> None:
        """Set how the clock of a demonstration's video maps onto the force clock.

        Raises
        ------
        InputError
            If there is no such demonstration or it has no video.
        """
        with self._db.writing():
            row = self._db.demonstration(demonstration)
            if row["video"] is None:
                raise InputError(
                    f"'{row['name']}' has no video whose clock could be set; attach one first."
                )
            self._write_video(demonstration, row["video"], clock)

    def attach_stamps(self, demonstration: str, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Store a recording's raw stamps beside it, in place of those there: numbers and names."""
        path = self._folder(demonstration) / STAMPS
        self._db.refuse_read_only()
        if any(array.dtype.hasobject for array in arrays.values()):
            raise InputError(
                f"Stamps of '{demonstration}' are no plain numbers and names; convert them first."
            )
        # As numpy.savez_compressed writes it, at the level that costs a third of the time and
        # almost no room: what arrives together has one stamp, and the low digits of the others do
        # not compress.
        with (
            atomic_file(path) as stream,
            zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        ):
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)

    def stamps(
        self, demonstration: str, names: Container[str] | None = None
    ) -> dict[str, NDArray[Any]] | None:
        """The raw stamps beside a demonstration, or those of some names; None without any.

        Only recorded demonstrations have them; archives leave them out.
        """
        path = self._folder(demonstration) / STAMPS
        files.check_file(path)
        largest = max(_LARGEST, _EACH * self._db.demonstration(demonstration)["samples"])
        try:
            # Given a path, NumPy leaves a file open that is no archive.
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                if sum(member.file_size for member in archive.zip.infolist()) > largest:
                    raise ValueError("too large")
                requested = (name for name in archive.files if names is None or name in names)
                return {name: archive[name] for name in requested}
        except FileNotFoundError:
            return None
        except (
            OSError,
            ValueError,
            EOFError,
            KeyError,
            AttributeError,
            TypeError,
            zipfile.BadZipFile,
        ) as error:
            raise InputError(
                f"The file '{path}' is damaged; delete it, the demonstration itself is whole."
            ) from error

    def attach_file(self, demonstration: str, path: str | PathLike[str]) -> Path:
        """Copy a further file beside a recording, such as a second camera's video; gives the copy.

        Archives leave it out.
        """
        home = self._folder(demonstration)
        self._db.refuse_read_only()
        with (
            files.file_errors(f"'{path}' was not copied to '{home}'"),
            files.staging(home.parent) as staging,
        ):
            name = files.copy_named(Path(path), staging, _BESIDE).name
            files.move_into(home, staging)
        return home / name

    def attached_files(self, demonstration: str) -> tuple[Path, ...]:
        """The files that :meth:`attach_file` copied, by their names."""
        paths = sorted(self._folder(demonstration).glob(f"{_BESIDE}*"))
        return tuple(path for path in paths if path.is_file() and not path.is_symlink())

    def cameras(self, demonstration: Demonstration) -> tuple[Camera, ...]:
        """The cameras that filmed a recording; none unless there are several.

        Parameters
        ----------
        demonstration : Demonstration
            As loaded; its video is the first camera's.

        Raises
        ------
        InputError
            If there is no such demonstration or its stamps are damaged.
        """
        attached = self.attached_files(demonstration.id)
        first = demonstration.video
        if first is None or not attached:
            return ()
        arrays = self.stamps(demonstration.id, (_NAMES, _FILES, _CLOCKS)) or {}
        if _NAMES not in arrays:
            return self._cameras_by_frames(demonstration.id, first, attached)
        home = self._folder(demonstration.id)
        try:
            stored = [
                Camera(
                    str(name),
                    VideoReference(
                        home / Path(str(file)).name, ClockMap(float(clock[0]), float(clock[1]))
                    ),
                )
                for name, file, clock in zip(
                    arrays[_NAMES], arrays[_FILES], arrays[_CLOCKS], strict=True
                )
            ]
        except (KeyError, ValueError, IndexError) as error:
            raise InputError(
                f"The stamps of '{demonstration.id}' do not say what its cameras filmed ({error})."
            ) from error
        others = [camera for camera in stored[1:] if camera.video.path in attached]
        return (Camera(stored[0].name, first), *others) if others else ()

    def _cameras_by_frames(
        self, demonstration: str, first: VideoReference, attached: Sequence[Path]
    ) -> tuple[Camera, ...]:
        """The cameras of a recording made before their names were stored.

        Of two cameras the attached video is the second one's, and its time 0 is when its first
        frame arrived; of more cameras nothing tells which video is whose.
        """
        arrays = {_START, *(f"{_FRAMES}{number}" for number in range(MOST_CAMERAS))}
        stored = self.stamps(demonstration, arrays) or {}
        frames = [
            stored.get(f"{_FRAMES}{number}", np.empty((0, 2))) for number in range(MOST_CAMERAS)
        ]
        arrived = [each[:, 0] for each in frames if each.ndim == 2 and len(each)]
        start = stored.get(_START, np.empty(0))
        if len(attached) != 1 or len(arrived) != 2 or start.shape != ():
            return ()
        video = VideoReference(attached[0], ClockMap(float(arrived[1][0] - start)))
        return Camera("first camera", first), Camera("second camera", video)

    def _folder(self, demonstration: str) -> Path:
        self._db.demonstration(demonstration)
        return self._db.demonstration_folder(demonstration)

    def _write_video(self, demonstration: str, video: str, clock: ClockMap) -> None:
        self._db.execute(
            "UPDATE demonstration SET video = ?, video_offset = ?, video_rate = ? WHERE id = ?",
            video,
            float(clock.offset),
            float(clock.rate),
            demonstration,
        )


def camera_stamps(cameras: Sequence[Camera]) -> dict[str, NDArray[Any]]:
    """The arrays of a recording's stamps that tell its cameras apart.

    The first camera's video is the demonstration's; the others are in the folder by now. Gives
    ``video_names``; ``video_files``, the name of each file (of the first one nothing); and
    ``video_clocks``, shape (n, 2): offset (s) and rate, from each video's clock to the force's.
    """
    return {
        _NAMES: np.array([camera.name for camera in cameras], dtype=np.str_),
        _FILES: np.array(["", *(camera.video.path.name for camera in cameras[1:])], dtype=np.str_),
        _CLOCKS: np.array([(c.video.clock.offset, c.video.clock.rate) for c in cameras]),
    }


def name_video(sentence: str, path: Path, demonstration: str) -> str:
    """Replace a stored video's name or path in a sentence by that of its demonstration.

    The path stays beside the name; a file that is not in a store keeps its own.
    """
    if not _STORED.fullmatch(path.name):
        return sentence
    for quoted, where in ((str(path), f" ('{path}')"), (path.name, "")):
        parts = re.split(rf"(?:The video )?'{re.escape(quoted)}'", sentence)
        if len(parts) > 1:
            sentence = f"the video of '{demonstration}'{where}".join(parts)
            return sentence[:1].upper() + sentence[1:]
    return sentence
