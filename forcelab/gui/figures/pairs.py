"""One timeline pair, drawn alike in figures and in the window."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QPainter

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.canvas import Theme
from forcelab.gui.figures.fading import veils
from forcelab.gui.figures.marks import paint_marks
from forcelab.gui.figures.tracks import Look, paint_track
from forcelab.labels import Segments

if TYPE_CHECKING:
    from forcelab.recognition.probability_trace import Certainty
    from forcelab.review.differences import Difference

__all__ = ["CAPTION", "Lane", "Measures", "Pair", "PairBoxes", "captions", "paint_pair"]

#: Height of the captions of bars, in pixels.
CAPTION = 9.0


@dataclass(frozen=True)
class Lane:
    """A further track below a pair.

    Parameters
    ----------
    caption : str
        What it is, such as ``"raw"`` or a coder's name.
    segments : tuple of Segment
        In order, never overlapping.
    certain : bool
        Whether it is a prediction, which is lighter where it is less probable.
    """

    caption: str
    segments: Segments
    certain: bool = False


@dataclass(frozen=True)
class Pair:
    """One demonstration's two tracks, and what is shown beside them.

    Parameters
    ----------
    name : str
        The demonstration's.
    human, predicted : tuple of Segment
        In order, never overlapping. What lies outside ``[start, end)`` is not drawn. `human` is
        None where only the prediction is drawn.
    start, end : float
        The demonstration's, in seconds, finite, ``start < end``.
    note : str
        Said at the right, such as ``"72.0 %"``.
    lanes : tuple of Lane
        Further tracks, drawn below the pair from top to bottom.
    certainty : Certainty, optional
        Predictions are lighter where it is low.
    marks : tuple of Difference, optional
        Drawn between the two bars, for which room is left then; None for no room.

    Raises
    ------
    InputError
        If the demonstration is empty or runs backwards.
    """

    name: str
    human: Segments | None
    predicted: Segments
    start: float
    end: float
    note: str = ""
    lanes: tuple[Lane, ...] = ()
    certainty: Certainty | None = None
    marks: tuple[Difference, ...] | None = None

    def __post_init__(self) -> None:
        finite = math.isfinite(self.start) and math.isfinite(self.end)
        if not finite or not self.start < self.end:
            raise InputError(
                f"The timeline of '{self.name}' must end after it starts; it goes from "
                f"{self.start} s to {self.end} s."
            )

    @property
    def tracks(self) -> tuple[Segments, ...]:
        """All that is drawn, the human's first."""
        return (self.human or (), self.predicted, *(lane.segments for lane in self.lanes))


@dataclass(frozen=True, slots=True)
class PairBoxes:
    """Where the parts of a pair lie, in pixels; `human` and `band` are flat where there is none."""

    human: QRectF
    band: QRectF
    predicted: QRectF
    lanes: tuple[QRectF, ...] = ()


@dataclass(frozen=True, slots=True)
class Measures:
    """Heights in pixels: of bars, the gap and the band of marks between them, and of lanes."""

    bar: float = 13.0
    thin: float = 2.0
    band: float = 8.0
    lane: float = 9.0
    apart: float = 3.0

    def height(self, pair: Pair) -> float:
        """From the top of a pair's first bar to the bottom of its last one."""
        main = self.bar
        if pair.human is not None:
            main += self.bar + (self.thin if pair.marks is None else self.band)
        return main + len(pair.lanes) * (self.lane + self.apart)

    def boxes(self, pair: Pair, axis: Axis, top: float) -> PairBoxes:
        """Where everything of a pair lies whose first bar begins at `top`."""
        left, right = axis.at(pair.start), axis.at(pair.end)

        def box(top: float, height: float) -> QRectF:
            return QRectF(left, top, right - left, height)

        bar, between = self.bar, self.thin if pair.marks is None else self.band
        if pair.human is None:
            bar = between = 0.0
        below = top + bar + between + self.bar
        lanes = (
            box(below + self.apart + i * (self.lane + self.apart), self.lane)
            for i in range(len(pair.lanes))
        )
        predicted = box(top + bar + between, self.bar)
        return PairBoxes(box(top, bar), box(top + bar, between), predicted, tuple(lanes))


def paint_pair(
    painter: QPainter,
    boxes: PairBoxes,
    axis: Axis,
    pair: Pair,
    *,
    looks: Mapping[str, Look],
    theme: Theme,
    mark: QColor,
) -> None:
    """Draw a pair's bars, lanes and marks.

    Parameters
    ----------
    painter : QPainter
    boxes : PairBoxes
        As of :meth:`Measures.boxes`.
    axis : Axis
        From seconds to pixels.
    pair : Pair
    looks : mapping of str to Look
        One for each action.
    theme : Theme
        Colours of unlabelled time, frames and lines.
    mark : QColor
        Of disagreements.
    """
    if pair.human is not None:
        paint_track(painter, boxes.human, axis, pair.human, looks=looks, theme=theme)
        paint_marks(painter, boxes.band, axis, pair.marks or (), mark)
    tracks = [(boxes.predicted, pair.predicted, True)]
    tracks += [
        (box, lane.segments, lane.certain)
        for box, lane in zip(boxes.lanes, pair.lanes, strict=True)
    ]
    for box, segments, certain in tracks:
        fading = (
            veils(pair.certainty, segments, axis, box)
            if certain and pair.certainty is not None
            else ()
        )
        paint_track(painter, box, axis, segments, looks=looks, theme=theme, veils=fading)


def captions(
    boxes: PairBoxes, pair: Pair, human: str = "human", predicted: str = "predicted"
) -> Iterator[tuple[float, str]]:
    """What the bars are called, and at which height that stands; nothing for a mere pair."""
    if not pair.lanes:
        return
    if pair.human is not None:
        yield boxes.human.center().y(), text.shown(human)
    yield boxes.predicted.center().y(), text.shown(predicted)
    for box, lane in zip(boxes.lanes, pair.lanes, strict=True):
        yield box.center().y(), text.shown(lane.caption)
