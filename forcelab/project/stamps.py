"""Raw stamps beside a recorded demonstration: when its bytes arrived, and the devices' counters."""

from __future__ import annotations

import zipfile
from collections.abc import Container, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.io import atomic_file
from forcelab.project import files
from forcelab.project.database import Database
from forcelab.project.loading import home_of, known_id, row_of

__all__ = ["BESIDE", "STAMPS", "attach_beside", "attach_stamps", "files_beside", "stamps"]

#: Name of the file in a demonstration's folder.
STAMPS = "stamps.npz"
#: What the names of files begin with that lie beside, such as the video of a second camera.
BESIDE = "beside-"
#: Bytes of stamps, unpacked, that are always read, and those for each sample of a demonstration.
_LARGEST, _EACH = 1 << 30, 1 << 10


def attach_stamps(database: Database, id_: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Keep arrays beside a demonstration, in place of those there; the rows do not know them."""
    path = home_of(database, known_id(database, id_)) / STAMPS
    if any(array.dtype.hasobject for array in arrays.values()):
        raise InputError(f"Stamps of '{id_}' are no plain numbers and names; convert them first.")
    # As numpy.savez_compressed writes it, at the level that costs a third of the time and almost no
    # room: what arrives together has one stamp, and the low digits of the others do not compress.
    with (
        atomic_file(path) as stream,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
    ):
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def attach_beside(database: Database, id_: str, file: Path) -> Path:
    """Copy a file into a demonstration's folder; gives the copy, named after what is in it."""
    home = home_of(database, known_id(database, id_))
    with (
        files.told(f"'{file}' was not copied to '{home}'"),
        files.staging(home.parent) as staging,
    ):
        name = files.copy_named(file, staging, BESIDE).name
        files.move_into(home, staging)
    return home / name


def files_beside(database: Database, id_: str) -> tuple[Path, ...]:
    """The files that were copied into a demonstration's folder, by their names."""
    home = home_of(database, known_id(database, id_))
    found = sorted(home.glob(f"{BESIDE}*"))
    return tuple(path for path in found if path.is_file() and not path.is_symlink())


def stamps(
    database: Database, id_: str, names: Container[str] | None = None
) -> dict[str, NDArray[Any]] | None:
    """The arrays beside a demonstration, or those of some names; None where there are none."""
    path = home_of(database, known_id(database, id_)) / STAMPS
    files.check_file(path)
    largest = max(_LARGEST, _EACH * row_of(database, id_)["samples"])
    try:
        # Given a path, NumPy leaves a file open that is no archive.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as found:
            if sum(member.file_size for member in found.zip.infolist()) > largest:
                raise ValueError("too large")
            wanted = (name for name in found.files if names is None or name in names)
            return {name: found[name] for name in wanted}
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
