"""What messages hold: forces, labels and stamps, found by type and by name.

A ``geometry_msgs/Wrench`` is a force and a torque wherever it stands in a message. A vector, an
array or a number is a force or a torque where its name says so, or the name of its topic if its own
says nothing, as ``data`` does. A whole number or a text called tag, label, action or the like is a
label.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from numbers import Real
from typing import Any, Final, TypeAlias

import numpy as np

from forcelab.errors import InputError
from forcelab.formats.table.columns import is_label_name

__all__ = [
    "Contents",
    "Definitions",
    "Field",
    "Path",
    "address_of",
    "contents",
    "follow",
    "with_sensors",
    "within",
]

#: Names and places that lead from a message to a value in it.
Path: TypeAlias = tuple[str | int, ...]
#: Constants and fields of each type, as the library keeps them.
Definitions: TypeAlias = Mapping[str, tuple[Sequence[Any], Sequence[Any]]]

_WRENCH: Final = "geometry_msgs/msg/Wrench"
_TIME: Final = "builtin_interfaces/msg/Time"
#: What is not looked into.
_WHOLE: Final = frozenset([_WRENCH, _TIME, "builtin_interfaces/msg/Duration"])
_AXES: Final = "xyz"
#: Names of fields that say nothing of what is in them.
_EMPTY: Final = frozenset(["data", "value", "values", "vector", "header", "msg"])
_STAMPS: Final = frozenset(["stamp", "time", "timestamp"])
_TORQUES: Final = frozenset(["torque", "torques"])
_FORCES: Final = frozenset(["force", "forces", "wrench", "ft", "fx", "fy", "fz"])
#: An array of more numbers is a picture or a cloud, and a list of more messages is one too.
_MOST: Final = 64


@dataclass(frozen=True, slots=True)
class Field:
    """Numbers that belong together, such as those of a wrench; k of them.

    Parameters
    ----------
    topic : str
        With its slash.
    path : Path
        To what holds them.
    leaves : tuple of Path, length k
        To each of them.
    names, units : tuple of str, length k
        Of the channels that they become.
    force : bool
        Whether they are forces or torques.
    """

    topic: str
    path: Path
    leaves: tuple[Path, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    force: bool

    @property
    def address(self) -> str:
        """Topic and path, as people name it: ``/tag_multimodal.wrench_stamped.wrench``."""
        return address_of(self.topic, self.path)

    @property
    def addresses(self) -> list[str]:
        """Those of each number."""
        return [address_of(self.topic, leaf) for leaf in self.leaves]

    def part(self, places: Sequence[int]) -> Field:
        """Only some of the numbers."""
        return replace(
            self,
            leaves=tuple(self.leaves[i] for i in places),
            names=tuple(self.names[i] for i in places),
            units=tuple(self.units[i] for i in places),
        )


@dataclass(frozen=True, slots=True)
class Contents:
    """What the messages of a topic hold, as its first one tells.

    Parameters
    ----------
    topic : str
    numbers : tuple of Field
        Forces and all others, in the order of the definition, what is outermost first.
    labels : list of str
        Addresses of those words that are called like labels, the surest first.
    words : dict of str to Path
        By their address: whole numbers and texts, whatever they are called; no others are labels.
    stamp : Path or None
        The outermost stamp, such as that of the header.
    first : object
        That message.
    """

    topic: str
    numbers: tuple[Field, ...]
    labels: list[str]
    words: dict[str, Path]
    stamp: Path | None
    first: object


def contents(topic: str, message: object, definitions: Definitions) -> Contents:
    """Look through a message.

    Parameters
    ----------
    topic : str
    message : object
        As the library makes it: dataclasses, lists, arrays and plain values.
    definitions : mapping
        The constants and the fields of each type of message.
    """
    numbers: list[Field] = []
    ranks: dict[str, int] = {}
    words: dict[str, Path] = {}
    stamp: Path | None = None
    for path, value in _walk(message, definitions):
        name = _told(topic, path)
        if getattr(value, "__msgtype__", "") == _TIME:
            if stamp is None and name in _STAMPS:
                stamp = path
        elif isinstance(value, str | int) and not isinstance(value, bool):
            words[address := address_of(topic, path)] = path
            if rank := is_label_name(name):
                ranks[address] = rank
        made = _field(topic, path, name, value)
        if made is not None:
            numbers.append(made)
    labels = sorted(ranks, key=lambda address: ranks[address])
    return Contents(topic, tuple(numbers), labels, words, stamp, message)


def follow(message: Any, path: Path) -> Any:
    """The value in a message to which a path leads."""
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


def within(address: str, wish: str) -> bool:
    """Whether an address is the one that is wished for, or lies in it; slashes may be left out."""
    start, full = wish.removeprefix("/"), address.removeprefix("/")
    return full == start or full.startswith((f"{start}.", f"{start}/"))


def with_sensors(found: Sequence[Field]) -> list[Field]:
    """Give channels names that differ: with what tells their sensors apart, where they have to be.

    Raises
    ------
    InputError
        If nothing tells two of them apart.
    """
    names = [name for one in found for name in one.names]
    if len(set(names)) == len(names):
        return list(found)
    parts = [_parts(one) for one in found]
    for end in (0, -1):
        while all(len(p) > 1 for p in parts) and len({p[end] for p in parts}) == 1:
            for p in parts:
                p.pop(end)
    named = [
        replace(one, names=tuple(f"{name} {'_'.join(p)}".strip() for name in one.names))
        for one, p in zip(found, parts, strict=True)
    ]
    names = [name for one in named for name in one.names]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"two fields would both become the channel '{twice[0]}'; leave one out.")
    return named


def _walk(message: object, definitions: Definitions) -> Iterator[tuple[Path, object]]:
    """The message and all that is in it, with their paths, the outermost first."""
    coming: deque[tuple[Path, object]] = deque([((), message)])
    while coming:
        path, value = coming.popleft()
        yield path, value
        kind = getattr(value, "__msgtype__", "")
        if kind == "std_msgs/msg/Header":
            coming.append(((*path, "stamp"), follow(value, ("stamp",))))
        elif kind and kind not in _WHOLE and not _parts_of(value):
            # To the library's classes, constants and the type are fields too.
            coming += [((*path, name), getattr(value, name)) for name, _ in definitions[kind][1]]
        elif isinstance(value, list) and len(value) <= _MOST:
            coming += [((*path, i), one) for i, one in enumerate(value) if is_dataclass(one)]


def _parts_of(value: object) -> list[Path]:
    """Paths to the numbers that belong together in a wrench, a vector, or what is like one."""
    kind = getattr(value, "__msgtype__", "")
    if kind == _WRENCH:
        return [(part, axis) for part in ("force", "torque") for axis in _AXES]
    if not is_dataclass(value) or not kind.startswith("geometry_msgs/"):
        return []
    names = [one.name for one in fields(value) if one.name != "__msgtype__"]
    numeric = all(isinstance(getattr(value, name), Real) for name in names)
    return [(name,) for name in names] if numeric else []


def _field(topic: str, path: Path, name: str, value: object) -> Field | None:
    """The numbers that a value is or holds; None where it holds none."""
    inner = _parts_of(value)
    if isinstance(value, np.ndarray) and value.size <= _MOST and value.dtype.kind in "fiub":
        inner = [(i,) for i in range(value.size)]
    elif isinstance(value, Real):
        inner = [()]
    if not inner:
        return None
    kind = getattr(value, "__msgtype__", "")
    leaves = tuple((*path, *one) for one in inner)
    # Whole numbers that are called forces are counts of a device.
    measured = bool(kind) or np.asarray(value).dtype.kind == "f"
    names, units = _forces(name, len(inner), kind) if measured else ((), ())
    if names:
        return Field(topic, path, leaves, names, units, force=True)
    plain = tuple(".".join(map(str, leaf)) for leaf in leaves)
    if path == ("data",):
        plain = _counted(name, len(inner))
    return Field(topic, path, leaves, plain, ("",) * len(leaves), force=False)


def _forces(name: str, number: int, kind: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of so many numbers called `name`, if they are forces or torques."""
    words = set(_words(name))
    if kind == _WRENCH or (number == 6 and words & _FORCES):
        return tuple(f"{part}{axis}" for part in "ft" for axis in _AXES), ("N",) * 3 + ("Nm",) * 3
    if not words & (_TORQUES | _FORCES):
        return (), ()
    letter, unit = ("t", "Nm") if words & _TORQUES else ("f", "N")
    names = tuple(f"{letter}{axis}" for axis in _AXES) if number == 3 else _counted(name, number)
    return names, (unit,) * number


