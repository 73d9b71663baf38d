"""The rows below the live channels: what is marked by hand, and what a recogniser says."""

from __future__ import annotations

import math
from dataclasses import replace

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QPainter

from forcelab.gui.capture.session import Session
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.fading import Veil, veils
from forcelab.gui.figures.shades import translucent
from forcelab.gui.figures.tracks import Look, paint_track
from forcelab.gui.label.swatches import look_of
from forcelab.gui.theme import colours
from forcelab.labels import Segment

__all__ = ["ROW", "paint_rows", "rows_height"]

#: Height of a row in pixels.
ROW = 20


def rows_height(session: Session) -> int:
    """Pixels of all rows: the prediction has one only while a recogniser is chosen."""
    return ROW * (2 if session.recognising.choice is not None else 1)


def paint_rows(painter: QPainter, session: Session, plot: QRectF, axis: Axis, now: float) -> None:
    """Draw the rows below a plot.

    Parameters
    ----------
    painter : QPainter
    session : Session
    plot : QRectF
        Of the channels.
    axis : Axis
        From seconds of the host's monotonic clock to pixels.
    now : float
        Seconds of that clock.
    """
    marked = session.marks.track(now, axis.start)
    box = QRectF(plot.left(), plot.bottom() + 1, plot.width(), ROW - 2)
    _paint(painter, session, box, axis, marked, ())
    _name(painter, box, "Marks")
    recognising = session.recognising
    if recognising.choice is None:
        return
    box = box.translated(0, ROW)
    glimpse = recognising.glimpse
    if glimpse is None:
        _paint(painter, session, box, axis, [], ())
    else:
        seen = [one for one in glimpse.segments if one.end > axis.start]
        fading: tuple[Veil, ...] = ()
        if glimpse.certainty is not None:
            fading = veils(glimpse.certainty, tuple(seen), axis, box)
        _paint(painter, session, box, axis, seen, fading)
        recognising.painted(glimpse.until)
        until = glimpse.until
        if math.isnan(until) and seen:  # begun anew: what was said before stays
            until = seen[-1].end
        _paint_undecided(painter, box, axis, until)
    _name(painter, box, "Predicted")


def _paint(
    painter: QPainter,
    session: Session,
    box: QRectF,
    axis: Axis,
    segments: list[Segment],
    fading: tuple[Veil, ...],
) -> None:
    """One row."""
    vocabulary = session.seen_vocabulary
    looks: dict[str, Look] = {s.action: look_of(vocabulary, s.action) for s in segments}
    theme = replace(colours(), text=colours().on_unlabelled)
    painter.save()
    painter.setClipRect(box)
    paint_track(painter, box, axis, segments, looks=looks, theme=theme, veils=fading)
    painter.restore()


def _paint_undecided(painter: QPainter, box: QRectF, axis: Axis, until: float) -> None:
    """Hatch what no label can be known of yet: it is not unlabelled."""
    left = box.left() if math.isnan(until) else max(axis.at(until), box.left())
    if left < box.right():
        rest = QRectF(left, box.top() + 1, box.right() - left, box.height() - 2)
        painter.fillRect(rest, QColor(colours().panel))
        ink = translucent(colours().muted, 0.5)
        painter.fillRect(rest, QBrush(ink, Qt.BrushStyle.BDiagPattern))


def _name(painter: QPainter, box: QRectF, name: str) -> None:
    """What a row shows, in the gutter."""
    painter.setPen(QColor(colours().muted))
    room = QRectF(8, box.top(), box.left() - 14, box.height())
    painter.drawText(room, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, name)
