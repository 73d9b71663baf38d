"""MATLAB files: versions 4 to 7 by SciPy, 7.3, which is HDF5 with MATLAB's attributes, by h5py.

Structs and cells are flattened: field ``b`` of the second element of ``a`` is ``a.2.b``. What only
MATLAB itself can make anything of (objects, tables, function handles) is left out.
"""

from __future__ import annotations

import math
import struct
import warnings
import zlib
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.formats import hdf5
from forcelab.formats.arrays import (
    MOST_TIMES,
    ROOM,
    Array,
    Tree,
    array_of,
    check_size,
    cut,
    preview_tree,
    read_apart,
    read_tree,
)
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import naming_damage
from forcelab.jobs import Progress, finish
from forcelab.text import listed

#: Where the HDF5 part of a file of version 7.3 begins.
_HDF5_AT: Final = 512
#: What a variable of version 4 may begin with: its type, as a number of either byte order.
_TYPES_4: Final = frozenset((0, 1, 10, 20, 30, 40, 50, 51))
#: How deep structs and cells may be nested, and how many arrays a file may hold.
_DEEPEST, _MOST_ARRAYS = 32, 200_000

_OBJECTS: Final = (
    "which only MATLAB can read; save them there as numbers or texts, as with cellstr(labels) or "
    "table2array"
)


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file says that it is one of MATLAB, or is called ``.mat`` and reads as one."""
    if head.startswith(b"MATLAB "):
        return True
    if path.suffix.lower() != ".mat" or len(head) < 20:
        return False
    return any(_is_version_4(head, order) for order in "<>")


def _is_version_4(head: bytes, order: str) -> bool:
    """Whether a file begins with a variable of version 4 of that byte order."""
    kind, rows, columns, imaginary, name = struct.unpack(f"{order}5i", head[:20])
    kind -= 1000 if order == ">" else 0
    plausible = kind in _TYPES_4 and rows >= 0 and columns >= 0 and imaginary in {0, 1}
    return plausible and 1 < name <= 64 and head[20 : 20 + name].endswith(b"\0")


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read a file as a demonstration, or as many as its structs or cells are numbered."""
    return read_apart(_open_tree, read_tree, path, options)


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the arrays of a file would be read as."""
    return finish(read_apart(_open_tree, preview_tree, path, options))


@contextmanager
def _open_tree(path: Path) -> Iterator[Tree]:
    if _is_hdf5(path):
        with hdf5.opened(path, "a MATLAB file of version 7.3") as file:
            yield _Walk73(path, file).tree()
    else:
        with _naming_damage(path), warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what SciPy finds odd and reads nevertheless
            yield _Variables(path).tree()


def _is_hdf5(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(_HDF5_AT)
        return hdf5.sniff(path, file.read(8))


class _Variables:
    """The variables of a file of version 4 to 7, as SciPy reads them."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._arrays: list[Array] = []
        self._left: list[str] = []

    def tree(self) -> Tree:
        _check_packed(self._path)
        for name, shape, kind in _list_variables(self._path):
            if name.startswith("__"):
                continue  # the insides of objects and functions
            if kind in {"cell", "struct", "char"}:
                self._add(name, self._variable(name), 0)
            elif kind in {"opaque", "object", "function", "sparse", "unknown"}:
                self._left.append(name)
            else:
                check_size(name, math.prod(shape), self._path.stat().st_size)
                dtype = np.dtype({"double": "f8", "single": "f4", "logical": "u1"}.get(kind, kind))
                self._arrays.append(Array(name, shape, dtype, partial(self._part, name)))
        remarks = []
        if self._left:
            remarks.append(f"{listed(self._left)}: left out, {_OBJECTS}.")
        return Tree(self._path, tuple(self._arrays), tuple(remarks))

    def _variable(self, name: str) -> Any:
        from scipy.io import loadmat

        return loadmat(self._path, variable_names=[name])[name]

    def _part(self, name: str, part: slice, axis: int) -> NDArray[Any]:
        with _naming_damage(self._path):
            values = self._variable(name)
        if not isinstance(values, np.ndarray) or values.dtype.kind not in "biuf":
            raise InputError(
                f"'{self._path}': {name} is sparse or holds complex numbers, which are no "
                f"measurements; leave it out (--leave-out {name})."
            )
        return np.asarray(cut(values, part, axis))

    def _add(self, path: str, value: Any, depth: int) -> None:
        """Add what is in a value: a struct, a cell, text or numbers."""
        if depth > _DEEPEST or len(self._arrays) > _MOST_ARRAYS:
            raise InputError(
                f"'{self._path}' holds more than {_MOST_ARRAYS:,} arrays, or structs nested deeper "
                f"than {_DEEPEST}; save a part."
            )
        value = np.asanyarray(value)
        plain = type(value) is np.ndarray
        if value.dtype.names and plain:
            for place, element in enumerate(value.reshape(-1, order="F"), start=1):
                above = path if value.size == 1 else f"{path}.{place}"
                for name in value.dtype.names:
                    self._add(f"{above}.{name}", element[name], depth + 1)
        elif value.dtype == object and plain:
            items = [v for v in value.reshape(-1, order="F") if isinstance(v, np.ndarray)]
            words = [_as_text(item) for item in items]
            if items and None not in words:
                self._arrays.append(array_of(path, np.array(words, dtype=object)))
            else:
                for place, item in enumerate(items, start=1):
                    self._add(f"{path}.{place}", item, depth + 1)
        elif not plain or value.dtype.kind not in "biufUS":
            self._left.append(path)
        else:
            text = value.dtype.kind == "U"
            self._arrays.append(array_of(path, np.strings.rstrip(value) if text else value))


