"""Packets of OptoForce DAQs: frames, samples, status words and the sample counter.

A stream is read from the left. Where no frame starts, or one with a wrong checksum, the reading
goes on by one byte only, as the bytes of a header may lie inside a payload.

Everything is big-endian. Byte 3 of a header is the length of the body, and a checksum is the sum
of all bytes before it, header included, modulo 65,536:

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

import re
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.typing import NDArray


def with_checksum(body: bytes) -> bytes:
    """A header and payload with their checksum behind them."""
    return body + (sum(body) & 0xFFFF).to_bytes(2, "big")


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
    def header(self) -> bytes:
        """What its packets begin with."""
        return bytes([170, 7, 8, 4 + 2 * self.columns])

    @property
    def size(self) -> int:
        """Bytes of a packet, header and checksum included."""
        return _frame_size(self.header)

    def names(self, first: int = 1) -> tuple[str, ...]:
        """Names of its columns, such as ``fx1 fy1 fz1``, with its first sensor called `first`."""
        return tuple(f"{axis}{first + i}" for i in range(self.sensors) for axis in self.axes)


KINDS: Final = (
    SensorKind("3-axis", ("fx", "fy", "fz")),
    SensorKind("3-axis x 4", ("fx", "fy", "fz"), sensors=4),
    SensorKind("6-axis", ("fx", "fy", "fz", "tx", "ty", "tz")),
)
#: How a DAQ begins its answers: how it took a configuration, and its serial number.
_CONFIGURED, _SERIAL = bytes([170, 0, 80, 1]), bytes([170, 0, 18, 8])
#: Bytes that are looked at together, so that a large file needs no multiple of its size.
_BLOCK_BYTES = 1 << 20


def _frame_size(header: bytes) -> int:
    """Bytes of a frame."""
    return len(header) + header[3] + 2


@cache
def _headers(kind: SensorKind | None) -> re.Pattern[bytes]:
    """Finds headers of a kind, or of all kinds, and of replies; at the end the beginning of one."""
    whole = [kind.header for kind in (KINDS if kind is None else (kind,))] + [_CONFIGURED, _SERIAL]
    torn = dict.fromkeys(header[:length] for header in whole for length in (3, 2, 1))
    parts = [*map(re.escape, whole), *(re.escape(start) + rb"\Z" for start in torn)]
    return re.compile(b"|".join(parts))


@dataclass(frozen=True, slots=True)
class Reply:
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

    A connection has packets of one kind, that of the first valid packet. Headers of other kinds are
    not looked at after that.
    """

    def __init__(self) -> None:
        self.kind: SensorKind | None = None
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
        starts = range(0, len(data), _BLOCK_BYTES)
        pieces = [self._scan(self._tail + data[i : i + _BLOCK_BYTES], final=False) for i in starts]
        return _join_packets(pieces, self.kind)

    def finish(self) -> Packets:
        """The packets in the unfinished end, as no bytes will come that complete it.

        What is in no packet counts as skipped; the parser may be fed again, as after a cable was
        plugged in once more.
        """
        return self._scan(self._tail, final=True)

    def take_replies(self) -> list[Reply]:
        """The replies since the last call."""
        taken, self._replies = self._replies, []
        return taken

    def _scan(self, data: bytes, *, final: bool) -> Packets:
        """Take whole frames from the left and buffer the rest, unless nothing follows."""
        starts: list[int] = []
        bad = place = in_frames = 0
        untaken = len(self._replies)
        while (match := _headers(self.kind).search(data, place)) is not None:
            start, header = match.start(), match[0]
            whole = len(header) == 4 and start + _frame_size(header) <= len(data)
            if not whole and not final:
                break
            place = start + 1
            if not whole:
                continue
            frame = data[start : start + _frame_size(header)]
            if with_checksum(frame[:-2]) != frame:
                bad += 1
                continue
            place, in_frames = start + len(frame), in_frames + len(frame)
            if header == _CONFIGURED:
                self._replies.append(Reply(code=frame[4]))
            elif header == _SERIAL:
                self._replies.append(Reply(serial=frame[4:-2].decode("latin-1").strip(" \0")))
            else:
                starts.append(start)
                self.kind = self.kind or next(k for k in KINDS if k.header == header)
        used = len(data) if match is None else match.start()
        packets = self._packets(data, np.array(starts, np.int64))
        before = self.statistics
        self.statistics = Statistics(
            before.packets + len(packets),
            before.replies + len(self._replies) - untaken,
            before.bad_checksums + bad,
            before.skipped_bytes + used - in_frames,
        )
        self._offset += used
        self._tail = data[used:]
        return packets

    def _packets(self, data: bytes, starts: NDArray[np.int64]) -> Packets:
        """Decode the packets that start at these places."""
        if self.kind is None or not starts.size:
            return _join_packets([], self.kind)
        array = np.frombuffer(data, np.uint8)
        rows = np.lib.stride_tricks.sliding_window_view(array, self.kind.size)[starts]
        words = np.ascontiguousarray(rows[:, 4:-2]).view(">u2").astype(np.uint16)
        values = words[:, 2:].view(np.int16)
        return Packets(words[:, 0], words[:, 1], values, starts + self._offset)


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
    return Packets(
        np.concatenate([piece.counts for piece in pieces]),
        np.concatenate([piece.status for piece in pieces]),
        np.concatenate([piece.values for piece in pieces]),
        np.concatenate([piece.offsets for piece in pieces]),
    )


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


def is_faulty(status: NDArray[np.uint16]) -> NDArray[np.bool_]:
    """Whether status words report an error, or an axis beyond its capacity."""
    return (status & 0xFFF0) != 0


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
        #: Of the sample before: its tick, its count and when it arrived.
        self._tick = -1
        self._count: int | None = None
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
        before = int(counts[0]) - self._step if self._count is None else self._count
        increments = _increments(np.concatenate([[before], counts]))
        steps = np.maximum((increments + self._step // 2) // self._step, 1)
        steps[increments == 0] = 0
        if arrived is not None:
            self._ask_the_clock(increments, steps, arrived)
        if self._count is None:
            steps[0] = 1
        is_new = steps > 0
        ticks = self._tick + np.cumsum(steps)[is_new]
        self.doubled += int(np.sum(~is_new))
        if ticks.size:
            self.missing += int(ticks[-1]) - self._tick - len(ticks)
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
    return np.remainder(np.diff(counts), np.int64(TURN))
