"""Reading Python 2 pickles that nobody has vouched for.

:class:`~forcelab.formats.pdl.pickle_machine.PickleMachine` builds plain data and nothing else; here
its results are checked to be trees of bounded size, so that whoever walks them is safe too.
"""

from __future__ import annotations

from typing import Final

from forcelab.errors import InputError
from forcelab.formats.pdl.pickle_machine import (
    CONTAINERS,
    MAX_DEPTH,
    TOO_DEEP,
    Inert,
    PickleMachine,
    Value,
)

__all__ = ["MAX_BYTES", "Inert", "Value", "load_all"]

#: A published database of ten demonstrations has 4 MB in 5 pickles, with 0.5 million values.
MAX_BYTES: Final = 64 * 2**20
MAX_PICKLES: Final = 100
MAX_VALUES: Final = 10_000_000


def load_all(data: bytes, name: str, inert: frozenset[str] = frozenset()) -> list[Value]:
    """Read all pickles that lie one after another in `data`.

    Parameters
    ----------
    data : bytes
        Pickles of protocols 0 to 2. Byte strings are read as Latin-1, as Python 2 wrote them.
    name : str
        What the errors call the data, such as the file's name.
    inert : frozenset of str
        Classes, as ``"module.Name"``, whose instances become :attr:`Inert.INSTANCE`.

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
    machine = PickleMachine(data, name, inert)
    values: list[Value] = []
    while machine.position < len(data):
        first = machine.position
        if len(values) == MAX_PICKLES:
            raise InputError(f"'{name}', byte {first}: more than {MAX_PICKLES} pickles follow.")
        value = machine.load()
        trouble = _overgrown(value)
        if trouble:
            raise InputError(f"'{name}', byte {first}: {trouble}.")
        values.append(value)
    return values


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
                    return TOO_DEEP
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
            return TOO_DEEP
        sizes[id(current)], depths[id(current)] = size, depth
        open_ids.discard(id(current))
        path.pop()
    return ""


def _parts(value: Value) -> list[Value]:
    """The containers directly inside a value."""
    if isinstance(value, dict):
        return [part for part in value.values() if type(part) in CONTAINERS]
    if isinstance(value, list | tuple):
        return [part for part in value if type(part) in CONTAINERS]
    return []
