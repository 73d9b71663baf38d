"""Packets of OptoForce DAQs: frames, samples, status words and the sample counter.

A stream is read from the left. Where no frame starts, or one with a wrong checksum, the reading
goes on by one byte only, as the bytes of a header may lie inside a payload. That order is kept
although a whole stretch is looked at together: numpy searches the headers, and the sums of all that
were found are differences of one cumulative sum.

Everything is big-endian. Byte 3 of a header is the length of the payload, and a checksum is the
sum of all bytes before it, header included, modulo 65,536:

============ =========== ===== ==========================================================
kind         header      bytes body
============ =========== ===== ==========================================================
3-axis       170 7 8 10  16    count u16, status u16, Fx Fy Fz i16, checksum u16
3-axis x 4   170 7 8 28  34    count, status, four times Fx Fy Fz, checksum
6-axis       170 7 8 16  22    count, status, Fx Fy Fz Tx Ty Tz, checksum
configured   170 0 80 1  7     code u8 (0 is well), checksum
serial       170 0 18 8  14    eight characters, checksum
============ =========== ===== ==========================================================

The status word:

====== ==================================================================
bits   meaning
====== ==================================================================
15-13  the DAQ: 1 error, 2 communication error
12-10  the sensor: 1 absent, 2 failure, 4 temperature out of range
9-4    overload of Fx, Fy, Fz, Tx, Ty, Tz
3      several sensors are concerned
2-0    number of the sensor that the word is about
====== ==================================================================

The counter goes on by the same step from sample to sample, but by which one differs from device to
device and with the speed that it was told: it is learnt from the stream. Where it goes on by
several steps, the samples between are missing. Up to half a turn the counter is believed; beyond
that the host's clock decides how many turns it made, or whether it jumped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: The first byte of every header, and the number of bytes of one.
_START, _HEADER = 170, 4


@dataclass(frozen=True, slots=True)
class FrameType:
    """One type of frame."""

    header: bytes  #: four bytes, the first of them 170
    size: int  #: bytes, header and checksum included


@dataclass(frozen=True)
class Frames:
    """The frames in a stretch of bytes, n of them."""

    starts: NDArray[np.int64]  #: place of each valid frame, increasing; frames never overlap
    sizes: NDArray[np.int64]
    types: NDArray[np.int64]  #: which of the types that were looked for
    bad: NDArray[np.int64]  #: places of headers, in no frame, whose checksum was wrong
    used: int  #: bytes that were read; what follows may be the start of a frame

    @property
    def skipped(self) -> int:
        """Bytes that were read and are in no frame."""
        return self.used - int(self.sizes.sum())

    def before(self, place: int) -> Frames:
        """The frames before a place that lies in no frame, or at the start of one."""
        keep = self.starts < place
        return Frames(
            self.starts[keep],
            self.sizes[keep],
            self.types[keep],
            self.bad[self.bad < place],
            place,
        )


def with_checksum(body: bytes) -> bytes:
    """A header and payload with their checksum behind them."""
    return body + (sum(body) & 0xFFFF).to_bytes(2, "big")


def find_frames(array: NDArray[np.uint8], types: Sequence[FrameType], *, final: bool) -> Frames:
    """Find the valid frames in a stretch of bytes, from the left.

    Unless it is `final`, the reading stops at the first frame that is not complete, as it is not
    known yet whether it is one.
    """
    places, kinds, sizes = _headers(array, types)
    complete = places + sizes <= len(array)
    valid = complete.copy()
    valid[complete] = _sums_agree(array, places[complete], sizes[complete])
    chosen = _never_overlapping(places[valid], sizes[valid])
    starts, lengths = places[valid][chosen], sizes[valid][chosen]
    frames = Frames(starts, lengths, kinds[valid][chosen], starts[:0], len(array))
    frames = replace(frames, bad=_outside(frames, places[complete & ~valid]))
    if not final:
        torn = _torn_header(array, types)
        unfinished = _outside(frames, np.concatenate([places[~complete], torn]))
        if unfinished.size:
            frames = frames.before(int(unfinished[0]))
    return frames


def clean_run(data: bytes, frame: FrameType) -> int:
    """How many valid packets stand at the start, one right behind the other.

    A device that is read live gives a few packets at a time: this is tenfold faster for them.
    """
    place, size = 0, frame.size
    while place + size <= len(data) and data.startswith(frame.header, place):
        end = place + size
        total = sum(data[place : end - 2]) & 0xFFFF
        if total != data[end - 2] << 8 | data[end - 1]:
            break
        place = end
    return place // size


def is_start(data: bytes, frame: FrameType) -> bool:
    """Whether all that is left is the unfinished start of a packet, or nothing."""
    return len(data) < frame.size and data[:4] == frame.header[: len(data)]


def _headers(
    array: NDArray[np.uint8], types: Sequence[FrameType]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Places of all complete headers, which type each has, and how long its frame is."""
    places = np.flatnonzero(array[: max(len(array) - _HEADER + 1, 0)] == _START)
    rest = array[places + 1].astype(np.int64) << 16
    rest |= array[places + 2].astype(np.int64) << 8
    rest |= array[places + 3]
    kinds = np.full(len(places), -1, np.int64)
    for number, type_ in enumerate(types):
        kinds[rest == int.from_bytes(type_.header[1:], "big")] = number
    known = kinds >= 0
    kinds = kinds[known]
    sizes = np.array([type_.size for type_ in types], np.int64)
    return places[known], kinds, sizes[kinds]


