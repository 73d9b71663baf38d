"""Which scales of a stream are computed together, on which copy of the signal, and their matrices.

A product of 20 samples with the weights of one narrow wavelet takes no longer than the call that
asks for it. So neighbouring scales share a product wherever the zeros that this adds to the
narrower ones cost less than a call, and the calls that are left are told by a sum of costs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.streaming_kernels import ENDED, HALF, HELD, HIGHEST, Kernel, low_pass
from forcelab.signals.wavelets import Wavelet

__all__ = ["Level", "plan"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Samples that one product takes at once: blocks of 20 ms at 1 kHz, with some to spare.
TOGETHER = 32
#: What calling a product costs, and decimating for it, in weights of a sample: measured, 20 us.
CALL, DECIMATION = 1000.0, 700.0
#: Decimations that are thought of. Few, so that several groups share a copy.
STEPS = (1, 4, 16, 64, 256)


@dataclass(frozen=True)
class Level:
    """Scales whose coefficients come from one matrix product.

    Parameters
    ----------
    members : slice or ndarray of int, shape (k,)
        Places of the scales among all.
    count : int
        How many they are, k.
    step : int
        Decimation of the copy; 1 where there is none.
    rows : int
        Outputs of one product at most; the first of them may be any of the first `step`.
    coarse, fine : int
        How many decimated samples, and how many full-rate ones before the first row's, take
        part. The newest decimated sample lies ``HALF * step`` before the first row's.
    behind : int
        Samples that the newest one to take part lies behind the newest of all.
    matrix : ndarray of float64, shape (rows * k * 2, coarse + fine + rows)
        Rows by output, scale, and real or imaginary part; columns by time, decimated first.
    """

    members: slice | NDArray[np.int64]
    count: int
    step: int
    rows: int
    coarse: int
    fine: int
    behind: int
    matrix: Real

    @property
    def block(self) -> int:
        """Outputs of each of many products at once: a multiple of the step."""
        return self.rows // self.step * self.step


def plan(
    scales: Real,
    wavelet: Wavelet,
    delays: NDArray[np.int64],
    pasts: NDArray[np.int64],
    together: int | None = None,
) -> tuple[list[Level], NDArray[np.int64]]:
    """Group scales and build their matrices.

    Parameters
    ----------
    scales : ndarray, shape (k,)
        In samples.
    wavelet : Wavelet
    delays, pasts : ndarray of int, shape (k,)
        Samples after and before the coefficient that must take part.
    together : int, optional
        The delay at which all coefficients are wanted, at least that of each; by default each
        comes at its own.

    Returns
    -------
    levels : list of Level
    aheads : ndarray of int, shape (k,)
        Samples after the coefficient that do take part: where all are wanted at one delay, those
        of a group wait for the same sample, which costs nothing.
    """
    order = np.argsort(scales, kind="stable")
    levels, aheads = [], delays.copy()
    parts = _groups(scales[order], _ended(wavelet), delays[order], pasts[order])
    for first, last, step in parts:
        members = order[first:last]
        if together is not None:
            aheads[members] = np.max(delays[members])
        behind = 0 if together is None else together - int(aheads[members[0]])
        kernels = [Kernel.of(float(scales[j]), wavelet) for j in members]
        levels.append(_level(members, kernels, aheads[members], pasts[members], step, behind))
    return levels, aheads


def _ended(wavelet: Wavelet) -> float:
    """The angular frequency, per unit of scale, above which a wavelet's spectrum has ended."""
    frequencies = np.linspace(0.0, 64.0 + 2 * getattr(wavelet, "p", 0.0), 4096)
    size = np.abs(wavelet.spectrum(frequencies)) + np.abs(wavelet.spectrum(-frequencies))
    return float(frequencies[np.flatnonzero(size > ENDED * np.max(size))[-1]])


def _groups(
    scales: Real, ended: float, delays: NDArray[np.int64], pasts: NDArray[np.int64]
) -> list[tuple[int, int, int]]:
    """The cheapest way to part rising scales into groups: first, last, and step of each.

    The wavelet's spectrum ends at `ended` radians per unit of scale. Bellman's recursion over where
    the last group begins.
    """
    k = len(scales)
    cheapest = np.concatenate([[0.0], np.full(k, np.inf)])
    chosen = [(0, 1)] * (k + 1)
    for last in range(1, k + 1):
        delay, past = 0, 0
        for first in range(last - 1, -1, -1):
            delay, past = max(delay, int(delays[first])), max(past, int(pasts[first]))
            taps = delay + past + 1
            for step in STEPS:
                if step > 1 and step * ended > HIGHEST * scales[first]:
                    break
                columns = taps if step == 1 else taps / step + 0.5 * step
                if step > 1:
                    columns += max(2 * HALF * step, HELD * scales[last - 1])
                columns += 0.5 * TOGETHER
                cost = CALL + (step > 1) * DECIMATION + (last - first) * columns
                if cheapest[first] + cost < cheapest[last]:
                    cheapest[last] = cheapest[first] + cost
                    chosen[last] = (first, step)
    groups, last = [], k
    while last:
        first, step = chosen[last]
        groups.append((first, last, step))
        last = first
    return groups[::-1]


