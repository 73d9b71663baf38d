"""Topics on one clock: each with stamps of its own, all at the times of the one with most messages.

A message's stamp is that of its outermost header. Where there is none, or none that was ever set,
it is the time at which the message arrived. Where a topic's stamps are of another clock than those
that the rest is put to, they are shifted by how much more or less late its messages arrived.
"""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.errors import InputError
from forcelab.formats.rosbag.fields import Field, Path, address_of, follow
from forcelab.formats.table.clocks import RawStamps
from forcelab.formats.table.stamps import repair
from forcelab.text import counted

__all__ = ["Held", "Placed", "placed"]

_SECOND: Final = 10**9
#: A message does not travel so many nanoseconds; where it seems to, two clocks differ.
_TRAVEL: Final = _SECOND
#: Nanoseconds beyond this, 70 years from 1970, tell nothing; sums of four stay within 64 bits.
_ABSURD: Final = 22 * 10**17


@dataclass(slots=True)
class Held:
    """What the messages of one topic held; n of them.

    Parameters
    ----------
    topic : str
    fields : tuple of Field
        The numbers that become channels, c of them.
    sizes : mapping of Path to int
        How many there are in each array and list that they are taken from.
    stamp, label : Path or None
        To the stamp and the label of a message.
    arrived, stamped : array of int, length n
        Nanoseconds since 1970; `stamped` is 0 where a message has none.
    values : array of float, length n * c
        Message by message.
    words : list of str
        The labels as words; empty where there is no label.
    """

    topic: str
    fields: tuple[Field, ...]
    sizes: Mapping[Path, int]
    stamp: Path | None
    label: Path | None
    arrived: array[int] = field(default_factory=lambda: array("q"))
    stamped: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))
    words: list[str] = field(default_factory=list)

    def add(self, arrived: int, message: object) -> None:
        """Take in a message.

        Raises
        ------
        InputError
            If an array or a list in it is shorter or longer than in the first one.
        """
        for path, size in self.sizes.items():
            if (there := len(follow(message, path))) != size:
                name = address_of(self.topic, path)
                raise InputError(
                    f"message {len(self.arrived) + 1:,} of {self.topic} holds {there:,} values in "
                    f"{name}, and the first one {size:,}; leave it out (--leave-out {name})."
                )
        for one in self.fields:
            self.values.extend([float(follow(message, leaf)) for leaf in one.leaves])
        self.arrived.append(_told(arrived))
        stamp = None if self.stamp is None else follow(message, self.stamp)
        self.stamped.append(0 if stamp is None else _told(stamp.sec * _SECOND + stamp.nanosec))
        if self.label is not None:
            self.words.append(" ".join(str(follow(message, self.label)).split()))


@dataclass(frozen=True, slots=True)
class Placed:
    """Topics on one clock.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Those of the topic with most messages, in seconds from its first one.
    signals : ndarray, shape (n, c)
        The channels of all topics, NaN where one has no message near.
    words : list of str, length n
        The label that holds at each time, empty before the first; empty without labels.
    start : float
        The first time in seconds since 1970.
    remarks : tuple of str
        One sentence for each thing that was repaired, shifted or interpolated.
    """

    times: NDArray[np.float64]
    signals: NDArray[np.float64]
    words: list[str]
    start: float
    remarks: tuple[str, ...]


def placed(topics: Sequence[Held], where: str, *, strict: bool) -> Placed:
    """Bring topics onto one clock.

    Parameters
    ----------
    topics : sequence of Held
        At least one with fields; at most one with labels.
    where : str
        The bag, for errors.
    strict : bool
        Refuse what would be repaired or shifted.

    Raises
    ------
    InputError
        If a topic has fewer than two stamps, its time runs backwards, or strict and something
        would have to be repaired.
    """
    base = max((topic for topic in topics if topic.fields), key=lambda topic: len(topic.arrived))
    stamps, late = _clock(base)
    zero = int(np.median(stamps))  # near all others: their differences are exact
    ways = {topic.topic: _way(topic, zero, late, where, strict=strict) for topic in topics}
    at = ways[base.topic].at
    remarks: list[str] = []
    columns: list[NDArray[np.float64]] = []
    words: list[str] = []
    for topic in topics:
        way = ways[topic.topic]
        remarks += [f"{topic.topic}: {one}" for one in way.remarks]
        if topic.label is not None:
            words = _holding(way, [topic.words[i] for i in way.kept], at)
        if topic is base:
            columns.append(way.values)
        elif topic.fields:
            columns.append(_onto(way, at))
            if not np.isin(at, way.at).all():
                remarks.append(
                    f"{topic.topic} ({1 / way.period:.4g} Hz, {counted(way.at.size, 'message')}) "
                    f"was interpolated at the times of {base.topic}."
                )
    start = zero / _SECOND + float(at[0])
    return Placed(at - at[0], np.column_stack(columns), words, start, tuple(remarks))


