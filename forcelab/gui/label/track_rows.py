"""The rows of the track panel: whose tracks, their visible spans and names, and their painting.

A stroke changes a few of ten thousand segments. To read all of them into arrays again, for each
view that draws or counts them, would take longer than everything else that a stroke does.

A track of ten thousand segments costs little more than its pixels: segments too narrow for a line
between them or for a texture are brought onto columns of pixels first, all at once.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QHelpEvent, QImage, QPainter, QPen, QPixmap, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QToolTip

from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.colormap import translucent
from forcelab.gui.figures.figure import Theme
from forcelab.gui.figures.tracks import LabelStyle, paint_track, plate
from forcelab.gui.label.track_gestures import hit
from forcelab.gui.theme import Colours, colours
from forcelab.gui.time_panel import TimePanel
from forcelab.labels import MODEL_PREFIX, Segment, Segments, is_model
from forcelab.project import Origin
from forcelab.segment_edits import splice
from forcelab.vocabulary import Vocabulary

#: How many tracks are kept: the coder's, whole and as far as it is seen, and some others'.
CACHED_TRACKS = 8
#: A track whose length differs by more than this is another track.
SAME_SECONDS = 1000

_start, _end, _action = attrgetter("start"), attrgetter("end"), attrgetter("action")


@dataclass(frozen=True, slots=True, eq=False)
class TrackSpans:
    """Segments as arrays.

    Parameters
    ----------
    starts, ends : ndarray of float64, shape (n,)
        In seconds.
    codes : ndarray of int64, shape (n,)
        The action of each, as an index into `names`.
    names : tuple of str
        All actions of the segments, and maybe others.
    """

    starts: NDArray[np.float64]
    ends: NDArray[np.float64]
    codes: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """How long all segments last together."""
        return float((self.ends - self.starts).sum())

    def totals(self) -> dict[str, tuple[int, float]]:
        """How many segments each action has, and how many seconds they last together."""
        counts = np.bincount(self.codes, minlength=len(self.names)).tolist()
        lasting = np.bincount(self.codes, self.ends - self.starts, len(self.names)).tolist()
        return {
            name: (count, seconds)
            for name, count, seconds in zip(self.names, counts, lasting, strict=True)
            if count
        }


_cache: list[tuple[Segments, TrackSpans]] = []


def track_spans(segments: Segments) -> TrackSpans:
    """A track's arrays; what it shares with a track that was asked for lately is not read again."""
    for place, (known, spans) in enumerate(_cache):
        if known is segments:
            _cache.insert(0, _cache.pop(place))
            return spans
    before = next((kept for kept in _cache if _related(kept[0], segments)), None)
    spans = _read(segments, ()) if before is None else _tracked_documents(*before, segments)
    _cache.insert(0, (segments, spans))
    del _cache[CACHED_TRACKS:]
    return spans


def _related(known: Segments, segments: Segments) -> bool:
    """Whether two tracks look like one before and after a stroke: they share an end."""
    if not known or not segments or abs(len(known) - len(segments)) > SAME_SECONDS:
        return False
    return known[0] is segments[0] or known[-1] is segments[-1]


def _read(segments: Segments, names: tuple[str, ...]) -> TrackSpans:
    """The arrays of a track, read segment by segment; `names` keep their codes."""
    count = len(segments)
    names = tuple(dict.fromkeys((*names, *map(_action, segments))))
    codes = {name: code for code, name in enumerate(names)}
    return TrackSpans(
        np.fromiter(map(_start, segments), np.float64, count),
        np.fromiter(map(_end, segments), np.float64, count),
        np.fromiter((codes[segment.action] for segment in segments), np.int64, count),
        names,
    )