def _list_variables(path: Path) -> list[tuple[str, tuple[int, ...], str]]:
    """Name, shape and class of each variable.

    SciPy lists none where one is an object such as a table; of that, read alone, it tells the name.
    """
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import varmats_from_mat

    try:
        return list(whosmat(path))
    except TypeError:
        with path.open("rb") as file:
            alone = [single for _, single in varmats_from_mat(file)]

    def describe(single: BytesIO) -> list[tuple[str, tuple[int, ...], str]]:
        try:
            return list(whosmat(single))
        except TypeError:
            single.seek(0)
            (opaque,) = loadmat(single)["None"]  # as SciPy calls what has a name of its own
            return [(opaque["s0"].decode("latin-1"), (), "opaque")]

    return [variable for single in alone for variable in describe(single)]


def _as_text(item: Any) -> str | None:
    """The text that a cell holds, if it holds one."""
    if isinstance(item, np.ndarray) and item.dtype.kind == "U" and item.size <= 1:
        return str(item.reshape(-1)[0]) if item.size else ""
    return None


#: Bytes that are unpacked at a time, and the compressed variables of version 7.
_BLOCK, _COMPRESSED = 2**20, 15


def _check_packed(path: Path) -> None:
    """Refuse variables that are cut off, or unpack to more than can be believed.

    What they say of their size need not be true, so they are unpacked once to be measured.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(128)
        if not head.startswith(b"MATLAB "):
            return  # version 4, which packs nothing
        order = "<" if head[126:128] == b"IM" else ">"
        while tag := file.read(8):
            kind, length = struct.unpack(f"{order}2I", tag) if len(tag) == 8 else (0, size)
            start = file.tell()
            if length > size - start:
                raise InputError(f"'{path}' ends within a variable; copy it again.")
            if kind == _COMPRESSED:
                unpacked, most = 0, ROOM + MOST_TIMES * length
                unpacking = zlib.decompressobj()
                data = file.read(min(length, _BLOCK))
                while data and unpacked <= most:
                    unpacked += len(unpacking.decompress(data, _BLOCK))
                    data = unpacking.unconsumed_tail or file.read(
                        max(0, min(_BLOCK, start + length - file.tell()))
                    )
                if unpacked > most:
                    raise InputError(
                        f"'{path}' unpacks {length:,} bytes to more than {most:,}, which is not "
                        f"believed; save it again without compression (save -v6)."
                    )
            file.seek(start + length)


def _naming_damage(path: Path) -> AbstractContextManager[None]:
    """Turn what SciPy says of a damaged file into a sentence."""
    from scipy.io.matlab import MatReadError

    cure = "copy it again, or save it again (save -v7)"
    return naming_damage(path, "MATLAB file", cure, MatReadError, NameError)


class _Walk73(hdf5.Walk):
    """The variables of a file of version 7.3.

    Arrays lie in it with their axes in reverse; text is 16-bit numbers; a cell, and each field of
    a struct with several elements, holds references to what is in it.
    """

    separator = "."

    def add_item(self, item: Any, path: str, depth: int, rate: float | None) -> None:
        import h5py

        if path.startswith("#"):  # what is referred to, and the insides of objects
            return
        kind = _class_of(item)
        if isinstance(item, h5py.Group):
            if kind in {"", "struct"} and "MATLAB_object_decode" not in item.attrs:
                self.add_group(item, path, depth + 1, rate)
            else:
                self.leave(path, _OBJECTS)
        elif isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) is h5py.Reference:
            self._add_cell(item, path, depth, rate)
        elif "MATLAB_empty" in item.attrs:
            return
        elif kind in {"cell", "function_handle"} or "MATLAB_object_decode" in item.attrs:
            self.leave(path, _OBJECTS)
        else:
            super().add_item(item, path, depth, rate)

    def _add_cell(self, item: Any, path: str, depth: int, rate: float | None) -> None:
        """Add what the references in a cell or a field lead to."""
        if depth > hdf5.DEEPEST:
            raise InputError(f"'{self.path}' is nested deeper than {hdf5.DEEPEST} cells ({path}).")
        check_size(path, math.prod(item.shape), self.size)
        targets = [self.file[reference] for reference in item[()].T.reshape(-1, order="F")]
        words = [self._text(target) for target in targets]
        if targets and None not in words:
            self.arrays.append(array_of(path, np.array(words, dtype=object)))
            return
        # A struct's fields are numbered as its elements are: a.2.b.
        above, _, last = path.rpartition(".")
        of_struct = _class_of(item.parent) == "struct"
        for place, target in enumerate(targets, start=1):
            number = f"{above}.{place}.{last}" if of_struct and above else f"{path}.{place}"
            self.add_item(target, number, depth + 1, rate)

    @staticmethod
    def _text(item: Any) -> str | None:
        """The text that a data set holds, if it holds one."""
        if _class_of(item) != "char":
            return None
        if "MATLAB_empty" in item.attrs:
            return ""
        if 1 not in item.shape or math.prod(item.shape) > 1000:
            return None
        return item[()].reshape(-1).astype("<u2").tobytes().decode("utf-16-le", "replace")

    def add_data_set(self, data: Any, path: str, rate: float | None) -> None:
        if _class_of(data) == "char":
            check_size(path, math.prod(data.shape), self.size)
            letters = np.ascontiguousarray(data[()].T).astype("<u2")
            words = [row.tobytes().decode("utf-16-le", "replace").rstrip() for row in letters]
            self.arrays.append(array_of(path, np.array(words, dtype=object)))
            return
        before = len(self.arrays)
        super().add_data_set(data, path, rate)
        self.arrays[before:] = [
            replace(
                array,
                shape=array.shape[::-1],
                read=partial(_cut_reversed, array.read, len(array.shape)),
                chunks=array.chunks[::-1],
            )
            for array in self.arrays[before:]
        ]


def _cut_reversed(
    load: Callable[[slice, int], NDArray[Any]], axes: int, part: slice, axis: int
) -> NDArray[Any]:
    """A part of an array whose axes are reversed in the file."""
    return load(part, max(0, axes - 1 - axis)).T


def _class_of(item: Any) -> str:
    """The class that MATLAB gives to what is in a file; empty where it names none."""
    kind = item.attrs.get("MATLAB_class", b"")
    return kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
