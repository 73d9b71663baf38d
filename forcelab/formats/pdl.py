"""The paper's databases: Python 2 pickles, read without executing any.

A pickle is a program. Before any of it runs, ``pickletools`` lists its opcodes: whatever does not
build plain data, and whatever could take memory or time without end, is refused by name and byte.
What then runs may look up the inert classes only, and gets :class:`Opaque` for them. Its result is
checked to be a tree of bounded size, so that walking it is safe too.

Several pickles one after another: the field names, the next id, the records by id, and what later
versions of pydblite add. A record is one demonstration of a pair of tongs with two force sensors.
"""

from __future__ import annotations

import io
import pickle
import pickletools
import re
import warnings
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions, Recording
from forcelab.labels import UNLABELLED, Track, from_codes, means_unlabelled

#: A published database of ten demonstrations has 4 MB in 5 pickles, with 0.5 million opcodes, 160
#: of them for containers, 4 deep.
MAX_BYTES: Final = 64 * 2**20
MAX_PICKLES: Final = 100
MAX_VALUES: Final = 10_000_000
MAX_OPCODES: Final = 10_000_000
MAX_CONTAINERS: Final = 100_000
MAX_MEMO: Final = 500_000
MAX_DEPTH: Final = 50

_OPCODES: Final = {opcode.code: opcode for opcode in pickletools.opcodes}
_TUPLES: Final = frozenset({"TUPLE", "TUPLE1", "TUPLE2", "TUPLE3"})
_CONTAINERS: Final = _TUPLES | {"EMPTY_LIST", "EMPTY_DICT", "EMPTY_TUPLE", "LIST", "DICT"}
_PUTS: Final = frozenset({"PUT", "BINPUT", "LONG_BINPUT"})
_GETS: Final = frozenset({"GET", "BINGET", "LONG_BINGET"})
_CLASSES: Final = frozenset({"GLOBAL", "INST"})
#: What Python 2 wrote for plain data and for instances.
_ALLOWED: Final = (
    {"PROTO", "MARK", "STOP", "NONE", "NEWTRUE", "NEWFALSE", "INT", "LONG", "BININT", "BININT1"}
    | {"BININT2", "LONG1", "LONG4", "FLOAT", "BINFLOAT", "STRING", "BINSTRING", "SHORT_BINSTRING"}
    | {"UNICODE", "BINUNICODE", "APPEND", "APPENDS", "SETITEM", "SETITEMS"}
    | {"OBJ", "REDUCE", "NEWOBJ", "BUILD"}
    | (_CONTAINERS | _PUTS | _GETS | _CLASSES)
)
_MARK_ENDS: Final = frozenset({"APPENDS", "SETITEMS", "LIST", "DICT", "TUPLE", "OBJ", "INST"})
#: What the unpickler raises where a pickle is damaged.
_UNPICKLING_ERRORS: Final = (
    pickle.UnpicklingError, ValueError, TypeError, AttributeError, LookupError, EOFError,
    ArithmeticError,
)  # fmt: skip
#: Half of a pair, which no valid text holds.
_SURROGATE: Final = re.compile("[\ud800-\udfff]")
_TOO_DEEP: Final = (
    f"lists and dictionaries lie more than {MAX_DEPTH} deep in each other; a database does not"
)


class Opaque:
    """An instance of an inert class, without its state."""

    def __new__(cls, *_args: object) -> Opaque:
        """Drop the arguments."""
        return super().__new__(cls)

    def __setstate__(self, state: object) -> None:
        """Drop the state."""


#: What can come out; the brackets in quotes because the type names itself.
Value: TypeAlias = (
    "list[Value] | tuple[Value, ...] | dict[str | int, Value] | str | int | float | Opaque | None"
)


class _Unpickler(pickle.Unpickler):
    """The standard unpickler, which finds :class:`Opaque` only."""

    def find_class(self, module: str, name: str) -> Any:  # noqa: ARG002 - as the library calls it
        """Opaque: other classes were refused when the opcodes were listed."""
        return Opaque


