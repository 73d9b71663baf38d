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


def spectrum(ring: Callable[[NDArray[np.int64]], Real], length: int, kind: Any) -> list[Complex]:
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
    list of ndarray, shape (P / 2 + 1,) each
        ``X[j P + k]`` for all j < M; those for k above P / 2 are conjugates of others, as the
        ring is real.
    """
    index = PARTS * np.arange(length // PARTS)
    table: list[Complex] = []
    for r in range(0, PARTS, ROWS):
        rows = np.stack([ring(index + i) for i in range(r, r + ROWS)])
        table += [row.astype(kind) for row in fft.rfft(rows, axis=-1)]
    for columns, turned in _turns(length, 0, len(table[0])):
        part = np.stack([row[columns] for row in table])
        for row, found in zip(table, fft.fft(part * np.conj(turned), axis=0), strict=True):
            row[columns] = found
    return table


def from_spectrum(
    table: list[Complex], length: int, response: Callable[[slice], Complex]
) -> Iterator[tuple[int, Complex]]:
    """The ring of a spectrum times a response, in pieces.

    Parameters
    ----------
    table : list of ndarray
        From :func:`spectrum`. It is used up, and is empty in the end: both it and what is made of
        it would take a third more memory.
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
    part, width = length // PARTS, length // PARTS**2
    half, kind = part // 2, table[0].dtype
    blocks: dict[int, Complex] = {}
    for j in range(PARTS // 2):
        first, last = table.pop(0), table.pop()  # each other's mirror images
        for place, own, mirrored in ((j, first, last), (PARTS - 1 - j, last, first)):
            bins = np.empty(part, dtype=kind)
            bins[: half + 1] = own
            bins[half + 1 :] = np.conj(mirrored[half - 1 : 0 : -1])
            for k in range(0, part, STRETCH):
                here = bins[k : k + STRETCH]
                here *= response(slice(place * part + k, place * part + k + len(here)))
            # Every M-th bin beside each other.
            blocks[place] = bins.reshape(-1, PARTS).T.copy()
    for r in range(0, PARTS, ROWS):
        rows = np.concatenate([blocks[j][r : r + ROWS] for j in range(PARTS)], axis=1)
        rows = fft.ifft(rows, axis=-1, overwrite_x=True)
        for j in range(PARTS):
            blocks[j][r : r + ROWS] = rows[:, j * width : (j + 1) * width]
    for j in range(PARTS):
        for columns, turned in _turns(length, j * width, (j + 1) * width):
            within = slice(columns.start - j * width, columns.stop - j * width)
            block = fft.ifft(blocks[j][:, within] * turned.astype(kind), axis=0)
            for r in range(PARTS):
                yield r * part + columns.start, block[r]


def _turns(length: int, begin: int, end: int) -> Iterator[tuple[slice, NDArray[np.complex128]]]:
    """``exp(2 pi i r k / L)`` for all r < M, and k in stretches of `begin` .. `end`."""
    r = np.arange(PARTS)[:, None]
    first = np.exp(2j * np.pi * r * np.arange(min(COLUMNS, end - begin)) / length)
    for start in range(begin, end, COLUMNS):
        columns = slice(start, min(start + COLUMNS, end))
        turned = np.exp(2j * np.pi * r * start / length)
        yield columns, turned * first[:, : columns.stop - start]