def _tracked_documents(known: Segments, spans: TrackSpans, segments: Segments) -> TrackSpans:
    """The arrays of a track that came of another one by a stroke."""
    position, removed, inserted = splice(known, segments)
    new, tail = _read(inserted, spans.names), position + len(removed)
    return TrackSpans(
        np.concatenate([spans.starts[:position], new.starts, spans.starts[tail:]]),
        np.concatenate([spans.ends[:position], new.ends, spans.ends[tail:]]),
        np.concatenate([spans.codes[:position], new.codes, spans.codes[tail:]]),
        new.names,
    )


#: Stands where letters are left out.
LEFT_OUT = "…"
#: Letters beside that sign: with fewer, it would take the room of those that tell the name.
LEAST = 3


@lru_cache(maxsize=4096)
def fitting(name: str, names: tuple[str, ...], size: float, room: int) -> tuple[str, float]:
    """As much of a name as fits into so many pixels, and its width.

    A beginning that other names have too tells nothing: ``slip transition`` beside ``slip`` is
    ``slip tra…``, then ``s…tra``, then ``st``; never ``sl``.

    Parameters
    ----------
    name : str
        Of an action.
    names : tuple of str
        Of all actions that are shown.
    size : float
        Height of the letters in pixels.
    room : int
        In pixels.
    """
    face, whole = text.font(size), text.printable(name)
    if (wide := text.width(whole, face)) <= room:
        return whole, wide
    others = [text.printable(other) for other in names if other != name]
    common = max((_common(whole, other) for other in others), default=0)
    common += len(whole[common:]) - len(whole[common:].lstrip())
    short = text.elided(whole, face, room)
    kept = len(short) - len(LEFT_OUT)
    if kept < LEAST or (common >= LEAST and kept <= common):
        short = _joined(whole, common, face, room) if common >= LEAST else ""
    if not short:
        tokens = signs(tuple(dict.fromkeys((*names, name))))[name]
        short = next((sign for sign in tokens if text.width(sign, face) <= room), "")
    return short, text.width(short, face)


@lru_cache(maxsize=256)
def signs(names: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """Two letters and one letter of each name; none where another name has the same.

    Parameters
    ----------
    names : tuple of str
        An earlier name does not change its sign for a later one, unless that begins like it.
    """
    shown = {name: text.printable(name) for name in names}
    pairs: dict[str, str] = {}
    later = []
    for name, whole in shown.items():
        if whole[:2] not in pairs.values():
            pairs[name] = whole[:2]
        else:
            later.append(name)
    for name in later:
        whole = shown[name]
        tail = whole[max(_common(whole, o) for n, o in shown.items() if n != name) :]
        made = (whole[0] + letter for letter in (*tail, *whole[1:]) if not letter.isspace())
        pairs[name] = next((pair for pair in made if pair not in pairs.values()), "")
    firsts = [whole[:1] for whole in shown.values()]
    return {
        name: tuple(filter(None, (pairs[name], whole[:1] if firsts.count(whole[:1]) == 1 else "")))
        for name, whole in shown.items()
    }


def _joined(whole: str, common: int, face: QFont, room: int) -> str:
    """The first letter, and what follows after what other names begin with, too."""
    tail = whole[common:]
    for count in range(len(tail), 0, -1):
        short = f"{whole[0]}{LEFT_OUT}{tail[:count].rstrip()}"
        if text.width(short, face) <= room:
            return short
    return ""


def _common(one: str, other: str) -> int:
    """How many letters two names begin with alike."""
    count = 0
    for a, b in zip(one, other, strict=False):
        if a != b:
            break
        count += 1
    return count


#: Room that the mark takes at the end of a cell.
MARK = 14
#: Corners of the mark around its middle.
_DIAMOND = ((0.0, -3.5), (3.5, 0.0), (0.0, 3.5), (-3.5, 0.0))


def origin_text(origin: Origin | None) -> str:
    """Who proposed a segment, in words; nothing where no model did."""
    if origin is None:
        return ""
    if origin.changed:
        return f"proposed by {origin.proposer}, changed since"
    return f"proposed by {origin.proposer}"


def paint_proposed(painter: QPainter, box: QRectF, ink: str, changed: bool) -> None:
    """Mark at the end of a box that a model proposed a segment; hollow if it was changed since."""
    middle = QPointF(box.right() - MARK / 2, box.center().y())
    painter.save()
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(ink), 1.2))
    painter.setBrush(Qt.GlobalColor.transparent if changed else QColor(ink))
    painter.drawPolygon(QPolygonF([middle + QPointF(*corner) for corner in _DIAMOND]))
    painter.restore()


