"""What every device gives: blocks of samples with their stamps."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import Channel
from forcelab.errors import ForcelabError


class UnpluggedError(ForcelabError):
    """A device is not there any more; it may come back."""


@dataclass(frozen=True)
class Block:
    """Some samples of one device, in their order.

    Parameters
    ----------
    arrived : ndarray of float64, shape (n,)
        When the bytes of each sample were read, in seconds of the host's monotonic clock.
    ticks : ndarray of int64, shape (n,), or None
        The device's own counter, unwrapped and in units of one sample: neighbours differ by one
        where nothing was lost. None for a device without a counter.
    values : ndarray of float64, shape (n, c)
        One column a channel, in its unit.
    status : ndarray of uint16, shape (n,), or None
        What the device said of each sample; None where it says nothing.
    """

    arrived: NDArray[np.float64]
    ticks: NDArray[np.int64] | None
    values: NDArray[np.float64]
    status: NDArray[np.uint16] | None = None

    def __len__(self) -> int:
        return len(self.arrived)


class Device(Protocol):
    """Something that gives samples as time goes on.

    Attributes
    ----------
    name : str
        Such as ``"optoforce:/dev/ttyACM0"``.
    channels : tuple of Channel
        The columns of its blocks.
    rate : float
        Samples a second that it was told to give; only ever used for what is said on screen.
    holds : bool
        Whether it gives a sample on change only: the last value holds then, and that is no gap.
    """

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The columns of its blocks."""

    @property
    def rate(self) -> float:
        """Samples a second that it was told to give (Hz)."""

    @property
    def holds(self) -> bool:
        """Whether its last value holds."""

    def open(self) -> None:
        """Connect and configure, as a device that nothing is known of: a zero is forgotten.

        Raises
        ------
        InputError
            If it cannot be opened: what, where, the cure.
        """

    def read(self, timeout: float) -> Block | None:
        """What has arrived, after waiting for at most `timeout` seconds; None if nothing has.

        Raises
        ------
        UnpluggedError
            If the device is gone.
        """

    def zero(self) -> None:
        """Take the present readings for zero.

        That holds until the device is zeroed again or opened anew, and so after a cable was
        unplugged and plugged in again too.
        """

    def remarks(self) -> tuple[str, ...]:
        """What went wrong since the last time this was asked, a sentence each."""

    def close(self) -> None:
        """Let go of it; closing twice is fine."""


OpenedT = TypeVar("OpenedT", bound="Opened")


class Opened(ABC):
    """Something to open and to close: in a ``with`` statement both are done."""

    @abstractmethod
    def open(self) -> None:
        """Begin."""

    @abstractmethod
    def close(self) -> None:
        """End; closing twice is fine."""

    def __enter__(self: OpenedT) -> OpenedT:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
