"""A stack machine that runs Python 2 pickles and can build nothing but plain data.

A pickle is a program for a small stack machine, and Python's own machine may import and call what
the program names. This one has no such verbs: it knows the opcodes of protocols 0 to 2 that build
lists, tuples, dictionaries, strings, numbers, booleans and None, and nothing else. An instance of
a class that the caller names as inert becomes :attr:`Inert.INSTANCE`, its state is dropped; any
other class and any other opcode is refused by name and byte. Nothing is imported or executed.

Reference: the opcode descriptions in the standard library's ``pickletools``.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from enum import Enum
from typing import Final, NoReturn, TypeAlias

from forcelab.formats.pdl.pickle_bytes import PickleBytes, shown

__all__ = ["CONTAINERS", "MAX_DEPTH", "TOO_DEEP", "Inert", "PickleMachine", "Value"]

#: Limits that keep a crafted pickle from using up the memory. A published database of ten
#: demonstrations has 0.5 million opcodes, 160 of them for containers, 4 deep.
MAX_OPCODES: Final = 10_000_000
MAX_CONTAINERS: Final = 100_000
MAX_MEMO: Final = 500_000
MAX_DEPTH: Final = 50


class Inert(Enum):
    """What stands for a class that is not built; neither member can be called."""

    CLASS = "class"
    INSTANCE = "instance"


#: What can come out; the brackets in quotes because the type names itself.
Value: TypeAlias = (
    "list[Value] | tuple[Value, ...] | dict[str | int, Value] | str | int | float | Inert | None"
)

CONTAINERS: Final = frozenset({list, tuple, dict})
_BINFLOAT: Final = ord("G")
_STOP: Final = ord(".")
TOO_DEEP: Final = (
    f"lists and dictionaries lie more than {MAX_DEPTH} deep in each other; a database does not"
)


class PickleMachine(PickleBytes):
    """The stack machine: a stack, marks into it, and a memo.

    Parameters
    ----------
    data, name
        As of :class:`~forcelab.formats.pdl.pickle_bytes.PickleBytes`.
    inert : frozenset of str
        Classes, as ``"module.Name"``, whose instances become :attr:`Inert.INSTANCE`.
    """

    def __init__(self, data: bytes, name: str, inert: frozenset[str]) -> None:
        super().__init__(data, name)
        self.inert = inert
        self.opcodes = 0
        self.containers = 0
        self.stack: list[Value] = []
        self.marks: list[int] = []
        self.memo: dict[int, Value] = {}

    def load(self) -> Value:
        """Run one pickle to its STOP and give what it built."""
        self.stack, self.marks, self.memo = [], [], {}
        data, size = self.data, len(self.data)
        read_float = struct.Struct(">d").unpack_from
        while True:
            at = self.opcode_at = self.position
            if at >= size:
                self.refuse("ends in the middle of a pickle; it is cut short, so copy it again")
            code = data[at]
            if code == _BINFLOAT and at + 9 <= size:
                # Nine in ten opcodes of a recording are floats: they take the short way.
                self.position = at + 9
                self.stack.append(read_float(data, at + 1)[0])
            elif code == _STOP:
                self.position = at + 1
                return self.finished()
            else:
                verb = _VERBS.get(code)
                if verb is None:
                    self.refuse_opcode(code)
                self.position = at + 1
                verb(self)
            self.opcodes += 1
            if self.opcodes > MAX_OPCODES:
                self.refuse(f"has more than {MAX_OPCODES:,} opcodes; split the database")

    def finished(self) -> Value:
        """The one value that is left."""
        if len(self.stack) != 1 or self.marks:
            self.refuse("stops with an unfinished value; the pickle is damaged")
        return self.stack.pop()

    def refuse_opcode(self, code: int) -> NoReturn:
        """Say which opcode is not known here."""
        import pickletools

        names = {ord(opcode.code): opcode.name for opcode in pickletools.opcodes}
        if code not in names:
            self.refuse(f"0x{code:02x} is no pickle opcode; the file is damaged or no pickle")
        self.refuse(
            f"the pickle opcode {names[code]} is refused, because it does not build plain data as "
            f"Python 2 wrote it; nothing was executed"
        )

    # -- the stack -----------------------------------------------------------------------------

    def push(self, value: Value) -> None:
        """Put a new value on the stack; containers are counted."""
        if type(value) in CONTAINERS:
            self.containers += 1
            if self.containers > MAX_CONTAINERS:
                self.refuse(f"holds more than {MAX_CONTAINERS:,} lists; split the database")
        self.stack.append(value)

    def pop(self, count: int) -> list[Value]:
        """Take the `count` topmost values, which must lie above the last mark."""
        floor = self.marks[-1] if self.marks else 0
        if len(self.stack) - count < floor:
            self.refuse("takes more values than there are; the pickle is damaged")
        taken = self.stack[-count:]
        del self.stack[-count:]
        return taken

    def pop_to_mark(self) -> list[Value]:
        """Take the values above the last mark, and the mark."""
        if not self.marks:
            self.refuse("goes back to a mark that is not there; the pickle is damaged")
        floor = self.marks.pop()
        taken = self.stack[floor:]
        del self.stack[floor:]
        return taken

    def top(self) -> Value:
        """The topmost value, left where it is."""
        (value,) = self.pop(1)
        self.stack.append(value)
        return value

    def mark(self) -> None:
        """Mark the place to which a later opcode goes back."""
        if len(self.marks) > 2 * MAX_DEPTH:
            self.refuse(TOO_DEEP)
        self.marks.append(len(self.stack))

    def protocol(self) -> None:
        """Accept the protocols that Python 2 wrote."""
        version = self.number("B")
        if version > 2:
            self.refuse(
                f"is written in pickle protocol {version}, and only those of Python 2 (0 to 2) are "
                f"read; write it again with protocol=2"
            )

    # -- containers ----------------------------------------------------------------------------

    def append(self, items: list[Value]) -> None:
        """APPEND and APPENDS: lengthen the list on top."""
        target = self.top()
        if not isinstance(target, list):
            self.refuse("appends to something that is no list; the pickle is damaged")
        target.extend(items)

    def set_items(self, items: list[Value]) -> None:
        """SETITEM and SETITEMS: fill the dictionary on top."""
        target = self.top()
        if not isinstance(target, dict):
            self.refuse("sets a key of something that is no dictionary; the pickle is damaged")
        target.update(self.paired(items))

    def paired(self, items: list[Value]) -> dict[str | int, Value]:
        """A dictionary of keys and values in turn.

        Keys are strings and integers only: to hash a nested tuple can take for ever.
        """
        if len(items) % 2:
            self.refuse("has a key without a value; the pickle is damaged")
        result: dict[str | int, Value] = {}
        for key, value in zip(items[::2], items[1::2], strict=True):
            if isinstance(key, bool) or not isinstance(key, str | int):
                self.refuse(f"a key is of the type {type(key).__name__}, not a string or integer")
            result[key] = value
        return result

    # -- the memo ------------------------------------------------------------------------------

    def put(self, index: int) -> None:
        """PUT: remember the topmost value."""
        if len(self.memo) >= MAX_MEMO:
            self.refuse(f"remembers more than {MAX_MEMO:,} values; split the database")
        self.memo[index] = self.top()

    def get(self, index: int) -> None:
        """GET: push a remembered value."""
        if index not in self.memo:
            self.refuse(f"asks for value {index}, which was not remembered; the pickle is damaged")
        self.stack.append(self.memo[index])

    # -- classes, none of which is ever looked up ----------------------------------------------

    def known_class(self) -> Inert:
        """Read the two lines that name a class, and refuse all but the inert ones."""
        module, name = self.line(), self.line()
        full = module + b"." + name
        if full.decode("latin-1") not in self.inert:
            self.refuse(
                f"the pickle asks for {shown(full)}, which is refused because it could run a "
                f"program; nothing was executed"
            )
        return Inert.CLASS

    def instance(self, what: list[Value]) -> None:
        """OBJ, REDUCE and NEWOBJ: an inert instance; the arguments are dropped."""
        if not what or what[0] is not Inert.CLASS:
            self.refuse("calls something that is no known class; nothing was executed")
        self.stack.append(Inert.INSTANCE)

    def inst(self) -> None:
        """INST: an inert instance whose class is named on the spot."""
        self.known_class()
        self.pop_to_mark()
        self.push(Inert.INSTANCE)

    def build(self) -> None:
        """BUILD: drop the state of an inert instance."""
        target, _ = self.pop(2)
        if target is not Inert.INSTANCE:
            self.refuse("gives a state to something that is no known object; nothing was executed")
        self.stack.append(target)


def _verbs() -> dict[int, Callable[[PickleMachine], None]]:
    """What each opcode does; STOP is handled in the loop."""
    m = PickleMachine
    verbs: dict[str, Callable[[PickleMachine], None]] = {
        "\x80": m.protocol,
        "(": m.mark,
        "N": lambda s: s.push(None),
        "\x88": lambda s: s.push(True),
        "\x89": lambda s: s.push(False),
        "I": lambda s: s.push(s.boolean_or_integer_line()),
        "L": lambda s: s.push(s.integer_line()),
        "J": lambda s: s.push(s.number("<i")),
        "K": lambda s: s.push(s.number("B")),
        "M": lambda s: s.push(s.number("<H")),
        "\x8a": lambda s: s.push(s.long(s.number("B"))),
        "\x8b": lambda s: s.push(s.long(s.number("<i"))),
        "F": lambda s: s.push(s.float_line()),
        "G": lambda s: s.push(s.double()),
        "S": lambda s: s.push(s.quoted_line()),
        "T": lambda s: s.push(s.latin(s.number("<i"))),
        "U": lambda s: s.push(s.latin(s.number("B"))),
        "V": lambda s: s.push(s.text(s.line(), "raw_unicode_escape")),
        "X": lambda s: s.push(s.text(s.take(s.number("<I")), "utf-8")),
        "]": lambda s: s.push([]),
        "}": lambda s: s.push({}),
        ")": lambda s: s.push(()),
        "l": lambda s: s.push(s.pop_to_mark()),
        "t": lambda s: s.push(tuple(s.pop_to_mark())),
        "d": lambda s: s.push(s.paired(s.pop_to_mark())),
        "\x85": lambda s: s.push(tuple(s.pop(1))),
        "\x86": lambda s: s.push(tuple(s.pop(2))),
        "\x87": lambda s: s.push(tuple(s.pop(3))),
        "a": lambda s: s.append(s.pop(1)),
        "e": lambda s: s.append(s.pop_to_mark()),
        "s": lambda s: s.set_items(s.pop(2)),
        "u": lambda s: s.set_items(s.pop_to_mark()),
        "p": lambda s: s.put(s.integer_line()),
        "q": lambda s: s.put(s.number("B")),
        "r": lambda s: s.put(s.number("<I")),
        "g": lambda s: s.get(s.integer_line()),
        "h": lambda s: s.get(s.number("B")),
        "j": lambda s: s.get(s.number("<I")),
        "c": lambda s: s.push(s.known_class()),
        "i": m.inst,
        "o": lambda s: s.instance(s.pop_to_mark()),
        "R": lambda s: s.instance(s.pop(2)),
        "\x81": lambda s: s.instance(s.pop(2)),
        "b": m.build,
    }
    return {ord(opcode): verb for opcode, verb in verbs.items()}


_VERBS: Final = _verbs()
