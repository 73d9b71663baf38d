"""HDF5 files: a tree of groups and data sets, such as those of robomimic and ALOHA.

Nothing outside the file is opened: links to other files, data in other files and virtual data sets
are left out, and so are soft links, which only repeat what has a place of its own.
"""

from __future__ import annotations

import json
import math
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.arrays import (
    Array,
    Tree,
    check_size,
    cut,
    is_rate_name,
    preview_tree,
    read_apart,
    read_tree,
)
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import naming_damage
from forcelab.jobs import Progress, finish
from forcelab.text import listed

#: How deep groups may be nested, and how many groups and data sets a file may hold.
DEEPEST, MOST_OBJECTS = 32, 200_000
#: Attributes by which programs name the columns of a data set, or what its codes stand for.
_NAMES: Final = ("names", "columns", "column_names", "channels", "channel_names", "labels", "axes")
_CODES: Final = ("flag_meanings", "classes", "class_names", "label_names", "categories")
_UNITS: Final = ("units", "unit", "Units", "Unit")
#: Attributes that turn whole numbers into what was measured, and mark those that are missing.
_SCALES: Final = ("scale_factor", "scale", "gain")
_OFFSETS: Final = ("add_offset", "offset")
_MISSING: Final = ("_FillValue", "missing_value")
_ENVIRONMENT: Final = ("env_args",)


def sniff(path: Path, head: bytes) -> bool:  # noqa: ARG001 - as every format
    """Whether a file starts as an HDF5 file."""
    return head.startswith(b"\x89HDF\r\n\x1a\n")


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read a file as a demonstration, or as many as its groups are numbered."""
    return read_apart(_open_tree, read_tree, path, options)


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the data sets of a file would be read as."""
    return finish(read_apart(_open_tree, preview_tree, path, options))


@contextmanager
def _open_tree(path: Path) -> Iterator[Tree]:
    with opened(path, "an HDF5 file") as file:
        yield Walk(path, file).tree()


@contextmanager
def opened(path: Path, kind: str) -> Iterator[Any]:
    """The file, open as long as it is read; what the library says of damage is one sentence."""
    h5py = load_extra("h5py", "hdf5", f"'{path}' is {kind}, which")
    cure = "copy it again, or write it again with the program that made it"
    with naming_damage(path, "HDF5 file", cure), h5py.File(path, "r", locking=False) as file:
        yield file


class Walk:
    """Goes through a file and gathers what can be read of it."""

    separator = "/"

    def __init__(self, path: Path, file: Any) -> None:
        self.path, self.file = path, file
        self.size = path.stat().st_size
        self.arrays: list[Array] = []
        self.left: dict[str, list[str]] = {}  #: what is left out, by the reason
        self._seen: set[int] = set()

    def tree(self) -> Tree:
        """All arrays of the file, in the order of their names."""
        self.add_group(self.file, "", 0, None)
        remarks = [f"{listed(names)}: left out, {why}." for why, names in self.left.items()]
        return Tree(self.path, tuple(self.arrays), tuple(remarks))

    def leave(self, path: str, why: str) -> None:
        self.left.setdefault(why, []).append(path)

    def add_group(self, group: Any, path: str, depth: int, rate: float | None) -> None:
        """Add what is in a group; hard links can make circles."""
        import h5py

        if not self._is_new(group):
            return
        if depth > DEEPEST:
            raise InputError(f"'{self.path}' is nested deeper than {DEEPEST} groups ({path[:80]}).")
        rate = Attributes(group).rate() or rate
        for name in group:
            inner = self.separator.join(filter(None, (path, name)))
            link = group.get(name, getlink=True)
            if isinstance(link, h5py.ExternalLink):
                self.leave(inner, "a link to another file")
            elif isinstance(link, h5py.HardLink):
                try:
                    item = group[name]
                except (KeyError, TypeError, ValueError, RuntimeError, OSError):
                    self.leave(inner, "which cannot be opened")
                    continue
                self.add_item(item, inner, depth, rate)

    def add_item(self, item: Any, path: str, depth: int, rate: float | None) -> None:
        import h5py

        if isinstance(item, h5py.Group):
            self.add_group(item, path, depth + 1, rate)
        elif isinstance(item, h5py.Dataset) and self._is_new(item):
            self.add_data_set(item, path, rate)

    def _is_new(self, item: Any) -> bool:
        import h5py

        address = h5py.h5o.get_info(item.id).addr
        if address in self._seen:
            return False
        self._seen.add(address)
        if len(self._seen) > MOST_OBJECTS:
            raise InputError(
                f"'{self.path}' holds more than {MOST_OBJECTS:,} groups and data sets; save a part."
            )
        return True

    def add_data_set(self, data: Any, path: str, rate: float | None) -> None:
        """Add a data set, or each member of one of records."""
        import h5py

        properties = data.id.get_create_plist()
        if properties.get_layout() == h5py.h5d.VIRTUAL or properties.get_external_count():
            self.leave(path, "its data lie in other files")
            return
        filters = [properties.get_filter(place) for place in range(properties.get_nfilters())]
        lacking = [name for code, _, _, name in filters if not h5py.h5z.filter_avail(code)]
        if lacking:
            kinds = listed([name.decode("ascii", "replace")[:40] for name in lacking])
            self.leave(path, f"compressed by {kinds}, which h5py has not; write it with gzip")
            return
        try:
            dtype, shape = data.dtype, data.shape
        except (TypeError, ValueError, RuntimeError):
            self.leave(path, "of a type that NumPy has not")
            return
        if shape is None:
            return
        attributes = Attributes(data)
        rate = attributes.rate() or rate
        for name in dtype.names or ("",):
            part = dtype.fields[name][0] if name else dtype
            where = f"{path}.{name}" if name else path
            text = h5py.check_string_dtype(part) is not None
            if (part.kind not in "biufS" and not text) or (part.subdtype and len(shape) > 1):
                self.leave(where, "neither numbers nor text")
                continue
            enumeration = h5py.check_enum_dtype(part) or {}
            codes = {int(code): str(word) for word, code in enumeration.items()}
            self.arrays.append(
                Array(
                    where,
                    (*shape, *part.shape),
                    np.dtype(object if text else float if attributes.scaled else part.base),
                    partial(self.load, data, where, name, attributes),
                    unit=next(iter(attributes.texts(_UNITS)), ""),
                    names=attributes.texts(_NAMES),
                    codes=codes or dict(enumerate(attributes.texts(_CODES))),
                    rate=rate,
                    chunks=(*(data.chunks or (1,) * len(shape)), *part.shape),
                )
            )

    def load(
        self,
        data: Any,
        path: str,
        member: str,
        attributes: Attributes,
        part: slice,
        axis: int,
    ) -> NDArray[Any]:
        """A part of a data set as what was measured."""
        stored = min(int(data.id.get_storage_size()), self.size)
        count = math.prod(data.shape)
        if part.start is None and part.stop is not None and axis < data.ndim:
            # The first rows are looked at; what goes on from there reads all of it in the end.
            count = count // max(1, data.shape[axis]) * min(part.stop, data.shape[axis])
        for number in (count, math.prod(data.chunks or ())):  # a chunk is unpacked as a whole
            check_size(path, number, stored, data.dtype.itemsize)
        values = np.asarray(cut(data.fields(member) if member else data, part, axis))
        if data.ndim <= axis:  # an axis of the member
            values = cut(values, part, axis)
        if values.dtype == object:
            words = [_decoded(value) for value in values.flat]
            return np.array(words, dtype=object).reshape(values.shape)
        return attributes.measured(values)


