"""What the messages of a bag hold, and its topics on one clock.

A ``geometry_msgs/Wrench`` is a force and a torque wherever it stands in a message. A vector, an
array or a number is a force or a torque where its name says so, or the name of its topic if its own
says nothing, as ``data`` does. A whole number or a text called tag, label, action or the like is a
label.

A message's stamp is that of its outermost header. Where there is none, or none that was ever set,
it is the time at which the message arrived. Where a topic's stamps are of another clock than those
that the rest is put to, they are shifted by how much more or less late its messages arrived.
"""

from __future__ import annotations

import re
from array import array
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from numbers import Real
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS, Channel
from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table_sniff import is_label_name
from forcelab.formats.timestamps import RawTimestamps, repair_timestamps
from forcelab.signals.grid import interpolate
from forcelab.text import counted

#: Names and places that lead from a message to a value in it.
FieldPath: TypeAlias = tuple[str | int, ...]
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
    """Numbers that belong together, such as those of a wrench; k of them."""

    topic: str  #: with its slash
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


@dataclass(frozen=True, slots=True)
class Contents:
    """What the messages of a topic hold, by the first one."""

    topic: str
    numbers: tuple[Field, ...]  #: outermost first, in the order of the definition
    labels: list[str]  #: addresses of those words that are called like labels, the surest first
    #: paths of whole numbers and texts, by address; no others are labels
    words: dict[str, FieldPath]
    stamp: FieldPath | None  #: the outermost, such as that of the header
    first: object  #: that message


def contents(topic: str, message: object, definitions: Definitions) -> Contents:
    """What a message of the library holds: dataclasses, lists, arrays and plain values."""
    numbers: list[Field] = []
    ranks: dict[str, int] = {}
    words: dict[str, FieldPath] = {}
    stamp: FieldPath | None = None
    for path, value in _walk(message, definitions):
        name = _describing_name(topic, path)
        if getattr(value, "__msgtype__", "") == _TIME:
            if stamp is None and name in _STAMPS:
                stamp = path
        elif isinstance(value, str | int) and not isinstance(value, bool):
            words[address := address_of(topic, path)] = path
            if rank := is_label_name(name):
                ranks[address] = rank
        field_ = _field(topic, path, name, value)
        if field_ is not None:
            numbers.append(field_)
    labels = sorted(ranks, key=lambda address: ranks[address])
    return Contents(topic, tuple(numbers), labels, words, stamp, message)


def follow_path(message: Any, path: FieldPath) -> Any:
    """The value in a message to which a path leads."""
    for step in path:
        message = message[step] if isinstance(step, int) else getattr(message, step)
    return message


def values_within(address: str, *names: str) -> bool:
    """Whether an address is one of these names, or lies in one; slashes may be left out."""
    full = address.removeprefix("/")
    bare = [name.removeprefix("/") for name in names]
    return any(full == name or full.startswith((f"{name}.", f"{name}/")) for name in bare)


def with_sensors(fields_: Sequence[Field]) -> list[Field]:
    """Give channels distinct names: with what tells their sensors apart, where they have to be."""
    names = [name for field_ in fields_ for name in field_.names]
    if len(set(names)) == len(names):
        return list(fields_)
    all_words = [_parts(field_) for field_ in fields_]
    for end in (0, -1):
        while (
            all(len(words) > 1 for words in all_words)
            and len({words[end] for words in all_words}) == 1
        ):
            for words in all_words:
                words.pop(end)
    named = [
        replace(field_, names=tuple(f"{name} {'_'.join(words)}".strip() for name in field_.names))
        for field_, words in zip(fields_, all_words, strict=True)
    ]
    (name, number), *_ = Counter(name for f in named for name in f.names).most_common(1)
    if number > 1:
        raise InputError(f"two fields would both become the channel '{name}'; leave one out.")
    return named


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
        return [(part, axis) for part in ("force", "torque") for axis in _AXES]
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
    names, units = name_forces(name, len(parts), kind) if measured else ((), ())
    if names:
        return Field(topic, path, leaves, names, units, force=True)
    plain = tuple(".".join(map(str, leaf)) for leaf in leaves)
    if path == ("data",):
        plain = _counted(name, len(parts))
    return Field(topic, path, leaves, plain, ("",) * len(leaves), force=False)


def name_forces(name: str, number: int, kind: str = "") -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of so many numbers called `name`, if they are forces or torques."""
    words = set(_name_words(name))
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


def _describing_name(topic: str, path: FieldPath) -> str:
    """The innermost name on the way to a value that says anything: of a field, else of the topic.

    In ``wrist_ft/raw`` that is the first one, which is called like a force.
    """
    for step in reversed(path):
        if isinstance(step, str) and step not in _EMPTY:
            return step
    parts = [part for part in topic.split("/") if part]
    quantities = _FORCES | _TORQUES
    describing = (
        p for p in reversed(parts) if is_label_name(p) or quantities.intersection(_name_words(p))
    )
    return next(describing, parts[-1] if parts else "data")


def _name_words(name: str) -> list[str]:
    """The words of a name in lower case, numbers left out."""
    return re.split(r"[\W_\d]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).lower())


def _parts(field: Field) -> list[str]:
    """What can tell a field's sensor from others, each fit for a name."""
    steps = [part for part in field.topic.split("/") if part]
    if field.force:  # all others are called by their path already
        steps += map(str, field.path)
    return [re.sub(r"\W+", "_", step) for step in steps if step not in _EMPTY]


