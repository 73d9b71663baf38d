"""Numbers of a file that belong together: how people name them, and the channels they become."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.text import listed

#: Names and places that lead to a value, as in a message of a bag.
FieldPath: TypeAlias = tuple[str | int, ...]

AXES: Final = "xyz"
#: Names that say nothing of what is in them.
EMPTY_NAMES: Final = frozenset(["data", "value", "values", "vector", "header", "msg"])
_TORQUES: Final = frozenset(["torque", "torques"])
_FORCES: Final = frozenset(["force", "forces", "wrench", "ft", "fx", "fy", "fz"])


@dataclass(frozen=True, slots=True)
class Field:
    """Numbers that belong together, such as those of a wrench; k of them."""

    topic: str  #: of a bag with its slash; else the stream or array
    path: FieldPath  #: to what holds them
    leaves: tuple[FieldPath, ...]  #: to each of them
    names: tuple[str, ...]  #: of the channels that they become
    units: tuple[str, ...]
    force: bool  #: whether they are forces or torques, which are read without being asked for

    @property
    def address(self) -> str:
        """Topic and path, as people name it: ``/tag_multimodal.wrench_stamped.wrench``."""
        return address_of(self.topic, self.path)

    @property
    def addresses(self) -> list[str]:
        """Those of each number."""
        return [address_of(self.topic, leaf) for leaf in self.leaves]

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What they become."""
        return tuple(map(Channel, self.names, self.units))

    def requested(self, options: ReadOptions) -> Field:
        """Those of them that are read: of a force all, else what is asked for."""
        places = [
            i
            for i, address in enumerate(self.addresses)
            if (self.force or values_within(address, *options.signals))
            and not values_within(address, *options.leave_out)
        ]
        return replace(
            self,
            leaves=tuple(self.leaves[i] for i in places),
            names=tuple(self.names[i] for i in places),
            units=tuple(self.units[i] for i in places),
        )


def address_of(topic: str, path: FieldPath) -> str:
    """How people name a value."""
    return ".".join([topic, *map(str, path)])


def values_within(address: str, *names: str) -> bool:
    """Whether an address is one of these names, or lies in one; slashes may be left out."""
    full = address.removeprefix("/")
    bare = [name.removeprefix("/") for name in names]
    return any(full == name or full.startswith((f"{name}.", f"{name}/")) for name in bare)


def unknown_name(name: str, kind: str, known: Sequence[str]) -> InputError:
    """The error for a name that means nothing, or more than one thing."""
    cure = f"name one of {listed(known)}" if known else "there are none"
    return InputError(f"it has no {kind} called '{name}'; {cure}.")


def name_forces(name: str, number: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of so many numbers called `name`, if they are forces or torques."""
    words = _name_words(name)
    if number == 6 and words & _FORCES:
        return tuple(f"{part}{axis}" for part in "ft" for axis in AXES), ("N",) * 3 + ("Nm",) * 3
    if not is_force_name(name):
        return (), ()
    letter, unit = ("t", "Nm") if words & _TORQUES else ("f", "N")
    names = tuple(f"{letter}{axis}" for axis in AXES) if number == 3 else numbered(name, number)
    return names, (unit,) * number


def is_force_name(name: str) -> bool:
    """Whether what is called so is a force or a torque."""
    return bool(_name_words(name) & (_FORCES | _TORQUES))


def numbered(name: str, number: int) -> tuple[str, ...]:
    """Names of so many numbers of one name."""
    return (name,) if number == 1 else tuple(f"{name} {i + 1}" for i in range(number))


def _name_words(name: str) -> set[str]:
    """The words of a name in lower case, numbers left out."""
    return set(re.split(r"[\W_\d]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower()))


def with_sensors(fields: Sequence[Field]) -> list[Field]:
    """Give channels distinct names: with what tells their sensors apart, where they have to be."""
    names = [name for field in fields for name in field.names]
    if len(set(names)) == len(names):
        return list(fields)
    all_words = [_sensor_words(field) for field in fields]
    for end in (0, -1):
        while (
            all(len(words) > 1 for words in all_words)
            and len({words[end] for words in all_words}) == 1
        ):
            for words in all_words:
                words.pop(end)
    named = [
        replace(field, names=tuple(f"{name} {'_'.join(words)}".strip() for name in field.names))
        for field, words in zip(fields, all_words, strict=True)
    ]
    (name, number), *_ = Counter(name for field in named for name in field.names).most_common(1)
    if number > 1:
        raise InputError(f"two fields would both become the channel '{name}'; leave one out.")
    return named


def _sensor_words(field: Field) -> list[str]:
    """What can tell a field's sensor from others, each fit for a name."""
    steps = [part for part in field.topic.split("/") if part]
    if field.force:  # all others are called by their path already
        steps += map(str, field.path)
    return [re.sub(r"\W+", "_", step) for step in steps if step not in EMPTY_NAMES]
