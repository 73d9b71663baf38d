"""Probabilities of actions over time, as coarse as a screen can show them."""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Values a second that are kept.
RATE = 50.0
#: Steps between the probabilities 0 and 1 that are told apart.
STEPS = 255
#: What a time may be off by rounding, as a share of a bin.
ROUNDING = 1e-3


@dataclass(frozen=True)
class ProbabilityTrace:
    """Probabilities of each action over one demonstration, as coarse as a screen can show them.

    A reviewer sees them as certainty.
    """

    start: float  # seconds, of the first value
    rate: float  # values a second
    actions: tuple[str, ...]  # K; the columns
    #: (n, K); probabilities in 255ths; value ``i`` is the mean over ``start + [i, i + 1) / rate``
    values: NDArray[np.uint8]

    @classmethod
    def of(
        cls,
        times: NDArray[np.float64],
        probabilities: NDArray[np.floating],
        actions: tuple[str, ...],
        rate: float = RATE,
    ) -> ProbabilityTrace:
        """Mean probabilities of increasing `times` (n,), in bins of ``1 / rate`` seconds.

        Where time steps are farther apart than that, a bin is as long as a step. Bins without a
        time step, as in gaps, are zero throughout.
        """
        start = float(times[0])
        if len(times) > 1:
            rate = min(rate, 1.0 / float(np.median(np.diff(times))))
        # A step that lies on the edge of a bin must not fall before it for its last bits.
        bins = np.floor((times - start) * rate + ROUNDING).astype(np.int64)
        count = int(bins[-1]) + 1
        firsts = np.flatnonzero(np.diff(bins, prepend=-1))
        means = np.add.reduceat(probabilities, firsts, axis=0, dtype=np.float64)
        means /= np.diff(firsts, append=len(bins))[:, None]
        values = np.zeros((count, len(actions)), dtype=np.uint8)
        values[bins[firsts]] = np.rint(means * STEPS)
        return cls(start, rate, actions, values)

    def to_json(self) -> dict[str, Any]:
        """Plain values: the array is compressed, then base64."""
        packed = zlib.compress(np.ascontiguousarray(self.values).tobytes())
        return {
            "start": self.start,
            "rate": self.rate,
            "actions": list(self.actions),
            "count": len(self.values),
            "values": base64.b64encode(packed).decode(),
        }

    @classmethod
    def from_json(cls, plain: Mapping[str, Any]) -> ProbabilityTrace:
        """The inverse of :meth:`to_json`; a ValueError where it is damaged."""
        actions, count = tuple(plain["actions"]), plain["count"]
        try:
            packed = base64.b64decode(plain["values"], validate=True)
            unpacking = zlib.decompressobj()
            # No more than there can be: a damaged count must not fill the memory.
            content = unpacking.decompress(packed, count * len(actions) + 1)
        except (binascii.Error, zlib.error) as error:
            raise ValueError(str(error)) from error
        values = np.frombuffer(content, dtype=np.uint8).reshape(count, len(actions))
        return cls(float(plain["start"]), float(plain["rate"]), actions, values)

    @property
    def times(self) -> NDArray[np.float64]:
        """The middle of each bin in seconds, shape (n,)."""
        middles = np.arange(len(self.values), dtype=np.float64) + 0.5
        return np.asarray(self.start + middles / self.rate, dtype=np.float64)

    @property
    def known(self) -> NDArray[np.bool_]:
        """In which bins anything is known, shape (n,); not so in gaps."""
        return np.asarray(self.values.any(axis=1))

    def mean(self, start: float, end: float) -> NDArray[np.float64]:
        """Mean probability of each action over ``[start, end)`` seconds, shape (K,).

        Of the bins in which anything is known; zero where there are none.
        """
        values = self._between(start, end)
        return np.asarray(values.sum(axis=0) / (STEPS * _known_bins(values)), dtype=np.float64)

    def of_action(self, action: str | None, start: float, end: float) -> float:
        """Mean probability of one action over ``[start, end)``; 0 for one that is not known."""
        if action not in self.actions:
            return 0.0
        values = self._between(start, end)
        column = values[:, self.actions.index(action)]  # alone: it is asked for in long lists
        return float(column.sum()) / (STEPS * _known_bins(values))

    def _between(self, start: float, end: float) -> NDArray[np.uint8]:
        """The bins of ``[start, end)``, at least one, shape (m, K)."""
        begin, stop = (start - self.start) * self.rate, (end - self.start) * self.rate
        first = min(max(math.floor(begin + ROUNDING), 0), len(self.values) - 1)
        last = min(max(math.ceil(stop - ROUNDING), first + 1), len(self.values))
        return self.values[first:last]


def _known_bins(values: NDArray[np.uint8]) -> int:
    """In how many bins anything is known; 1 where in none, as what is divided by it is 0 then."""
    return max(1, int(np.count_nonzero(values.any(axis=1))))
