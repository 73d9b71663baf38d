"""Timeline pairs: what the coder labelled above what the recogniser predicted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import TYPE_CHECKING

from PySide6.QtCore import QLineF, QRectF, QSizeF
from PySide6.QtGui import QColor, QPainter

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, draw_bottom, draw_grid
from forcelab.gui.figures.figure import LIGHT, MARGIN, REMARK_LINE, Figure, Theme
from forcelab.gui.figures.tracks import (
    LabelStyle,
    Legend,
    fade_overlays,
    paint_differences,
    paint_track,
    styles_in_order,
)
from forcelab.labels import Segments
from forcelab.vocabulary import Vocabulary

if TYPE_CHECKING:
    from forcelab.recognition.probabilities import ProbabilityTrace
    from forcelab.review.differences import Difference


#: Height of the captions of bars, in pixels.
CAPTION = 9.0


@dataclass(frozen=True)
class PairRow:
    """A further track below a pair, with its caption.

    `certain` tracks are predictions, which are lighter where they are less probable.
    """

    caption: str
    segments: Segments
    certain: bool = False


@dataclass(frozen=True)
class Pair:
    """One demonstration's human and predicted track, and what is shown beside them.

    Segments outside ``[start, end)`` (s) are not drawn. `human` is None where only the prediction
    is drawn; `note` stands at the right, such as ``"72.0 %"``; `lanes` are drawn below the pair.
    Predictions are lighter where `probability_trace` is low. `marks` are drawn between the two
    bars, for which room is left then; None for no room.
    """

    name: str
    human: Segments | None
    predicted: Segments
    start: float
    end: float
    note: str = ""
    lanes: tuple[PairRow, ...] = ()
    probability_trace: ProbabilityTrace | None = None
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
        """All drawn tracks, the human's first."""
        return (self.human or (), self.predicted, *(lane.segments for lane in self.lanes))


@dataclass(frozen=True, slots=True)
class PairBoxes:
    """Where the parts of a pair lie, in pixels; `human` and `band` are flat where there is none."""

    human: QRectF
    band: QRectF
    predicted: QRectF
    lanes: tuple[QRectF, ...] = ()


@dataclass(frozen=True, slots=True)
class PairGeometry:
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
        """Where the parts of a pair lie whose first bar begins at `top`."""
        left, right = axis.at(pair.start), axis.at(pair.end)

        def box(top: float, height: float) -> QRectF:
            return QRectF(left, top, right - left, height)

        bar, band = self.bar, self.thin if pair.marks is None else self.band
        if pair.human is None:
            bar = band = 0.0
        below = top + bar + band + self.bar
        lanes = (
            box(below + self.apart + i * (self.lane + self.apart), self.lane)
            for i in range(len(pair.lanes))
        )
        predicted = box(top + bar + band, self.bar)
        return PairBoxes(box(top, bar), box(top + bar, band), predicted, tuple(lanes))


def paint_pair(
    painter: QPainter,
    boxes: PairBoxes,
    axis: Axis,
    pair: Pair,
    *,
    styles: Mapping[str, LabelStyle],
    theme: Theme,
    mark: QColor,
) -> None:
    """Draw a pair's bars, lanes and marks; `mark` is the colour of disagreements."""
    if pair.human is not None:
        paint_track(painter, boxes.human, axis, pair.human, styles=styles, theme=theme)
        paint_differences(painter, boxes.band, axis, pair.marks or (), mark)
    tracks = [(boxes.predicted, pair.predicted, True)]
    tracks += [
        (box, lane.segments, lane.certain)
        for box, lane in zip(boxes.lanes, pair.lanes, strict=True)
    ]
    for box, segments, certain in tracks:
        fading = (
            fade_overlays(pair.probability_trace, segments, axis, box)
            if certain and pair.probability_trace is not None
            else ()
        )
        paint_track(painter, box, axis, segments, styles=styles, theme=theme, fades=fading)