def _torn_header(array: NDArray[np.uint8], types: Sequence[FrameType]) -> NDArray[np.int64]:
    """Places at the very end where the first bytes of a header stand."""
    first = max(len(array) - _HEADER + 1, 0)
    end = array[first:].tobytes()
    return np.array(
        [
            first + i
            for i in range(len(end))
            if any(type_.header.startswith(end[i:]) for type_ in types)
        ],
        np.int64,
    )


def _sums_agree(
    array: NDArray[np.uint8], places: NDArray[np.int64], sizes: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether each frame ends with the sum of its bytes, modulo 65,536."""
    if not places.size:
        return np.zeros(0, np.bool_)
    # A sum that wraps at 2 ** 32 leaves differences right.
    sums = np.cumsum(array, dtype=np.uint32)
    ends = places + sizes
    total = sums[ends - 3] - sums[places] + array[places]
    expected = array[ends - 2].astype(np.uint32) * 256 + array[ends - 1]
    agree: NDArray[np.bool_] = (total & 0xFFFF) == expected
    return agree


def _never_overlapping(places: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which frames remain when each is followed by the next one that starts behind its end."""
    chosen = np.ones(len(places), np.bool_)
    if np.any(places[1:] < places[:-1] + sizes[:-1]):
        free = 0
        for i, (place, size) in enumerate(zip(places.tolist(), sizes.tolist(), strict=True)):
            chosen[i] = place >= free
            if place >= free:
                free = place + size
    return chosen


def _outside(frames: Frames, places: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of some places that lie inside no valid frame."""
    if not frames.starts.size or not places.size:
        return places
    before = np.searchsorted(frames.starts, places, side="right") - 1
    ends = frames.starts[before] + frames.sizes[before]
    outside: NDArray[np.int64] = places[(before < 0) | (places >= ends)]
    return outside


@dataclass(frozen=True, slots=True)
class SensorKind:
    """A kind of data packet."""

    name: str  #: such as "3-axis"
    axes: tuple[str, ...]  #: of one sensor, such as ("fx", "fy", "fz")
    sensors: int = 1  #: in a packet

    @property
    def columns(self) -> int:
        """Readings in a packet."""
        return len(self.axes) * self.sensors

    @property
    def frame(self) -> FrameType:
        """Header and length of its packets."""
        return FrameType(bytes([170, 7, 8, 4 + 2 * self.columns]), 10 + 2 * self.columns)

    def names(self, first: int = 1) -> tuple[str, ...]:
        """Names of its columns, such as ``fx1 fy1 fz1``, with its first sensor called `first`."""
        return tuple(f"{axis}{first + i}" for i in range(self.sensors) for axis in self.axes)


KINDS: Final = (
    SensorKind("3-axis", ("fx", "fy", "fz")),
    SensorKind("3-axis x 4", ("fx", "fy", "fz"), sensors=4),
    SensorKind("6-axis", ("fx", "fy", "fz", "tx", "ty", "tz")),
)
#: What a DAQ answers: how it took a configuration, and its serial number.
_REPLIES: Final = (FrameType(bytes([170, 0, 80, 1]), 7), FrameType(bytes([170, 0, 18, 8]), 14))
#: Bytes that are looked at together, so that a large file needs no multiple of its size.
_BLOCK_BYTES = 1 << 20
#: Bytes up to which a loop over packets beats numpy.
_SHORT_BYTES = 2048


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer of a DAQ."""

    code: int | None = None  #: of a configuration: 0 if it was accepted
    serial: str | None = None  #: its serial number, if that was asked for


@dataclass(frozen=True, slots=True)
class Statistics:
    """Counts of a stream; every byte that was used up is in one of them."""

    packets: int = 0  #: valid packets of data
    replies: int = 0  #: valid replies
    bad_checksums: int = 0  #: headers, in no frame, whose checksum was wrong
    skipped_bytes: int = 0  #: bytes in no valid packet and no reply


@dataclass(frozen=True)
class Packets:
    """Valid packets in their order, n of them."""

    counts: NDArray[np.uint16]  #: the device's counter
    status: NDArray[np.uint16]  #: see the table at the head of this module
    values: NDArray[np.int16]  #: counts, shape (n, readings)
    offsets: NDArray[np.int64]  #: start of each in the stream, in bytes

    def __len__(self) -> int:
        return len(self.counts)


class Parser:
    """Finds the packets in a stream.

    A connection has packets of one kind: that of the first valid packet, or the one given. Headers
    of other kinds are not looked at after that.
    """

    def __init__(self, kind: SensorKind | None = None) -> None:
        self.kind = kind
        self.statistics = Statistics()
        self._tail = b""
        self._offset = 0  # of the tail's first byte in the stream
        self._replies: list[Reply] = []

    @property
    def pending(self) -> int:
        """Bytes at the end that may be the start of a packet; never more than 33."""
        return len(self._tail)

    def feed(self, data: bytes) -> Packets:
        """The packets that are complete with these bytes; an unfinished end waits for the next."""
        pieces = []
        for start in range(0, len(data), _BLOCK_BYTES):
            pieces += self._scan(self._tail + data[start : start + _BLOCK_BYTES], final=False)
        return _join_packets(pieces, self.kind)

    def finish(self) -> Packets:
        """The packets in the unfinished end, as no bytes will come that complete it.

        What is in no packet counts as skipped; the parser may be fed again, as after a cable was
        plugged in once more.
        """
        return _join_packets(self._scan(self._tail, final=True), self.kind)

    def take_replies(self) -> list[Reply]:
        """The replies since the last call."""
        taken, self._replies = self._replies, []
        return taken

    def _scan(self, data: bytes, *, final: bool) -> list[Packets]:
        """Take complete packets from the left and buffer the rest, unless nothing follows."""
        pieces: list[Packets] = []
        if self.kind is None:
            data = self._first(data, final)
        elif len(data) < _SHORT_BYTES and (run := clean_run(data, self.kind.frame)):
            rows = np.frombuffer(data, np.uint8, run * self.kind.frame.size)
            starts = np.arange(run) * self.kind.frame.size
            pieces.append(self._packets(rows.reshape(run, -1), starts))
            so_far, data = self.statistics, data[len(rows) :]
            self.statistics = replace(so_far, packets=so_far.packets + run)
            self._offset += len(rows)
        if self.kind is not None and (final or not is_start(data, self.kind.frame)):
            array = np.frombuffer(data, np.uint8)
            frames = _find_packets(array, (self.kind,), final)
            starts, size = frames.starts[frames.types == 0], self.kind.frame.size
            if starts.size:
                rows = np.lib.stride_tricks.sliding_window_view(array, size)[starts]
                pieces.append(self._packets(rows, starts))
            self._note(data, frames, 1)
            data = data[frames.used :]
        self._tail = data
        return pieces

    def _first(self, data: bytes, final: bool) -> bytes:
        """Look for the first packet of any kind; gives the bytes from there on."""
        frames = _find_packets(np.frombuffer(data, np.uint8), KINDS, final)
        of_data = np.flatnonzero(frames.types < len(KINDS))
        if of_data.size:
            self.kind = KINDS[int(frames.types[of_data[0]])]
            # From the first packet on, headers of other kinds mean nothing.
            frames = frames.before(int(frames.starts[of_data[0]]))
        self._note(data, frames, len(KINDS))
        return data[frames.used :]

    def _packets(self, rows: NDArray[np.uint8], starts: NDArray[np.int64]) -> Packets:
        """Decode packets, one a row."""
        words = np.ascontiguousarray(rows[:, 4:-2]).view(">u2").astype(np.uint16)
        values = words[:, 2:].view(np.int16)
        return Packets(words[:, 0], words[:, 1], values, starts + self._offset)

    def _note(self, data: bytes, frames: Frames, kinds: int) -> None:
        """Count the frames, store the replies, and advance in the stream."""
        replies = np.flatnonzero(frames.types >= kinds)
        for start, size in zip(frames.starts[replies], frames.sizes[replies], strict=True):
            self._replies.append(_parse_reply(data[start : start + size]))
        so_far = self.statistics
        self.statistics = Statistics(
            so_far.packets + len(frames.starts) - len(replies),
            so_far.replies + len(replies),
            so_far.bad_checksums + len(frames.bad),
            so_far.skipped_bytes + frames.skipped,
        )
        self._offset += frames.used


def parse_all(data: bytes) -> tuple[Parser, Packets]:
    """The packets of a whole stream, and the parser that knows what else was in it."""
    parser = Parser()
    packets = _join_packets([parser.feed(data), parser.finish()], parser.kind)
    return parser, packets


def _join_packets(pieces: list[Packets], kind: SensorKind | None) -> Packets:
    pieces = [piece for piece in pieces if len(piece)]
    if not pieces:
        empty, columns = np.empty(0, np.uint16), kind.columns if kind else 0
        return Packets(empty, empty, np.empty((0, columns), np.int16), np.empty(0, np.int64))
    if len(pieces) == 1:
        return pieces[0]
    return Packets(
        np.concatenate([piece.counts for piece in pieces]),
        np.concatenate([piece.status for piece in pieces]),
        np.concatenate([piece.values for piece in pieces]),
        np.concatenate([piece.offsets for piece in pieces]),
    )


def _find_packets(array: NDArray[np.uint8], kinds: tuple[SensorKind, ...], final: bool) -> Frames:
    """The packets of some kinds, and the replies, whose types are numbered behind them."""
    return find_frames(array, [*(kind.frame for kind in kinds), *_REPLIES], final=final)


def _parse_reply(frame: bytes) -> Reply:
    """Decode a valid frame that holds no data."""
    if len(frame) == _REPLIES[0].size:
        return Reply(code=frame[4])
    return Reply(serial=frame[4:-2].decode("latin-1").strip(" \0"))


_DAQ: Final = (
    (1, "the DAQ reports an error; unplug it and plug it in again"),
    (2, "the DAQ cannot talk to the sensor; check the sensor's cable"),
)
_SENSOR: Final = (
    (1, "is absent; check its cable"),
    (2, "has failed; it may have to be repaired"),
    (4, "is too hot or too cold; let it come to room temperature"),
)
_AXES: Final = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_FAULTY, _OVERLOADED = 0xFC00, 0x03F0


def is_faulty(status: ArrayLike) -> NDArray[np.bool_]:
    """Whether the DAQ or a sensor reports an error, for status words of any shape."""
    return (np.asarray(status, np.uint16) & _FAULTY) != 0


def is_overloaded(status: ArrayLike) -> NDArray[np.bool_]:
    """Whether an axis is beyond its capacity, for status words of any shape."""
    return (np.asarray(status, np.uint16) & _OVERLOADED) != 0


def status_sentences(status: int) -> tuple[str, ...]:
    """What a status word says, a sentence each; nothing if all is well."""
    number = status & 7
    subject = f"sensor {number}" if number else "the sensor"
    if status & 8:
        subject += " (and others)"
    sentences = [text for bit, text in _DAQ if status >> 13 & bit]
    sentences += [f"{subject} {text}" for bit, text in _SENSOR if status >> 10 & bit]
    axes = [axis for place, axis in enumerate(_AXES) if status >> (9 - place) & 1]
    if axes:
        sentences.append(f"{subject} is overloaded in {', '.join(axes)}; press less")
    return tuple(f"{text[0].upper()}{text[1:]}." for text in sentences)


#: Values of the counter.
TURN: Final = 65_536


def modal_step(counts: NDArray[np.uint16]) -> tuple[int, float]:
    """The commonest step of a counter (the smallest of several; 1 without any), and its share.

    A counter that stands still, as in a packet that came twice, is no step.
    """
    steps = _increments(counts.astype(np.int64))
    steps = steps[steps > 0]
    if not steps.size:
        return 1, 0.0
    number = np.bincount(steps)
    return int(number.argmax()), float(number.max() / steps.size)


@dataclass(frozen=True)
class CounterTime:
    """Ticks of n samples, m of which are new."""

    is_new: NDArray[np.bool_]  #: shape (n,); False for a sample that came a second time
    #: shape (m,), strictly increasing; by one where nothing is missing between
    ticks: NDArray[np.int64]


class Unwrapper:
    """Turns the counter of one connection into ticks, the first of which is 0.

    `step` is how much the counter increases per sample, `rate` the expected samples a second, with
    which the host's clock is compared.
    """

    def __init__(self, step: int, rate: float) -> None:
        self.missing = self.doubled = 0  #: samples that never came, and that came twice
        self.jumps = 0  #: how often the counter made no sense and the host's clock was taken
        self._step, self._rate = step, rate
        self._tick: int | None = None
        self._count = 0
        self._arrived: float | None = None
        self._resumed = False

    def resume(self, step: int, rate: float) -> None:
        """Continue with a counter that was restarted, as after a cable was unplugged.

        The host's clock decides how many samples are missing before the next one.
        """
        self._step, self._rate, self._resumed = step, rate, True

    def feed(
        self, counts: NDArray[np.uint16], arrived: NDArray[np.float64] | None = None
    ) -> CounterTime:
        """Ticks of the next samples, by their counts and arrival on the host's clock in seconds.

        Without `arrived` the counter is believed: it went on by less than one turn.
        """
        if not len(counts):
            return CounterTime(np.zeros(0, np.bool_), np.zeros(0, np.int64))
        first = self._tick is None
        before = int(counts[0]) - self._step if first else self._count
        increments = _increments(np.concatenate([[before], counts]))
        steps = np.maximum((increments + self._step // 2) // self._step, 1)
        steps[increments == 0] = 0
        if arrived is not None:
            self._ask_the_clock(increments, steps, arrived)
        if first:
            steps[0] = 1
        is_new = steps > 0
        start = -1 if self._tick is None else self._tick
        ticks = start + np.cumsum(steps)[is_new]
        self.doubled += int(np.sum(~is_new))
        if ticks.size:
            self.missing += int(ticks[-1]) - start - len(ticks)
            self._tick = int(ticks[-1])
        self._count = int(counts[-1])
        self._arrived = None if arrived is None else float(arrived[-1])
        return CounterTime(is_new, ticks)

    def _ask_the_clock(
        self, increments: NDArray[np.int64], steps: NDArray[np.int64], arrived: NDArray[np.float64]
    ) -> None:
        """Correct, in place, what the counter alone cannot tell."""
        last = arrived[0] if self._arrived is None else self._arrived
        elapsed = np.diff(arrived, prepend=last)
        expected = np.maximum(elapsed, 0.0) * self._rate * self._step
        doubtful = (increments == 0) | (increments > TURN // 2) | (expected > TURN // 2)
        if self._resumed:
            steps[0] = max(1, round(expected[0] / self._step))
            doubtful[0] = self._resumed = False
        for i in np.flatnonzero(doubtful):
            turns = max(0, round((expected[i] - increments[i]) / TURN))
            total = int(increments[i]) + turns * TURN
            if total == 0:
                steps[i] = 0
            elif abs(total - expected[i]) <= TURN // 2:
                steps[i] = max(1, round(total / self._step))
            else:
                steps[i] = max(1, round(expected[i] / self._step))
                self.jumps += 1


def _increments(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """By how much a counter increased from one to the next, less than a turn."""
    increments: NDArray[np.int64] = np.remainder(np.diff(counts), np.int64(TURN))
    return increments
