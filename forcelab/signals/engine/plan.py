"""One plan for all transforms of one length, with the same scales, wavelet and tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.signals.engine.copies import Copies, Smoothing
from forcelab.signals.engine.cut import Cut
from forcelab.signals.engine.design import SINGLE, Design, design
from forcelab.signals.engine.memory import keep_freed_memory
from forcelab.signals.engine.narrow import Narrow
from forcelab.signals.engine.ring import KEPT as RING
from forcelab.signals.engine.ring import Ring, ring_length
from forcelab.signals.engine.sinks import Coefficients, LogPolar, Sink
from forcelab.signals.engine.threads import one_blas_thread
from forcelab.signals.engine.wide import WIDEST_STEP, Wide
from forcelab.signals.wavelets import Morlet, Wavelet

__all__ = ["ROUNDING", "Plan", "plan_for"]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]

#: Magnitudes of channels of amplitude 1 that are above this share times the root of the scale are
#: above the rounding of the transform.
ROUNDING = 1e-13
#: Recordings above the first length are cut into blocks of the second.
WHOLE, BLOCK = 1 << 17, 1 << 16
#: Wavelets take part with grids of this step and wider.
COARSE = 4
#: Up to this length, where a call costs more than a sample, copies are for the widest only.
SHORT = 1 << 15
#: A wavelet that reaches further than this share of a block is transformed on a slower copy.
SHARE = 0.15
#: Scales of one copy are up to so many times the narrowest of them.
SPAN = 16.0


class _Path(Protocol):
    """A way to transform some of the scales."""

    def transform(self, copies: Copies, sink: Sink) -> None: ...


class Plan:
    """A transform that is ready to run; use :func:`plan_for`, which keeps plans.

    Parameters
    ----------
    n : int
        Samples of a channel.
    scales : sequence of float
        In samples, positive, in any order.
    wavelet : Wavelet
    tolerance : float
        One of 1e-3, 1e-5, 1e-7, 1e-10 and 1e-14.
    single : bool
        Whether coefficients are given in single precision, and interpolated in it.
    """

    def __init__(
        self, n: int, scales: Sequence[float], wavelet: Wavelet, tolerance: float, single: bool
    ) -> None:
        keep_freed_memory()
        self.n, self.tolerance, self.single = n, tolerance, single
        self.scales: Real = np.asarray(scales, dtype=np.float64)
        # In rising order inside.
        self._order = np.argsort(self.scales, kind="stable")
        rising = self.scales[self._order]
        block = WIDEST_STEP * -(-(n if n <= WHOLE else BLOCK) // WIDEST_STEP)
        self._padded = n
        self._smoothing = Smoothing((1,), 1.0, 1)
        if type(wavelet) is Morlet:
            self._paths = self._morlet(rising, wavelet, design(wavelet.p, tolerance), block)
        else:
            design(5.0, tolerance)  # refuses unknown tolerances
            self._paths = [Ring(n, rising, range(len(rising)), wavelet, single)]

    def _morlet(self, scales: Real, wavelet: Morlet, made: Design, block: int) -> list[_Path]:
        """Ways for cut, narrow, wide and the widest wavelets."""
        n, single = self.n, self.single
        cut = [j for j, a in enumerate(scales.tolist()) if made.is_cut(a)]
        narrow = [
            j for j, a in enumerate(scales.tolist()) if j not in cut and made.step(a) < COARSE
        ]
        paths: list[_Path] = []
        if cut and ring_length(n, float(scales[0]), wavelet.radius) > RING:
            paths.append(Cut(n, scales[cut], cut, wavelet, made, self.tolerance, single))
        elif cut:
            paths.append(Ring(n, scales[cut], cut, wavelet, single))
        if narrow:
            paths.append(Narrow(n, scales[narrow], narrow, wavelet, made, single))
        first = len(cut) + len(narrow)
        if first < len(scales):
            self._padded = WIDEST_STEP * -(-n // WIDEST_STEP)
        half = math.ceil(made.reach * made.gaussian)
        self._smoothing = Smoothing((1,), made.gaussian, half)
        while first < len(scales):
            scale = float(scales[first])
            near = made.half_width(scale) <= max(SHARE * block, 512)
            step = self._copy_step(scale, made, near)
            last = int(np.searchsorted(scales, self._reached(scale, step, made, block)))
            last = max(last, first + 1)
            paths.append(
                Wide(
                    n,
                    block if near else self._padded,
                    scales[first:last],
                    first,
                    wavelet,
                    made,
                    single,
                    step,
                    self._smoothing.variance(step),
                )
            )
            first = last
        return paths

    def _copy_step(self, scale: float, made: Design, near: bool) -> int:
        """Samples a step of the copy that a scale is transformed on; 1 for the signal itself."""
        known = self._smoothing.steps
        step = min(made.copy_step(scale), 1 << max(0, (self.n // 32).bit_length() - 1))
        if step <= known[-1] or (near and self.n <= SHORT):
            return known[-1]
        self._smoothing = replace(self._smoothing, steps=(*known, step))
        return step

    def _reached(self, scale: float, step: int, made: Design, block: int) -> float:
        """The scale up to which others join that one on its copy."""
        farthest = (max(SHARE * block, 512) - 2) / made.reach
        if scale > farthest:
            return SPAN * scale
        return min(farthest * (1 + 1e-12), SPAN * scale if step > 1 else math.inf)

    def coefficients(self, values: Real) -> Complex:
        """Transform channels.

        Parameters
        ----------
        values : ndarray of float64, shape (c, n)
            Finite, moderate in size, as from :func:`forcelab.signals.conditioning.condition`.

        Returns
        -------
        ndarray of complex64 or complex128, shape (c, k, n)
        """
        sink = Coefficients(len(values), len(self.scales), self.n, self._padded, self.single)
        self._run(values, sink)
        return self._as_asked(sink.result)

    def log_polar(self, values: Real) -> tuple[Floats, Floats]:
        """Log magnitudes and phases of channels, without their coefficients ever being kept.

        Parameters
        ----------
        values : ndarray of float64, shape (c, n)
            As for :meth:`coefficients`.

        Returns
        -------
        magnitudes, phases : ndarray of float32 or float64, shape (c, k, n)
            Natural logarithms, and radians from -pi to pi. Magnitudes below :data:`ROUNDING` times
            the root of the scale are raised to that, and their phase is 0.
        """
        floor = ROUNDING * np.sqrt(self.scales[self._order])
        sink = LogPolar(len(values), floor, self.n, self.single)
        self._run(values, sink)
        return self._as_asked(sink.magnitudes), self._as_asked(sink.phases)

    def _run(self, values: Real, sink: Sink) -> None:
        if values.ndim != 2 or values.shape[1] != self.n:
            raise InputError(
                f"This plan is for channels of {self.n} samples, not for {values.shape}."
            )
        values = np.ascontiguousarray(values, dtype=np.float64)
        with one_blas_thread():
            copies = Copies(values, self._smoothing)
            for path in self._paths:
                path.transform(copies, sink)

    def _as_asked(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Bring scales back into the order they were given in."""
        if np.array_equal(self._order, np.arange(len(self._order))):
            return rows
        return rows[:, np.argsort(self._order)]


