"""The zero of a DAQ that has forgotten it, as it was unplugged."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.formats.optoforce.calibration import Calibration

__all__ = ["Zeroed"]


@dataclass(frozen=True)
class Zeroed(Calibration):
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
