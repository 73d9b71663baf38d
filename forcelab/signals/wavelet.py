"""What a mother wavelet is, as a function of frequency and of time.

Time `t` is in units of the scale; angular frequency `omega` in radians per unit of scale, with
the transform ``psi_hat(omega) = integral psi(t) exp(-i omega t) dt``.

References
----------
.. [1] Torrence, C. and Compo, G. P., "A practical guide to wavelet analysis", Bull. Amer. Meteor.
   Soc. 79 (1998), section 3g (e-folding time).
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["TAIL", "Wavelet", "cone_of_influence", "gauss"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


class Wavelet(ABC):
    """A mother wavelet psi.

    Attributes
    ----------
    name : str
        What messages and figures call it.
    real : bool
        Whether psi is real; its transform then has no imaginary part.
    fourier_factor : float
        Period, in units of the scale, of the sine whose response over all scales is largest at
        this scale.
    radius : float
        Half-width in units of the scale outside of which the wavelet is below 1e-13 of its peak
        (below 1e-11 for a Morlet with p < 3; Torrence and Compo's has no such width).
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


#: Where exp(-t^2 / 2) has fallen to 1e-13.
TAIL = math.sqrt(2 * math.log(1e13))


def gauss(x: Real) -> Real:
    """``exp(-x^2 / 2)``."""
    return np.exp(-0.5 * x * x)


def cone_of_influence(times: Real, bounds: tuple[float, float], e_folding: float) -> Real:
    """Largest scale at each time that the ends of the recording do not yet bear upon.

    Above it a coefficient rests on held end values by more than exp(-2) of its power [1]_.

    Parameters
    ----------
    times : ndarray, shape (n,)
    bounds : tuple of float
        Where the recording begins and ends.
    e_folding : float
        Of the wavelet, over its scale: the distance at which the power of its envelope has fallen
        by exp(-2), such as the root of 2 for the Morlet.

    Returns
    -------
    ndarray, shape (n,)
        Scales in the unit of the times.
    """
    return np.minimum(times - bounds[0], bounds[1] - times) / e_folding