def address_of(topic: str, path: FieldPath) -> str:
    """How people name a value."""
    return ".".join([topic, *map(str, path)])


_SECOND: Final = 10**9
#: A message does not travel so many nanoseconds; where it seems to, two clocks differ.
_LATENCY: Final = _SECOND
#: By how many nanoseconds a message may overtake another one of its topic.
_OVERTAKING: Final = _SECOND // 20
#: Nanoseconds beyond this, 70 years from 1970, tell nothing; sums of four stay within 64 bits.
_ABSURD: Final = 22 * 10**17


@dataclass(slots=True)
class TopicData:
    """The messages of one topic, n of them, as far as they are read."""

    topic: str
    fields: tuple[Field, ...]  #: the numbers that become channels, c of them
    #: how many there are in each array and list that they are taken from
    sizes: Mapping[FieldPath, int]
    stamp: FieldPath | None
    label: FieldPath | None
    arrived: array[int] = field(default_factory=lambda: array("q"))  #: nanoseconds since 1970
    stamped: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))  #: message by message, n * c
    #: the labels as words; empty where there is no label
    words: list[str] = field(default_factory=list)

    def add(self, arrived: int, message: object) -> None:
        """Add a message; refused if an array or list has another length than in the first one."""
        for path, size in self.sizes.items():
            if (count := len(follow_path(message, path))) != size:
                name = address_of(self.topic, path)
                raise InputError(
                    f"message {len(self.arrived) + 1:,} of {self.topic} holds {count:,} values in "
                    f"{name}, and the first one {size:,}; leave it out (--leave-out {name})."
                )
        for field_ in self.fields:
            self.values.extend([float(follow_path(message, leaf)) for leaf in field_.leaves])
        self.arrived.append(_bounded(arrived))
        stamp = None if self.stamp is None else follow_path(message, self.stamp)
        self.stamped.append(0 if stamp is None else _bounded(stamp.sec * _SECOND + stamp.nanosec))
        if self.label is not None:
            self.words.append(" ".join(str(follow_path(message, self.label)).split()))


@dataclass(frozen=True, slots=True)
class AlignedTopics:
    """Topics on one clock, n samples of c channels."""

    #: those of the topic with most messages, in seconds from its first one
    times: NDArray[np.float64]
    signals: NDArray[np.float64]  #: shape (n, c); NaN where a topic has no message near
    #: the label that holds at each time, empty before the first; none without labels
    words: list[str]
    start: float  #: the first time in seconds since 1970
    #: a sentence for each thing that was repaired, shifted or interpolated
    remarks: tuple[str, ...]
    #: of each topic of pictures the times at which they were taken
    frames: tuple[FrameTimes, ...] = ()


@dataclass(frozen=True, slots=True)
class FrameTimes:
    """When the pictures of a topic were taken; n of them."""

    topic: str
    rows: NDArray[np.int64]  #: (n,), the places of their messages in the topic, from 0; rising
    times: NDArray[np.float64]  #: (n,), in seconds on the clock of the samples; rising
    remarks: tuple[str, ...]  #: what was repaired, or why there are none


def align_topics(
    topics: Sequence[TopicData],
    where: str,
    *,
    strict: bool,
    pictures: Sequence[TopicData] = (),
    topic_word: str = "topic",
    message_word: str = "message",
) -> AlignedTopics:
    """Bring topics onto one clock: at least one with fields, at most one with labels.

    `strict` refuses what would be repaired or shifted; `where` is the bag, for errors. Of
    `pictures` only the times are needed. What is no bag has other words for topics and messages.
    """
    base = max((topic for topic in topics if topic.fields), key=lambda topic: len(topic.arrived))
    stamps, late = _clock(base)
    zero = int(np.median(stamps))  # near all others: their differences are exact
    resamplings = {
        topic.topic: _resampling(
            topic, zero, late, f"{where}, {topic_word} {topic.topic}", message_word, strict=strict
        )
        for topic in topics
    }
    at = resamplings[base.topic].at
    remarks: list[str] = []
    columns: list[NDArray[np.float64]] = []
    words: list[str] = []
    for topic in topics:
        resampling = resamplings[topic.topic]
        remarks += [f"{topic.topic}: {remark}" for remark in resampling.remarks]
        if topic.label is not None:
            words = _sample_and_hold(resampling, [topic.words[i] for i in resampling.rows], at)
        if topic is base:
            columns.append(resampling.values)
        elif topic.fields:
            longest, beyond = GAP_PERIODS * resampling.period, resampling.period
            lines = interpolate(
                at, resampling.at, resampling.values, longest=longest, beyond=beyond
            )
            columns.append(lines)
            if not np.isin(at, resampling.at).all():
                remarks.append(
                    f"{topic.topic} ({1 / resampling.period:.4g} Hz, "
                    f"{counted(resampling.at.size, message_word)}) was interpolated at the times "
                    f"of {base.topic}."
                )
    start = zero / _SECOND + float(at[0])
    frames = tuple(_frame_times(topic, zero, late, at[0], strict=strict) for topic in pictures)
    return AlignedTopics(at - at[0], np.column_stack(columns), words, start, tuple(remarks), frames)


