"""Streams of samples, labels or pictures, each with times of its own, on one clock.

A stream's stamps count. Where it has none, or none that was ever set, it is the times at which its
samples arrived. Where its stamps are of another clock than those that the rest is put to, they are
shifted by how much more or less late its samples arrived.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import GAP_PERIODS
from forcelab.errors import InputError
from forcelab.formats.timestamps import RawTimestamps, repair_timestamps
from forcelab.signals.grid import interpolate
from forcelab.text import counted

_SECOND: Final = 10**9
#: A sample does not travel so many nanoseconds; where it seems to, two clocks differ.
_LATENCY: Final = _SECOND
#: By how many nanoseconds a sample may overtake another one of its stream.
_OVERTAKING: Final = _SECOND // 20


@dataclass(frozen=True, slots=True, eq=False)
class TimedStream:
    """What came with times of its own, n times; with neither channels nor labels, pictures."""

    name: str
    #: (n,), when each came, in nanoseconds on the clock of all; 0 where that is not known
    arrived: NDArray[np.int64]
    stamped: NDArray[np.int64] | None  #: (n,), by its own clock, 0 where not set; None without
    values: NDArray[np.float64]  #: (n, c)
    labels: Sequence[str] | None = None  #: the n labels, if it has any

    @property
    def has_channels(self) -> bool:
        return self.values.shape[1] > 0


@dataclass(frozen=True, slots=True)
class TimedRows:
    """The usable ones of a stream, m of n, by rising times."""

    name: str
    times: NDArray[np.float64]  #: (m,), s
    rows: NDArray[np.int64]  #: (m,), their places in the stream, from 0
    values: NDArray[np.float64]  #: (m, c)
    remarks: tuple[str, ...]  #: what was repaired or shifted, or why there are none


@dataclass(frozen=True, slots=True)
class AlignedStreams:
    """Streams on one clock, n samples of c channels."""

    #: those of the stream with most samples, in seconds from its first one
    times: NDArray[np.float64]
    signals: NDArray[np.float64]  #: shape (n, c); NaN where a stream has no sample near
    #: the label that holds at each time, empty before the first; none without labels
    labels: list[str]
    start: float  #: the first time in seconds, on the clock of the stamps
    #: a sentence for each thing that was repaired, shifted or interpolated
    remarks: tuple[str, ...]
    pictures: tuple[TimedRows, ...] = ()  #: their times are on the clock of the samples


def align_streams(
    streams: Sequence[TimedStream],
    where: str,
    *,
    strict: bool,
    pictures: Sequence[TimedStream] = (),
    stream_word: str = "stream",
    sample_word: str = "sample",
) -> AlignedStreams:
    """Bring streams onto one clock: at least one with channels, at most one with labels.

    `strict` refuses what would be repaired or shifted. `where` is the file, and the words are what
    it calls a stream and a sample, for errors and remarks.
    """
    base = max((s for s in streams if s.has_channels), key=lambda stream: stream.arrived.size)
    stamps, lateness = _stamps(base)
    # In the middle of all others, so that their differences are exact.
    clock = _Clock(int(np.median(stamps)), lateness, strict)
    placed = [clock.place(s, f"{where}, {stream_word} {s.name}", sample_word) for s in streams]
    times = placed[streams.index(base)].times
    remarks: list[str] = []
    columns: list[NDArray[np.float64]] = []
    labels: list[str] = []
    for stream, rows in zip(streams, placed, strict=True):
        remarks += rows.remarks
        if stream.labels is not None:  # each holds until the next one
            known = ["", *(stream.labels[row] for row in rows.rows)]
            last = np.searchsorted(rows.times, times, side="right").tolist()
            labels = [known[number] for number in last]
        if stream is base:
            columns.append(rows.values)
        elif stream.has_channels:
            period = float(np.median(np.diff(rows.times)))
            longest = GAP_PERIODS * period
            columns.append(
                interpolate(times, rows.times, rows.values, longest=longest, beyond=period)
            )
            if not np.isin(times, rows.times).all():
                remarks.append(
                    f"{stream.name} ({1 / period:.4g} Hz, {counted(rows.times.size, sample_word)}) "
                    f"was interpolated at the times of {base.name}."
                )
    zero = float(times[0])
    frames = tuple(_place_pictures(stream, clock, zero) for stream in pictures)
    start = clock.zero / _SECOND + zero
    signals = np.column_stack(columns)
    return AlignedStreams(times - zero, signals, labels, start, tuple(remarks), frames)


def _place_pictures(stream: TimedStream, clock: _Clock, zero: float) -> TimedRows:
    """The times of pictures; where they cannot be repaired none, unless that is refused."""
    try:
        rows = clock.place(stream, stream.name, "picture")
    except InputError as error:
        if clock.strict:
            raise
        none, reason = np.array([]), str(error).removeprefix(stream.name).lstrip(", ")
        remark = f"Pictures of {stream.name} were left out: {reason}"
        return TimedRows(stream.name, none, none.astype(np.int64), stream.values[:0], (remark,))
    return replace(rows, times=rows.times - zero)


def _stamps(stream: TimedStream) -> tuple[NDArray[np.int64], int]:
    """The times of a stream in nanoseconds, 0 where one is not known, and how late it arrives."""
    if stream.stamped is None:
        return stream.arrived, 0
    is_set = stream.stamped != 0
    if np.unique(stream.stamped[is_set]).size < min(2, stream.stamped.size):
        return stream.arrived, 0
    return stream.stamped, int(np.median(stream.arrived[is_set] - stream.stamped[is_set]))


@dataclass(frozen=True, slots=True)
class _Clock:
    """The clock of all streams."""

    zero: int  #: nanoseconds that it counts from
    lateness: int  #: nanoseconds by which samples arrive late on it
    strict: bool

    def place(self, stream: TimedStream, name: str, noun: str) -> TimedRows:
        """Put a stream on the clock; errors call it by `name`, and its samples by `noun`."""
        stamps, lateness = _stamps(stream)
        repairs = []
        if stream.stamped is not None and not np.array_equal(stamps, stream.stamped):
            repairs.append(
                "its headers hold no times; those at which its messages arrived were taken"
            )
        shift = lateness - self.lateness
        if abs(shift) > _LATENCY:
            repairs.append(f"it is of another clock and was shifted by {shift / _SECOND:.6g} s")
            stamps = np.where(stamps == 0, 0, stamps + shift)
        if self.strict and repairs:
            raise InputError(f"{name}: {repairs[0]}; record it anew or let it be repaired.")
        ticks = np.where(stamps == 0, np.nan, (stamps - self.zero).astype(np.float64))
        remarks = [f"{stream.name}: {sentence}." for sentence in repairs]
        if stream.labels is not None and not stream.has_channels:  # of which one is enough
            rows = np.flatnonzero(~np.isnan(ticks))
            rows = rows[np.argsort(ticks[rows], kind="stable")]
            times = ticks[rows] / _SECOND
        else:
            pictures = not stream.has_channels
            # Pictures are read in the order of the file.
            ordered = stream.stamped is None or pictures
            order = np.arange(ticks.size) if ordered else _order_of(ticks)
            repaired = repair_timestamps(
                RawTimestamps(ticks[order], per_second=_SECOND),
                order + 1,
                name,
                strict=self.strict,
                row=noun,
                line="message" if pictures else noun,
                bursts=not pictures,
            )
            rows = order[repaired.rows]
            # The same for samples of one nanosecond.
            times = np.round(repaired.start + repaired.times, 9)
            remarks += [f"{stream.name}: {remark}" for remark in repaired.remarks]
        return TimedRows(stream.name, times, rows, stream.values[rows], tuple(remarks))


def _order_of(ticks: NDArray[np.float64]) -> NDArray[np.int64]:
    """The order of samples by their stamps, as some overtake others on their way to the file.

    Where one is stamped long before another that is there already, a clock was set back or
    something was played twice, and they stay as they are.
    """
    latest = np.fmax.accumulate(ticks)
    if (latest - ticks > _OVERTAKING).any():
        return np.arange(ticks.size)
    return np.argsort(ticks, kind="stable")