def load_all(data: bytes, name: str, inert: frozenset[str] = frozenset()) -> list[Value]:
    """Read all pickles (protocols 0 to 2) that lie one after another in `data`.

    Instances of the classes `inert`, as ``"module.Name"``, become :class:`Opaque`. Values may share
    parts, but hold no cycle; written out in full they have at most :data:`MAX_VALUES` parts,
    :data:`MAX_DEPTH` deep. Errors name the byte.
    """
    if len(data) > MAX_BYTES:
        raise InputError(
            f"'{name}' has {len(data):,} bytes, more than the {MAX_BYTES:,} that are read from a "
            f"pickle; split the database."
        )
    budget = _Budget(name, inert)
    stream = io.BytesIO(data)
    values: list[Value] = []
    with warnings.catch_warnings():
        # Of escapes that escape nothing, in strings as Python 2 wrote them.
        warnings.simplefilter("ignore", DeprecationWarning)
        while (first := stream.tell()) < len(data):
            if len(values) == MAX_PICKLES:
                raise InputError(f"'{name}', byte {first}: more than {MAX_PICKLES} pickles follow.")
            budget.check_pickle(stream)
            stream.seek(first)
            try:
                values.append(_Unpickler(stream, encoding="latin-1").load())
            except _UNPICKLING_ERRORS as error:
                raise InputError(
                    f"'{name}', byte {first}: the pickle is damaged "
                    f"({_shortened(str(error))}); nothing was executed."
                ) from None
            try:
                _check_tree(values[-1], (), {})
            except ValueError as error:
                raise InputError(f"'{name}', byte {first}: {error}.") from None
    return values


class _Budget:
    """Checks opcodes, and counts what all pickles of a file take together."""

    def __init__(self, name: str, inert: frozenset[str]) -> None:
        self.name, self.inert = name, inert
        self.at = self.opcodes = self.containers = self.memo = self.marks = 0
        #: What the memo holds tuples under, and the opcode before the present one.
        self.tuples: set[int] = set()
        self.before = ""

    def check_pickle(self, stream: io.BytesIO) -> None:
        """Check the opcodes of the next pickle up to its STOP, as ``pickletools`` reads them."""
        self.tuples, self.marks, self.before = set(), 0, ""
        while self.before != "STOP":
            self.at = stream.tell()
            opcode = _OPCODES.get(stream.read(1).decode("latin-1"))
            if opcode is None:
                self.refuse("here is no pickle opcode; the file is cut short, damaged or no pickle")
            if opcode.name not in _ALLOWED:
                self.refuse(
                    f"the pickle opcode {opcode.name} is refused, because it does not build plain "
                    "data as Python 2 wrote it; nothing was executed"
                )
            try:
                argument = opcode.arg.reader(stream) if opcode.arg else None
            except UnicodeDecodeError:
                argument = ""  # a string that is not ASCII is whole all the same
            except ValueError as error:
                self.refuse(f"the file is cut short or damaged ({_shortened(str(error))})")
            self._count(opcode.name)
            self._check_argument(opcode.name, argument)
            if opcode.name not in _PUTS:
                self.before = opcode.name

    def _count(self, opcode: str) -> None:
        """Count what may use up memory or time."""
        self.opcodes += 1
        self.containers += opcode in _CONTAINERS
        self.memo += opcode in _PUTS
        self.marks += (opcode == "MARK") - (opcode in _MARK_ENDS)
        if self.opcodes > MAX_OPCODES:
            self.refuse(f"has more than {MAX_OPCODES:,} opcodes; split the database")
        if self.containers > MAX_CONTAINERS:
            self.refuse(f"holds more than {MAX_CONTAINERS:,} lists; split the database")
        if self.memo > MAX_MEMO:
            self.refuse(f"remembers more than {MAX_MEMO:,} values; split the database")
        if self.marks > 2 * MAX_DEPTH:
            self.refuse(_TOO_DEEP)

    def _check_argument(self, opcode: str, argument: Any) -> None:
        if opcode == "PROTO" and argument > 2:
            self.refuse(
                f"is written in pickle protocol {argument}, and only those of Python 2 (0 to 2) "
                "are read; write it again with protocol=2"
            )
        if opcode in _CLASSES and (full := argument.replace(" ", ".")) not in self.inert:
            self.refuse(
                f"the pickle asks for {_shortened(ascii(full))}, which is refused because it could "
                "run a program; nothing was executed"
            )
        if opcode in _PUTS:
            # The unpickler keeps a table as long as the largest index.
            if not 0 <= argument <= MAX_MEMO:
                self.refuse(f"remembers more than {MAX_MEMO:,} values; split the database")
            (self.tuples.add if self.before in _TUPLES else self.tuples.discard)(argument)
        if opcode in _GETS and argument in self.tuples:
            # As a key, a tuple of one tuple twice, of one tuple twice and so on hashes for ever.
            self.refuse("uses one tuple in several places; a database does not")
        if isinstance(argument, int) and not -(2**63) <= argument < 2**64:
            self.refuse("an integer is longer than 64 bits")
        if isinstance(argument, str) and _SURROGATE.search(argument):
            self.refuse(f"{_shortened(ascii(argument))} is no valid text")

    def refuse(self, problem: str) -> NoReturn:
        raise InputError(f"'{self.name}', byte {self.at}: {problem}.")


