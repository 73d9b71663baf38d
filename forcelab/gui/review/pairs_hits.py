"""What is under the pointer among the timeline pairs, and what is told of it."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from operator import attrgetter

import numpy as np
from PySide6.QtCore import QPointF, QRectF

from forcelab.gui.figures.marks import mark_box
from forcelab.gui.review.pairs_layout import Layout
from forcelab.gui.review.pairs_rows import Entry
from forcelab.labels import Segment, Segments
from forcelab.review.differences import Interval, action_over

__all__ = ["Hit", "described", "hit", "place_of", "told"]


#: How far from a mark it is still meant, in pixels.
REACH = 3.0
#: How many actions a tooltip tells the probability of.
MOST = 3

_start = attrgetter("start")


@dataclass(frozen=True)
class Hit:
    """What is at a point of a row.

    Parameters
    ----------
    row : int
    time : float or None
        In seconds; None beside the bars.
    what : Segment, Place or None
    author : str
        Whose bar it is, as it is called on screen.
    """

    row: int
    time: float | None = None
    what: Segment | Interval | None = None
    author: str = ""


def hit(layout: Layout, point: QPointF) -> Hit | None:
    """What is at a point among all rows; None below and between them."""
    row = layout.row_at(point.y())
    if row is None:
        return None
    entry, boxes = layout.entries[row], layout.boxes(row)
    axis = layout.axis(entry)
    x, y = point.x(), point.y() - layout.tops[row]
    if not boxes.predicted.left() - REACH <= x <= boxes.predicted.right() + REACH:
        return Hit(row)
    time = min(max(axis.value(x), entry.reviewed.start), entry.reviewed.end)
    if boxes.band.top() <= y < boxes.band.bottom():
        distances = [(_distance(mark_box(boxes.band, axis, m), x), m) for m in entry.marks]
        distance, mark = min(distances, key=lambda pair: pair[0], default=(REACH + 1, None))
        return Hit(row, time, mark if distance <= REACH else None)
    predicted = entry.reviewed.predicted
    bars: list[tuple[str, QRectF, Segments]] = [
        (layout.names[0], boxes.human, entry.human or ()),
        (layout.names[1], boxes.predicted, predicted),
    ]
    for lane, box in zip(entry.lanes, boxes.lanes, strict=True):
        bars.append((lane.caption, box, lane.segments))
    for author, box, segments in bars:
        if box.top() <= y < box.bottom():
            return Hit(row, time, at(segments, time), author)
    return Hit(row, time)


def at(segments: Sequence[Segment], time: float) -> Segment | None:
    """The segment that covers a time."""
    i = bisect_right(segments, time, key=_start) - 1
    return segments[i] if i >= 0 and time < segments[i].end else None


def place_of(entry: Entry, what: Segment | Interval) -> Interval:
    """A segment or a disagreement as a place: what each sees in most of it, and how sure."""
    predicted = action_over(entry.reviewed.predicted, what.start, what.end)
    human = action_over(entry.human or (), what.start, what.end)
    if isinstance(what, Interval):
        human, predicted = what.human, what.predicted
    certainty, confidence = entry.reviewed.certainty, None
    if certainty is not None and predicted is not None:
        confidence = certainty.of_action(predicted, what.start, what.end)
    return Interval(entry.id, what.start, what.end, human, predicted, confidence)


def told(entry: Entry, found: Hit) -> str:
    """What a tooltip says, as rich text without anything of the names taken for markup."""
    lines = [f"<b>{escape(entry.reviewed.name)}</b>"]
    if found.time is None:
        return "<br>".join([*lines, escape(described(entry))])
    what = found.what
    if isinstance(what, Interval):
        lines.append(escape(said(what)))
    elif isinstance(what, Segment):
        lines.append(escape(f"{found.author}: {what.action}, {_stretch(what.start, what.end)}"))
    else:
        lines.append(f"{found.time:.3f} s")
    certainty = entry.reviewed.certainty
    if certainty is not None:
        start, end = (what.start, what.end) if what is not None else (found.time, found.time)
        means = certainty.mean(start, end)
        best = np.argsort(-means, kind="stable")[:MOST]
        lines += [f"{100 * means[i]:.0f} %&nbsp; {escape(certainty.actions[i])}" for i in best]
    return "<br>".join(lines)


def said(mark: Interval) -> str:
    """A disagreement in words."""
    predicted = mark.predicted
    if predicted is None:
        predicted = "unlabelled"
    return f"{_stretch(mark.start, mark.end)}: human {mark.human}, predicted {predicted}"


def described(entry: Entry, mark: int | None = None) -> str:
    """A row in words, for screen readers and tooltips; with a disagreement that has the focus."""
    share = "" if entry.share is None else f"{100 * entry.share:.1f} %"
    if entry.human is None:
        mean = f"proposal, mean probability {share}"
        return mean if share else "proposal"
    words = [f"accuracy {share}"] if share else []
    if entry.edited:
        words.append("edited since the run")
    count = len(entry.marks)
    words.append(f"disagreements: {count}")
    if mark is not None:
        words.append(f"number {mark + 1}, {said(entry.marks[mark])}")
    return "; ".join(words)


def _stretch(start: float, end: float) -> str:
    """A stretch in words."""
    return f"{start:.3f}\N{EN DASH}{end:.3f} s"


def _distance(box: QRectF, x: float) -> float:
    """Pixels from a mark; of two that cover the point the narrower is the nearer."""
    if box.left() <= x <= box.right():
        return box.width() / 1e6
    return min(abs(box.left() - x), abs(box.right() - x))
