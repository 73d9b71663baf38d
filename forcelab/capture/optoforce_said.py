"""What is said of a DAQ: each event once, however many samples it lasts."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.events import Events
from forcelab.formats.optoforce.status import sentences

__all__ = ["Said"]

#: Seconds without a packet after which that is remarked.
SILENCE = 1.0


class Said(Events):
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
            for sentence in sentences(word & ~0x03F0):
                self.during(sentence, f"{called}: {sentence}", arrived)
            for sentence in sentences(word & 0x03FF):
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
