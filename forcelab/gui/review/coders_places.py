"""A list of places where coders differ; a click shows the place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSize, Signal
from PySide6.QtWidgets import QHeaderView

from forcelab.gui.figures.text import NAMES
from forcelab.gui.review.rows import Column, Row, TextModel, TextRows
from forcelab.review.differences import Interval

__all__ = ["PlaceRow", "PlaceTable"]

#: Widths of all columns but the last, in digits.
WIDTHS = (15, 8, 10, 10, 10)


@dataclass(frozen=True, slots=True)
class PlaceRow:
    """A place, what kind of thing is there, and whether it is done with."""

    place: Interval
    kind: str = ""
    done: bool = False


class PlaceTable(TextRows):
    """Places in rows: where, how long, what each of two says, and what kind of place it is.

    Parameters
    ----------
    title : str
        What is listed, for screen readers.

    Attributes
    ----------
    rows : tuple of PlaceRow

    Signals
    -------
    wanted(Place)
        A click, or Enter: it is to be shown.
    """

    wanted = Signal(object)

    def __init__(self, title: str) -> None:
        super().__init__(TextModel())
        self.rows: tuple[PlaceRow, ...] = ()
        self.setAccessibleName(title)
        self.setTextElideMode(NAMES)
        header = self.horizontalHeader()
        header.setStretchLastSection(True)
        header.setTextElideMode(NAMES)
        header.setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        self.put((), {}, ("", "", ""))
        digit = self.fontMetrics().horizontalAdvance("0")
        for column, digits in enumerate(WIDTHS):
            header.resizeSection(column, digits * digit)
        self.clicked.connect(lambda index: self.wanted.emit(self.rows[index.row()].place))

    def put(
        self, rows: Sequence[PlaceRow], names: Mapping[str, str], heads: tuple[str, str, str]
    ) -> None:
        """Show other places.

        Parameters
        ----------
        rows : sequence of PlaceRow
        names : mapping of str to str
            Of the demonstrations, by id.
        heads : tuple of str
            Over the two sayings and the kind.
        """
        self.rows = tuple(rows)
        numbers = Column("At, s"), Column("Length, s")
        texts = [Column(head, number=False) for head in ("Demonstration", *heads)]
        self._model.show((texts[0], *numbers, *texts[1:]), [_cells(row, names) for row in rows])

    def sizeHint(self) -> QSize:
        """Room for some rows."""
        return QSize(320, 9 * self.verticalHeader().defaultSectionSize())

    def minimumSizeHint(self) -> QSize:
        """Room for the header and three rows."""
        return QSize(160, round(4.5 * self.verticalHeader().defaultSectionSize()))


def _cells(row: PlaceRow, names: Mapping[str, str]) -> Row:
    """What stands in a row."""
    place = row.place
    return Row(
        (
            names.get(place.demonstration, place.demonstration),
            f"{'✓ ' if row.done else ''}{place.start:.2f}",
            f"{place.duration:.3f}",
            place.human or "–",
            place.predicted or "–",
            row.kind,
        )
    )
