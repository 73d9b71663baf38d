"""Parquet, Feather and other Arrow files: tables whose columns have types.

What each column is read as is told as of text (:mod:`~forcelab.formats.table_columns`), by its name
and its first cells. A vector becomes a column for each of its numbers, a structure one for each of
its fields.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.formats.recording import ColumnUse, ReadOptions, Recording
from forcelab.formats.signatures import lerobot_dataset_of, naming_damage
from forcelab.formats.table import TableReader, make_recordings, preview_layout, typed_layout
from forcelab.formats.table_columns import choose_roles
from forcelab.formats.table_sniff import Layout
from forcelab.jobs import Progress
from forcelab.text import listed

_PARQUET, _ARROW, _STREAM = b"PAR1", b"ARROW1\0\0", b"\xff\xff\xff\xff"
#: What a stream of Arrow data, which begins with nothing of its own, is called.
_STREAM_SUFFIXES: Final = frozenset([".arrow", ".arrows", ".feather", ".ipc"])
#: Rows looked at to find out what the columns are, and rows read at a time.
_SAMPLE_ROWS, _BLOCK_ROWS = 400, 1 << 16
#: Numbers of a vector at most; more are a picture.
_MOST: Final = 64
#: How pandas writes the name of a column that has several levels: ``('left', 'fx')``.
_LEVEL: Final = r"'[^']*'|\d+"
_LEVELS: Final = re.compile(rf"\((?:{_LEVEL})(?:, (?:{_LEVEL}))+\)")
#: How deep structures may be nested.
_DEEPEST: Final = 8
#: Bytes, and times its size, that a file may always take in memory.
_ROOM, _MOST_TIMES = 1 << 27, 100
_CURE: Final = "write it again, or copy it again from where it is from"


def sniff(path: Path, head: bytes) -> bool:
    """Whether a file is Parquet or Arrow, as a file or as a stream, and no part of a dataset."""
    stream = head.startswith(_STREAM) and path.suffix.lower() in _STREAM_SUFFIXES
    return (stream or head.startswith((_PARQUET, _ARROW))) and lerobot_dataset_of(path) is None


def read(path: Path, options: ReadOptions) -> Generator[Progress, None, list[Recording]]:
    """Read a table, and the labels beside it, as one demonstration, called like the file.

    Only the columns that become something are read.
    """
    table = _sniff_table(path)
    options = table.name_parts(options)
    roles = choose_roles(table.layout, options)
    reader = TableReader(table.layout, roles)
    read_columns = [i for i in range(len(table.layout.columns)) if i not in roles.left_out]
    sources = [source for source in table.sources if not roles.left_out.issuperset(source.indices)]
    first = 1
    with _naming_damage(path):
        rows = _stated_rows(path)
        tops = {source.top for source in sources}
        for batch in _batches(path, tops, len(read_columns)):
            columns = _columns(batch, tops, sources, first, path)
            numbers = np.arange(first, first + batch.num_rows)
            reader.read(numbers, {index: columns[index] for index in read_columns})
            first += batch.num_rows
            yield Progress(min(first - 1, rows), rows, f"reading {path.name}")
    return make_recordings(path.stem, reader.finish(), options, table.remarks)


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """What the columns of a table would be read as, from its first rows."""
    table = _sniff_table(path)
    return preview_layout(table.layout, table.name_parts(options))


@dataclass(frozen=True, slots=True)
class _Source:
    """A field of the file's table that becomes one column, or one for each number in a vector."""

    top: int  #: index of the field, or of the one that it is in
    path: tuple[int, ...]  #: from there, the indices of fields of structures
    name: str
    unit: str
    width: int  #: how many numbers a vector has; 0 of what is none
    start: int = 0  #: index of its first column

    @property
    def indices(self) -> range:
        """Those of its columns."""
        return range(self.start, self.start + max(1, self.width))


@dataclass(frozen=True, slots=True)
class _Table:
    layout: Layout
    sources: tuple[_Source, ...]
    remarks: tuple[str, ...]

    def name_parts(self, options: ReadOptions) -> ReadOptions:
        """Options in which the name of a vector stands for all of its numbers."""
        parts = {
            source.name: [self.layout.columns[i].name for i in source.indices]
            for source in self.sources
            if source.width
        }

        def named(names: Sequence[str]) -> tuple[str, ...]:
            return tuple(part for name in names for part in parts.get(name, [name]))

        return replace(options, leave_out=named(options.leave_out), signals=named(options.signals))


