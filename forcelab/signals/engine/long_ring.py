"""Fourier transforms of long rings by many short ones, in little memory beside half a spectrum.

A ring of ``L = M P`` samples is seen as a table with M rows or columns (the "four-step" FFT [1]_):
the spectrum of every M-th sample at a time, then short transforms across them, and back likewise.

References
----------
.. [1] Bailey, D. H., "FFTs in external or hierarchical memory", J. Supercomputing 4 (1990).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft

__all__ = ["PARTS", "from_spectrum", "spectrum"]

Real = NDArray[np.float64]
Complex = NDArray[np.complexfloating[Any, Any]]

#: M; rows that are transformed at once, and columns.
PARTS = 64
ROWS = 4
COLUMNS = 1 << 11
#: Bins whose responses are worked out at once.
STRETCH = 1 << 14


def spectrum(ring: Callable[[NDArray[np.int64]], Real], length: int, kind: Any) -> Complex:
    """Half of the spectrum of a real ring.

    Parameters
    ----------
    ring : callable
        Gives the ring's samples at some indices.
    length : int
        L, a multiple of the square of :data:`PARTS`.
    kind : dtype
        Complex, of the result; transforms of the parts are in double precision.

    Returns
    -------
    ndarray, shape (M, P / 2 + 1)
        ``X[j P + k]``; those for k above P / 2 are conjugates of others, as the ring is real.
    """
    part = length // PARTS
    table = np.empty((PARTS, part // 2 + 1), dtype=kind)
    index = PARTS * np.arange(part)
    for r in range(0, PARTS, ROWS):
        rows = np.stack([ring(index + i) for i in range(r, r + ROWS)])
        table[r : r + ROWS] = fft.rfft(rows, axis=-1)
    for columns, turned in _turns(length, table.shape[1]):
        table[:, columns] = fft.fft(table[:, columns] * np.conj(turned), axis=0)
    return table


def from_spectrum(
    table: Complex, length: int, response: Callable[[slice], Complex]
) -> Iterator[tuple[int, Complex]]:
    """The ring of a spectrum times a response, in pieces.

    Parameters
    ----------
    table : ndarray, shape (M, P / 2 + 1)
        From :func:`spectrum`.
    length : int
        L.
    response : callable
        Gives the factors of the bins of a slice of 0 .. L.

    Yields
    ------
    start : int
        Index of a sample of the ring.
    piece : ndarray, shape (m,)
        The samples from there on.
    """
    part = length // PARTS
    half = part // 2
    combs = np.empty((PARTS, part), dtype=table.dtype)
    for j in range(PARTS):
        bins = np.empty(part, dtype=table.dtype)
        bins[: half + 1] = table[j]
        bins[half + 1 :] = np.conj(table[PARTS - 1 - j, half - 1 : 0 : -1])
        for k in range(0, part, STRETCH):
            here = bins[k : k + STRETCH]
            here *= response(slice(j * part + k, j * part + k + len(here)))
        # Every M-th bin beside each other.
        combs[:, j * part // PARTS : (j + 1) * part // PARTS] = bins.reshape(-1, PARTS).T
    for r in range(0, PARTS, ROWS):
        combs[r : r + ROWS] = fft.ifft(combs[r : r + ROWS], axis=-1, overwrite_x=True)
    for columns, turned in _turns(length, part):
        block = fft.ifft(combs[:, columns] * turned.astype(table.dtype), axis=0)
        for r in range(PARTS):
            yield r * part + columns.start, block[r]


def _turns(length: int, count: int) -> Iterator[tuple[slice, NDArray[np.complex128]]]:
    """``exp(2 pi i r k / L)`` for all r < M, and k in stretches of 0 .. `count`."""
    r = np.arange(PARTS)[:, None]
    first = np.exp(2j * np.pi * r * np.arange(COLUMNS) / length)
    for start in range(0, count, COLUMNS):
        columns = slice(start, min(start + COLUMNS, count))
        turned = np.exp(2j * np.pi * r * start / length)
        yield columns, turned * first[:, : columns.stop - start]
