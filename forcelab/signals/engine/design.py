"""How far a Morlet wavelet reaches in time and frequency, and how coarse a grid may be for it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfc

from forcelab.errors import InputError
from forcelab.signals.engine.kernels import Kernel
from forcelab.signals.wavelets import Morlet

__all__ = ["SINGLE", "TOLERANCES", "Design", "band", "design", "response"]

Real = NDArray[np.float64]

#: Errors to choose from, relative to the largest coefficient of the scale, and fewest taps.
TOLERANCES = {1e-3: 4, 1e-5: 6, 1e-7: 8, 1e-10: 12, 1e-14: 16}
#: From this tolerance on, the result is in single precision unless double is asked for.
SINGLE = 1e-7
#: Each of the four things that are left away (tails in time, both ends of the band, aliases) errs
#: by no more than this share of the tolerance.
SHARE = 0.2
#: The finest grid, in points to those that the band needs; before it a kernel takes more taps.
FINEST = 2.4
MOST_TAPS = 24
#: Further taps for a band whose grid may be coarse: its window is the shorter in time.
WIDER = 4
#: Rates and Gaussians of copies: what folds is below 4e-9 of what is kept, or below 1e-16.
COPIES = (4.0, 1.4)
FINE_COPIES = (8.0, 1.6)


@dataclass(frozen=True)
class Design:
    """What a tolerance asks of transforming with one Morlet wavelet.

    Parameters
    ----------
    reach : float
        Half-width of the wavelet in scales, beyond which it is left away.
    low, high : float
        Band outside of which its spectrum is left away, in radians per unit of scale.
    kernel : Kernel
    points : float
        Fewest points of the grid a scale: the step may be up to ``scale / points`` samples.
    rate, gaussian : float
        For transforming on a copy of the signal: its samples to the shortest period wanted, and
        the width of the Gaussian that makes it, in its steps.
    """

    reach: float
    low: float
    high: float
    kernel: Kernel
    points: float
    rate: float
    gaussian: float

    def copy_step(self, scale: float) -> int:
        """The largest power of two that a copy's step may be at a scale."""
        return 2 ** math.floor(math.log2(max(1.0, 2 * math.pi * scale / (self.rate * self.high))))

    def step(self, scale: float) -> int:
        """The largest power of two that the grid's step may be at a scale."""
        return 2 ** max(0, math.floor(math.log2(max(scale / self.points, 1.0))))

    def half_width(self, scale: float) -> int:
        """Samples to both sides that take part in a coefficient."""
        return math.ceil(self.reach * scale) + 2

    def is_cut(self, scale: float) -> bool:
        """Whether the band reaches past the Nyquist frequency."""
        return self.high > math.pi * scale


@cache
def design(p: float, tolerance: float) -> Design:
    """Work out the cheapest design for a Morlet wavelet that holds a tolerance.

    Raises
    ------
    InputError
        If the tolerance is none of :data:`TOLERANCES`.
    """
    if tolerance not in TOLERANCES:
        choices = ", ".join(f"{known:g}" for known in TOLERANCES)
        raise InputError(f"The engine's tolerance is one of {choices}, not {tolerance:g}.")
    wavelet = Morlet(p)
    high = p + math.sqrt(2 * math.log(1 / (SHARE * tolerance)))
    u = np.linspace(-12.0, high, 200)
    size = np.abs(wavelet.spectrum(u).real)
    size /= size.max()
    # Forces have most of their power at low frequencies: up to 1 / u^2 in amplitude, as of a
    # ramp or of a kink. Below the band the spectrum must be small even for these.
    heavy = size * np.maximum(1.0, (p / np.maximum(np.abs(u), 1e-3)) ** 2) > SHARE * tolerance
    low = min(0.0, float(u[max(0, int(np.argmax(heavy)) - 1)]))
    kernel, points = _grid(u[u >= low], size[u >= low], high, tolerance)
    reach = math.sqrt(2 * math.log(1e3 / tolerance))
    copies = COPIES if tolerance >= SINGLE else FINE_COPIES
    return Design(reach, low, high, kernel, points, *copies)


@cache
def band(tolerance: float) -> tuple[Kernel, float, float]:
    """Work out a grid for a band with edges as soft as a Gaussian's integral.

    In units of the Gaussian's width in frequency the band is 1 up to half of its end, and falls by
    ``erfc((u - high / 2) / sqrt(2)) / 2``.

    Returns
    -------
    kernel : Kernel
    points : float
        Fewest points of the grid to one over the Gaussian's width.
    high : float
        Where the band ends.
    """
    flat = math.sqrt(2 * math.log(1 / (SHARE * tolerance)))
    u = np.linspace(0.0, 2 * flat, 200)
    size = np.asarray(0.5 * erfc((u - flat) / math.sqrt(2)), dtype=np.float64)
    return (*_grid(u, size, 2 * flat, tolerance, WIDER), 2 * flat)


def _grid(
    u: Real, size: Real, high: float, tolerance: float, more: int = 0
) -> tuple[Kernel, float]:
    """The shortest kernel, and for it the coarsest grid whose aliases are small enough.

    With `more` the kernel has so many taps more than the tolerance needs at least.

    They count with the spectrum where they come from: near the end of the band, where they are
    largest, it is small.
    """

    def holding(taps: int, fineness: float) -> Kernel | None:
        # Slightly less or more than the usual beta may do better, for the same reason.
        for share in (0.98, 0.94, 1.02):
            kernel = Kernel(taps, share * math.pi * taps * (1 - 1 / (2 * fineness)))
            aliases = kernel.aliases(math.pi * u / (fineness * high))
            if np.max(size * aliases) <= SHARE * tolerance:
                return kernel
        return None

    taps, fine = TOLERANCES[tolerance] + more, FINEST
    while (best := holding(taps, fine)) is None:
        taps += 2
        if taps > MOST_TAPS:
            raise AssertionError("A kernel of 24 taps holds every tolerance.")
    coarse = 1.0
    for _ in range(6):
        middle = 0.5 * (coarse + fine)
        kernel = holding(taps, middle)
        if kernel is None:
            coarse = middle
        else:
            best, fine = kernel, middle
    return best, fine * high / math.pi


def response(wavelet: Morlet, scale: float, omega: Real) -> Real:
    """``sqrt(a) psi_hat(a omega)``, real for a Morlet."""
    return np.asarray(math.sqrt(scale) * wavelet.spectrum(scale * omega).real, dtype=np.float64)