def captions(pair: Pair) -> list[str]:
    """The captions of the bars from the top; none for a pair without further lanes."""
    if not pair.lanes:
        return []
    bars = [] if pair.human is None else ["human"]
    return [*bars, "predicted", *(text.printable(lane.caption) for lane in pair.lanes)]


def paint_captions(
    painter: QPainter, boxes: PairBoxes, pair: Pair, right: float, room: float, ink: QColor | str
) -> None:
    """Write the captions beside their bars, up to a pixel at their right."""
    face = text.font(CAPTION)
    bars = [box for box in (boxes.human, boxes.predicted, *boxes.lanes) if box.height()]
    for box, caption in zip(bars, captions(pair), strict=False):
        short = text.elided(caption, face, room)
        text.draw_text(painter, right, box.center().y(), short, face=face, ink=ink, align=1.0)


MEASURES = PairGeometry()
#: Between one pair and the next.
ROW_GAP = 9.0
#: Names and notes longer than this are elided.
NAME_ROOM = 170.0
NOTE_ROOM = 150.0
CAPTION_ROOM = 90.0
#: From the last row to the bottom: marks, numbers and title of the time axis.
AXIS_ROOM = 36.0
#: Figures higher than this have a time axis at the top as well.
TALL = 900.0
KEY = "Upper bar: human. Lower bar: predicted. White: unlabelled."
NOTES = "At the right: accuracy after the filters."
STRETCHED_NOTE = "Each over the whole width."
LIGHTER = "Lighter: less probable."
BETWEEN = "Between: bar where they differ, line where nothing was predicted."
#: Of the marks where human and model differ.
MARK = "#b3261e"


