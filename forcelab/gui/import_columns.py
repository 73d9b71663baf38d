"""What the columns of a table are read as: shown before the import, and to be changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import InputError
from forcelab.formats import identify
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table.columns import is_time_name
from forcelab.formats.table.preview import ColumnUse, Use, preview, rate_in
from forcelab.gui.theme import colours
from forcelab.gui.wheel_guard import guard_from_wheel

__all__ = ["ImportColumns"]

#: Formats whose files have columns, or fields that are like them.
_WITH_COLUMNS = frozenset(["table", "rosbag"])
#: Free room above and below a choice, in pixels.
AROUND = 3


class ImportColumns(QWidget):
    """The columns of one table or bag among the files, of the first one first; else hidden.

    Attributes
    ----------
    table : QTableWidget
        A row a column: its name, its first cells, and a choice of what it is.
    """

    def __init__(self) -> None:
        super().__init__()
        self._path: Path | None = None
        self._wishes: dict[str, Use] = {}
        self._untouched: tuple[ColumnUse, ...] = ()
        self._rate, self._trouble = 0.0, ""
        self._rate_in_file: float | None = None
        self.uses: tuple[ColumnUse, ...] = ()
        self.heading = QLabel()
        self.heading.setWordWrap(True)
        self.table = QTableWidget(0, 3)
        self.table.setAccessibleName("Columns of the table")
        self.table.setHorizontalHeaderLabels(["Column", "First cells", "Read as"])
        header = self.table.horizontalHeader()
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.ResizeToContents)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        header.setHighlightSections(False)
        self.table.verticalHeader().hide()
        self.table.setShowGrid(False)
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        high = QComboBox().sizeHint().height() + 2 * AROUND
        self.table.verticalHeader().setDefaultSectionSize(high)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.heading)
        column.addWidget(self.table, 1)
        self.setVisible(False)

    def show_first(self, files: Sequence[Path]) -> None:
        """Show the columns of the first file that has any."""
        if self._path in files:
            return
        self._path = next((file for file in files if _format(file) in _WITH_COLUMNS), None)
        self._wishes.clear()
        self._fill()

    def show_file(self, path: Path) -> None:
        """Show the columns of another file, if it has any; what was chosen is for all."""
        if path != self._path and _format(path) in _WITH_COLUMNS:
            self._path = path
            self._fill()

    def options(self, options: ReadOptions) -> ReadOptions:
        """Add what was chosen; what is found by itself stays to be found in each file."""
        chosen = {use: name for name, use in self._wishes.items()}
        several: dict[Use, tuple[str, ...]] = {
            use: tuple(name for name, wish in self._wishes.items() if wish == use)
            for use in ("signal", "left out")
        }
        return replace(
            options,
            time=chosen.get("times"),
            counter=chosen.get("counter"),
            label=chosen.get("labels"),
            leave_out=several["left out"],
            signals=several["signal"],
        )

    def wish(self, name: str, use: Use) -> None:
        """Have a column read as something else than it is taken for."""
        taken = {one.name: one.use for one in self._untouched}
        if use in ("times", "counter", "labels"):  # there is one of each
            self._wishes = {n: u for n, u in self._wishes.items() if u != use}
        if use in ("times", "counter"):  # one stands in for the other
            other: Use = "counter" if use == "times" else "times"
            self._wishes = {n: u for n, u in self._wishes.items() if u != other}
        self._wishes.pop(name, None)
        if taken.get(name) != use:
            self._wishes[name] = use
        self._fill()

    def set_rate(self, rate: float) -> None:
        """Take in the samples a second that are given for files without times; 0 for none."""
        if rate != self._rate:
            self._rate = rate
            self._say()

    def _fill(self) -> None:
        """Show the columns as they are read now."""
        self._untouched, trouble = self._previewed(ReadOptions())
        self.uses = self._untouched
        if self._wishes and self._untouched:
            uses, trouble = self._previewed(self.options(ReadOptions()))
            self.uses = uses or self._untouched
        self.setVisible(bool(self.uses))
        self.table.setRowCount(len(self.uses))
        for row, one in enumerate(self.uses):
            name = f"{one.name} [{one.unit}]" if one.unit else one.name
            for place, text in enumerate((name, "   ".join(one.cells))):
                item = QTableWidgetItem(text)
                item.setToolTip(text)
                self.table.setItem(row, place, item)
            self.table.setCellWidget(row, 2, _with_room(self._choice(one)))
        self._trouble = trouble
        self._say()

    def _say(self) -> None:
        """Say what is shown, and what is still lacking."""
        self.heading.setText(self._trouble or self._said())
        wrong = self._trouble or not self._timed
        self.heading.setStyleSheet(f"color: {colours().warning}" if wrong else "")

    @property
    def _timed(self) -> bool:
        """Whether the times of the samples are known."""
        rate = self._rate or self._rate_in_file
        return bool(rate) or any(one.use == "times" for one in self.uses)

    def _previewed(self, options: ReadOptions) -> tuple[tuple[ColumnUse, ...], str]:
        """The columns as the importer reads them, or none and why."""
        self._rate_in_file = None
        if self._path is None:
            return (), ""
        try:
            if _format(self._path) == "rosbag":
                from forcelab.formats.rosbag.preview import preview as of_bag

                return of_bag(self._path, options), ""
            self._rate_in_file = rate_in(self._path)
            return preview(self._path, options), ""
        except (InputError, OSError) as error:
            return (), str(error)

    def _said(self) -> str:
        """One sentence on which file this is and how its times are known."""
        name = self._path.name if self._path else ""
        kinds = [one.use for one in self.uses]
        if self._timed:
            return f"Columns of {name}, and what each is read as:"
        if "counter" in kinds:
            return f"{name} has no times but counts its samples; give their rate:"
        if stuck := self._stuck():
            return (
                f"{name} has in '{stuck}' one and the same time; choose a column, or give the "
                "sample rate:"
            )
        return f"{name} has no column of times; choose one, or give the sample rate:"

    def _stuck(self) -> str:
        """The column of times that the importer leaves out, as they never change; "" without."""
        if any(one.use == "times" for one in self._untouched):
            return ""
        for one in self._untouched:
            if one.use == "left out" and is_time_name(one.name) and any(one.cells):
                return one.name
        return ""

    def _choice(self, one: ColumnUse) -> QComboBox:
        """What a column is read as, and what else it could be."""
        box = QComboBox()
        guard_from_wheel(box)  # it scrolls the table
        box.setAccessibleName(f"{one.name} is read as")
        taken = next((t.use for t in self._untouched if t.name == one.name), one.use)
        for use in dict.fromkeys((taken, one.use, *one.choices)):
            box.addItem(_word(use), use)
        box.setCurrentIndex(box.findData(one.use))
        box.activated.connect(lambda index: self.wish(one.name, box.itemData(index)))
        return box


def _with_room(choice: QComboBox) -> QWidget:
    """A choice that does not touch those above and below it."""
    cell = QWidget()
    row = QHBoxLayout(cell)
    row.setContentsMargins(0, AROUND, 2 * AROUND, AROUND)
    row.addWidget(choice)
    return cell


def _word(use: Use) -> str:
    """A use in the coder's language."""
    words = {
        "signal": "signal",
        "times": "times",
        "counter": "sample counter",
        "labels": "labels",
        "left out": "left out",
    }
    return words[use]


def _format(path: Path) -> str:
    """The format of a file; empty where it has none."""
    try:
        return identify(path).name
    except (InputError, OSError):
        return ""  # what is wrong is told when the file is read
