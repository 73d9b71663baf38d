"""What the messages of a bag's topics hold, and which of it is read.

A ``geometry_msgs/Wrench`` is a force and a torque wherever it stands in a message. A vector, an
array or a number is a force or a torque where its name says so, or the name of its topic if its own
says nothing, as ``data`` does. A whole number or a text called tag, label, action or the like is a
label. A message's stamp is that of its outermost header.
"""

from __future__ import annotations

from array import array
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from numbers import Real
from typing import Any, Final, TypeAlias

import numpy as np

from forcelab.errors import InputError
from forcelab.formats.alignment import TimedStream
from forcelab.formats.fields import (
    AXES,
    EMPTY_NAMES,
    Field,
    FieldPath,
    address_of,
    is_force_name,
    name_forces,
    numbered,
    unknown_name,
    values_within,
    with_sensors,
)
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table_sniff import is_label_name
from forcelab.text import listed

#: Constants and fields of each type, as the library keeps them.
Definitions: TypeAlias = Mapping[str, tuple[Sequence[Any], Sequence[Any]]]

_WRENCH: Final = "geometry_msgs/msg/Wrench"
_TIME: Final = "builtin_interfaces/msg/Time"
#: What is not looked into.
_WHOLE: Final = frozenset([_WRENCH, _TIME, "builtin_interfaces/msg/Duration"])
_STAMPS: Final = frozenset(["stamp", "time", "timestamp"])
#: An array of more numbers is a picture or a cloud, and a list of more messages is one too.
_MOST: Final = 64


@dataclass(frozen=True, slots=True)
class Topic:
    """What the messages of a topic hold, by the first one."""

    name: str  #: with its slash
    numbers: tuple[Field, ...]  #: outermost first, in the order of the definition
    labels: list[str]  #: addresses of those words that are called like labels, the surest first
    #: paths of whole numbers and texts, by address; no others are labels
    words: dict[str, FieldPath]
    stamp: FieldPath | None  #: the outermost, such as that of the header
    first: Any  #: that message
    size: int  #: bytes of that message, as which all of them are counted
    count: int  #: messages

    @property
    def type_name(self) -> str:
        """The type of its messages, as people call it."""
        return str(self.first.__msgtype__).replace("/msg/", "/")


def describe_topic(
    name: str, message: object, definitions: Definitions, *, size: int, count: int
) -> Topic:
    """What a topic holds by its first message: dataclasses, lists, arrays and plain values."""
    numbers: list[Field] = []
    ranks: dict[str, int] = {}
    words: dict[str, FieldPath] = {}
    stamp: FieldPath | None = None
    for path, value in _walk(message, definitions):
        describing = _describing_name(name, path)
        if getattr(value, "__msgtype__", "") == _TIME:
            if stamp is None and describing in _STAMPS:
                stamp = path
        elif isinstance(value, str | int) and not isinstance(value, bool):
            words[address := address_of(name, path)] = path
            if rank := is_label_name(describing):
                ranks[address] = rank
        if (field_ := _field(name, path, describing, value)) is not None:
            numbers.append(field_)
    labels = sorted(ranks, key=lambda address: ranks[address])
    return Topic(name, tuple(numbers), labels, words, stamp, message, size, count)


def follow_path(message: Any, path: FieldPath) -> Any:
    """The value in a message to which a path leads."""
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


def _walk(message: object, definitions: Definitions) -> Iterator[tuple[FieldPath, object]]:
    """The message and all that is in it, with their paths, the outermost first."""
    queue: deque[tuple[FieldPath, object]] = deque([((), message)])
    while queue:
        path, value = queue.popleft()
        yield path, value
        kind = getattr(value, "__msgtype__", "")
        if kind == "std_msgs/msg/Header":
            queue.append(((*path, "stamp"), follow_path(value, ("stamp",))))
        elif kind and kind not in _WHOLE and not _parts_of(value):
            # To the library's classes, constants and the type are fields too.
            queue += [((*path, name), getattr(value, name)) for name, _ in definitions[kind][1]]
        elif isinstance(value, list) and len(value) <= _MOST:
            queue += [((*path, i), item) for i, item in enumerate(value) if is_dataclass(item)]


