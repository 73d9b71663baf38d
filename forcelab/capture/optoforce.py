"""OptoForce DAQs: their packets, what is sent to them, and what is said of them.

Nothing here opens a port; :mod:`forcelab.formats.optoforce_packets` holds the packets themselves.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device import Block
from forcelab.capture.messages import MessageQueue
from forcelab.errors import InputError
from forcelab.formats.calibration import Calibration
from forcelab.formats.optoforce_packets import (
    Packets,
    Parser,
    Reply,
    Unwrapper,
    modal_step,
    status_sentences,
    with_checksum,
)

#: Seconds without a packet after which that is remarked.
SILENCE = 1.0


class StatusMessages(MessageQueue):
    """Events of a DAQ, as sentences."""

    def status(self, called: str, status: NDArray[np.uint16], arrived: float) -> None:
        """Remark what status words say.

        Parameters
        ----------
        called : str
            What sentences call the DAQ.
        status : ndarray of uint16, shape (n,)
            Those that are not zero.
        arrived : float
            When the last one came, in s of the host's monotonic clock.
        """
        for number in np.unique(status & 0xF):
            word = int(np.bitwise_or.reduce(status[status & 0xF == number]))
            for sentence in status_sentences(word & ~0x03F0):
                self.during(sentence, f"{called}: {sentence}", arrived)
            for sentence in status_sentences(word & 0x03FF):
                self.during(int(number), f"{called}: {sentence}", arrived)

    def still(self, called: str, arrived: float) -> None:
        """Remark it once when nothing has come but samples that are dropped as repeated.

        Parameters
        ----------
        called : str
            What sentences call the DAQ.
        arrived : float
            When the last of them came, in s of the host's monotonic clock.
        """
        self.during(
            "still",
            f"{called}: its sample counter stands still, so its packets are left out as repeated; "
            f"unplug it and plug it in again.",
            arrived,
        )

    def silence(self, called: str, heard: float) -> None:
        """Remark it once when nothing has come for long.

        Parameters
        ----------
        called : str
            What sentences call the DAQ.
        heard : float
            When the last packet came, in s of the host's monotonic clock.
        """
        now = time.monotonic()
        if now - heard > SILENCE:
            self.during(
                "silence",
                f"{called} has sent no valid packet for {SILENCE:g} s; check its cable.",
                now,
            )


@dataclass(frozen=True)
class Tare(Calibration):
    """A calibration of a DAQ that has forgotten its zero.

    Parameters
    ----------
    offset : ndarray of float64, shape (c,)
        Counts that it reads where zero was taken.
    """

    offset: NDArray[np.float64]

    def apply(self, counts: NDArray[np.int16]) -> NDArray[np.float64]:
        """Carry counts, shape (n, c), to the unit of the channels, from the zero on."""
        left = counts - self.offset
        return left * np.where(left < 0, self.negative, self.positive)


BAUD: Final = 1_000_000
#: Vendor and product of its USB port.
USB_ID: Final = (0x04D8, 0x000A)
#: Cut-off frequencies of the built-in low-pass filter in Hz, by code; 0 Hz is no filter.
FILTERS: Final = (0.0, 500.0, 150.0, 50.0, 15.0, 5.0, 1.5)
#: Steps of the counter from which its usual step is learnt, if so large a share is the same; and
#: the number from which the commonest is taken whatever its share.
_LEARN, _SHARE, _LEARN_ANYHOW = 16, 0.75, 256


def speed_for(rate: float) -> int:
    """The speed code for a rate: n for 1000 / n samples a second, 0 to stop.

    Parameters
    ----------
    rate : float
        Samples a second.

    Raises
    ------
    InputError
        If the DAQ has no such rate. The sentence names the nearest ones.
    """
    if rate == 0:
        return 0
    code = round(1000 / rate) if 0 < rate < np.inf else 0
    if not 1 <= code <= 255 or abs(1000 / code - rate) > 0.005 * rate:
        near = sorted({1000 / n for n in (code - 1, code, code + 1) if 1 <= n <= 255} or {1000, 4})
        raise InputError(
            f"An OptoForce DAQ cannot give {rate:g} samples a second; choose 1000 / n with n from "
            f"1 to 255, such as {' or '.join(f'{one:.5g}' for one in near)}."
        )
    return code


def configure(speed: int, filtered: int = 4, zero: int = 0) -> bytes:
    """The command that sets speed and filter, and zeroes if asked to.

    To zero, send it with `zero` 0, then with 255, and drop what had been buffered.

    Parameters
    ----------
    speed : int
        n for 1000 / n samples a second, 0 to stop; see :func:`speed_for`.
    filtered : int
        Place in :data:`FILTERS`; 4 (15 Hz) is what the device starts with.
    zero : int
        255 takes the present readings for zero, 0 takes that back.

    Raises
    ------
    InputError
        If a code does not exist.
    """
    if not 0 <= speed <= 255:
        raise InputError(f"The speed of an OptoForce DAQ is a code from 0 to 255, not {speed}.")
    if not 0 <= filtered < len(FILTERS):
        raise InputError(
            f"The filter of an OptoForce DAQ is a code from 0 to {len(FILTERS) - 1}, not "
            f"{filtered}; 0 is none, 4 is 15 Hz."
        )
    if zero not in (0, 255):
        raise InputError(f"Zeroing an OptoForce DAQ takes 0 or 255, not {zero}.")
    return with_checksum(bytes([170, 0, 50, 3, speed, filtered, zero]))


def serial_request() -> bytes:
    """The command that asks for the serial number."""
    return with_checksum(bytes([171, 0, 18, 8]))


class Stream:
    """Turns the bytes of one DAQ into blocks of samples.

    The first few samples are withheld until the usual step of the counter is known; they come with
    the first block then. A sample that came twice is dropped.

    Parameters
    ----------
    rate : float
        Samples a second that the DAQ was told to give.
    calibration : Calibration, optional
        Without it the values are counts.
    """

    def __init__(self, rate: float, calibration: Calibration | None = None) -> None:
        self.rate, self.calibration = rate, calibration
        self._parser = Parser()
        self._unwrapper: Unwrapper | None = None
        self._step: int | None = None
        self._withheld: list[tuple[Packets, NDArray[np.float64]]] = []
        self._arrived = 0.0  # the last bytes

    @property
    def repeated(self) -> int:
        """How many samples were dropped, as the counter had not gone on since the one before."""
        return 0 if self._unwrapper is None else self._unwrapper.doubled

    def take_replies(self) -> list[Reply]:
        """What the DAQ answered since this was asked last."""
        return self._parser.take_replies()

    def feed(self, data: bytes, arrived: float) -> Block | None:
        """The samples that are complete with these bytes; None if there are none.

        Parameters
        ----------
        data : bytes
            What follows on what was given before.
        arrived : float
            When they were read, in seconds of the host's monotonic clock.
        """
        packets, self._arrived = self._parser.feed(data), arrived
        if not len(packets):
            return None
        self._withheld.append((packets, np.full(len(packets), arrived)))
        if self._step is None:
            counts = np.concatenate([one.counts for one, _ in self._withheld])
            step, share = modal_step(counts)
            if len(counts) <= (_LEARN if share >= _SHARE else _LEARN_ANYHOW):
                return None
            self._learnt(step)
        return self._released()

    def flush(self) -> Block | None:
        """What is still withheld or unfinished, as nothing follows; None if there is nothing.

        Afterwards the stream may be fed again, as after a cable was plugged in once more.
        """
        packets = self._parser.finish()
        if len(packets):
            self._withheld.append((packets, np.full(len(packets), self._arrived)))
        if not self._withheld:
            return None
        if self._step is None:
            self._learnt(modal_step(np.concatenate([p.counts for p, _ in self._withheld]))[0])
        return self._released()

    def restart(self, rate: float) -> None:
        """Learn the step anew, as after the DAQ was plugged in again or told another speed.

        Ticks go on: the host's clock decides how many samples are missing in between. Call
        :meth:`flush` first, or what is withheld counts as having come afterwards.

        Parameters
        ----------
        rate : float
            Samples a second that it was told to give; the same as before, or ticks and samples
            would not go together any more.
        """
        self.rate, self._step = rate, None

    def _learnt(self, step: int) -> None:
        """Go on with a step that is known now."""
        self._step = step
        if self._unwrapper is None:
            self._unwrapper = Unwrapper(step, self.rate)
        else:
            self._unwrapper.resume(step, self.rate)

    def _released(self) -> Block | None:
        """What was withheld, as a block."""
        pieces, self._withheld = self._withheld, []
        assert self._unwrapper is not None
        arrived = np.concatenate([when for _, when in pieces])
        unwrapped = self._unwrapper.feed(np.concatenate([p.counts for p, _ in pieces]), arrived)
        kept = unwrapped.is_new
        if not kept.any():
            return None
        counts = np.concatenate([p.values for p, _ in pieces])[kept]
        status = np.concatenate([p.status for p, _ in pieces])[kept]
        calibrated = self.calibration.apply(counts) if self.calibration else counts.astype(float)
        return Block(arrived[kept], unwrapped.ticks, calibrated, status)
