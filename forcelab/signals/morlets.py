"""The Morlet wavelets: with the term that makes the mean zero, real, and as others define them.

References
----------
.. [1] Torrence, C. and Compo, G. P., "A practical guide to wavelet analysis", Bull. Amer. Meteor.
   Soc. 79 (1998), table 1 and section 3h (Fourier period). Their Fourier period of the Morlet
   leaves out the correction term; here it counts where the wavelet has it.
.. [2] Subramani, G. et al., "Recognizing actions during tactile manipulations through force
   sensing", IROS 2017: the Morlet with p = 5 on which preset ``paper`` rests.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.errors import InputError
from forcelab.signals.wavelet import TAIL, Wavelet, gauss

__all__ = ["Morlet", "RealMorlet", "TorrenceCompoMorlet", "UncorrectedMorlet"]

Complex = NDArray[np.complex128]


@cache
def _strongest(p: float, real: bool) -> float:
    """Scale times angular frequency of the sine that a Morlet wavelet answers to most.

    The maximum of ``sqrt(u) |psi_hat(u)|``, where its logarithm has no slope:
    ``1 / (2 u) - u + p / (1 - exp(-u p)) = 0``, of the real wavelet
    ``1 / (2 u) - u + p coth(u p / 2) = 0``. The slope falls without end, so there is one root.
    """

    def slope(u: float) -> float:
        carrier = p / math.tanh(0.5 * u * p) if real else -p / math.expm1(-u * p)
        return 0.5 / u - u + carrier

    # Halved until no number lies between: scipy's root finders take half a second to load.
    low, high = max(1.0, p), p + 2.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if slope(middle) > 0 else (low, middle)
    return low


@dataclass(frozen=True)
class Morlet(Wavelet):
    """The complex Morlet wavelet, with the term that makes its mean exactly zero.

    ``psi(t) = pi^-1/4 (exp(i p t) - exp(-p^2/2)) exp(-t^2/2)``

    ``psi_hat(w) = sqrt(2 pi) pi^-1/4 (exp(-(w - p)^2/2) - exp(-p^2/2) exp(-w^2/2))``

    Parameters
    ----------
    p : float
        Angular frequency of the carrier, in radians per unit of scale: more oscillations under
        the envelope, finer in frequency, coarser in time. From 0.1, below which the wavelet
        hardly changes any more while its two terms cancel, to 1000.

    Notes
    -----
    The correction is 3.7e-6 at p = 5. At scales below ``(p + 3.7) / pi`` samples, about 2.8 for
    p = 5, the spectrum is above 1e-3 of its peak at the Nyquist frequency and is cut there; at
    scale 2 the cut lies at 44 % of the peak. From ``(p + 6.5) / pi`` samples on, 3.7 for p = 5,
    what is cut is below 1e-9.
    """

    p: float = 5.0

    def __post_init__(self) -> None:
        if not 0.1 <= self.p <= 1000:
            raise InputError(f"The Morlet's p must lie between 0.1 and 1000, not at {self.p:g}.")

    @property
    def name(self) -> str:  # type: ignore[override]
        """Such as ``Morlet p = 5``."""
        return f"Morlet p = {self.p:g}"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        bells = gauss(w - self.p) - math.exp(-0.5 * self.p**2) * gauss(w)
        return (math.sqrt(2 * math.pi) * math.pi**-0.25 * bells).astype(np.complex128)

    def time(self, t: ArrayLike) -> Complex:
        t = np.asarray(t, dtype=np.float64)
        carrier = np.exp(1j * self.p * t) - math.exp(-0.5 * self.p**2)
        return math.pi**-0.25 * carrier * gauss(t)

    @property
    def fourier_factor(self) -> float:
        return 2 * math.pi / _strongest(self.p, self.real)

    @property
    def radius(self) -> float:
        return TAIL


@dataclass(frozen=True)
class RealMorlet(Morlet):
    """The real part of :class:`Morlet`: magnitude and phase are no longer told apart."""

    real: ClassVar[bool] = True

    @property
    def name(self) -> str:  # type: ignore[override]
        """Such as ``real Morlet p = 5``."""
        return f"real Morlet p = {self.p:g}"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        return 0.5 * (super().spectrum(w) + super().spectrum(-w))

    def time(self, t: ArrayLike) -> Complex:
        return super().time(t).real.astype(np.complex128)


@dataclass(frozen=True)
class UncorrectedMorlet(Morlet):
    """The Morlet wavelet as it is often written, without the term that makes its mean zero.

    ``psi(t) = pi^-1/4 exp(i p t - t^2/2)``

    Notes
    -----
    It answers a constant with ``sqrt(2 pi) pi^-1/4 exp(-p^2/2)`` times the root of the scale, at
    p = 5 with 3.7e-6 of what it answers the sine that suits it best; at p = 2 with 14 %. The
    transforms take the median of a channel away first, so that they give the answer to what
    differs from it: a force that rests at another level than usual has a magnitude there, and a
    phase that means nothing.
    """

    @property
    def name(self) -> str:  # type: ignore[override]
        """Such as ``uncorrected Morlet p = 5``."""
        return f"uncorrected Morlet p = {self.p:g}"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        return (math.sqrt(2 * math.pi) * math.pi**-0.25 * gauss(w - self.p)).astype(np.complex128)

    def time(self, t: ArrayLike) -> Complex:
        t = np.asarray(t, dtype=np.float64)
        return math.pi**-0.25 * np.exp(1j * self.p * t) * gauss(t)

    @property
    def fourier_factor(self) -> float:
        return 4 * math.pi / (self.p + math.hypot(self.p, math.sqrt(2)))  # table 1 of [1]_


@dataclass(frozen=True)
class TorrenceCompoMorlet(UncorrectedMorlet):
    """The Morlet wavelet of Torrence and Compo: the uncorrected one's positive frequencies.

    ``psi_hat(w) = sqrt(2 pi) pi^-1/4 H(w) exp(-(w - p)^2/2)`` with the unit step H, 0 at 0.

    Notes
    -----
    A constant gives nothing, but of the step at frequency 0 comes a tail that falls like 1 / t
    only: ``pi^-1/4 exp(-p^2/2) / (sqrt(2 pi) |t|)`` far out, at p = 5 the 4e-6 level of [1]_'s
    ``H(w)``, over the distance. So every coefficient hears of every impact, however long ago,
    and a tail that reaches beyond the ends of a recording is cut off there, which errs by 1e-6
    at p = 5.
    """

    @property
    def name(self) -> str:  # type: ignore[override]
        """Such as ``Torrence-Compo Morlet p = 5``."""
        return f"Torrence-Compo Morlet p = {self.p:g}"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        return np.where(w > 0, super().spectrum(w), 0.0)

    def time(self, t: ArrayLike) -> Complex:
        from scipy.special import wofz

        # What negative frequencies would give is half an error function of complex argument.
        t = np.asarray(t, dtype=np.float64)
        negative = 0.5 * math.exp(-0.5 * self.p**2) * wofz((1j * self.p - t) / math.sqrt(2))
        return np.asarray(super().time(t) - math.pi**-0.25 * negative, dtype=np.complex128)
