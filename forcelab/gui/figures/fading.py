"""Predictions of low probability are lighter: veils of the unlabelled colour over a bar."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter

from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.shades import translucent
from forcelab.labels import Segments, to_codes

if TYPE_CHECKING:
    from forcelab.recognition.probability_trace import Certainty

__all__ = ["Veil", "opacity", "paint_veils", "veil_at", "veils"]

#: From this probability on a prediction has its full colour; from that one down the lightest.
SURE, UNSURE = 0.95, 0.35
#: How much of the colour the thickest veil takes, and how many thicknesses there are: so few that
#: a bar is a few rectangles in an SVG, so many that no step is seen as an edge of a segment.
THICKEST, LEVELS = 0.72, 16
#: Width of what has one thickness, in pixels: narrower flicker cannot be read.
COLUMN = 5.0

_left = attrgetter("left")


@dataclass(frozen=True, slots=True)
class Veil:
    """From `left` to `right` in pixels a bar is lighter; `opacity` from 0, not, to 1, gone."""

    left: float
    right: float
    opacity: float


def opacity(probability: float) -> float:
    """How thick the veil over a prediction is."""
    return float(_levels(np.array([probability]))[0] * THICKEST / LEVELS)


def veils(certainty: Certainty, segments: Segments, axis: Axis, box: QRectF) -> tuple[Veil, ...]:
    """The veils over a bar, from left to right; none where a prediction is sure.

    Parameters
    ----------
    certainty : Certainty
        How probable each action is.
    segments : tuple of Segment
        What is predicted; an action that `certainty` does not know is not veiled.
    axis : Axis
        From seconds to pixels.
    box : QRectF
        The bar.
    """
    if not segments or not len(certainty.values) or box.width() <= 0:
        return ()
    actions = tuple(dict.fromkeys((*certainty.actions, *(s.action for s in segments))))
    edges = _edges(segments, axis, box)
    middles = _times((edges[1:] + edges[:-1]) / 2, axis)
    labelled = to_codes(segments, middles, actions) >= 0
    own = _own(certainty, to_codes(segments, certainty.times, actions))
    ticks = certainty.start + np.arange(len(own) + 1) / certainty.rate
    sums = np.interp(_times(edges, axis), ticks, np.concatenate([[0.0], np.cumsum(own)]))
    shares = np.diff(sums) / np.maximum(np.diff(_times(edges, axis)) * certainty.rate, 1e-12)
    levels = np.where(labelled, _levels(shares), 0)
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(levels)) + 1, [len(levels)]])
    return tuple(
        Veil(float(edges[first]), float(edges[last]), int(levels[first]) * THICKEST / LEVELS)
        for first, last in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)
        if levels[first]
    )


def paint_veils(
    painter: QPainter, box: QRectF, found: tuple[Veil, ...], unlabelled: QColor
) -> None:
    """Make a bar lighter."""
    alike: dict[float, list[QRectF]] = {}
    for veil in found:
        stretch = QRectF(veil.left, box.top(), veil.right - veil.left, box.height())
        alike.setdefault(veil.opacity, []).append(stretch)
    painter.setPen(Qt.PenStyle.NoPen)
    for share, stretches in alike.items():
        colour = translucent(unlabelled, share)
        painter.setBrush(colour)
        painter.drawRects(stretches)


def veil_at(found: tuple[Veil, ...], x: float) -> float:
    """How thick the veil at a pixel is; 0 where there is none."""
    i = bisect_right(found, x, key=_left) - 1
    return found[i].opacity if i >= 0 and x < found[i].right else 0.0


def _levels(probabilities: NDArray[np.float64]) -> NDArray[np.int64]:
    """Thickness of the veils, in steps."""
    shares = np.clip((SURE - probabilities) / (SURE - UNSURE), 0.0, 1.0)
    return np.rint(shares * LEVELS).astype(np.int64)


def _edges(segments: Segments, axis: Axis, box: QRectF) -> NDArray[np.float64]:
    """Pixels at which the thickness may change: a grid, and the edges of segments."""
    grid = np.append(np.arange(box.left(), box.right(), COLUMN), box.right())
    bounds = np.array([(s.start, s.end) for s in segments]).ravel()
    scale = (axis.finish - axis.begin) / (axis.end - axis.start)
    spots = axis.begin + (bounds - axis.start) * scale
    return np.unique(np.clip(np.concatenate([grid, spots]), box.left(), box.right()))


def _times(pixels: NDArray[np.float64], axis: Axis) -> NDArray[np.float64]:
    """Seconds of pixels."""
    share = (pixels - axis.begin) / (axis.finish - axis.begin)
    return np.asarray(axis.start + share * (axis.end - axis.start))


def _own(certainty: Certainty, codes: NDArray[np.int64]) -> NDArray[np.float64]:
    """The probability in each bin of what is predicted there; 1 where nothing is known of it."""
    known = (codes >= 0) & (codes < len(certainty.actions))
    own = np.ones(len(codes))
    own[known] = (
        certainty.values[np.flatnonzero(known), codes[known]] / np.iinfo(certainty.values.dtype).max
    )
    return own
