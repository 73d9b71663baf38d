"""Reading Python 2 pickles that nobody has vouched for, with the standard library.

A pickle is a program. Before any of it runs, ``pickletools`` lists its opcodes: whatever does not
build plain data, and whatever could take memory or time without end, is refused by name and byte.
What then runs may look up the inert classes only, and gets :class:`Opaque` for them. Its result is
checked to be a tree of bounded size, so that walking it is safe too.
"""

from __future__ import annotations

import io
import pickle
import pickletools
import warnings
from typing import Any, Final, NoReturn, TypeAlias

from forcelab.errors import InputError

__all__ = ["MAX_BYTES", "Opaque", "Value", "load_all"]

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
_STUMBLES: Final = (
    pickle.UnpicklingError, ValueError, TypeError, AttributeError, LookupError, EOFError,
    ArithmeticError,
)  # fmt: skip
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
    """Read all pickles that lie one after another in `data`.

    Parameters
    ----------
    data : bytes
        Pickles of protocols 0 to 2. Byte strings are read as Latin-1, as Python 2 wrote them.
    name : str
        What the errors call the data, such as the file's name.
    inert : frozenset of str
        Classes, as ``"module.Name"``, whose instances become :class:`Opaque`.

    Returns
    -------
    list of Value
        One value a pickle. Values may share parts, as they did when written, but hold no cycle;
        written out in full they have at most :data:`MAX_VALUES` parts, :data:`MAX_DEPTH` deep.

    Raises
    ------
    InputError
        If the data is not a sequence of whole pickles, names another class, uses any opcode that
        does not build plain data, or goes beyond a limit. The sentence says at which byte.
    """
    if len(data) > MAX_BYTES:
        raise InputError(
            f"'{name}' has {len(data):,} bytes, more than the {MAX_BYTES:,} that are read from a "
            f"pickle; split the database."
        )
    with warnings.catch_warnings():
        # Of escapes that escape nothing, in strings as Python 2 wrote them.
        warnings.simplefilter("ignore", DeprecationWarning)
        return _load_all(data, name, inert)


def _load_all(data: bytes, name: str, inert: frozenset[str]) -> list[Value]:
    """Load pickle by pickle."""
    budget = _Budget(name, inert)
    stream = io.BytesIO(data)
    values: list[Value] = []
    while (first := stream.tell()) < len(data):
        if len(values) == MAX_PICKLES:
            raise InputError(f"'{name}', byte {first}: more than {MAX_PICKLES} pickles follow.")
        budget.check_pickle(stream)
        stream.seek(first)
        try:
            value = _Unpickler(stream, encoding="latin-1").load()
        except _STUMBLES as error:
            raise InputError(
                f"'{name}', byte {first}: the pickle is damaged ({_short(str(error))}); nothing "
                "was executed."
            ) from None
        if trouble := _overgrown(value):
            raise InputError(f"'{name}', byte {first}: {trouble}.")
        values.append(value)
    return values


class _Budget:
    """What all pickles of a file may take together, and what each may do.

    Parameters
    ----------
    name : str
        What the errors call the data.
    inert : frozenset of str
        The classes that may be named.
    """

    def __init__(self, name: str, inert: frozenset[str]) -> None:
        self.name, self.inert = name, inert
        self.at = self.opcodes = self.containers = self.memo = self.marks = 0
        #: What the memo holds tuples under, and the opcode before the present one.
        self.tuples: set[int] = set()
        self.before = ""

    def check_pickle(self, stream: io.BytesIO) -> None:
        """List the opcodes of the next pickle up to its STOP, as ``pickletools`` reads them.

        Raises
        ------
        InputError
            At the first opcode or argument that is refused.
        """
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
                self.refuse(f"the file is cut short or damaged ({_short(str(error))})")
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
        """Refuse what an opcode must not be given."""
        if opcode == "PROTO" and argument > 2:
            self.refuse(
                f"is written in pickle protocol {argument}, and only those of Python 2 (0 to 2) "
                "are read; write it again with protocol=2"
            )
        if opcode in _CLASSES and (full := argument.replace(" ", ".")) not in self.inert:
            self.refuse(
                f"the pickle asks for {_short(ascii(full))}, which is refused because it could "
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
        if isinstance(argument, str) and not _writable(argument):
            self.refuse(f"{_short(ascii(argument))} is no valid text")

    def refuse(self, what: str) -> NoReturn:
        """Raise the sentence; `what` follows the place."""
        raise InputError(f"'{self.name}', byte {self.at}: {what}.")


def _writable(text: str) -> bool:
    """Whether a text can be written as UTF-8."""
    try:
        text.encode()
    except UnicodeError:
        return False
    return True


def _short(text: str) -> str:
    """Foreign text as it may stand in a sentence: printable and short."""
    text = text.encode("ascii", "backslashreplace").decode("ascii").replace("\n", " ")
    return "".join(c if c.isprintable() else "?" for c in text[:100]) + "..." * (len(text) > 100)


def _overgrown(value: Value) -> str:
    """Why a value is no tree of bounded size; empty if it is one.

    Shared parts count as often as they are reached, so that whoever walks the value is safe.
    """
    sizes: dict[int, int] = {}
    depths: dict[int, int] = {}
    path: list[tuple[Value, list[Value]]] = [(value, _parts(value))]
    open_ids = {id(value)}
    while path:
        current, waiting = path[-1]
        if waiting:
            part = waiting.pop()
            if id(part) in open_ids:
                return "a list or dictionary holds itself; such a database cannot be read"
            if id(part) not in sizes:
                if len(path) >= MAX_DEPTH:
                    return _TOO_DEEP
                open_ids.add(id(part))
                path.append((part, _parts(part)))
            continue
        parts = _parts(current)
        length = len(current) if isinstance(current, list | tuple | dict) else 0
        size = 1 + length + sum(sizes[id(part)] for part in parts)
        depth = 1 + max((depths[id(part)] for part in parts), default=0)
        if size > MAX_VALUES:
            return f"written out in full it has more than {MAX_VALUES:,} values"
        if depth > MAX_DEPTH:
            return _TOO_DEEP
        sizes[id(current)], depths[id(current)] = size, depth
        open_ids.discard(id(current))
        path.pop()
    return _bad_key(value)


def _bad_key(value: Value) -> str:
    """Why a key of a dictionary is none of a database; empty if all are."""
    seen: set[int] = set()
    waiting = [value]
    while waiting:
        current = waiting.pop()
        if id(current) in seen:
            continue
        seen.add(id(current))
        for key in current if isinstance(current, dict) else ():
            if isinstance(key, bool) or not isinstance(key, str | int):
                return f"a key is of the type {type(key).__name__}, not a string or integer"
        waiting += _parts(current)
    return ""


def _parts(value: Value) -> list[Value]:
    """The containers directly inside a value."""
    if isinstance(value, dict):
        return [part for part in value.values() if isinstance(part, list | tuple | dict)]
    if isinstance(value, list | tuple):
        return [part for part in value if isinstance(part, list | tuple | dict)]
    return []
