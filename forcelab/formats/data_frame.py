"""Data frames of pandas and dictionaries of arrays, read as a table in a file is.

A column becomes what one of a text file would (:mod:`~forcelab.formats.table_columns`), by its name
and its first values.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.formats.table import TableReader, TypedColumn, make_recording, typed_layout
from forcelab.formats.table_columns import choose_roles

if TYPE_CHECKING:
    from pandas import DataFrame

#: Rows looked at to find out what the columns are.
_SAMPLE_ROWS = 400


def read_frame(
    frame: DataFrame | Mapping[str, ArrayLike], name: str, options: ReadOptions | None = None
) -> Recording:
    """Read a data frame, or a dictionary of arrays, as one demonstration with its labels.

    Columns are understood as those of files are: times by their name or how they step, seconds,
    dates or whole nanoseconds; columns of words as labels; all other numbers as channels, whose
    unit may stand in their name, such as ``"fx1 (N)"``, or in ``frame.attrs["units"]``. The index
    of a data frame is one more column, unless it only counts rows.

    Parameters
    ----------
    frame : pandas.DataFrame or mapping of str to array_like
        Columns of one length; of a mapping an array of shape (n, c) makes c columns.
    name : str
        What the demonstration is called.
    options : ReadOptions, optional
        What the columns do not say themselves.

    Returns
    -------
    Recording
        The demonstration, a track for each column of labels, and a remark on each thing that was
        left out or repaired.

    Raises
    ------
    InputError
        If there is no column of times and no rate, no column of numbers, or one does not hold what
        its name says.

    Examples
    --------
    >>> columns = {"t": [0.0, 0.01, 0.02], "fx": [0.1, 0.4, 0.3], "label": ["grab", "grab", ""]}
    >>> recording = forcelab.read_frame(columns, "pull", forcelab.ReadOptions(author="Ada"))
    >>> recording.tracks
    (Track(author='Ada', segments=(Segment(start=0.0, end=0.02, action='grab'),)),)
    """
    options = options or ReadOptions()
    where = f"Frame {name}"
    units = dict(getattr(frame, "attrs", {}).get("units", {}))
    columns = list(_columns(frame, where))
    lengths = {len(values) for _, values in columns}
    if len(lengths) != 1 or 0 in lengths:
        found = "columns of different lengths" if len(lengths) > 1 else "no rows"
        raise InputError(f"{where} has {found}; give arrays of one length.")
    (length,) = lengths
    layout = typed_layout(
        [name for name, _ in columns],
        [str(units.get(name, "")) for name, _ in columns],
        [values[:_SAMPLE_ROWS] for _, values in columns],
        Path(where),
    )
    roles = choose_roles(layout, options)
    reader = TableReader(layout, roles)
    reader.read(np.arange(1, length + 1), dict(enumerate(values for _, values in columns)))
    return make_recording(name, reader.finish(), options, beside=False)


def demonstration_from_frame(
    frame: DataFrame | Mapping[str, ArrayLike],
    name: str,
    task: str,
    time: str | None,
    rate: float | None,
    leave_out: tuple[str, ...],
) -> Demonstration:
    """As :meth:`Demonstration.from_frame`, which calls it."""
    options = ReadOptions(task=task, time=time, rate=rate, leave_out=leave_out, strict=True)
    recording = read_frame(frame, name, options)
    for remark in recording.remarks:
        warnings.warn(f"{name}: {remark}", stacklevel=4)  # where from_frame was called
    return recording.demonstration


def _columns(
    frame: DataFrame | Mapping[str, ArrayLike], where: str
) -> Iterator[tuple[str, TypedColumn]]:
    """The name of each column, empty where it has none, and its values: numbers, dates or words."""
    index: Any = getattr(frame, "index", None)  # which a dictionary has not
    # A nameless one of whole numbers is where the rows stood before some were left out.
    counts = index is None or (index.names == [None] and index.dtype.kind in "iu")
    for level in range(0 if counts else index.nlevels):
        yield str(index.names[level] or ""), _values(index.get_level_values(level))
    for key, column in frame.items():
        name = key if isinstance(key, str) else ""
        array = np.asarray(column)
        if array.ndim == 1:
            yield name, _values(column)
        elif array.ndim == 2:
            yield from ((f"{name} {i}", _values(part)) for i, part in enumerate(array.T, start=1))
        else:
            raise InputError(
                f"{where}: column '{name}' is an array of {array.ndim} dimensions; give one "
                f"number or one row of numbers for each sample."
            )


def _values(column: Any) -> NDArray[Any] | list[str]:
    """A column as numbers (NaN where there is none), dates or words."""
    values = np.asarray(column)
    kind = getattr(getattr(column, "dtype", values.dtype), "kind", "O")
    if values.dtype.kind == "O" and kind in "iufb":  # of pandas, with room for missing ones
        values = np.asarray(column.to_numpy(np.float64, na_value=np.nan))
    if values.dtype.kind == "m":
        return np.asarray(values / np.timedelta64(1, "s"))
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.kind in "iufM":
        return values
    missing = column.isna() if hasattr(column, "isna") else [v is None or v != v for v in values]  # noqa: PLR0124 - NaN
    pairs = zip(values, missing, strict=True)
    return ["" if lacks else " ".join(str(v).split()) for v, lacks in pairs]
