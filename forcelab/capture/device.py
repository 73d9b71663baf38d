"""What every device gives, blocks of stamped samples, and how it is opened, asked and closed."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel
from forcelab.errors import ForcelabError


class UnpluggedError(ForcelabError):
    """The device is gone; it may come back."""


@dataclass(frozen=True)
class Block:
    """Consecutive samples of one device."""

    #: When the bytes of each sample were read: seconds of the host's monotonic clock, shape (n,).
    #: Of a device that is ``stamped``, such as a stream, when each was taken.
    arrived: NDArray[np.float64]
    #: The device's counter, unwrapped, in samples: neighbours differ by one where nothing was lost.
    #: Shape (n,); None for a device without a counter.
    ticks: NDArray[np.int64] | None
    #: In the units of the channels, shape (n, c).
    values: NDArray[np.float64]
    #: Status word of each sample, shape (n,), where the device sends any.
    status: NDArray[np.uint16] | None = None

    def __len__(self) -> int:
        return len(self.arrived)


ClosableT = TypeVar("ClosableT", bound="Closable")


class Closable(ABC):
    """Opened and closed by a ``with`` statement."""

    @abstractmethod
    def open(self) -> None: ...

    @abstractmethod
    def close(self) -> None:
        """Closing twice is fine."""

    def __enter__(self: ClosableT) -> ClosableT:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


#: Seconds after which a condition that comes again is new.
QUIET_SECONDS = 0.5
#: The newest messages that are kept until they are taken.
MOST_MESSAGES = 100


class MessageQueue:
    """Sentences for the user from any thread, each once however long its condition lasts."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._messages: list[str] = []
        self._last: dict[object, float] = {}  # when each condition was last seen

    def put(self, message: str) -> None:
        with self._lock:
            del self._messages[: max(0, len(self._messages) + 1 - MOST_MESSAGES)]
            self._messages.append(message)

    def put_once(self, condition: object, message: str, now: float | None = None) -> None:
        """Put a message when a condition (a hashable) begins, not again while it lasts.

        `now` is in seconds of the host's monotonic clock, by default the present.
        """
        now = time.monotonic() if now is None else now
        last = self._last.get(condition)
        self._last[condition] = now
        if last is None or now - last > QUIET_SECONDS:
            self.put(message)

    def take(self) -> tuple[str, ...]:
        """All messages since the last call."""
        with self._lock:
            messages, self._messages = tuple(self._messages), []
        return messages


class SoftwareZero:
    """The zero of a device that has none itself: the mean of the last samples when it was taken."""

    def __init__(self, samples: int = 1) -> None:
        self._samples = samples
        self._latest: NDArray[np.float64] | None = None
        self._zero: NDArray[np.float64] | float = 0.0

    def apply(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Carry readings, shape (n, c), n >= 1, to this zero."""
        before = values[:0] if self._latest is None else self._latest
        self._latest = np.concatenate([before, values[-self._samples :]])[-self._samples :]
        return values - self._zero

    def take(self) -> None:
        """Take the last readings for zero; a channel without one keeps the zero it has."""
        if self._latest is not None:
            mean = self._latest.mean(axis=0)
            self._zero = np.where(np.isfinite(mean), mean, self._zero)


#: Seconds between two reads at least; the newest sample of each is still a millisecond old at most.
GATHER_SECONDS = 0.004


class ReadPacer:
    """Keeps reads apart: what arrives meanwhile costs a fraction of reading packet by packet."""

    def __init__(self) -> None:
        self._next = 0.0

    def wait(self, timeout: float) -> float:
        """Wait until it is time to read, `timeout` s at most; the seconds left of those."""
        pause = max(min(self._next - time.monotonic(), timeout), 0.0)
        time.sleep(pause)
        return timeout - pause

    def arrived(self) -> float:
        """Now, when something was read (s, host's monotonic clock)."""
        now = time.monotonic()
        self._next = now + GATHER_SECONDS
        return now


class Device(Closable):
    """A source of samples that is read as time goes on; in one thread at a time."""

    #: Such as ``"optoforce:/dev/ttyACM0"``.
    name: str
    #: The columns of its blocks; some are known only once it is open.
    channels: tuple[Channel, ...] = ()
    #: Configured samples a second (Hz), 0 where there are none; never used as a clock.
    rate = 0.0
    #: Whether `rate` was measured by arrivals: no promise, and good to a hundredth.
    measured = False
    #: Whether it sends a sample on change only: the last value holds, and that is no gap.
    holds = False
    #: Whether its ticks tell all samples that are missing; else torn ones only.
    counted = True
    #: Whether its samples bring their times.
    stamped = False

    def __init__(self) -> None:
        self._messages = MessageQueue()
        self._zero = SoftwareZero()

    @abstractmethod
    def open(self) -> None:
        """Connect and configure as if nothing were known of it; a zero is forgotten.

        Raises InputError if it cannot be opened.
        """

    @abstractmethod
    def reopen(self) -> None:
        """Connect again after it was unplugged; a ForcelabError while it is not back."""

    @abstractmethod
    def read(self, timeout: float) -> Block | None:
        """What has arrived after at most `timeout` seconds, if anything; UnpluggedError if gone."""

    def zero(self) -> None:
        """Take the present readings for zero.

        That holds until the device is zeroed or opened anew, and so over an unplugged cable too.
        """
        self._zero.take()

    def number_sensors(self, first: int) -> int:
        """Number its sensors, with which names of channels end, from `first` on; the next number.

        Of a device whose packets tell how many it has, once it is open; others have their names.
        """
        return first

    def take_markers(self) -> Sequence[tuple[float, str]]:
        """Times (s, host's monotonic clock) and texts of the markers since the last call."""
        return ()

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last call, a sentence each."""
        return self._messages.take()