#: Room left of and right of a name inside its segment, in pixels.
PADDING = 4.0
#: Below this contrast to the ground (WCAG 2.2) a segment gets a line around it.
VISIBLE_WIDTH = 1.6
#: From what is dragged, and from the pointer's arrow, to the words about it, in pixels.
APART, ARROW = 8.0, 20.0
#: Segments narrower than this many pixels are drawn as columns of pixels.
NARROW = 3.0


def styles_of(vocabulary: Vocabulary, used: Iterable[str], theme: Theme) -> dict[str, LabelStyle]:
    """How each action is drawn; grey where another author's action is not in the vocabulary."""
    looks = {
        action.name: LabelStyle(action.key, QColor(action.colour), action.texture)
        for action in vocabulary
    }
    for name in used:
        if name not in looks:
            looks[name] = LabelStyle("", QColor(theme.muted))
    return looks


def visible(segments: Segments, start: float, end: float) -> Segments:
    """The segments that reach into ``[start, end]``, found in O(log n)."""
    first = bisect_right(segments, start, key=_end)
    last = bisect_left(segments, end, key=_start)
    return segments[first:last]


def crowded_runs(
    segments: Segments, start: float, pixel: float, count: int, widest: float
) -> tuple[Segments, NDArray[np.int64], tuple[str, ...]]:
    """Bring the narrow segments onto columns of pixels.

    A segment gets the columns whose middle it covers, but at least one. Where several crowd in one
    column, the action that is the rarest among the narrow segments is seen: it must not be lost.

    Parameters
    ----------
    segments : tuple of Segment
        In order, never overlapping.
    start : float
        The time at which the first column begins, in seconds.
    pixel : float
        Seconds in one column.
    count : int
        Number of columns.
    widest : float
        Segments shorter than this are narrow, in seconds.

    Returns
    -------
    wide : tuple of Segment
        The other segments.
    columns : ndarray of int64, shape (count,)
        What is seen in each column, as an index into the names; -1 where no narrow segment is.
    names : tuple of str
        The actions of the narrow segments, and maybe others.
    """
    columns = np.full(count, -1, dtype=np.int64)
    spans = track_spans(segments)
    is_narrow = spans.ends - spans.starts < widest
    if not is_narrow.any():
        return segments, columns, ()
    wide = tuple(segments[i] for i in np.flatnonzero(~is_narrow).tolist())
    codes = spans.codes[is_narrow]
    # Rare ones come last: of several values written to one place the last one stays.
    order = np.argsort(-np.bincount(codes)[codes], kind="stable")
    codes = codes[order]
    left, right = (
        (times[is_narrow][order] - start) / pixel for times in (spans.starts, spans.ends)
    )
    first, last = np.ceil(left - 0.5), np.ceil(right - 0.5)
    single = last <= first
    first[single] = np.floor((left[single] + right[single]) / 2)
    last[single] = first[single] + 1
    for step in range(int((last - first).max())):
        place = first + step
        there = (place < last) & (place >= 0) & (place < count)
        columns[place[there].astype(np.int64)] = codes[there]
    return wide, columns, spans.names


