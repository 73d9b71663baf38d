"""What is written into the cells of a matrix: as much of per cents and counts as has room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QFont

from forcelab.gui.figures import text

__all__ = ["CellTexts", "counts_alone", "shares_first"]

#: Left free inside a cell on either side of its text.
PADDING = 2.0


@dataclass(frozen=True, eq=False, slots=True)
class CellTexts:
    """Texts of all cells, row after row.

    Parameters
    ----------
    face, below_face : QFont
        Of the first and of the second line.
    labels : list of str
        The first line.
    below : list of str, optional
        The second line; None where it has no room.
    """

    face: QFont
    labels: list[str]
    below_face: QFont
    below: list[str] | None = None


def counts_alone(counts: Sequence[str], cell: float) -> CellTexts:
    """Counts in the largest face that lets all of them into cells of a side; cut if none does."""
    room = cell - 2 * PADDING
    faces = (text.font(11), text.font(9), text.font(8))
    face = next((face for face in faces if text.widest(counts, face) <= room), faces[-1])
    return CellTexts(face, [text.elided(count, face, cell) for count in counts], face)


def shares_first(counts: Sequence[str], shares: NDArray[np.float64], cell: float) -> CellTexts:
    """Per cents, and the counts below them in cells that are large enough.

    A share of NaN, which is one of nothing, is a dash.
    """
    room = cell - 2 * PADDING
    large, medium, small = text.font(11), text.font(9), text.font(8)
    decimals = text.width("100.0 %", large) <= room
    fitting = (face for face in (large, medium) if text.width("100", face) <= room)
    face = next(fitting, small)
    labels = [
        "–" if np.isnan(share) else f"{100 * share:.1f} %" if decimals else f"{100 * share:.0f}"
        for share in shares.flat
    ]
    below = list(counts) if decimals and text.widest(counts, medium) <= room else None
    return CellTexts(face, labels, medium, below)
