"""What every device gives, blocks of stamped samples, and how it is opened, asked and closed."""

from __future__ import annotations

import threading
import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol, TypeVar

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


class Device(Protocol):
    """A source of samples that is read as time goes on.

    Some have more: ``counted`` (False: its ticks tell torn samples only), ``measured`` (True: its
    rate was measured by arrivals), ``stamped`` (True: samples bring their times),
    ``take_markers()`` (times and texts since the last call).
    """

    @property
    def name(self) -> str:
        """Such as ``"optoforce:/dev/ttyACM0"``."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The columns of its blocks."""

    @property
    def rate(self) -> float:
        """Configured samples a second (Hz), 0 where there are none; never used as a clock."""

    @property
    def holds(self) -> bool:
        """Whether it sends a sample on change only: the last value holds, and that is no gap."""

    def open(self) -> None:
        """Connect and configure as if nothing were known of it; a zero is forgotten.

        Raises InputError if it cannot be opened.
        """

    def reopen(self) -> None:
        """Connect again after it was unplugged; a ForcelabError while it is not back."""

    def read(self, timeout: float) -> Block | None:
        """What has arrived after at most `timeout` seconds, if anything; UnpluggedError if gone."""

    def zero(self) -> None:
        """Take the present readings for zero.

        That holds until the device is zeroed or opened anew, and so over an unplugged cable too.
        """

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last call, a sentence each."""

    def close(self) -> None:
        """Release it; closing twice is fine."""


class SoftwareZero:
    """The zero of a device that has none itself: what it read last when it was taken."""

    def __init__(self) -> None:
        self._latest: NDArray[np.float64] | None = None
        self._zero: NDArray[np.float64] | float = 0.0

    def apply(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Carry readings, shape (n, c), n >= 1, to this zero."""
        self._latest = values[-1].copy()
        return values - self._zero

    def take(self) -> None:
        """Take the last readings for zero; a channel without one keeps the zero it has."""
        if self._latest is not None:
            self._zero = np.where(np.isfinite(self._latest), self._latest, self._zero)


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