def paint_row(
    painter: QPainter,
    box: QRectF,
    axis: Axis,
    segments: Segments,
    *,
    vocabulary: Vocabulary,
    theme: Colours,
    size: float,
) -> None:
    """Draw one author's visible segments with the actions' names in them.

    Parameters
    ----------
    painter, box, axis
        As of :func:`forcelab.gui.figures.tracks.paint_track`.
    segments : tuple of Segment
        In order, never overlapping; more than can be told apart cost little.
    vocabulary : Vocabulary
        How actions look.
    theme : Colours
        The window's colours.
    size : float
        Height of the names in pixels.
    """
    device = painter.device()
    ratio = 1.0 if device is None else device.devicePixelRatio()
    count = max(1, round(box.width() * ratio))
    pixel = (axis.end - axis.start) / count
    wide, columns, names = crowded_runs(segments, axis.start, pixel, count, NARROW * ratio * pixel)
    looks = styles_of(vocabulary, (*names, *(s.action for s in wide)), theme)
    # Lines between segments lie on light colours in either theme.
    on_track = replace(theme, text=theme.on_unlabelled)
    edge = QPen(QColor(theme.on_unlabelled), 1.0)
    ground = QColor(theme.unlabelled)
    faint = {
        name for name, look in looks.items() if text.contrast(look.colour, ground) < VISIBLE_WIDTH
    }
    inks = {name: text.ink_on(look.colour) for name, look in looks.items()}
    face, known = text.font(size), vocabulary.names

    def inscribe(painter: QPainter, bar: QRectF, action: str, look: LabelStyle) -> None:
        width = bar.width()
        if action in faint:
            painter.setPen(edge)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawRect(bar.adjusted(0.5, 0.5, -0.5, -0.5))
        if width < 2 * PADDING or bar.height() < size:  # the letters would be cut
            return
        name, needed = fitting(action, known, size, int(width - 2 * PADDING))
        if name:
            middle = bar.center()
            line = QRectF(bar.left(), middle.y() - size * 0.7, width, size * 1.4)
            plate(painter, line.intersected(bar), needed + PADDING, look)
            text.draw_text(
                painter, middle.x() - needed / 2, middle.y(), name, face=face, ink=inks[action]
            )

    paint_track(painter, box, axis, wide, looks=looks, theme=on_track, inscribe=inscribe)
    if names:
        palette = [looks[name].colour.rgba() for name in names]
        painter.drawImage(box, _strip(columns, np.array([*palette, 0], dtype=np.uint32)))


def _strip(columns: NDArray[np.int64], palette: NDArray[np.uint32]) -> QImage:
    """One line of pixels in the colours of the palette; its last one stands for -1."""
    pixels = np.ascontiguousarray(palette[columns])
    image = QImage(
        pixels.data, len(pixels), 1, 4 * len(pixels), QImage.Format.Format_ARGB32_Premultiplied
    )
    return image.copy()  # of its own: the array's memory goes