def _parts_of(value: object) -> list[FieldPath]:
    """Paths to the numbers that belong together in a wrench, a vector, or what is like one."""
    kind = getattr(value, "__msgtype__", "")
    if kind == _WRENCH:
        return [(part, axis) for part in ("force", "torque") for axis in AXES]
    if not is_dataclass(value) or not kind.startswith("geometry_msgs/"):
        return []
    names = [field_.name for field_ in fields(value) if field_.name != "__msgtype__"]
    numeric = all(isinstance(getattr(value, name), Real) for name in names)
    return [(name,) for name in names] if numeric else []


def _field(topic: str, path: FieldPath, name: str, value: object) -> Field | None:
    """The numbers that a value is or holds; None where it holds none."""
    parts = _parts_of(value)
    if isinstance(value, np.ndarray) and value.size <= _MOST and value.dtype.kind in "fiub":
        parts = [(i,) for i in range(value.size)]
    elif isinstance(value, Real):
        parts = [()]
    if not parts:
        return None
    kind = getattr(value, "__msgtype__", "")
    leaves = tuple((*path, *part) for part in parts)
    # Whole numbers that are called forces are counts of a device.
    measured = bool(kind) or np.asarray(value).dtype.kind == "f"
    force_name = "wrench" if kind == _WRENCH else name
    names, units = name_forces(force_name, len(parts)) if measured else ((), ())
    if names:
        return Field(topic, path, leaves, names, units, force=True)
    plain = tuple(".".join(map(str, leaf)) for leaf in leaves)
    if path == ("data",):
        plain = numbered(name, len(parts))
    return Field(topic, path, leaves, plain, ("",) * len(leaves), force=False)


def _describing_name(topic: str, path: FieldPath) -> str:
    """The innermost name on the way to a value that says anything: of a field, else of the topic.

    In ``wrist_ft/raw`` that is the first one, which is called like a force.
    """
    for step in reversed(path):
        if isinstance(step, str) and step not in EMPTY_NAMES:
            return step
    parts = [part for part in topic.split("/") if part]
    describing = (part for part in reversed(parts) if is_label_name(part) or is_force_name(part))
    return next(describing, parts[-1] if parts else "data")


#: Nanoseconds beyond this, 70 years from 1970, tell nothing; sums of four stay within 64 bits.
_ABSURD: Final = 22 * 10**17


def _bounded(nanoseconds: int) -> int:
    """A time with which can be reckoned."""
    return max(-_ABSURD, min(nanoseconds, _ABSURD))


@dataclass(slots=True)
class TopicData:
    """What is read of a topic, message by message: only its times where it is of pictures."""

    topic: Topic
    fields: tuple[Field, ...] = ()  #: the numbers that become channels, c of them
    label: FieldPath | None = None
    leaves: list[FieldPath] = field(init=False)  #: paths to each of these numbers
    #: how many there are in each array and list that they are taken from
    sizes: dict[FieldPath, int] = field(init=False)
    arrived: array[int] = field(default_factory=lambda: array("q"))  #: nanoseconds since 1970
    stamped: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))  #: message by message
    words: list[str] = field(default_factory=list)  #: the labels

    def __post_init__(self) -> None:
        self.leaves = [leaf for field_ in self.fields for leaf in field_.leaves]
        self.sizes = {
            leaf[:i]: len(follow_path(self.topic.first, leaf[:i]))
            for leaf in self.leaves
            for i, step in enumerate(leaf)
            if isinstance(step, int)
        }

    @property
    def label_address(self) -> str:
        """How people name its label; empty without one."""
        return "" if self.label is None else address_of(self.topic.name, self.label)

    def add(self, arrived: int, message: object) -> None:
        """Add a message; refused if an array or list has another length than in the first one."""
        for path, size in self.sizes.items():
            if (count := len(follow_path(message, path))) != size:
                name = address_of(self.topic.name, path)
                raise InputError(
                    f"message {len(self.arrived) + 1:,} of {self.topic.name} holds {count:,} "
                    f"values in {name}, and the first one {size:,}; leave it out (--leave-out "
                    f"{name})."
                )
        self.values.extend([float(follow_path(message, leaf)) for leaf in self.leaves])
        self.arrived.append(_bounded(arrived))
        if self.topic.stamp is not None:
            stamp = follow_path(message, self.topic.stamp)
            self.stamped.append(_bounded(stamp.sec * 10**9 + stamp.nanosec))
        if self.label is not None:
            self.words.append(" ".join(str(follow_path(message, self.label)).split()))

    def stream(self) -> TimedStream:
        """What was added, to be brought onto one clock with others."""
        return TimedStream(
            self.topic.name,
            np.asarray(self.arrived, np.int64),
            None if self.topic.stamp is None else np.asarray(self.stamped, np.int64),
            np.asarray(self.values).reshape(len(self.arrived), len(self.leaves)),
            None if self.label is None else self.words,
        )


