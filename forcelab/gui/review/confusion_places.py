"""The list of a cell's places: going through it shows one after the other."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QModelIndex, QSize, Qt
from PySide6.QtWidgets import QWidget

from forcelab.gui.arranging import column, muted
from forcelab.gui.document import Document
from forcelab.gui.review.rows import Column, Row, TextModel, TextRows
from forcelab.review.differences import Interval

__all__ = ["PlacesList"]


class PlacesList(QWidget):
    """Places, the longest and most confident first; choosing one shows it in the window.

    Attributes
    ----------
    places : tuple of Place
        What is listed.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self.places: tuple[Interval, ...] = ()
        self.model = TextModel(self)
        self.table = TextRows(self.model)
        self.table.setAccessibleName("Places of the cell")
        self.hint = muted()
        self.hint.setMargin(8)
        self.hint.setAlignment(Qt.AlignmentFlag.AlignTop)
        column(self, self.hint, self.table, growing=self.table)
        self._filling = False
        self.table.selectionModel().currentRowChanged.connect(self._row_chosen)
        self.table.clicked.connect(self._row_clicked)
        self.clear()

    def minimumSizeHint(self) -> QSize:
        """The header and two rows."""
        return QSize(160, 90)

    def clear(self) -> None:
        """List nothing, and say what would be listed."""
        self.show_places((), {}, 0)
        self.hint.setText("Click on a cell to list its places.")
        self.hint.show()

    def show_places(
        self, places: tuple[Interval, ...], names: Mapping[str, str], number: int
    ) -> None:
        """List places.

        Parameters
        ----------
        places : tuple of Place
            In their order.
        names : mapping of str to str
            The demonstrations' names by id.
        number : int
            How many there are in all.
        """
        columns = (
            Column("Demonstration", number=False),
            Column("Start (s)"),
            Column("Duration (s)"),
            Column(
                "Confidence (%)",
                "Mean probability that the model gives to what it predicts",
            ),
        )
        rows = [
            Row(
                (
                    names.get(place.demonstration, place.demonstration),
                    f"{place.start:.3f}",
                    f"{place.duration:.3f}",
                    "–" if place.confidence is None else f"{100 * place.confidence:.0f}",
                )
            )
            for place in places
        ]
        self._filling = True
        self.places = places
        self.model.show(columns, rows)
        self._filling = False
        self.table.fit_columns(stretched=0)
        self.table.setVisible(bool(places))
        self.hint.setVisible(len(places) < number or not number)
        if number:
            self.hint.setText(
                "The {} longest of {} places are listed.".format(f"{len(places):,}", f"{number:,}")
            )
        else:
            self.hint.setText("This cell is empty.")

    def _row_chosen(self, index: QModelIndex) -> None:
        """Show the place of the row."""
        if index.isValid() and not self._filling:
            self.document.examine(self.places[index.row()])

    def _row_clicked(self, index: QModelIndex) -> None:
        """Show the place once more, if the window has gone elsewhere since."""
        document, place = self.document, self.places[index.row()]
        here = document.id, document.cursor
        if document.examined is not place or here != (place.demonstration, place.start):
            document.examine(place)
