"""Where the timeline pairs lie in the window: columns, rows and what is at a point."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate

from PySide6.QtCore import QRectF

from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.pairs import CAPTION, Measures, PairBoxes, captions
from forcelab.gui.review.pairs_rows import Entry

__all__ = ["MARGIN", "MEASURES", "Layout"]

MEASURES = Measures(bar=16.0, lane=10.0)
#: Left and right of everything, and above and below the bars of a row, in pixels.
MARGIN = 12.0
AIR = 6.0
#: The heading of the proposals.
HEADING = 44.0
#: Names take so much of the width at most, in pixels and as a share.
NAME_ROOM, NAME_SHARE = 190.0, 0.26
CAPTION_ROOM = 80.0
NOTE_ROOM = 56.0


@dataclass(frozen=True)
class Layout:
    """The rows of some entries in a width.

    Parameters
    ----------
    entries : sequence of Entry
        The tested first, then the proposals.
    width : float
        In pixels.
    stretched : bool
        Whether each takes the whole width, whatever it lasts.
    names : tuple of str
        What the bars of the human and of the model are called.
    """

    entries: Sequence[Entry]
    width: float
    stretched: bool
    names: tuple[str, str]

    @cached_property
    def name_room(self) -> float:
        """Width of the column of names."""
        widest = text.widest(
            (text.shown(e.reviewed.name) for e in self.entries), text.font(bold=True)
        )
        return min(widest + 2, NAME_ROOM, NAME_SHARE * self.width)

    @cached_property
    def caption_room(self) -> float:
        """Width of the column of captions; 0 where no row needs one."""
        found = {
            caption
            for entry in self.entries
            if entry.lanes
            for _, caption in captions(self._boxes(entry), entry.sketch, *self.names)
        }
        return min(text.widest(found, text.font(CAPTION)), CAPTION_ROOM) + 12 if found else 0.0

    @property
    def left(self) -> float:
        """Where the bars begin."""
        return MARGIN + self.name_room + self.caption_room + 10

    @property
    def right(self) -> float:
        """Where the longest bars end."""
        return max(self.width - MARGIN - NOTE_ROOM, self.left + 40)

    @cached_property
    def span(self) -> tuple[float, float]:
        """From the earliest start to the latest end, in seconds."""
        if not self.entries:
            return 0.0, 1.0
        start = min(entry.reviewed.start for entry in self.entries)
        return start, max(entry.reviewed.end for entry in self.entries)

    def axis(self, entry: Entry | None = None) -> Axis:
        """The time axis of an entry, or the common one."""
        start, end = self.span
        if entry is not None and self.stretched:
            start, end = entry.reviewed.start, entry.reviewed.end
        return Axis(start, end, self.left, self.right)

    @cached_property
    def first_proposal(self) -> int | None:
        """Above which row the heading of the proposals stands."""
        return next((i for i, entry in enumerate(self.entries) if entry.human is None), None)

    @cached_property
    def tops(self) -> list[float]:
        """Upper edge of each row, headings above it left out, and the end of the last one."""
        heights = []
        for i, entry in enumerate(self.entries):
            heading = HEADING if i == self.first_proposal else 0.0
            heights += [heading, MEASURES.height(entry.sketch) + 2 * AIR]
        edges = list(accumulate(heights, initial=0.0))
        return [*edges[1::2], edges[-1]]

    @property
    def height(self) -> float:
        """Of all rows."""
        return self.tops[-1] if self.entries else 0.0

    def row_height(self, row: int) -> float:
        """Height of a row."""
        return MEASURES.height(self.entries[row].sketch) + 2 * AIR

    def row_box(self, row: int) -> QRectF:
        """Where a row lies among all rows."""
        return QRectF(0, self.tops[row], self.width, self.row_height(row))

    def visible(self, top: float, bottom: float) -> range:
        """The rows of which something lies between two heights."""
        count = len(self.entries)
        first = max(bisect_right(self.tops, top, 0, count) - 1, 0)
        return range(first, max(first, bisect_right(self.tops, bottom, 0, count)))

    def row_at(self, y: float) -> int | None:
        """Which row is at a height; None between and below them."""
        row = bisect_right(self.tops, y, 0, len(self.entries)) - 1
        if row < 0 or y >= self.tops[row] + self.row_height(row):
            return None
        return row

    def boxes(self, row: int) -> PairBoxes:
        """Where the bars of a row lie, measured from the row's upper edge."""
        entry = self.entries[row]
        return MEASURES.boxes(entry.sketch, self.axis(entry), AIR)

    def _boxes(self, entry: Entry) -> PairBoxes:
        """Where the bars of an entry lie up and down."""
        return MEASURES.boxes(entry.sketch, Axis(*self.span, 0.0, 1.0), 0.0)
