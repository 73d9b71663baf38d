"""The scales that are marked in the scalogram, and the wavelet that the picture is made with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.gui.label.scalogram_job import SMALLEST

if TYPE_CHECKING:
    from forcelab.signals.wavelets import Wavelet

__all__ = ["PAPER", "Marked"]


@dataclass(frozen=True, eq=False, slots=True)
class Marked:
    """Scales of a recogniser.

    Parameters
    ----------
    scales : ndarray, shape (k,)
        In samples of the grid, those of the picture's wavelet with the same frequencies.
    p : float
        Of the picture's Morlet.
    factor : float
        Its period over its scale.
    e_folding : float
        Its e-folding time over its scale.
    """

    scales: NDArray[np.float64]
    p: float = 5.0
    factor: float = 1.232462020307901
    e_folding: float = math.sqrt(2.0)

    @classmethod
    def of(cls, scales: ArrayLike, wavelet: Wavelet) -> Marked:
        """Take over a recogniser's scales, and its wavelet where that is a complex Morlet."""
        sizes = np.asarray(scales, dtype=np.float64)
        p = getattr(wavelet, "p", None)
        if p is not None and not wavelet.real:
            return cls(sizes, float(p), wavelet.fourier_factor, wavelet.e_folding)
        return cls(sizes * wavelet.fourier_factor / PAPER.factor)

    @property
    def largest(self) -> float:
        """The largest scale to show: an octave beyond what the recogniser uses."""
        return max(2 * float(self.scales.max(initial=SMALLEST)), 8 * SMALLEST)


#: Those of preset ``paper``, written out: to load the wavelets takes long.
PAPER = Marked(2.0 ** np.arange(1, 11, dtype=np.float64))
