"""The compact kernel that carries a band-limited row from a coarse grid to every sample.

``W(t) = sum_m c_m phi(t / D - m)`` for a grid of step D, where phi is the "exponential of
semicircle" ``phi(z) = exp(beta (sqrt(1 - (2 z / w)^2) - 1))`` for ``|z| < w / 2``, 0 beyond. A
wave ``exp(i omega m)`` on the grid comes out multiplied by phi's transform, so the row is divided
by that beforehand; what is left are the aliases ``phi_hat(omega + 2 pi k)``, k = -1, 1, ...

References
----------
.. [1] Barnett, A. H., Magland, J. and af Klinteberg, L., "A parallel nonuniform fast Fourier
   transform library based on an 'exponential of semicircle' kernel", SIAM J. Sci. Comput. 41
   (2019), section 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

__all__ = ["Interpolation", "Kernel", "interpolation", "windows"]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]

#: Outputs of one row of the matrix product: enough work a row, and few products with zeros.
ROW = 64


@dataclass(frozen=True)
class Kernel:
    """An exponential of semicircle.

    Parameters
    ----------
    taps : int
        Its width w in steps of the grid: even.
    beta : float
        How fast it falls; about ``pi w (1 - 1 / (2 s))`` for a grid s times as fine as the band
        needs ([1]_, equation 3.8 for s = 2).
    """

    taps: int
    beta: float

    def __call__(self, z: Real) -> Real:
        """The kernel at `z` steps of the grid."""
        inside = np.maximum(1.0 - (2.0 * z / self.taps) ** 2, 0.0)
        fallen = np.exp(self.beta * (np.sqrt(inside) - 1.0))
        return np.where(inside > 0, fallen, 0.0)

    def transform(self, omega: Real) -> Real:
        """phi_hat at `omega` of at most 5 pi rad a step, by the midpoint rule.

        In ``z = w/2 sin(theta)`` the square root at the kernel's ends is gone, and what is left is
        almost a Gaussian, for which the rule is as exact as float64.
        """
        count = 12 * self.taps + 40
        width = math.pi / count
        theta = width * (np.arange(count) + 0.5) - 0.5 * math.pi
        fallen = width * np.cos(theta) * np.exp(self.beta * (np.cos(theta) - 1))
        waves = np.cos(np.multiply.outer(omega, 0.5 * self.taps * np.sin(theta)))
        return np.asarray(0.5 * self.taps * (waves @ fallen), dtype=np.float64)

    @cached_property
    def _series(self) -> Real:
        """Chebyshev coefficients of phi_hat over omega in -pi .. pi."""
        degree = 2 * self.taps + 40
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        return np.asarray(chebyshev.chebfit(nodes, self.transform(np.pi * nodes), degree))

    def transforms(self, omega: Real) -> Real:
        """phi_hat at many frequencies of at most pi rad a step; a hundred times as fast."""
        return np.asarray(chebyshev.chebval(omega / np.pi, self._series), dtype=np.float64)

    def aliases(self, omega: Real) -> Real:
        """Size of all aliases of a wave, as a share of the wave."""
        folds = 2.0 * math.pi * np.array([-2, -1, 1, 2])
        beside = np.abs(self.transform(np.add.outer(omega, folds)))
        # What is left below is the quadrature's own rounding.
        beside[beside < 4 * np.finfo(np.float64).eps] = 0.0
        # All others together come from the small steps at the kernel's ends.
        steps = 2.0 * math.exp(-self.beta)
        return np.asarray((beside.sum(axis=-1) + steps) / self.transform(omega), dtype=np.float64)


@dataclass(frozen=True)
class Interpolation:
    """One matrix product that makes all samples of a row from its coarse grid.

    Each row of the left factor holds `inputs` neighbouring points of the grid, `points` after those
    of the row before, and gives the ``points * step`` samples from its middle.

    Parameters
    ----------
    step : int
        D, samples of a step of the grid.
    points : int
        Steps that one row of the product covers.
    before : int
        Points of the grid that a row needs before its first sample.
    matrix : ndarray, shape (inputs, points * step)
        For real and imaginary parts apart.
    interleaved : ndarray, shape (2 * inputs, 2 * points * step)
        The same for parts in turn, as complex numbers lie in memory: half of it is zero, but its
        product is written where it belongs at once.
    """

    step: int
    points: int
    before: int
    matrix: NDArray[np.floating]
    interleaved: NDArray[np.floating]

    @property
    def inputs(self) -> int:
        """Points of the grid in one row of the left factor."""
        return len(self.matrix)

    @property
    def outputs(self) -> int:
        """Samples in one row of the product."""
        return self.points * self.step


@cache
def interpolation(kernel: Kernel, step: int, single: bool) -> Interpolation:
    """The products for grids of one step, in single or double precision."""
    points = max(1, ROW // step)
    before = kernel.taps // 2 - 1
    grid = np.arange(kernel.taps + points - 1)[:, None] - before
    matrix = kernel(np.arange(points * step) / step - grid)
    interleaved = np.zeros((len(grid), 2, points * step, 2))
    interleaved[:, 0, :, 0] = interleaved[:, 1, :, 1] = matrix
    flat = interleaved.reshape(2 * len(grid), -1)
    if single:
        return Interpolation(
            step, points, before, matrix.astype(np.float32), flat.astype(np.float32)
        )
    return Interpolation(step, points, before, matrix, flat)


def windows(points: Floats, rows: int, product: Interpolation, group: int = 1) -> Floats:
    """Overlapping windows of rows of `group` numbers a point: (..., rows, inputs * group).

    Each window begins `product.points` points after the one before.
    """
    *outer, last = points.strides
    strides = (*outer, product.points * group * last, last)
    shape = (*points.shape[:-1], rows, product.inputs * group)
    return np.lib.stride_tricks.as_strided(points, shape, strides, writeable=False)
