"""The databases of the paper's authors: ``*.pdl``, written by pydblite under Python 2.

Several pickles one after another: the field names, the next id, the records by id, and what later
versions of pydblite add. A record is one demonstration of a pair of tongs with two force sensors.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats.pdl.restricted_pickle import MAX_BYTES, Value, load_all
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.labels import UNLABELLED, Track, from_codes, means_unlabelled

__all__ = ["CHANNELS", "read", "sniff"]

#: Our channels and the places in a record's `signals` where the authors keep them. Forces in N;
#: the normals are signed, negative in compression.
CHANNELS: Final[tuple[tuple[str, int], ...]] = (
    ("fx1", 7),
    ("fy1", 8),
    ("fz1", 2),
    ("fx2", 9),
    ("fy2", 10),
    ("fz2", 3),
)

#: Places of the tangential magnitudes, and of the two forces that each is the hypotenuse of.
_MAGNITUDES: Final = ((0, 7, 8), (1, 9, 10))

#: The authors' class around the same signals; its module moved once.
_BUNDLES: Final = frozenset(
    {"labelSelectedData.SignalBundle", "cwt_learner.labelSelectedData.SignalBundle"}
)

#: How a pickle starts: with its protocol (from 2 on), or with a list or dictionary (0 and 1).
_START: Final = re.compile(rb"\x80[\x00-\x0f]|[]}]q[\x00-\xff]|\([ld]p[0-9]+\n")

_Record: TypeAlias = Mapping[str | int, Value]


def sniff(path: Path, head: bytes) -> bool:
    """Whether `head`, the start of the file, is a pickle's.

    A file called ``*.pdl`` also counts if it starts with any opcode that pickles start with.
    """
    if path.suffix.lower() == ".pdl":
        return head[:1] in (b"\x80", b"]", b"}", b"(", b"c")
    return bool(_START.match(head))


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read every record of a database, in the file's order.

    Parameters
    ----------
    path : Path
        The database.
    options : ReadOptions
        `task`, `author`, `rate` and `strict` count; the others concern tables.

    Returns
    -------
    list of Recording
        Six channels (:data:`CHANNELS`) in N. Times are in seconds and start at zero. Labels are
        one track by ``options.author``; the empty label and ``unlabelled`` are unlabelled time.
        Demonstrations have the records' names or, where a name is missing or not unique,
        ``"<file> 01"`` and so on.

    Raises
    ------
    InputError
        If the file is no such database, or a record lacks signals or has lists of different
        lengths.
    """
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"'{path}' is larger than {MAX_BYTES:,} bytes; split the database.")
    records = _records(str(path), load_all(path.read_bytes(), str(path), _BUNDLES))
    names, remarks = _names(path, records)
    recordings = []
    for name, (key, record) in zip(names, records.items(), strict=True):
        recordings.append(_recording(f"'{path}', record {key}", record, name, remarks, options))
        remarks = ()  # what concerns the whole file is said once
    return recordings


def _names(path: Path, records: Mapping[int, _Record]) -> tuple[list[str], tuple[str, ...]]:
    """The demonstrations' names, and a remark where they are not those of the records."""
    names = [record.get("name") for record in records.values()]
    usable = [n for n in names if isinstance(n, str) and n.strip() and n.isprintable()]
    if len(set(usable)) == len(names):
        return usable, ()
    made = [f"{path.stem} {number:02d}" for number in range(1, len(names) + 1)]
    return made, (
        f"The names of the records are missing or not unique; the demonstrations are called "
        f"'{made[0]}' and so on.",
    )


def _records(file: str, pickles: list[Value]) -> dict[int, _Record]:
    """The records by id, once the pickles are those of a pydblite database."""
    match pickles:
        case [list(), int(), dict() as records, *_] if records:
            pass
        case [list(), int(), dict(), *_]:
            raise InputError(f"'{file}' is a database without records; there is nothing to import.")
        case _:
            raise InputError(
                f"'{file}' holds pickles but is no pydblite database (field names, next id, "
                f"records); only the *.pdl databases of the paper's authors can be read."
            )
    checked: dict[int, _Record] = {}
    for key, record in records.items():
        if not isinstance(key, int) or not isinstance(record, dict):
            raise InputError(f"'{file}': what is kept under {_quoted(key)} is no record.")
        checked[key] = record
    return checked