def outline(painter: QPainter, bar: QRectF, theme: Colours) -> None:
    """Draw a frame that is seen on every action's colour: accent outside, white inside."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for inset, colour, thickness in ((0.0, theme.accent, 2.0), (2.0, "#ffffff", 1.0)):
        shrunk = inset + thickness / 2
        if bar.width() < 2 * shrunk + 1 and inset:
            continue
        pen = QPen(QColor(colour), thickness)
        pen.setJoinStyle(Qt.PenJoinStyle.MiterJoin)
        painter.setPen(pen)
        painter.drawRect(bar.adjusted(shrunk, shrunk, -shrunk, -shrunk))


def _plate(words: str) -> QRectF:
    """A small plate for a few words."""
    return QRectF(0, 0, text.width(words, text.font(10)) + 10, 16)


def plate_beside(bar: QRectF, words: str, pointer: float, within: QRectF) -> QPointF:
    """Where the middle of a plate is to be, that it covers neither a bar nor the pointer.

    Parameters
    ----------
    bar : QRectF
        What is dragged.
    words : str
        On the plate.
    pointer : float
        Where it is pointed at, in pixels.
    within : QRectF
        There is no room elsewhere. Where the bar leaves none either, the plate lies at the end
        that is further from the pointer.
    """
    wide, y = _plate(words).width(), bar.center().y()
    before = min(bar.left() - APART, pointer - APART) - wide / 2
    behind = max(bar.right() + APART, pointer + ARROW) + wide / 2
    fits_before = before - wide / 2 >= within.left()
    fits_behind = behind + wide / 2 <= within.right()
    at_the_end = abs(pointer - bar.right()) <= abs(pointer - bar.left())
    if fits_before and (at_the_end or not fits_behind):
        return QPointF(before, y)
    if fits_behind:
        return QPointF(behind, y)
    ends = within.left() + wide / 2, within.right() - wide / 2
    return QPointF(max(ends, key=lambda x: abs(x - pointer)), y)


def draw_plate(painter: QPainter, at: QPointF, words: str, theme: Colours, within: QRectF) -> None:
    """Write a few words on a small plate centred on a point, kept within a box."""
    face = text.font(10)
    room = _plate(words)
    room.moveCenter(at)
    room.moveLeft(max(min(room.left(), within.right() - room.width()), within.left()))
    painter.setPen(QPen(QColor(theme.frame), 1))
    painter.setBrush(QColor(theme.background))
    painter.drawRoundedRect(room.adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)
    middle = room.center()
    text.draw_text(
        painter, middle.x(), middle.y(), words, face=face, ink=QColor(theme.text), align=0.5
    )


#: Heights in pixels: of the coder's row at least and at most, of another author's row, of the
#: space between rows and around them, and of names in them.
OWN, OWN_MOST, OTHER, BETWEEN, AROUND = 34.0, 64.0, 18.0, 4.0, 5.0
OWN_NAME, OTHER_NAME = 12.0, 10.0
#: The same where room is short: the coder's row, and what the others share, in pixels. Two of them
#: keep their names; more become lower, down to a stripe of colours each.
OWN_SLIM, OTHERS_SLIM, STRIPE = 26.0, 30.0, 7.0
#: Stands before the names of models, that no prediction is taken for a coder's label.
MODEL = "\N{WHITE DIAMOND}"


@dataclass(frozen=True, slots=True)
class Row:
    """One author's track on screen."""

    author: str
    segments: Segments
    box: QRectF
    own: bool


