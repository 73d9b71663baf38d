"""Streams of the Lab Streaming Layer as devices.

A stream's samples bring the stamps that the program which sends them gave them, on the clock of its
computer. They are carried onto this one's by liblsl, which measures how the two clocks differ all
the while (to some 0.2 ms), and are believed: a sample that the sender left out is a gap. Once a
recording has ended, stamps that jitter, and where none is missing, are evened out. A stream that
states no rate holds its last value, as one of events does; one of texts gives markers, of which a
recording makes labels as those of an XDF file are made.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block, Device, ReadPacer, SoftwareZero, UnpluggedError
from forcelab.capture.discovery import LIST_HINT
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.extras import load_extra
from forcelab.text import counted

#: Seconds in which all streams of the network answer.
SEARCH_SECONDS = 1.0
#: Seconds for a stream's description, its clock and its first sample.
ANSWER_SECONDS = 3.0
#: Seconds from now beyond which stamps are of another clock than liblsl's.
FARTHEST_STAMP = 60.0
#: Samples that are read at once at most.
CHUNK = 4096
#: Values a second, and samples a second of a stream without a rate, that views have room for.
MOST_VALUES, UNKNOWN_RATE = 250_000, 1000.0
#: Seconds of samples that wait while this computer is busy.
WAITING_SECONDS = 60
#: NumPy's names of liblsl's numeric formats, by their numbers, and the number of texts.
FORMATS: Final = {1: "f4", 2: "f8", 4: "i4", 5: "i2", 6: "i1", 7: "i8"}
TEXT: Final = 3
#: Units as streams spell them out, and as channels have them.
UNITS: Final = {"newton": "N", "newtons": "N", "newtonmeter": "Nm", "newtonmeters": "Nm"}


@dataclass(frozen=True, slots=True)
class FoundStream:
    """A stream in the network."""

    name: str
    #: Such as ``"EEG"``, by whoever sends it.
    content: str
    host: str
    #: What tells it from others of its name; empty where its sender gives nothing.
    source: str
    channels: int
    #: Hz; 0 where it states none.
    rate: float
    #: Whether it sends texts, which are labels.
    texts: bool
    #: Whether another stream has its name.
    ambiguous: bool = False

    @property
    def description(self) -> str:
        """In words."""
        rate = f"{self.rate:g} Hz" if self.rate > 0 else "no rate"
        numbers = (counted(self.channels, "channel"), rate)
        parts = (self.content, *(["texts as labels"] if self.texts else numbers), self.host)
        return _one_line(", ".join(part for part in parts if part))


def find_streams() -> tuple[FoundStream, ...]:
    """All streams in the network that answer in time, sorted by name.

    Empty where the package that reads them is not installed.
    """
    *_, streams = search_streams()
    return streams


def search_streams() -> Iterator[tuple[FoundStream, ...]]:
    """The streams that have answered by now, a few times a second until all should have."""
    yield ()
    if find_spec("pylsl") is not None:
        yield from map(_found_streams, _search(SEARCH_SECONDS))


def _found_streams(infos: list[Any]) -> tuple[FoundStream, ...]:
    found = [
        FoundStream(
            info.name(),
            info.type(),
            info.hostname(),
            info.source_id(),
            info.channel_count(),
            info.nominal_srate(),
            info.channel_format() == TEXT,
        )
        for info in infos
        if info.channel_format() in (*FORMATS, TEXT) and info.name().strip()
    ]
    names = [stream.name for stream in found]
    found = [replace(stream, ambiguous=names.count(stream.name) > 1) for stream in found]
    return tuple(sorted(dict.fromkeys(found), key=lambda s: (s.name, s.source)))


def _search(seconds: float) -> Iterator[list[Any]]:
    """What has answered, as liblsl describes it, until so many seconds have passed."""
    resolver = _pylsl().ContinuousResolver()
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        time.sleep(0.1)
        yield resolver.results()


def _pylsl() -> Any:
    return load_extra("pylsl", "lsl", "A stream of the Lab Streaming Layer")


def lsl_clock_offset() -> float:
    """Seconds to add to liblsl's clock for the host's monotonic one."""
    clock = _pylsl().local_clock
    tries = []
    for _ in range(5):
        before = time.monotonic()
        stamp = clock()
        after = time.monotonic()
        tries.append((after - before, 0.5 * (before + after) - stamp))
    return min(tries)[1]


class LslStream(Device):
    """A stream that any program in the network sends.

    One of numbers gives samples; one of texts has no channels and gives markers.
    """

    #: Nothing numbers the samples of a stream.
    counted = False

    def __init__(self, stream: str = "", *, source: str = "", dejitter: bool = False) -> None:
        """The stream of this name, from this `source` if several have it; else the only of numbers.

        With `dejitter` liblsl smooths the stamps of a stream whose sender stamps unevenly what was
        sampled evenly.
        """
        super().__init__()
        self._source, self._dejitter = source, dejitter
        self._name_stream(stream)
        #: Whether its stamps are believed; else they are of a clock that liblsl does not know, and
        #: the samples get the time of their arrival.
        self.stamped = True
        self._inlet: Any = None
        self._markers: list[tuple[float, str]] = []
        self._offset = 0.0
        self._last = -np.inf
        self._pacer = ReadPacer()

    def _name_stream(self, stream: str) -> None:
        """Be called by a stream, with its source where that was asked for."""
        source = f" ({self._source})" if self._source else ""
        self._stream, self.name = stream, f"lsl:{stream}{source}"

    def open(self) -> None:
        """Find the stream, learn its channels, and see that its stamps are of liblsl's clock."""
        self.close()
        self._zero = SoftwareZero()
        self._last = -np.inf
        try:
            info = self._connect(SEARCH_SECONDS)
            self.channels = _channels(info)
            self.rate = max(info.nominal_srate(), 0.0) if self.channels else 0.0
            self.holds, self.stamped = self.rate == 0, True
            if not self.holds:
                self._check_clock(self._inlet.pull_sample(ANSWER_SECONDS)[1])
        except UnpluggedError as error:
            raise InputError(str(error)) from error
        except _errors() as error:
            raise InputError(f"{self.name} was lost while it was opened ({error}).") from error

    def reopen(self) -> None:
        """Find it again, as it was; UnpluggedError while it is not back."""
        self.close()
        try:
            info = self._connect(0.5 * SEARCH_SECONDS)
        except _errors() as error:
            raise UnpluggedError(f"{self.name} is not back yet.") from error
        if _channels(info) != self.channels or self.rate not in (0.0, info.nominal_srate()):
            self.close()
            raise InputError(f"{self.name} has other channels or another rate; connect it anew.")

    def read(self, timeout: float) -> Block | None:
        """What has arrived; as with a serial port, a few milliseconds are read together."""
        left = self._pacer.wait(timeout)
        if self._inlet is None:
            raise UnpluggedError(f"{self.name} is not connected.")
        try:
            first, stamp = self._inlet.pull_sample(left)
            if first is None:
                return None
            if self.holds and self._last == -np.inf:
                self._check_clock(stamp)
            if not self.channels:
                self._add_marker(first, stamp)
                return None
            _, stamps = self._inlet.pull_chunk(0.0, len(self._buffer), self._buffer)
        except UnicodeDecodeError:
            self._messages.put_once("text", f"{self.name} sent bytes that are no text.")
            return None
        except _errors() as error:
            raise UnpluggedError(
                f"{self.name} is gone; start the program that sends it again."
            ) from error
        now = self._pacer.arrived()
        values = np.concatenate([[first], self._buffer[: len(stamps)]]).astype(np.float64)
        times = self._times(np.array([stamp, *stamps]), now)
        return Block(times, None, self._zero.apply(values))

    def take_markers(self) -> list[tuple[float, str]]:
        markers, self._markers = self._markers, []
        return markers

    def close(self) -> None:
        inlet, self._inlet = self._inlet, None
        if inlet is not None:
            inlet.close_stream()

    def _check_clock(self, stamp: float | None) -> None:
        """See by the first stamp that is known whether it is of liblsl's clock."""
        off = 0.0 if stamp is None else stamp + self._offset - time.monotonic()
        self.stamped = abs(off) < FARTHEST_STAMP
        if not self.stamped:
            self._messages.put(
                f"The stamps of {self.name} are {abs(off):.4g} s {'ahead' if off > 0 else 'old'}: "
                f"its program does not stamp by the clock of LSL, so that its samples get the time "
                f"of their arrival."
            )

    def _add_marker(self, texts: list[str], stamp: float) -> None:
        (at,) = self._times(np.array([stamp]), time.monotonic()).tolist()
        self._markers.append((at, _one_line(" ".join(texts))))

    def _times(self, stamps: NDArray[np.float64], now: float) -> NDArray[np.float64]:
        """Stamps on the host's monotonic clock, which never go back; or when they arrived."""
        times = stamps + self._offset if self.stamped else np.full(len(stamps), now)
        times = np.where(np.isfinite(times), times, now)
        times = np.maximum.accumulate(np.concatenate([[self._last], times]))[1:]
        self._last = float(times[-1])
        return times

    def _connect(self, seconds: float) -> Any:
        """Connect to the only stream that is meant; its whole description."""
        pylsl = _pylsl()
        *_, infos = _search(seconds)
        inlet = pylsl.StreamInlet(
            self._choose(infos),
            max_buflen=WAITING_SECONDS,
            recover=False,  # a lost stream is told, and waited for here
            processing_flags=pylsl.proc_clocksync | self._dejitter * pylsl.proc_dejitter,
        )
        info = inlet.info(ANSWER_SECONDS)
        inlet.time_correction(ANSWER_SECONDS)
        inlet.open_stream(ANSWER_SECONDS)
        self._inlet, self._offset = inlet, lsl_clock_offset()
        shape = CHUNK, info.channel_count()
        self._buffer = np.empty(shape, FORMATS.get(info.channel_format(), "f8"))
        return info

    def _choose(self, infos: list[Any]) -> Any:
        """The stream that is meant, of those that answered."""
        named = [info for info in infos if self._stream in ("", info.name())]
        named = [info for info in named if self._source in ("", info.source_id())]
        if not named:
            raise UnpluggedError(
                f"No stream '{self._stream}' answers in this network; start the program that sends "
                f"it, and {LIST_HINT}."
            )
        if not self._stream:  # any stream of numbers
            named = [info for info in named if info.channel_format() in FORMATS] or named
        if len({info.uid() for info in named}) > 1:
            source = named[0].source_id()
            cure = f"say which, such as lsl:{named[0].name()}?source={source}"
            raise InputError(
                f"{len(named)} streams may be meant by '{self.name}'; "
                f"{cure if source else 'give them names that differ'}."
            )
        info = named[0]
        self._name_stream(info.name())
        number = info.channel_count() * (info.nominal_srate() or UNKNOWN_RATE)
        if not number <= MOST_VALUES:
            raise InputError(
                f"{self.name} states {info.channel_count()} channels at "
                f"{info.nominal_srate():g} Hz; no more than {MOST_VALUES:,} values a second are "
                f"recorded."
            )
        return info


def _errors() -> tuple[type[Exception], ...]:
    """What pylsl raises of a stream that is lost or does not answer."""
    util = _pylsl().util
    return (util.LostError, util.TimeoutError, util.InternalError)


def _channels(info: Any) -> tuple[Channel, ...]:
    """Names and units by a stream's description; without names, the stream's with numbers.

    None of a stream of texts.
    """
    if info.channel_format() not in FORMATS:
        return ()
    stream, count, channels = _one_line(info.name()), info.channel_count(), []
    element = info.desc().child("channels").child("channel")
    for number in range(1, count + 1):
        name, unit = (_one_line(element.child_value(key)) for key in ("label", "unit"))
        name = name or (f"{stream} {number}" if count > 1 else stream)
        channels.append(Channel(name, UNITS.get(unit.lower(), unit)))
        element = element.next_sibling("channel")
    return tuple(channels)


def _one_line(text: str) -> str:
    """A text from the network as one short line."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:60]
