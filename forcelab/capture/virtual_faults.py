"""What goes wrong between a device and the host, on demand and repeatably."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError

__all__ = ["Faults", "spoil"]


@dataclass(frozen=True, slots=True)
class Faults:
    """How often what happens; nothing by default.

    Parameters
    ----------
    lost : float
        Share of the packets that never arrive, though the counter counts them.
    lost_bytes, corrupted, doubled : float
        Share of the bytes that are left out, changed in one bit, or sent twice.

    Raises
    ------
    InputError
        If a share is not one.
    """

    lost: float = 0.0
    lost_bytes: float = 0.0
    corrupted: float = 0.0
    doubled: float = 0.0

    def __post_init__(self) -> None:
        for name in ("lost", "lost_bytes", "corrupted", "doubled"):
            share = getattr(self, name)
            if not 0 <= share <= 1:
                raise InputError(f"The share '{name}' of faults must lie in 0..1, not {share:g}.")


def spoil(
    packets: NDArray[np.uint8], faults: Faults, rng: np.random.Generator
) -> tuple[bytes, NDArray[np.bool_]]:
    """Do to packets what a bad cable does.

    Parameters
    ----------
    packets : ndarray of uint8, shape (n, size)
        One packet a row.
    faults : Faults
        How often what happens to them.
    rng : Generator
        Says to which.

    Returns
    -------
    sent : bytes
        What is left of them.
    intact : ndarray of bool, shape (n,)
        Which are all there.
    """
    intact = np.ones(len(packets), dtype=bool)
    if not (faults.lost or faults.lost_bytes or faults.corrupted or faults.doubled):
        return packets.tobytes(), intact
    repeats = np.ones(packets.shape, dtype=np.int64)
    repeats[rng.random(packets.shape) < faults.doubled] = 2
    repeats[rng.random(packets.shape) < faults.lost_bytes] = 0
    repeats[rng.random(len(packets)) < faults.lost] = 0
    flips = np.where(
        rng.random(packets.shape) < faults.corrupted,
        np.left_shift(1, rng.integers(0, 8, packets.shape)),
        0,
    ).astype(np.uint8)
    intact &= (repeats == 1).all(axis=1) & (flips == 0).all(axis=1)
    return np.repeat((packets ^ flips).ravel(), repeats.ravel()).tobytes(), intact