class TrackRows(TimePanel):
    """One row for each author, to look at."""

    def __init__(self, document: Document) -> None:
        super().__init__(document)
        self.setAccessibleName("Tracks of the coders")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        # Other authors' rows stay the same while one paints: pictures of them are kept.
        self._kept: dict[str, tuple[tuple[object, ...], QPixmap]] = {}
        self._slim = False
        for signal in (document.tracks_changed, document.demonstration_changed):
            signal.connect(self._tracks_changed)
        for signal in (document.vocabulary_changed, document.author_changed):
            signal.connect(self.invalidate)
        document.selection_changed.connect(self._selection_changed)

    # Where things are

    def rows(self) -> tuple[Row, ...]:
        """The tracks from top to bottom."""
        document, plot = self.document, self.plot
        others = document.other_tracks
        least, pitch = OWN_SLIM if self._slim else OWN, OTHER + BETWEEN
        room = self.height() - 2 * AROUND
        if others and self._slim:
            pitch = min(max((room - least) / len(others), STRIPE), pitch)
        between = min(BETWEEN, pitch / 5)
        top, high = AROUND, min(max(room - len(others) * pitch, least), OWN_MOST)
        rows = [
            Row(
                document.author,
                document.editor.segments,
                QRectF(plot.left(), top, plot.width(), high),
                True,
            )
        ]
        for author, segments in others.items():
            top = rows[-1].box.bottom() + between
            box = QRectF(plot.left(), top, plot.width(), pitch - between)
            rows.append(Row(author, segments, box, False))
        return tuple(rows)

    def set_slim(self, slim: bool) -> None:
        """Whether rows become lower where there is no room for all of them."""
        if slim != self._slim:
            self._slim = slim
            self.updateGeometry()
            self.invalidate()

    def least_height(self, slim: bool) -> int:
        """How high the rows are at least, in pixels."""
        count = len(self.document.other_tracks)
        if not slim:
            return round(OWN + 2 * AROUND + count * (OTHER + BETWEEN))
        shared = max(min(count, 2) * OTHERS_SLIM / 2, count * STRIPE)
        return round(OWN_SLIM + 2 * AROUND + shared)

    def sizeHint(self) -> QSize:
        """Room for every row."""
        return QSize(900, self.least_height(slim=False) + 10)

    def minimumSizeHint(self) -> QSize:
        """Room for every row, the own one at its slimmest."""
        return QSize(self.GUTTER + 100, self.least_height(self._slim))

    def row_at(self, position: QPointF) -> Row | None:
        """The row under a pixel of the plot, if any."""
        if self.document.demonstration is None or not self.plot.contains(position):
            return None
        return next((r for r in self.rows() if r.box.top() <= position.y() <= r.box.bottom()), None)

    def event(self, event: QEvent) -> bool:
        """Say what is under the pointer: narrow segments have no room for their names."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            QToolTip.showText(event.globalPos(), self.words_at(QPointF(event.pos())), self)
            return True
        return super().event(event)

    def words_at(self, position: QPointF) -> str:
        """What is under a pixel in words: a segment, or left of the tracks an author."""
        if position.x() < self.plot.left():
            author = self.row_at(QPointF(self.plot.left(), position.y()))
            return "" if author is None else author.author
        row = self.row_at(position)
        if row is None:
            return ""
        time = self.time_at(position.x())
        index = hit(row.segments, time, self.seconds_per_pixel).index
        if index is None:
            return ""
        segment = row.segments[index]
        words = f"{row.author}: {_author_text(segment)}"
        proposed = origin_text(self.document.origins().get(segment)) if row.own else ""
        return f"{words}\n{proposed}" if proposed else words

    # Drawing

    def paint_content(self, painter: QPainter, plot: QRectF) -> None:
        """Draw every row."""
        painter.fillRect(plot, QColor(colours().background))
        for row in self.rows():
            if row.own:
                self._paint_row(painter, row, row.segments)
            else:
                self._paint_kept(painter, row)

    def gutter_shows(self) -> object:
        """Authors, and where their rows are."""
        return tuple((row.author, row.box.top(), row.box.height(), row.own) for row in self.rows())

    def paint_gutter(self, painter: QPainter, box: QRectF) -> None:
        """Draw the authors' names, those of models marked and in italics."""
        now = colours()
        for row in self.rows():
            if row.box.height() < OTHER_NAME:  # a stripe: its tooltip names it
                continue
            face = QFont(text.font(OWN_NAME if row.own else OTHER_NAME + 1, bold=row.own))
            face.setItalic(is_model(row.author))
            name = row.author
            if is_model(name):
                name = f"{MODEL} {name.removeprefix(MODEL_PREFIX)}"
            name = text.elided_name(name, face, box.width() - 14)
            ink = QColor(now.text if row.own else now.muted)
            y = row.box.center().y()
            text.draw_text(painter, box.right() - 8, y, name, face=face, ink=ink, align=1.0)

    def paint_overlay(self, painter: QPainter, plot: QRectF) -> None:
        """Draw the drag, the stroke and the selection over the coder's row."""
        document = self.document
        if document.demonstration is None:
            return
        painter.setClipRect(plot)
        own = self.rows()[0]
        self._paint_marked(painter, own)
        if document.stroke is not None:
            self._paint_stroke(painter, own)
        if document.view.hint is not None:
            word = self._word(document.view.hint.kind)
            # Beside the line, which is drawn over everything.
            x = self.x_at(document.view.hint.time) + text.width(word, text.font(10)) / 2 + 8
            draw_plate(painter, QPointF(x, own.box.bottom() - 10), word, colours(), plot)

    def _paint_invitation(self, painter: QPainter, box: QRectF) -> None:
        """Say how to begin, in a row that is empty."""
        words = (
            "Drag here to paint, or press the key of an action to begin."
            if self.document.vocabulary
            else "Drag here and choose an action, or add one under Actions."
        )
        face = text.font(OWN_NAME)
        words = text.elided(words, face, box.width() - 20)
        centre, ink = box.center(), translucent(colours().on_unlabelled, 0.72)
        text.draw_text(painter, centre.x(), centre.y(), words, face=face, ink=ink, align=0.5)

    def _marks_moved(self, *_: object) -> None:
        """Draw all rows anew: what stands beside a mark is as wide as it is worded."""
        self.update()

    def _paint_row(self, painter: QPainter, row: Row, segments: Segments) -> None:
        """Draw some segments in a row."""
        document = self.document
        seen = visible(segments, document.view.start, document.view.end)
        paint_row(
            painter,
            row.box,
            self.axis,
            seen,
            vocabulary=document.vocabulary,
            theme=colours(),
            size=OWN_NAME if row.own else OTHER_NAME,
        )

    def _paint_kept(self, painter: QPainter, row: Row) -> None:
        """Draw a row that changes seldom, from a picture as long as it is the same."""
        document, ratio = self.document, self.devicePixelRatioF()
        seen = (document.view.start, document.view.end, self.size(), ratio)
        now = (row, seen, document.vocabulary, colours())
        kept = self._kept.get(row.author)
        if kept is None or kept[0] != now:
            picture = QPixmap(self.size() * ratio)
            picture.setDevicePixelRatio(ratio)
            picture.fill(Qt.GlobalColor.transparent)
            with QPainter(picture) as drawing:
                self._paint_row(drawing, row, row.segments)
            self._kept[row.author] = kept = (now, picture)
        painter.drawPixmap(0, 0, kept[1])

    def _paint_marked(self, painter: QPainter, own: Row) -> None:
        """Draw a frame around the selected segment, or say how to make the first one."""
        if not own.segments and self.document.stroke is None:
            self._paint_invitation(painter, own.box)
        selected = self.document.selected
        if selected is not None and selected < len(own.segments):
            segment = own.segments[selected]
            outline(painter, self._bar(own.box, segment.start, segment.end), colours())

    def _paint_stroke(self, painter: QPainter, own: Row) -> None:
        """Draw what a key has begun, up to the cursor."""
        stroke = self.document.stroke
        assert stroke is not None
        start, end = sorted((stroke.start, self.document.view.cursor))
        if end <= start:
            return
        growing = (Segment(start, end, stroke.action),)
        bar = self._bar(own.box, start, end)
        painter.save()
        painter.setClipRect(bar, Qt.ClipOperation.IntersectClip)
        self._paint_row(painter, own, growing)
        painter.restore()
        outline(painter, bar, colours())

    def _bar(self, box: QRectF, start: float, end: float) -> QRectF:
        """Where a stretch lies in a row, at least so wide that its outline is seen."""
        # What is far outside is cut: its frame must be straight at any zoom.
        left, right = (
            min(max(self.x_at(time), box.left() - 10), box.right() + 10) for time in (start, end)
        )
        return QRectF(left, box.top(), max(right - left, 4.0), box.height())

    def _word(self, kind: str) -> str:
        """What a snap target is called on screen."""
        words = {
            "contact": "contact",
            "edge": "edge",
            "frame": "frame",
            "sample": "sample",
        }
        return words[kind]

    def _tracks_changed(self) -> None:
        """Draw anew, with room for every row."""
        others = self.document.other_tracks
        self._kept = {author: kept for author, kept in self._kept.items() if author in others}
        self.updateGeometry()
        self.invalidate()

    def _selection_changed(self) -> None:
        """Frame another segment, and tell screen readers which."""
        selected, segments = self.document.selected, self.document.editor.segments
        there = selected is not None and selected < len(segments)
        self.setAccessibleDescription(_author_text(segments[selected or 0]) if there else "")
        self.update()


def _author_text(segment: Segment) -> str:
    """A segment in words."""
    return f"{segment.action} {segment.start:.3f}–{segment.end:.3f} s ({segment.duration:.3f} s)"