def _recording(
    where: str, record: _Record, name: str, remarks: tuple[str, ...], options: ReadOptions
) -> Recording:
    """One record's demonstration and track."""
    times = _numbers(where, "timestamps", record.get("timestamps"))
    if not (np.abs(times) < 1e12).all():
        raise InputError(f"{where}: timestamps holds something that is no time in seconds.")
    lists = record.get("signals")
    if not isinstance(lists, list):
        raise InputError(f"{where} has no signals.")
    signals = [_numbers(where, f"signal {place}", values) for place, values in enumerate(lists)]
    for _, place in CHANNELS:
        found = len(signals[place]) if place < len(signals) else 0
        if found != len(times):
            raise InputError(
                f"{where}: signal {place} has {found} samples where timestamps has {len(times)}; "
                f"the record is damaged or holds other signals than a pair of tongs."
            )
    remarks += tuple(f"'{name}': {what}" for what in _disagreements(signals))
    if remarks and options.strict:
        raise InputError(f"{where}: {remarks[0]}")
    demonstration = Demonstration(
        name=name,
        task=options.task or "",
        times=times - times[:1],
        signals=np.column_stack([signals[place] for _, place in CHANNELS]),
        channels=tuple(Channel(channel, "N") for channel, _ in CHANNELS),
        grid_rate=options.rate,
    )
    return Recording(
        demonstration, _tracks(where, record, demonstration.times, options.author), remarks
    )


def _numbers(where: str, what: str, values: Value) -> NDArray[np.float64]:
    """A list of plain numbers as an array of shape (n,)."""
    if not isinstance(values, list) or not set(map(type, values)) <= {int, float}:
        raise InputError(f"{where}: {what} is no list of numbers.")
    return np.array(values, dtype=np.float64)


def _disagreements(signals: list[NDArray[np.float64]]) -> Iterator[str]:
    """A sentence for each tangential magnitude that is not that of the forces imported."""
    for place, x, y in _MAGNITUDES:
        magnitude = signals[place]
        if magnitude.size == 0:
            continue
        with np.errstate(over="ignore"):
            expected = np.hypot(signals[x], signals[y])
        if magnitude.shape != expected.shape or not np.allclose(
            magnitude, expected, rtol=1e-6, atol=1e-9, equal_nan=True
        ):
            yield (f"signal {place} is not the magnitude of signals {x} and {y}, which were taken.")


def _tracks(
    where: str, record: _Record, times: NDArray[np.float64], author: str
) -> tuple[Track, ...]:
    """One track of the labels, or none where nothing is labelled."""
    labels = record.get("labels")
    if labels is None:
        return ()
    if not isinstance(labels, list) or not set(map(type, labels)) <= {str}:
        raise InputError(f"{where}: labels is no list of names.")
    if len(labels) != len(times):
        raise InputError(
            f"{where} has {len(labels)} labels for {len(times)} samples; the record is damaged."
        )
    names = (str(label) for label in dict.fromkeys(labels))
    actions = [name for name in names if name and not means_unlabelled(name)]
    for action in actions:
        if not action.isprintable():
            raise InputError(f"{where}: the label {_quoted(action)} is no printable name.")
    number = {action: code for code, action in enumerate(actions)}
    codes = np.array([number.get(str(label), UNLABELLED) for label in labels], dtype=np.int64)
    return (Track(author, from_codes(codes, times, actions)),) if actions else ()


def _quoted(value: object) -> str:
    """A foreign value as it may stand in a sentence: printable and short."""
    text = ascii(value)
    return text if len(text) <= 60 else f"{text[:60]}..."
