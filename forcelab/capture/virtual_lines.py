"""A virtual microcontroller, which prints its readings in lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.virtual_port import BURST
from forcelab.capture.virtual_sampler import Absent, Readings, VirtualSampler

__all__ = ["VirtualTextLine"]


class VirtualTextLine(VirtualSampler):
    """A microcontroller that prints a line for each sample.

    Parameters
    ----------
    source : callable
        Readings, shape (m, c), at device times (s), shape (m,).
    rate : float
        Lines a second of its own clock.
    names : sequence of str, length c
        Names of the readings; empty for none.
    header : bool
        Whether a line with the names comes first, each time it is switched on.
    labelled : bool
        Whether each value stands behind its name and a colon.
    clock : str
        Name of a first column with the device's time, in microseconds if it is ``"micros"``, else
        in milliseconds; empty for none.
    separator : str
        What stands between values.
    decimals : int
        Of the values.
    junk : float
        Share of the lines before which there is one that means nothing.
    path, burst, waits, absent
        As of :class:`~forcelab.capture.virtual_sampler.VirtualSampler`.
    """

    def __init__(
        self,
        source: Readings,
        rate: float = 80.0,
        *,
        names: Sequence[str] = (),
        header: bool = False,
        labelled: bool = False,
        clock: str = "",
        separator: str = ",",
        decimals: int = 3,
        junk: float = 0.0,
        path: Path | None = None,
        burst: float = BURST,
        waits: bool = False,
        absent: Absent | None = None,
    ) -> None:
        super().__init__(source, rate, 0.0, path, burst, waits, absent)
        self._names, self._header, self._labelled = tuple(names), header, labelled
        self._clock, self._separator, self._decimals = clock, separator, decimals
        self._junk, self._rng = junk, np.random.default_rng(0)
        self._begins = False

    def _begin(self, now: float) -> None:
        super()._begin(now)
        self._begins = self._header

    def _due(self, now: float) -> bytes:
        times, values = self._next(now)
        lines = []
        if self._begins and len(times):
            lines.append(self._separator.join([*([self._clock] * bool(self._clock)), *self._names]))
            self._begins = False
        for time, row in zip(times, values, strict=True):
            if self._junk and self._rng.random() < self._junk:
                lines.append("#~ sensor not ready")
            lines.append(self._line(time, row))
        return "".join(f"{line}\r\n" for line in lines).encode("ascii")

    def _line(self, time: float, row: NDArray[np.float64]) -> str:
        """One sample as it is printed."""
        cells = [f"{value:.{self._decimals}f}" for value in row]
        if self._labelled:
            cells = [f"{name}:{cell}" for name, cell in zip(self._names, cells, strict=True)]
        if self._clock:
            stamp = f"{(1e6 if self._clock == 'micros' else 1e3) * time:.0f}"
            cells.insert(0, f"{self._clock}:{stamp}" if self._labelled else stamp)
        return self._separator.join(cells)

    def _heard(self, _: bytes) -> bytes:
        return b""