def select_fields(topics: Sequence[Topic], options: ReadOptions) -> list[TopicData]:
    """The topics to read, empty yet: forces and requested signals, without what is to be left out.

    Options name topics, or fields as in ``/topic.field.part``.
    """
    all_fields = [field_ for topic in topics for field_ in topic.numbers]
    addresses = [address for field_ in all_fields for address in field_.addresses]
    addresses += [address for topic in topics for address in topic.words]
    for name in (*options.signals, *options.leave_out):
        if not any(values_within(address, name) for address in addresses):
            raise unknown_name(name, "values", [field_.address for field_ in all_fields])
    chosen = with_sensors(
        [part for field_ in all_fields if (part := field_.requested(options)).leaves]
    )
    if not chosen:
        left = " but what is left out" if options.leave_out else ""
        raise InputError(
            f"no topic in it carries forces{left} (there are "
            f"{listed([topic.name for topic in topics])}); name what is to be read as a "
            "signal, a topic or a field of it as in --signal /topic.field."
        )
    label = _label_address(topics, options, {field_.topic for field_ in chosen})
    return [
        TopicData(topic, own, topic.words.get(label))
        for topic in topics
        if (own := tuple(f for f in chosen if f.topic == topic.name)) or label in topic.words
    ]


def _label_address(topics: Sequence[Topic], options: ReadOptions, measured: set[str]) -> str:
    """Address of the labels: as asked for, else the surest name, beside forces first; or empty."""
    if options.label is not None:
        words = [address for topic in topics for address in topic.words]
        addresses = [address for address in words if values_within(address, options.label)]
        if len(addresses) != 1:
            raise unknown_name(options.label, "labels", words)
    else:
        addresses = [
            address
            for topic in sorted(topics, key=lambda topic: topic.name not in measured)
            for address in topic.labels
            if not values_within(address, *options.leave_out, *options.signals)
        ]
    return addresses[0] if addresses else ""


def left_numbers(data: Sequence[TopicData]) -> list[str]:
    """Addresses of numbers that are not read, in topics of which others are."""
    used = {field_.address for topic_data in data for field_ in topic_data.fields}
    return [
        field_.address
        for topic_data in data
        if topic_data.fields
        for field_ in topic_data.topic.numbers
        if field_.address not in used and field_.address not in topic_data.topic.words
    ]


#: What the library gives to a type without fields; in ROS 1 it takes no byte.
_DUMMY_FIELD: Final = "structure_needs_at_least_one_member"
#: A message has no more fields, all within one another counted, nor are they nested deeper.
_MOST_FIELDS, _DEEPEST = 20_000, 32


def unreadable_reason(kind: str, definitions: Definitions) -> str:
    """Why messages of a type cannot be read, before anything is made of them; empty if they can."""
    from rosbags.interfaces import Nodetype

    known: dict[str, int] = {}  # fields of each type; 0 of what takes no bytes

    def count_fields(kind: str, above: tuple[str, ...]) -> int:
        if kind in above:
            raise _UnreadableError(f"{kind} contains itself")
        if len(above) > _DEEPEST:
            raise _UnreadableError(f"messages are nested deeper than {_DEEPEST}")
        if kind not in definitions:
            raise _UnreadableError(f"{kind}, which the bag does not define")
        if kind not in known:
            known[kind] = sum(
                count_values(desc, (*above, kind))
                for name, desc in definitions[kind][1]
                if name != _DUMMY_FIELD
            )
        if known[kind] > _MOST_FIELDS:
            raise _UnreadableError(f"more than {_MOST_FIELDS:,} fields a message")
        return known[kind]

    def count_values(desc: Any, above: tuple[str, ...]) -> int:
        sort, inner = desc
        if sort == Nodetype.NAME:
            return count_fields(inner, above)
        if sort == Nodetype.BASE:
            return 1
        item, length = inner
        several = count_values(item, above)
        if several == 0:
            raise _UnreadableError(f"a list of {item[1]}, which holds nothing")
        if sort == Nodetype.SEQUENCE:
            return 1 + several
        return several if item[0] == Nodetype.BASE and item[1][0] != "string" else several * length

    try:
        count_fields(kind, ())
    except _UnreadableError as error:
        return str(error)
    return ""


class _UnreadableError(Exception):
    """A definition that no message can have."""