def _counted(name: str, number: int) -> tuple[str, ...]:
    """Names of so many numbers of one name."""
    return (name,) if number == 1 else tuple(f"{name} {i + 1}" for i in range(number))


def _told(topic: str, path: Path) -> str:
    """The innermost name on the way to a value that says anything: of a field, else of the topic.

    In ``wrist_ft/raw`` that is the first one, which is called like a force.
    """
    for step in reversed(path):
        if isinstance(step, str) and step not in _EMPTY:
            return step
    parts = [part for part in topic.split("/") if part]
    known = _FORCES | _TORQUES
    told = (p for p in reversed(parts) if is_label_name(p) or known.intersection(_words(p)))
    return next(told, parts[-1] if parts else "data")


def _words(name: str) -> list[str]:
    """The words of a name in lower case, numbers left out."""
    return re.split(r"[\W_\d]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())


def _parts(field: Field) -> list[str]:
    """What can tell a field's sensor from others, each fit for a name."""
    steps = [part for part in field.topic.split("/") if part]
    if field.force:  # all others are called by their path already
        steps += map(str, field.path)
    return [re.sub(r"\W+", "_", step) for step in steps if step not in _EMPTY]


def address_of(topic: str, path: Path) -> str:
    """How people name a value."""
    return ".".join([topic, *map(str, path)])