def _decoded(text: Any) -> str:
    return text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)


class Attributes:
    """What is said of a data set beside it."""

    def __init__(self, item: Any) -> None:
        self._item = item
        self._names = tuple(item.attrs)  # asking for each by name takes longer than the rest
        self._scale, self._offset = self.number(_SCALES), self.number(_OFFSETS)
        self._missing = self.number(_MISSING)
        #: Whether the numbers stand for others.
        self.scaled = (self._scale, self._offset, self._missing) != (None, None, None)

    def _value(self, name: str) -> Any:
        """An attribute, where there is one and it is short."""
        if name not in self._names:
            return None
        attributes = self._item.attrs
        with suppress(OSError, TypeError, ValueError, RuntimeError, KeyError):
            if math.prod(attributes.get_id(name).shape or ()) <= 10_000:
                return attributes[name]
        return None

    def texts(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """The words of the first attribute that there is; those of a netCDF are in one text."""
        for name in names:
            value = self._value(name)
            if value is None:
                continue
            if isinstance(value, str | bytes):
                text = _decoded(value)
                return tuple(text.split()) if name == "flag_meanings" else (text.strip(),)
            if isinstance(value, np.ndarray) and value.ndim == 1 and value.dtype.kind in "OSU":
                return tuple(map(_decoded, value))
        return ()

    def number(self, names: tuple[str, ...]) -> float | None:
        for name in names:
            value = np.asarray(self._value(name))
            if value.dtype.kind in "iuf" and value.size == 1 and np.isfinite(value).all():
                return float(value.reshape(-1)[0])
        return None

    def measured(self, values: NDArray[Any]) -> NDArray[Any]:
        """The numbers that were measured, in 64 bits where the stored ones stand for others."""
        if values.dtype.kind not in "iuf" or not self.scaled:
            return values
        result = values.astype(np.float64)
        if self._missing is not None:
            result[values == self._missing] = np.nan
        result *= 1.0 if self._scale is None else self._scale
        result += self._offset or 0.0
        return result

    def rate(self) -> float | None:
        rate = self.number(tuple(name for name in self._names if is_rate_name(name)))
        if rate is None:
            rate = self._control_rate()
        return rate if rate is not None and 1e-9 < rate < 1e9 else None

    def _control_rate(self) -> float | None:
        """The steps a second of an environment that robomimic describes in JSON, if it does."""
        for text in self.texts(_ENVIRONMENT):
            with suppress(ValueError, LookupError, TypeError, RecursionError, OverflowError):
                return float(json.loads(text)["env_kwargs"]["control_freq"])
        return None
