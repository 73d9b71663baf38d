"""Raw stamps beside a recorded demonstration: when its bytes arrived, and the devices' counters."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.atomic import atomic_file
from forcelab.errors import InputError
from forcelab.project.database import Database
from forcelab.project.loading import DEMONSTRATIONS, known_id

__all__ = ["STAMPS", "attach_stamps", "stamps"]

#: Name of the file in a demonstration's folder.
STAMPS = "stamps.npz"


def attach_stamps(database: Database, id_: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Keep arrays beside a demonstration, in place of those there; the rows do not know them."""
    path = database.folder / DEMONSTRATIONS / known_id(database, id_) / STAMPS
    if any(array.dtype.hasobject for array in arrays.values()):
        raise InputError(f"Stamps of '{id_}' are no plain numbers and names; convert them first.")
    with atomic_file(path) as stream:
        np.savez_compressed(stream, **dict(arrays))  # type: ignore[arg-type]


def stamps(database: Database, id_: str) -> dict[str, NDArray[Any]] | None:
    """The arrays beside a demonstration; None where there are none."""
    path = database.folder / DEMONSTRATIONS / known_id(database, id_) / STAMPS
    try:
        # Given a path, NumPy leaves a file open that is no archive.
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as found:
            return {name: found[name] for name in found.files}
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
