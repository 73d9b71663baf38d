"""What a channel's scalogram is put together from, kept in a file for the next session.

A hundred rows of a recording of 1e7 samples are 3e8 powers, and the transforms behind them alone
take 3.6 ns each: half a second of two cores before anything else is done. What comes out is a few
megabytes. So it is kept once it is complete, beside the recording, whose content never changes, and
read in 13 ms. Nothing hangs on the file: where it is missing, cannot be written, or is not what was
written, all is computed. So those of many recordings do not fill the disk either: the oldest go.
"""

from __future__ import annotations

import contextlib
import hashlib
import time
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.atomic import atomic_file
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.signals.scalogram_source import Level, Source, columns_of
from forcelab.signals.scalogram_survey import Survey
from forcelab.signals.wavelets import Morlet

__all__ = ["keep", "kept"]

Real = NDArray[np.float64]

#: To be raised when anything is computed in another way: older files count as missing then.
EDITION = 1
#: Bytes of the files beside all recordings together at most.
MOST = 1 << 30
#: Seconds after which nobody goes on with a file that is not complete.
ABANDONED = 3600.0


def keep(folder: Path, view: Survey, scales: Real) -> bool:
    """Write what is known of a channel; gives whether that could be done.

    Parameters
    ----------
    folder : Path
        Of the recording alone, such as the demonstration's in a project.
    view : Survey
        All of whose tiles are there.
    scales : ndarray, shape (k,)
        Those of the tiles.
    """
    source, level = view.source, view.level
    path = _path(folder, source.demonstration, source.channel, scales, view.wavelet)
    _clear_away(folder)
    facts = (view.noise, view.low, view.high, level.shift, level.exponent)
    grid = (source.uniform, source.rate, source.count)
    looked = source.looked_at
    wild = [(column, place) for column in looked for place in source.glitches(column).tolist()]
    arrays: dict[str, NDArray[Any]] = {
        "facts": np.array((*facts, *grid), dtype=np.float64),
        "looked": np.array(looked, dtype=np.int64),
        "wild": np.array(wild, dtype=np.int64).reshape(-1, 2),
        **view.tiles(scales).told(),
    }
    try:
        with atomic_file(path) as stream:
            np.savez(stream, allow_pickle=False, **arrays)
    except (InputError, OSError):  # a full disk, or another's: the next session computes it anew
        return False
    _make_room(folder.parent)
    return True


def kept(
    folder: Path, demonstration: Demonstration, channel: str, scales: Real, wavelet: Morlet
) -> Survey | None:
    """Read what was kept of a channel; None where there is nothing that fits.

    Parameters
    ----------
    folder : Path
        As of :func:`keep`.
    demonstration : Demonstration
        The very one of which it was kept.
    channel : str
    scales : ndarray, shape (k,)
    wavelet : Morlet
    """
    path = _path(folder, demonstration, channel, scales, wavelet)
    # What is damaged fails the archive's checksums. OverflowError and MemoryError: sizes made up.
    broken = (OSError, ValueError, LookupError, EOFError, OverflowError, MemoryError)
    with contextlib.suppress(*broken, zipfile.BadZipFile, zlib.error, NotImplementedError):
        # Given a path, NumPy leaves a file open that is no archive.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as found:
            told = {name: found[name] for name in found.files}
        noise, low, high, shift, exponent, uniform, rate, count = told["facts"].tolist()
        columns = columns_of(demonstration, channel)
        source = Source(demonstration, channel, columns, bool(uniform), rate, int(count))
        if source.uniform and source.count != len(demonstration.times):
            return None
        for column in told["looked"].tolist():
            source.know_glitches(column, told["wild"][told["wild"][:, 0] == column, 1])
        level = Level(shift, int(exponent))
        view = Survey(source, noise, low, high, level, wavelet)
        if view.tiles(scales).restore(told):
            view.kept = True
            return view
    return None


def _path(
    folder: Path, demonstration: Demonstration, channel: str, scales: Real, wavelet: Morlet
) -> Path:
    """The file of a channel in some scales."""
    columns = columns_of(demonstration, channel)
    # Another machine's powers may differ in the last digit.
    rounded = [f"{scale:.6g}" for scale in scales.tolist()]
    asked = repr((EDITION, channel, columns, wavelet, rounded))
    return folder / f"scalogram-{hashlib.sha256(asked.encode()).hexdigest()[:16]}.npz"


def _clear_away(folder: Path) -> None:
    """Delete what was begun in a recording's folder by a process that was killed."""
    for part in folder.glob(".forcelab-*.part"):
        with contextlib.suppress(OSError):  # its process is alive and has just ended it
            if time.time() - part.stat().st_mtime > ABANDONED:
                part.unlink()


def _make_room(folder: Path) -> None:
    """Delete the oldest of what was kept in the folders of all recordings, if it is too much."""
    found = []
    for path in folder.glob("*/scalogram-*.npz"):
        with contextlib.suppress(OSError):  # another window has just deleted it
            told = path.stat()
            found.append((told.st_mtime_ns, told.st_size, path))
    total = 0
    for _, size, path in sorted(found, reverse=True):
        total += size
        if total > MOST:
            with contextlib.suppress(OSError):  # in use, or another's
                path.unlink()