def _sniff_table(path: Path) -> _Table:
    """Find out what the columns of a file are, by their types and the first rows."""
    load_extra("pyarrow", "parquet", f"'{path}' is a Parquet or Arrow file, which")
    with _naming_damage(path):
        schema = _schema(path)
        tops = {i for i, field in enumerate(schema) if _is_readable(field.type)}
        batches = _batches(path, tops, len(tops), rows=_SAMPLE_ROWS)
        batch = next((batch for batch in batches if batch.num_rows), None) if tops else None
        if batch is None:
            raise InputError(f"'{path}' has no rows of numbers or words; there is nothing to read.")
        sample = batch.slice(0, _SAMPLE_ROWS)
        sources, left = _sources(schema, tops, sample)
        columns = _columns(sample, tops, sources, 1, path)
    names, units = [], []
    for source in sources:
        name = "" if source.name.startswith("__index_level_") else source.name
        names += [f"{name} {i + 1}" if source.width else name for i in range(len(source.indices))]
        units += [source.unit] * len(source.indices)
    layout = typed_layout(names, units, [columns[i] for i in range(len(names))], path)
    remarks = (f"No numbers or words were read from {listed(left)}.",) if left else ()
    return _Table(layout, tuple(sources), remarks)


def _is_parquet(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(_PARQUET)) == _PARQUET


@contextmanager
def _open_arrow(path: Path, fields: Collection[int] | None = None) -> Iterator[Any]:
    """An Arrow file or stream, of which only some fields are read."""
    from pyarrow import OSFile, ipc

    with path.open("rb") as file:
        stream = file.read(len(_STREAM)) == _STREAM
    options = ipc.IpcReadOptions(included_fields=None if fields is None else sorted(fields))
    with (
        OSFile(str(path)) as source,
        (ipc.open_stream if stream else ipc.open_file)(source, options=options) as opened,
    ):
        yield opened


def _schema(path: Path) -> Any:
    """The fields of a file and their types."""
    from pyarrow.parquet import read_schema

    if _is_parquet(path):
        return read_schema(path)
    with _open_arrow(path) as opened:
        return opened.schema


def _stated_rows(path: Path) -> int:
    """How many rows a file says that it has; 0 of an Arrow file, which does not say."""
    from pyarrow.parquet import read_metadata

    return int(read_metadata(path).num_rows) if _is_parquet(path) else 0


def _batches(
    path: Path, tops: Collection[int], columns: int, rows: int = _BLOCK_ROWS
) -> Iterator[Any]:
    """The rows of some fields, block by block; refused where they cannot fit into memory."""
    from pyarrow import RecordBatchFileReader
    from pyarrow.parquet import ParquetFile

    room = max(_ROOM, _MOST_TIMES * path.stat().st_size)

    def check(number: int) -> None:
        if number * columns * 8 > room:
            raise InputError(
                f"'{path}' has {path.stat().st_size:,} bytes and is said to hold {number:,} rows "
                f"of {columns:,} columns, which cannot be; {_CURE}."
            )

    if _is_parquet(path):
        with ParquetFile(path) as file:
            fields = [field for i, field in enumerate(file.schema_arrow) if i in tops]
            names = [field.name for field in fields]
            texts = {field.name for field in fields if _is_text(field.type)}
            texts -= _delta_encoded(file.metadata)
        # Words are kept once each, as they are in the file.
        with ParquetFile(path, read_dictionary=sorted(texts)) as file:
            check(file.metadata.num_rows)
            for batch in file.iter_batches(batch_size=rows, columns=names):
                if batch.schema.names != names:
                    raise ValueError("its columns have names that contradict each other")
                yield batch
        return
    total = 0
    with _open_arrow(path, tops) as opened:
        numbers = opened
        if isinstance(opened, RecordBatchFileReader):
            numbers = (opened.get_batch(i) for i in range(opened.num_record_batches))
        for batch in numbers:
            total += batch.num_rows
            check(total)
            batch.validate(full=True)
            for start in range(0, batch.num_rows, rows):
                yield batch.slice(start, rows)


def _delta_encoded(metadata: Any) -> set[str]:
    """Columns whose words are told by how they differ, which the library keeps once a row."""
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    columns = [group.column(i) for group in groups for i in range(group.num_columns)]
    return {
        column.path_in_schema
        for column in columns
        if any(encoding.startswith("DELTA") for encoding in column.encodings)
    }


def _is_text(kind: Any) -> bool:
    from pyarrow import types

    return bool(types.is_string(kind) or types.is_large_string(kind))


def _is_plain(kind: Any) -> bool:
    """Whether values of a type are a number, a time or a word each."""
    from pyarrow import types

    if types.is_dictionary(kind):
        return bool(_is_text(kind.value_type) or types.is_integer(kind.value_type))
    checks = (
        *(types.is_integer, types.is_floating, types.is_boolean, types.is_decimal),
        *(types.is_timestamp, types.is_time, types.is_duration, types.is_date, types.is_null),
        *(types.is_string, types.is_large_string, types.is_string_view),
    )
    return any(check(kind) for check in checks)


def _is_vector(kind: Any) -> bool:
    """Whether values of a type are lists of numbers."""
    from pyarrow import types

    checks = (types.is_list, types.is_large_list, types.is_fixed_size_list)
    if not any(check(kind) for check in checks):
        return False
    inner = kind.value_type
    return bool(types.is_integer(inner) or types.is_floating(inner) or types.is_boolean(inner))


