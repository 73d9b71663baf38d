"""Arrays of NumPy: ``.npy``, which holds one, and ``.npz``, which holds several with names."""

from __future__ import annotations

import math
import sys
import zipfile
from collections.abc import Generator
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from tokenize import TokenError
from typing import IO, Any, Final, NamedTuple

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.formats.arrays import Array, Tree, check_size, cut, preview_tree, read_tree
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import names_in_zip, naming_damage
from forcelab.jobs import Progress
from forcelab.text import listed

_NPY: Final = b"\x93NUMPY"
#: Arrays in an archive at most.
_MOST_MEMBERS: Final = 100_000
_CURE: Final = "copy it again, or write it again with numpy.save or numpy.savez"


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is an array, or a zip file of nothing else."""
    if head.startswith(_NPY):
        return True
    names = names_in_zip(path)
    return all(name.endswith(".npy") for name in names) if names else b".npy" in head[:100]


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read the arrays of a file as a demonstration, or as many as its groups are numbered."""
    with _naming_damage(path):
        return (yield from read_tree(_tree(path), options))


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the arrays of a file would be read as."""
    with _naming_damage(path):
        return preview_tree(_tree(path), options)


class _Header(NamedTuple):
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    start: int  #: bytes before the values
    size: int  #: bytes of the whole array, once it is unpacked


def _tree(path: Path) -> Tree:
    arrays: list[Array] = []
    left: list[str] = []
    with path.open("rb") as file:
        zipped = file.read(len(_NPY)) != _NPY
        file.seek(0)
        headers = _zipped_headers(path) if zipped else {"": _header(file, path.stat().st_size)}
    for name, (shape, dtype, start, size) in headers.items():
        if dtype.hasobject:
            left.append(name)
            continue
        values = math.prod(shape)
        if start + values * dtype.itemsize > size:
            raise InputError(
                f"'{path}' is cut off: {name or 'its array'} is said to hold {values:,} values, "
                f"and {max(0, size - start):,} bytes of it are there; {_CURE}."
            )
        for field in dtype.names or ("",):
            field_type = dtype.fields[field][0] if dtype.fields else dtype
            if field_type.names:
                continue
            array_path = ".".join(part for part in (name, field) if part)
            whole = (*shape, *field_type.shape)
            load = partial(_load, path, name if zipped else None, field)
            # What is packed in an archive is unpacked from its start each time.
            chunks = () if zipped else (1,) * len(whole)
            arrays.append(Array(array_path, whole, field_type.base, load, chunks=chunks))
    remarks = []
    if left:
        remarks.append(
            f"Python objects, which only running code of the file could read, were left out "
            f"({listed(left) or 'the array'}); save them as numbers or texts, as in "
            f"numpy.array(labels, dtype=str)."
        )
    return Tree(path, tuple(arrays), tuple(remarks))


def _zipped_headers(path: Path) -> dict[str, _Header]:
    headers = {}
    with zipfile.ZipFile(path) as archive:
        members = archive.infolist()
        if len(members) > _MOST_MEMBERS:
            raise InputError(f"'{path}' holds {len(members):,} arrays; {_MOST_MEMBERS:,} at most.")
        for member in members:
            name = member.filename.removesuffix(".npy")
            with archive.open(member) as file:
                header = headers[name] = _header(file, member.file_size)
            values = math.prod(header.shape)
            check_size(name, values, member.compress_size, header.dtype.itemsize)
    return headers


def _header(file: IO[bytes], size: int) -> _Header:
    version = npy.read_magic(file)
    read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = read_header(file)
    if any(length < 0 for length in shape):
        raise ValueError("a length below zero")
    return _Header(shape, dtype, file.tell(), size)


def _load(path: Path, name: str | None, field: str, part: slice, axis: int) -> NDArray[Any]:
    """A part of an array, or of one that is called so in an archive."""
    with _naming_damage(path):
        if name is None:
            values = np.load(path, mmap_mode="r", allow_pickle=False)
        else:
            with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as file:
                values = npy.read_array(file, allow_pickle=False)
        values = np.array(cut(values[field] if field else values, part, axis))
        if values.dtype.kind == "U":
            letters = values.reshape(-1).view(np.dtype("u4").newbyteorder(values.dtype.byteorder))
            if (letters > sys.maxunicode).any():
                raise ValueError(f"the text in {name or 'its array'} is none")
    return values


def _naming_damage(path: Path) -> AbstractContextManager[None]:
    """Turn what is raised over a damaged file into a sentence."""
    return naming_damage(path, "file of arrays", _CURE, SystemError, TokenError)