@dataclass(frozen=True)
class TimelinePairs(Figure):
    """Human and predicted timelines in pairs, on one time axis.

    The vocabulary has every drawn action; the legend begins with `actions`, the others follow in
    the order of their occurrence, human tracks first. The height follows from the number of pairs.
    `stretched` pairs take the whole width each, without a time axis.
    """

    title: str
    pairs: tuple[Pair, ...]
    vocabulary: Vocabulary
    actions: tuple[str, ...] = ()
    theme: Theme = LIGHT
    width: float = 960.0
    stretched: bool = False

    def __post_init__(self) -> None:
        if not self.pairs:
            raise InputError("There is no demonstration to draw; choose at least one.")
        tracks = [pair.human or () for pair in self.pairs]
        tracks += [track for pair in self.pairs for track in pair.tracks[1:]]
        drawn = (segment.action for track in tracks for segment in track)
        actions = tuple(dict.fromkeys((*self.actions, *drawn)))
        object.__setattr__(self, "actions", actions)
        for action in actions:
            if action not in self.vocabulary:
                raise InputError(f"The vocabulary lacks the action '{action}'; add it.")

    @property
    def size(self) -> QSizeF:
        return QSizeF(self.width, self._rows_end + AXIS_ROOM + MARGIN)

    @cached_property
    def axis(self) -> Axis:
        start = min(pair.start for pair in self.pairs)
        end = max(pair.end for pair in self.pairs)
        names = [text.printable(pair.name) for pair in self.pairs]
        left = MARGIN + min(text.widest(names, text.font()), NAME_ROOM) + 10 + self._caption_room
        notes = [text.printable(pair.note) for pair in self.pairs]
        note_room = min(text.widest(notes, text.font(10)), NOTE_ROOM)
        right = self.width - MARGIN - (note_room + 10 if note_room else 0.0)
        return Axis(start, end, left, right)

    def boxes(self, row: int) -> PairBoxes:
        return MEASURES.boxes(self.pairs[row], self.axis_of(row), self._tops[row])

    def axis_of(self, row: int) -> Axis:
        """A pair's time axis: that of all, unless each is stretched."""
        if not self.stretched:
            return self.axis
        return Axis(self.pairs[row].start, self.pairs[row].end, self.axis.begin, self.axis.finish)

    def paint(self, painter: QPainter) -> None:
        """Draw title, legend, pairs and time axis."""
        ink, muted, small = self.theme.text, self.theme.muted, text.font(10)
        self.paint_title(painter, *self._key)
        self._legend.paint(painter, MARGIN, self._legend_top, self.theme)
        axis = self.axis
        if not self.stretched:
            self._paint_grid(painter, axis)
        for row, pair in enumerate(self.pairs):
            boxes = self.boxes(row)
            paint_pair(
                painter,
                boxes,
                self.axis_of(row),
                pair,
                styles=self._action_styles,
                theme=self.theme,
                mark=QColor(MARK),
            )
            middle = (boxes.human.top() + boxes.predicted.bottom()) / 2
            edge = axis.begin - 10 - self._caption_room
            name = text.elided_name(pair.name, text.font(), edge - MARGIN)
            text.draw_text(painter, edge, middle, name, face=text.font(), ink=ink, align=1.0)
            paint_captions(painter, boxes, pair, axis.begin - 6, CAPTION_ROOM, muted)
            note, right = text.elided(pair.note, small, NOTE_ROOM), self.width - MARGIN
            text.draw_text(painter, right, middle, note, face=small, ink=muted, align=1.0)
        if self.stretched:
            return
        draw_bottom(painter, axis, self._rows_end, "time (s)", self.theme)
        if self._is_tall:
            draw_bottom(painter, axis, self._rows_top - 8, "time (s)", self.theme, above=True)

    @cached_property
    def _key(self) -> list[str]:
        """The explanation of the figure, in one line or two."""
        first = [KEY, STRETCHED_NOTE] if self.stretched else [KEY]
        if any(pair.note for pair in self.pairs):
            first.append(NOTES)
        second = [LIGHTER] if any(pair.probability_trace is not None for pair in self.pairs) else []
        if any(pair.marks is not None for pair in self.pairs):
            second.append(BETWEEN)
        return [" ".join(line) for line in (first, second) if line]

    @property
    def _legend_top(self) -> float:
        """Where the legend begins, in pixels."""
        return MARGIN + 40 + (len(self._key) - 1) * REMARK_LINE

    @cached_property
    def _action_styles(self) -> dict[str, LabelStyle]:
        return styles_in_order(self.actions, self.vocabulary)

    @cached_property
    def _legend(self) -> Legend:
        return Legend(self._action_styles, self.width - 2 * MARGIN)

    @cached_property
    def _caption_room(self) -> float:
        """Width of the column of captions between names and bars."""
        texts = [caption for pair in self.pairs for caption in captions(pair)]
        if not texts:
            return 0.0
        return min(text.widest(texts, text.font(CAPTION)), CAPTION_ROOM) + 14

    @cached_property
    def _tops(self) -> list[float]:
        """Upper edge of each pair, and of one that came after the last, in pixels."""
        heights = (MEASURES.height(pair) + ROW_GAP for pair in self.pairs)
        return list(accumulate(heights, initial=self._rows_top))

    @cached_property
    def _is_tall(self) -> bool:
        """Whether the figure needs a second time axis at the top."""
        return sum(MEASURES.height(pair) + ROW_GAP for pair in self.pairs) > TALL

    @cached_property
    def _rows_top(self) -> float:
        """Upper edge of the first row, in pixels."""
        above = AXIS_ROOM + 8 if self._is_tall and not self.stretched else 0
        return self._legend_top + self._legend.height + 12 + above

    @property
    def _rows_end(self) -> float:
        """Where the time axis lies, in pixels."""
        return self._tops[-1] - ROW_GAP + 8

    def _paint_grid(self, painter: QPainter, axis: Axis) -> None:
        top, bottom = self._rows_top - 8, self._rows_end
        marks = axis.marks(upright=False)
        grid = (QLineF(axis.at(v), top, axis.at(v), bottom) for v, _ in marks)
        draw_grid(painter, grid, self.theme)
