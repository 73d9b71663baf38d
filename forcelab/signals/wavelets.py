"""All mother wavelets by their names: Morlets, derivatives of Gaussians, and Haar's.

All have zero mean, so that a constant force gives nothing, but for the uncorrected Morlet.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.errors import InputError
from forcelab.signals.morlets import Morlet, RealMorlet, TorrenceCompoMorlet, UncorrectedMorlet
from forcelab.signals.wavelet import TAIL, Wavelet, gauss

__all__ = [
    "DOG",
    "WAVELETS",
    "Haar",
    "Morlet",
    "RealMorlet",
    "TorrenceCompoMorlet",
    "UncorrectedMorlet",
    "Wavelet",
    "wavelet_named",
]

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class DOG(Wavelet):
    """A derivative of a Gaussian, real; order 2 is the Mexican hat.

    ``psi(t) = (-1)^(m+1) / sqrt(Gamma(m + 1/2)) d^m/dt^m exp(-t^2/2)``

    ``psi_hat(w) = (-1)^(m+1) sqrt(2 pi / Gamma(m + 1/2)) (i w)^m exp(-w^2/2)``

    Parameters
    ----------
    m : int
        Order of the derivative, 1 to 100; a Morlet of p = sqrt(m) is much like those above.
    """

    m: int = 2
    real: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not 1 <= self.m <= 100 or self.m != int(self.m):
            raise InputError(
                f"The order of a Gaussian's derivative is a whole number from 1 to 100, "
                f"not {self.m}."
            )

    @property
    def name(self) -> str:  # type: ignore[override]
        """Such as ``DOG m = 2``."""
        return f"DOG m = {self.m}"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        # In logarithms: w^m and Gamma(m + 1/2) each overflow long before their ratio does.
        with np.errstate(divide="ignore"):
            size = np.exp(
                self.m * np.log(np.abs(w)) - 0.5 * w * w - 0.5 * math.lgamma(self.m + 0.5)
            )
        sign = np.sign(w) ** self.m * (-1.0) ** (self.m + 1)
        phase = 1j ** (self.m % 4)
        return np.asarray(math.sqrt(2 * math.pi) * sign * size * phase, dtype=np.complex128)

    def time(self, t: ArrayLike) -> Complex:
        t = np.asarray(t, dtype=np.float64)
        # Normalised Hermite functions by their three-term recurrence, which cannot overflow.
        before, here = np.zeros_like(t), gauss(t) / math.pi**0.25
        for k in range(self.m):
            before, here = here, (t * here - math.sqrt(k) * before) / math.sqrt(k + 1)
        scale = math.exp(0.5 * (math.lgamma(self.m + 1.0) - math.lgamma(self.m + 0.5)))
        return (-here * math.pi**0.25 * scale).astype(np.complex128)

    @property
    def fourier_factor(self) -> float:
        return 2 * math.pi / math.sqrt(self.m + 0.5)

    @property
    def radius(self) -> float:
        # exp(-t^2/2) t^m falls off from its turning point near sqrt(2 m) like a Gaussian.
        return TAIL + math.sqrt(2 * self.m)


@dataclass(frozen=True)
class Haar(Wavelet):
    """The Haar wavelet: +1 on [-1/2, 0), -1 on [0, 1/2).

    ``psi_hat(w) = 4 i sin(w/4)^2 / w``

    Its spectrum falls off only like 1/w and is cut at the Nyquist frequency, so that the sampled
    wavelet rings a little beside its three jumps.
    """

    name: str = "Haar"
    real: ClassVar[bool] = True

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        quarter = w / (4 * math.pi)
        # np.sinc(x) = sin(pi x) / (pi x), so sin(w/4)^2 * 4 / w = (w/4) sinc(w / 4 pi)^2.
        return (1j * 0.25 * w * np.sinc(quarter) ** 2).astype(np.complex128)

    def time(self, t: ArrayLike) -> Complex:
        t = np.asarray(t, dtype=np.float64)
        inside = (t >= -0.5) & (t < 0.5)
        return (np.where(t < 0, 1.0, -1.0) * inside).astype(np.complex128)

    @property
    def fourier_factor(self) -> float:
        # sqrt(a) |psi_hat(a w)| peaks over a where tan(a w / 4) = a w.
        return 2 * math.pi / 5.5729963013023545

    @property
    def radius(self) -> float:
        return 4.0  # the wavelet ends at 1/2; the rest is for the ringing to die down


#: Names for settings and the command line. The parameter is p for Morlets, m for DOG.
WAVELETS = ("morlet", "real-morlet", "uncorrected-morlet", "torrence-compo", "dog", "haar")
_MORLETS = {
    "morlet": Morlet,
    "real-morlet": RealMorlet,
    "uncorrected-morlet": UncorrectedMorlet,
    "torrence-compo": TorrenceCompoMorlet,
}


def wavelet_named(name: str, parameter: float | None = None) -> Wavelet:
    """Build a wavelet from its name in :data:`WAVELETS` and its parameter.

    Parameters
    ----------
    name : str
        One of :data:`WAVELETS`.
    parameter : float, optional
        p of a Morlet (default 5), order of a derivative of Gaussian (default 2); none for Haar.

    Raises
    ------
    InputError
        If the name is unknown or the parameter does not suit it.
    """
    if name in _MORLETS:
        return _MORLETS[name](5.0 if parameter is None else parameter)
    if name == "dog":
        order = 2.0 if parameter is None else parameter
        if not float(order).is_integer():
            raise InputError(
                f"The order of a Gaussian's derivative is a whole number from 1 to 100, "
                f"not {order:g}."
            )
        return DOG(int(order))
    if name == "haar" and parameter is None:
        return Haar()
    if name == "haar":
        raise InputError("The Haar wavelet has no parameter; leave it out.")
    raise InputError(f"There is no wavelet '{name}'; choose from {', '.join(WAVELETS)}.")