def _frame_times(
    topic: TopicData, zero: int, usual_lateness: int, start: float, *, strict: bool
) -> FrameTimes:
    """The times of pictures; where they cannot be repaired none, unless that is refused."""
    try:
        resampling = _resampling(topic, zero, usual_lateness, topic.topic, "picture", strict=strict)
    except InputError as error:
        if strict:
            raise
        none, reason = np.array([], np.int64), str(error).removeprefix(topic.topic).lstrip(", ")
        remark = f"Pictures of {topic.topic} were left out: {reason}"
        return FrameTimes(topic.topic, none, none.astype(np.float64), (remark,))
    remarks = tuple(f"{topic.topic}: {remark}" for remark in resampling.remarks)
    return FrameTimes(topic.topic, resampling.rows, resampling.at - start, remarks)


@dataclass(frozen=True, slots=True)
class _Resampling:
    """The usable messages of a topic, in seconds from what all topics count from."""

    at: NDArray[np.float64]
    rows: NDArray[np.int64]
    values: NDArray[np.float64]
    remarks: tuple[str, ...]

    @property
    def period(self) -> float:
        """The usual distance of two messages, s."""
        return float(np.median(np.diff(self.at)))


def _bounded(nanoseconds: int) -> int:
    """A time with which can be reckoned."""
    return max(-_ABSURD, min(nanoseconds, _ABSURD))


def _clock(topic: TopicData) -> tuple[NDArray[np.int64], int]:
    """The stamps of a topic in nanoseconds, 0 where one was not set, and how late it arrived."""
    arrived, stamped = np.array(topic.arrived, np.int64), np.array(topic.stamped, np.int64)
    is_set = stamped != 0
    if np.unique(stamped[is_set]).size < min(2, stamped.size):
        return arrived, 0
    return stamped, int(np.median(arrived[is_set] - stamped[is_set]))


def _resampling(
    topic: TopicData, zero: int, usual_lateness: int, name: str, message: str, *, strict: bool
) -> _Resampling:
    """Put a topic on the clock on which messages arrive `usual` nanoseconds late."""
    pictures = not topic.fields and topic.label is None
    stamps, lateness = _clock(topic)
    repairs = []
    if topic.stamp is not None and not np.array_equal(stamps, topic.stamped):
        repairs.append("its headers hold no times; those at which its messages arrived were taken")
    shift = lateness - usual_lateness
    if abs(shift) > _LATENCY:
        repairs.append(f"it is of another clock and was shifted by {shift / _SECOND:.6g} s")
        stamps = np.where(stamps == 0, 0, stamps + shift)
    if strict and repairs:
        raise InputError(f"{name}: {repairs[0]}; record it anew or let it be repaired.")
    ticks = np.where(stamps == 0, np.nan, (stamps - zero).astype(np.float64))
    values = np.array(topic.values).reshape(ticks.size, -1)
    remarks = tuple(f"{sentence}." for sentence in repairs)
    if topic.label is not None and not topic.fields:  # labels, of which one is enough
        rows = np.flatnonzero(~np.isnan(ticks))
        rows = rows[np.argsort(ticks[rows], kind="stable")]
        return _Resampling(ticks[rows] / _SECOND, rows, values, remarks)
    order = np.arange(ticks.size)
    if topic.stamp is not None and not pictures:  # those are read in the order of the bag
        order = _order_of(ticks)
    repaired = repair_timestamps(
        RawTimestamps(ticks[order], per_second=_SECOND),
        order + 1,
        name,
        strict=strict,
        row=message,
        line="message" if pictures else message,
        bursts=not pictures,
    )
    at = np.round(repaired.start + repaired.times, 9)  # the same for messages of one nanosecond
    rows = order[repaired.rows]
    return _Resampling(at, rows, values[rows], (*remarks, *repaired.remarks))


def _order_of(ticks: NDArray[np.float64]) -> NDArray[np.int64]:
    """The order of messages by their stamps, as some overtake others on their way to the bag.

    Where one is stamped long before another that is there already, a clock was set back or
    something was played twice, and they stay as they are.
    """
    latest = np.fmax.accumulate(ticks)
    if (latest - ticks > _OVERTAKING).any():
        return np.arange(ticks.size)
    return np.argsort(ticks, kind="stable")


def _sample_and_hold(
    topic: _Resampling, words: Sequence[str], times: NDArray[np.float64]
) -> list[str]:
    """The label at each time: the last one told."""
    last = np.searchsorted(topic.at, times, side="right").tolist()
    return [words[i - 1] if i else "" for i in last]
