"""Mother wavelets by their names: Morlets, derivatives of Gaussians, and Haar's.

Each is a function of frequency and of time. Time `t` is in units of the scale; angular frequency
`omega` in radians per unit of scale, with ``psi_hat(omega) = integral psi(t) exp(-i omega t) dt``.
All have zero mean, so that a constant force gives nothing, but for the uncorrected Morlet.

.. [1] Torrence, C. and Compo, G. P., "A practical guide to wavelet analysis", Bull. Amer. Meteor.
   Soc. 79 (1998), table 1, sections 3g (e-folding time) and 3h (Fourier period). Their Fourier
   period of the Morlet leaves out the correction term; here it counts where the wavelet has it.
.. [2] Subramani, G. et al., "Recognizing actions during tactile manipulations through force
   sensing", IROS 2017: the Morlet with p = 5 on which preset ``paper`` rests.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from forcelab.arrays import Real
from forcelab.errors import InputError

Complex = NDArray[np.complex128]


class Wavelet(ABC):
    """A mother wavelet psi.

    `name`: what messages and figures call it; `real`: whether psi is real; its transform then has
    no imaginary part; `fourier_factor`: period, in units of the scale, of the sine whose response
    over all scales is largest at this scale; `radius`: half-width in units of the scale outside of
    which the wavelet is below 1e-13 of its peak (below 1e-11 for a Morlet with p < 3; Torrence and
    Compo's has no such width).
    """

    name: str
    real: ClassVar[bool] = False

    @abstractmethod
    def spectrum(self, omega: ArrayLike) -> Complex:
        """Fourier transform psi_hat at angular frequencies `omega` (rad per unit of scale)."""

    @abstractmethod
    def time(self, t: ArrayLike) -> Complex:
        """The wavelet psi at times `t` (in units of the scale)."""

    @property
    @abstractmethod
    def fourier_factor(self) -> float:
        """Fourier period over scale."""

    @property
    @abstractmethod
    def radius(self) -> float:
        """Half-width of the support over scale."""


#: The integral of a Morlet wavelet's envelope, ``pi^-1/4 exp(-t^2/2)``.
AREA = math.sqrt(2 * math.pi) * math.pi**-0.25
#: Where exp(-t^2 / 2) has fallen to 1e-13.
TAIL = math.sqrt(2 * math.log(1e13))


def gauss(x: Real) -> Real:
    return np.exp(-0.5 * x * x)


def cone_of_influence(times: Real, bounds: tuple[float, float], e_folding: float) -> Real:
    """Largest scale at each time that the ends of the recording do not yet bear upon.

    Above it a coefficient rests on held end values by more than exp(-2) of its power [1]_.

    `times` (n,); `bounds`: where the recording begins and ends; `e_folding`: of the wavelet, over
    its scale: the distance at which the power of its envelope has fallen by exp(-2), such as the
    root of 2 for the Morlet. Gives (n,): scales in the unit of the times.
    """
    return np.minimum(times - bounds[0], bounds[1] - times) / e_folding


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

    Examples
    --------
    >>> tone = np.sin(np.arange(256) / 5)
    >>> low, high = np.abs(forcelab.cwt(tone, [8.0, 24.0], forcelab.Morlet()))
    >>> bool(high.max() > low.max())
    True
    """

    p: float = 5.0
    kind: ClassVar[str] = "Morlet"

    def __post_init__(self) -> None:
        if not 0.1 <= self.p <= 1000:
            raise InputError(f"The Morlet's p must lie between 0.1 and 1000, not at {self.p:g}.")

    @property
    def name(self) -> str:  # type: ignore[override]
        """Such as ``Morlet p = 5``."""
        return f"{self.kind} p = {self.p:g}"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        bells = gauss(w - self.p) - math.exp(-0.5 * self.p**2) * gauss(w)
        return (AREA * bells).astype(np.complex128)

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
    """The real part of :class:`Morlet`: magnitude and phase are no longer told apart.

    Examples
    --------
    >>> forcelab.cwt(np.sin(np.arange(256) / 5), [8.0], forcelab.RealMorlet()).shape
    (1, 256)
    """

    kind: ClassVar[str] = "real Morlet"
    real: ClassVar[bool] = True

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        return 0.5 * (super().spectrum(w) + super().spectrum(-w))

    def time(self, t: ArrayLike) -> Complex:
        return super().time(t).real.astype(np.complex128)


@dataclass(frozen=True)
class UncorrectedMorlet(Morlet):
    """The Morlet wavelet as it is often written, without the term that makes its mean zero.

    ``psi(t) = pi^-1/4 exp(i p t - t^2/2)``

    It answers a constant with ``sqrt(2 pi) pi^-1/4 exp(-p^2/2)`` times the root of the scale, at
    p = 5 with 3.7e-6 of what it answers the sine that suits it best; at p = 2 with 14 %. The
    transforms take the median of a channel away first, so that they give the answer to what
    differs from it: a force that rests at another level than usual has a magnitude there, and a
    phase that means nothing.
    """

    kind: ClassVar[str] = "uncorrected Morlet"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        return (AREA * gauss(w - self.p)).astype(np.complex128)

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

    A constant gives nothing, but of the step at frequency 0 comes a tail that falls like 1 / t
    only: ``pi^-1/4 exp(-p^2/2) / (sqrt(2 pi) |t|)`` far out, at p = 5 the 4e-6 level of [1]_'s
    ``H(w)``, over the distance. So every coefficient hears of every impact, however long ago,
    and a tail that reaches beyond the ends of a recording is cut off there, which errs by 1e-6
    at p = 5.
    """

    kind: ClassVar[str] = "Torrence-Compo Morlet"

    def spectrum(self, omega: ArrayLike) -> Complex:
        w = np.asarray(omega, dtype=np.float64)
        return np.where(w > 0, super().spectrum(w), 0.0)

    def time(self, t: ArrayLike) -> Complex:
        from scipy.special import wofz

        # What negative frequencies would give is half an error function of complex argument.
        t = np.asarray(t, dtype=np.float64)
        negative = 0.5 * math.exp(-0.5 * self.p**2) * wofz((1j * self.p - t) / math.sqrt(2))
        return np.asarray(super().time(t) - math.pi**-0.25 * negative, dtype=np.complex128)


@dataclass(frozen=True)
class DOG(Wavelet):
    """A derivative of a Gaussian, real; order 2 is the Mexican hat.

    ``psi(t) = (-1)^(m+1) / sqrt(Gamma(m + 1/2)) d^m/dt^m exp(-t^2/2)``

    ``psi_hat(w) = (-1)^(m+1) sqrt(2 pi / Gamma(m + 1/2)) (i w)^m exp(-w^2/2)``

    Parameters
    ----------
    m : int
        Order of the derivative, 1 to 100; a Morlet of p = sqrt(m) is much like those above.

    Examples
    --------
    >>> forcelab.cwt(np.sin(np.arange(256) / 5), [8.0, 16.0], forcelab.DOG(2)).shape
    (2, 256)
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

    Examples
    --------
    >>> steps = np.repeat([0.0, 1.0], 128)
    >>> (magnitudes,) = np.abs(forcelab.cwt(steps, [16.0], forcelab.Haar()))
    >>> bool(abs(magnitudes.argmax() - 127.5) < 1)
    True
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

    `name`: one of :data:`WAVELETS`; `parameter`: p of a Morlet (default 5), order of a derivative
    of Gaussian (default 2); none for Haar.
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