_kept = lru_cache(maxsize=8)(Plan)


def plan_for(
    n: int,
    scales: Sequence[float] | Real,
    wavelet: Wavelet | None = None,
    tolerance: float = 1e-7,
    *,
    double: bool = False,
) -> Plan:
    """A plan for transforms; the last few are kept and given again.

    Parameters
    ----------
    n : int
        Samples of a channel, at least 1.
    scales : array_like, shape (k,)
        In samples, positive, in any order.
    wavelet : Wavelet, optional
        The Morlet with p = 5 by default. Any other than the complex Morlet takes the plain way.
    tolerance : float
        1e-3, 1e-5, 1e-7, 1e-10 or 1e-14: error relative to the largest coefficient of its scale.
    double : bool
        Whether to give double precision where single precision holds the tolerance.

    Raises
    ------
    InputError
        If there are no samples, a scale is not positive or the tolerance is unknown.
    """
    sizes = np.asarray(scales, dtype=np.float64)
    if n < 1:
        raise InputError(f"A transform needs at least one sample, not {n}.")
    if sizes.ndim != 1 or sizes.size == 0 or not np.all((sizes > 0) & np.isfinite(sizes)):
        raise InputError("Scales are positive numbers of samples.")
    single = tolerance >= SINGLE and not double
    return _kept(int(n), tuple(sizes.tolist()), wavelet or Morlet(), float(tolerance), single)