def _shortened(text: str) -> str:
    """Foreign text as it may stand in a sentence: printable and short."""
    text = text.encode("ascii", "backslashreplace").decode("ascii").replace("\n", " ")
    return "".join(c if c.isprintable() else "?" for c in text[:100]) + "..." * (len(text) > 100)


def _check_tree(value: Value, above: tuple[int, ...], sizes: dict[int, tuple[int, int]]) -> None:
    """Raise ValueError unless a value is a tree of bounded size; `above` are the ids it lies in.

    Number of values and depth of each container, by its id, go into `sizes`. Shared parts count as
    often as they are reached, so that walking the value is safe.
    """
    if id(value) in above:
        raise ValueError("a list or dictionary holds itself; such a database cannot be read")
    if len(above) >= MAX_DEPTH:
        raise ValueError(_TOO_DEEP)
    if id(value) in sizes or not isinstance(value, list | tuple | dict):
        return
    for key in value if isinstance(value, dict) else ():
        if isinstance(key, bool) or not isinstance(key, str | int):
            raise ValueError(f"a key is of the type {type(key).__name__}, not a string or integer")
    size, depth = 1 + len(value), 1
    for part in value.values() if isinstance(value, dict) else value:
        if isinstance(part, list | tuple | dict):
            _check_tree(part, (*above, id(value)), sizes)
            size += sizes[id(part)][0]
            depth = max(depth, 1 + sizes[id(part)][1])
    if size > MAX_VALUES:
        raise ValueError(f"written out in full it has more than {MAX_VALUES:,} values")
    if depth > MAX_DEPTH:
        raise ValueError(_TOO_DEEP)
    sizes[id(value)] = size, depth


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
    """Whether a file starts like a pickle; one called ``*.pdl`` with any opcode that starts one."""
    if path.suffix.lower() == ".pdl":
        return head[:1] in (b"\x80", b"]", b"}", b"(", b"c")
    return bool(_START.match(head))


def read(path: Path, options: ReadOptions) -> list[Recording]:
    """Read every record of a database, in the file's order: six channels (:data:`CHANNELS`) in N.

    Times start at zero. Labels are one track by ``options.author``. Demonstrations have the
    records' names or, where one is missing or not unique, ``"<file> 01"`` and so on.
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
    numbered = [f"{path.stem} {number:02d}" for number in range(1, len(names) + 1)]
    return numbered, (
        f"The names of the records are missing or not unique; the demonstrations are called "
        f"'{numbered[0]}' and so on.",
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
            raise InputError(f"'{file}': what is kept under {_shortened(ascii(key))} is no record.")
        checked[key] = record
    return checked


def _recording(
    where: str, record: _Record, name: str, remarks: tuple[str, ...], options: ReadOptions
) -> Recording:
    times = _numbers(where, "timestamps", record.get("timestamps"))
    if not (np.abs(times) < 1e12).all():
        raise InputError(f"{where}: timestamps holds something that is no time in seconds.")
    lists = record.get("signals")
    if not isinstance(lists, list):
        raise InputError(f"{where} has no signals.")
    signals = [_numbers(where, f"signal {place}", values) for place, values in enumerate(lists)]
    for _, place in CHANNELS:
        count = len(signals[place]) if place < len(signals) else 0
        if count != len(times):
            raise InputError(
                f"{where}: signal {place} has {count} samples where timestamps has {len(times)}; "
                f"the record is damaged or holds other signals than a pair of tongs."
            )
    remarks += tuple(f"'{name}': {disagreement}" for disagreement in _disagreements(signals))
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


def _numbers(where: str, name: str, values: Value) -> NDArray[np.float64]:
    """A list of plain numbers as an array of shape (n,)."""
    if not isinstance(values, list) or not set(map(type, values)) <= {int, float}:
        raise InputError(f"{where}: {name} is no list of numbers.")
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
            shown = _shortened(ascii(action))
            raise InputError(f"{where}: the label {shown} is no printable name.")
    number = {action: code for code, action in enumerate(actions)}
    codes = np.array([number.get(str(label), UNLABELLED) for label in labels], dtype=np.int64)
    return (Track(author, from_codes(codes, times, actions)),) if actions else ()