@dataclass(frozen=True, slots=True)
class _Way:
    """A topic's messages, m of which were kept, at seconds from what all topics count from."""

    at: NDArray[np.float64]
    kept: NDArray[np.int64]
    values: NDArray[np.float64]
    remarks: tuple[str, ...]

    @property
    def period(self) -> float:
        """The usual distance of two messages, s."""
        return float(np.median(np.diff(self.at)))


def _told(nanoseconds: int) -> int:
    """A time with which can be reckoned."""
    return max(-_ABSURD, min(nanoseconds, _ABSURD))


def _clock(topic: Held) -> tuple[NDArray[np.int64], int]:
    """The stamps of a topic in nanoseconds, 0 where one was not set, and how late it arrived."""
    arrived, stamped = np.array(topic.arrived, np.int64), np.array(topic.stamped, np.int64)
    there = stamped != 0
    if np.unique(stamped[there]).size < min(2, stamped.size):
        return arrived, 0
    return stamped, int(np.median(arrived[there] - stamped[there]))


def _way(topic: Held, zero: int, usual: int, where: str, *, strict: bool) -> _Way:
    """Put a topic on the clock on which messages arrive `usual` nanoseconds late."""
    name = f"{where}, topic {topic.topic}"
    stamps, late = _clock(topic)
    mended = []
    if topic.stamp is not None and not np.array_equal(stamps, topic.stamped):
        mended.append("its headers hold no times; those at which its messages arrived were taken")
    shift = late - usual
    if abs(shift) > _TRAVEL:
        mended.append(f"it is of another clock and was shifted by {shift / _SECOND:.6g} s")
        stamps = np.where(stamps == 0, 0, stamps + shift)
    if strict and mended:
        raise InputError(f"{name}: {mended[0]}; record it anew or let it be repaired.")
    ticks = np.where(stamps == 0, np.nan, (stamps - zero).astype(np.float64))
    values = np.array(topic.values).reshape(ticks.size, -1)
    remarks = tuple(f"{one}." for one in mended)
    if not topic.fields:  # labels, of which one is enough
        kept = np.flatnonzero(~np.isnan(ticks))
        kept = kept[np.argsort(ticks[kept], kind="stable")]
        return _Way(ticks[kept] / _SECOND, kept, values, remarks)
    repaired = repair(
        RawStamps(ticks, per_second=_SECOND),
        np.arange(1, ticks.size + 1),
        name,
        strict=strict,
        row="message",
        line="message",
    )
    at = np.round(repaired.start + repaired.times, 9)  # the same for messages of one nanosecond
    return _Way(at, repaired.kept, values[repaired.kept], (*remarks, *repaired.remarks))


def _onto(way: _Way, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """A topic's numbers at other times: on lines, but neither over gaps nor beyond its ends."""
    place = np.clip(np.searchsorted(way.at, times), 1, way.at.size - 1)
    before, after = way.at[place - 1], way.at[place]
    lost = (after - before > GAP_PERIODS * way.period) & (before < times) & (times < after)
    lost |= (times < way.at[0] - way.period) | (times > way.at[-1] + way.period)
    values = np.column_stack([np.interp(times, way.at, column) for column in way.values.T])
    values[lost] = np.nan
    return values


def _holding(way: _Way, words: Sequence[str], times: NDArray[np.float64]) -> list[str]:
    """The label at each time: the last one told."""
    last = np.searchsorted(way.at, times, side="right").tolist()
    return [words[i - 1] if i else "" for i in last]