def _is_readable(kind: Any, depth: int = 0) -> bool:
    """Whether anything can be read of a field of that type."""
    from pyarrow import types

    if types.is_struct(kind):
        return depth < _DEEPEST and any(_is_readable(f.type, depth + 1) for f in kind)
    return _is_plain(kind) or _is_vector(kind)


def _sources(schema: Any, tops: Collection[int], sample: Any) -> tuple[list[_Source], list[str]]:
    """What becomes columns, and names of what does not."""
    from pyarrow import types

    found: list[_Source] = []
    left: list[str] = []

    def leave(name: str, kind: Any) -> None:
        left.append(f"{name} ({kind if len(str(kind)) < 40 else 'a structure'})")

    def add(top: int, path: tuple[int, ...], name: str, array: Any) -> None:
        if types.is_struct(array.type) and len(path) < _DEEPEST:
            for i, part in enumerate(array.flatten()):
                add(top, (*path, i), f"{name}.{array.type.field(i).name}", part)
            return
        width = 0
        if _is_vector(array.type):
            width = next((len(item) for item in array if item.is_valid), 0)
        if not _is_plain(array.type) and not 1 <= width <= _MOST:
            leave(name, array.type)
            return
        unit = array.type.unit if types.is_duration(array.type) else ""
        start = found[-1].indices.stop if found else 0
        if _LEVELS.fullmatch(name):
            levels = [level.strip("'") for level in re.findall(_LEVEL, name)]
            name = " ".join(filter(None, levels))
        found.append(_Source(top, path, name, unit, width, start))

    read = dict(zip(sorted(tops), sample.columns, strict=True))
    for top, field in enumerate(schema):
        if top in read:
            add(top, (), field.name, read[top])
        else:
            leave(field.name, field.type)
    return found, left


def _columns(
    batch: Any, tops: Collection[int], sources: Sequence[_Source], first: int, path: Path
) -> dict[int, NDArray[Any] | list[str]]:
    """The columns in some rows by their index: numbers or times as arrays, and words."""
    read = dict(zip(sorted(tops), batch.columns, strict=True))
    columns: dict[int, NDArray[Any] | list[str]] = {}
    for source in sources:
        array = read[source.top]
        for step in source.path:
            array = array.flatten()[step]
        if source.width:
            columns |= zip(source.indices, _vectors(array, source, first, path).T, strict=True)
        else:
            columns[source.start] = _values(array)
    return columns


def _vectors(array: Any, source: _Source, first: int, path: Path) -> NDArray[np.float64]:
    """The numbers of vectors, shape (n, width), NaN where there is no vector."""
    import pyarrow.compute as pc

    lengths = pc.list_value_length(array).to_numpy(zero_copy_only=False)
    present = np.flatnonzero(~np.isnan(lengths.astype(np.float64)))
    odd = present[lengths[present] != source.width]
    if odd.size:
        raise InputError(
            f"'{path}', row {first + int(odd[0])}: '{source.name}' holds {int(lengths[odd[0]]):,} "
            f"numbers, and {source.width:,} in its first row; leave it out "
            f"(--leave-out '{source.name}')."
        )
    result = np.full((len(array), source.width), np.nan)
    result[present] = np.asarray(_values(array.flatten()), np.float64).reshape(-1, source.width)
    return result


def _values(array: Any) -> NDArray[Any] | list[str]:
    """What a column holds: numbers (NaN where there is none), times as NumPy's, or words."""
    import pyarrow as pa
    from pyarrow import types

    kind = array.type
    if types.is_timestamp(kind):
        return np.asarray(array.to_numpy(zero_copy_only=False))
    if types.is_time(kind):
        integers = pa.int32() if types.is_time32(kind) else pa.int64()
        ticks = array.cast(integers).fill_null(0).to_numpy(zero_copy_only=False)
        times = ticks.astype(f"timedelta64[{kind.unit}]")
        times[array.is_null().to_numpy(zero_copy_only=False)] = np.timedelta64("NaT", kind.unit)
        return np.asarray(times)
    if types.is_boolean(kind):
        array = array.cast(pa.uint8())
    elif types.is_decimal(kind):
        array = array.cast(pa.float64())
    elif types.is_duration(kind):
        array = array.cast(pa.int64())
    elif not (types.is_integer(kind) or types.is_floating(kind)):
        if not types.is_dictionary(kind):
            array = (array.cast(pa.string()) if types.is_date(kind) else array).dictionary_encode()
        words = [" ".join(str(word or "").split()) for word in array.dictionary.to_pylist()]
        codes = array.indices.fill_null(len(words)).to_numpy(zero_copy_only=False)
        words.append("")
        return [words[code] for code in codes.tolist()]
    return np.asarray(array.to_numpy(zero_copy_only=False))


@contextmanager
def _naming_damage(path: Path) -> Iterator[None]:
    """Turn what the library says of a file that it cannot read into a sentence."""
    from pyarrow import ArrowException

    with (
        naming_damage(path, "Parquet or Arrow file", _CURE, ArrowException),
        np.errstate(invalid="ignore", over="ignore"),
    ):
        yield
