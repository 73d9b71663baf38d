"""Probabilities of actions over time, as coarse as a screen can show them."""

from __future__ import annotations

import base64
import binascii
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["RATE", "Certainty"]

#: Values a second that are kept.
RATE = 50.0
#: Steps between the probabilities 0 and 1 that are told apart.
STEPS = 255


@dataclass(frozen=True)
class Certainty:
    """How probable each action is over one demonstration.

    Parameters
    ----------
    start : float
        Seconds, of the first value.
    rate : float
        Values a second.
    actions : tuple of str, length K
        The columns.
    values : ndarray of uint8, shape (n, K)
        Probabilities in 255ths; value ``i`` is the mean over ``start + [i, i + 1) / rate``.
    """

    start: float
    rate: float
    actions: tuple[str, ...]
    values: NDArray[np.uint8]

    @classmethod
    def of(
        cls,
        times: NDArray[np.float64],
        probabilities: NDArray[np.floating],
        actions: tuple[str, ...],
        rate: float = RATE,
    ) -> Certainty:
        """Mean probabilities of `times` (n,), increasing, in bins of ``1 / rate`` seconds.

        Bins in which no time step falls, as in gaps, are zero throughout.
        """
        start = float(times[0])
        bins = np.floor((times - start) * rate).astype(np.int64)
        count = int(bins[-1]) + 1
        firsts = np.flatnonzero(np.diff(bins, prepend=-1))
        means = np.add.reduceat(probabilities, firsts, axis=0, dtype=np.float64)
        means /= np.diff(firsts, append=len(bins))[:, None]
        values = np.zeros((count, len(actions)), dtype=np.uint8)
        values[bins[firsts]] = np.rint(means * STEPS)
        return cls(start, rate, actions, values)

    def to_json(self) -> dict[str, Any]:
        """Plain values: the array is packed, then written in letters."""
        packed = zlib.compress(np.ascontiguousarray(self.values).tobytes())
        return {
            "start": self.start,
            "rate": self.rate,
            "actions": list(self.actions),
            "count": len(self.values),
            "values": base64.b64encode(packed).decode(),
        }

    @classmethod
    def from_json(cls, plain: Mapping[str, Any]) -> Certainty:
        """The inverse of :meth:`to_json`.

        Raises
        ------
        ValueError
            If it is damaged.
        """
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

    def mean(self, start: float, end: float) -> NDArray[np.float64]:
        """Mean probability of each action over ``[start, end)`` seconds, shape (K,)."""
        first = int(np.clip(np.floor((start - self.start) * self.rate), 0, len(self.values) - 1))
        last = int(np.clip(np.ceil((end - self.start) * self.rate), first + 1, len(self.values)))
        means = self.values[first:last].mean(axis=0) / STEPS
        return np.asarray(means, dtype=np.float64)

    def of_action(self, action: str | None, start: float, end: float) -> float:
        """Mean probability of one action over ``[start, end)``; 0 for one that is not known."""
        if action not in self.actions:
            return 0.0
        return float(self.mean(start, end)[self.actions.index(action)])