def _level(
    members: NDArray[np.int64],
    kernels: list[Kernel],
    delays: NDArray[np.int64],
    pasts: NDArray[np.int64],
    step: int,
    behind: int,
) -> Level:
    """The matrix of one level."""
    taps = int(np.max(delays + pasts)) + 1
    rows = step - 1 + TOGETHER
    if step == 1:
        coarse, fine = 0, taps - 1
    else:
        coarse = max(0, math.ceil((taps + rows) / step) - HALF) + 2
        # What holds beyond the newest sample is no smooth part of the wavelet: at the full rate.
        held = int(HELD * max(kernel.scale for kernel in kernels))
        fine = max((2 * HALF - 1) * step - 1, held)
    matrix = np.empty((rows, len(members), 2, coarse + fine + rows))
    for s, kernel in enumerate(kernels):
        lines = _lines(kernel, int(delays[s]), int(pasts[s]), step, rows, coarse, fine)
        matrix[:, s, 0], matrix[:, s, 1] = lines.real, lines.imag
    # A slice of the output is filled much faster than a choice of places.
    rising = np.array_equal(members, np.arange(members[0], members[0] + len(members)))
    places = slice(int(members[0]), int(members[0]) + len(members)) if rising else members
    flat = matrix.reshape(-1, matrix.shape[3])
    return Level(places, len(members), step, rows, coarse, fine, behind, flat)


def _lines(
    kernel: Kernel, delay: int, past: int, step: int, rows: int, coarse: int, fine: int
) -> Complex:
    """The weights of one scale, shape (rows, coarse + fine + rows)."""
    row = np.arange(rows)[:, None]
    lines = np.zeros((rows, coarse + fine + rows), dtype=np.complex128)
    weights = kernel.weights(delay, past)
    ages = row + fine - np.arange(fine + rows)  # into the past from the row's newest sample
    known = (ages >= 0) & (ages < len(weights))
    lines[:, coarse:][known] = weights[ages[known]]
    if coarse:
        # Places relative to the first row's sample.
        centres = -HALF * step - step * np.arange(coarse - 1, -1, -1)
        away = row - delay - centres  # from the decimated sample to the coefficient
        filter_ = low_pass(step)
        _share(lines, away, past, step * kernel.without(filter_), centres + fine, filter_)
        _balance(lines, away <= past, max(1, int(HELD * kernel.scale) // step))
    return lines


def _share(
    lines: Complex,
    away: NDArray[np.int64],
    past: int,
    smooth: Complex,
    places: NDArray[np.int64],
    filter_: Real,
) -> None:
    """Give the decimated samples their weights, and the full-rate ones what is left for them.

    Parameters
    ----------
    lines : ndarray, shape (rows, columns)
        With the weights of the full-rate columns; changed.
    away : ndarray of int, shape (rows, coarse)
        Distance from each decimated sample to the coefficient's.
    past : int
        The largest distance that counts.
    smooth : ndarray
        Weight of a decimated sample by distance.
    places : ndarray of int, shape (coarse,)
        Where each one's filter is centred among the full-rate columns.
    filter_ : ndarray
    """
    coarse, half = len(places), len(filter_) // 2
    lines[:, :coarse] = np.where(away <= past, smooth[away % len(smooth)], 0.0)
    newest = places[places + half >= 0]
    spread = np.zeros((len(newest), lines.shape[1] - coarse))
    for one, place in zip(spread, newest.tolist(), strict=True):
        low, high = max(0, place - half), max(0, place + half + 1)
        one[low:high] = filter_[half - place + low : half - place + high]
    lines[:, coarse:] -= lines[:, coarse - len(newest) : coarse] @ spread


def _balance(lines: Complex, reached: NDArray[np.bool_], held: int) -> None:
    """Let the oldest `held` decimated samples stand for all before, so that a line's sum is 0.

    Lines that reach no decimated sample are balanced as they are; `reached` is (rows, coarse).
    """
    for line, seen in zip(lines, reached, strict=True):
        places = np.flatnonzero(seen)[:held]
        if places.size:
            line[places] -= np.sum(line) / places.size
            line[places[0]] -= np.sum(line)
