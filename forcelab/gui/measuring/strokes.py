"""From the key that ends a stroke to the end of the paint that shows it, the store included."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Generator
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractItemView, QApplication, QWidget

from forcelab.errors import InputError
from forcelab.gui.measuring.stage import Lateness, Painted, rest, settle, shown
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.labels import Segments
from forcelab.measure.latency import Bound, Latency

__all__ = ["measuring_strokes"]

NAME, AFTER = "key to paint", "event loop's lateness after it"
PAINT, LATE = Bound("p95", 0.016), Bound("worst", 0.050)
#: Seconds in which the event loop is watched after strokes: what is put off is done by then.
AFTERWARDS = 1.0
#: How long a painted action lasts, in seconds: as the actions of the sample project do.
LASTING = (0.2, 1.5)


def measuring_strokes(
    project: Path, *, segments: int, times: int, size: tuple[int, int]
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Paint by keys on a track of many segments; see :mod:`forcelab.gui.measuring`.

    Parameters
    ----------
    project : Path
        Its first demonstration has so many `segments`.
    segments : int
    times : int
        Strokes at each zoom.
    size : tuple of int
        Of the window, in pixels.
    """
    rows = []
    with shown(project, size) as window:
        whole = window.document.bounds
        looks = {"all visible": whole[1] - whole[0], "10 s visible": 10.0}
        for i, (words, length) in enumerate(looks.items()):
            yield Progress(i, len(looks), f"{NAME}, {segments} segments, {words}")
            where = f"{segments} segments, {words}"
            taken, late = _strokes(window, length, times)
            rows.append(Latency(NAME, where, taken, PAINT))
            rows.append(Latency(AFTER, where, late, LATE))
    return tuple(rows)


def _strokes(
    window: Window, length: float, times: int
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Seconds of some strokes, and how late the event loop is once they are done."""
    document, label = window.document, window.label
    (low, high), actions = document.bounds, tuple(document.vocabulary)
    # The overview follows a moment later; what it takes is in the lateness afterwards.
    lists: list[QWidget] = [label.tracks, label.segments.table.viewport()]
    random, taken = np.random.default_rng(5), []
    with Painted([widget for widget in lists if widget.isVisible()]) as painted:
        for _ in range(times):
            start = float(random.uniform(low, high - 0.05 * length))
            document.set_span(start - 0.4 * length, start + 0.6 * length)
            document.seek(start)
            # An action that is there already would change nothing.
            row = _row(document.segments, start)
            there = {segment.action for segment in document.segments[max(row - 2, 0) : row + 2]}
            action = next(action for action in actions if action.name not in there)
            key = Qt.Key(ord(action.key.upper()))
            target = QApplication.focusWidget() or label.tracks
            QTest.keyClick(target, key)
            document.seek(start + float(random.uniform(*LASTING)))
            _scroll(window, row)
            settle(window)
            before = document.segments
            taken.append(painted.seconds(partial(QTest.keyPress, target, key)))
            QTest.keyRelease(target, key)
            if document.segments == before:
                raise InputError("A key painted nothing; the measurement means nothing then.")
            document.undo()  # so that there are as many segments the next time
    with Lateness() as lateness:
        rest(AFTERWARDS)
    return tuple(taken), tuple(lateness.samples)


def _row(segments: Segments, time: float) -> int:
    """The first segment that begins at or after a time."""
    row = bisect_left(segments, time, key=lambda segment: segment.start)
    return min(row, len(segments) - 1)


def _scroll(window: Window, row: int) -> None:
    """Let the table of segments show a row, so that it has to paint what changes there."""
    table, centre = window.label.segments.table, QAbstractItemView.ScrollHint.PositionAtCenter
    table.scrollTo(table.model().index(row, 0), centre)
