"""The wavelet of the scalograms on screen, the scales they show, and those marked in them.

Wavelet and marks are those of preset ``paper``, written out: to load the wavelets takes long.
"""

from __future__ import annotations

import math

__all__ = ["E_FOLDING", "FOURIER_FACTOR", "LARGEST", "MARKED", "SMALLEST", "P"]

#: p of the Morlet wavelet; its Fourier period and its e-folding time, both over its scale.
P = 5.0
FOURIER_FACTOR = 1.232462020307901
E_FOLDING = math.sqrt(2.0)

#: Scales that are marked, in samples of the grid.
MARKED = tuple(2.0**j for j in range(1, 11))
#: Smallest scale shown, in samples: the wavelet is cut by the Nyquist frequency below.
SMALLEST = 2.0
#: Largest scale shown: an octave beyond the marks.
LARGEST = 2.0 * MARKED[-1]
