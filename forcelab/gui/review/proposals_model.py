"""The unlabelled demonstrations as rows, and how their uncertainty is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QObject,
    QRectF,
    QSize,
    Qt,
)
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from forcelab.gui.indexes import NOWHERE, Index
from forcelab.gui.theme import colours

if TYPE_CHECKING:
    from forcelab.review.proposing import Proposal

__all__ = ["UNCERTAINTY", "BarDelegate", "ProposalModel"]

NAME, UNCERTAINTY, WRONG, LABELLED = range(4)


class ProposalModel(QAbstractTableModel):
    """One row for each proposal, as they are ordered."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.rows: tuple[Proposal, ...] = ()
        self._labelled: dict[str, float] = {}

    def set_rows(self, rows: Sequence[Proposal], labelled: dict[str, float]) -> None:
        """Show other proposals; `labelled` is the share that the coder labelled meanwhile."""
        self.beginResetModel()
        self.rows, self._labelled = tuple(rows), labelled
        self.endResetModel()

    def set_labelled(self, labelled: dict[str, float]) -> None:
        """Show how much of each is labelled by now."""
        if labelled != self._labelled and self.rows:
            self._labelled = labelled
            last = self.index(len(self.rows) - 1, LABELLED)
            self.dataChanged.emit(self.index(0, LABELLED), last)

    def rowCount(self, parent: Index = NOWHERE) -> int:
        """How many there are."""
        return 0 if parent.isValid() else len(self.rows)

    def columnCount(self, parent: Index = NOWHERE) -> int:
        """Name, uncertainty, seconds, share."""
        return 0 if parent.isValid() else 4

    def headerData(
        self,
        section: int,
        orientation: Qt.Orientation,
        role: int = Qt.ItemDataRole.DisplayRole,
    ) -> Any:
        """What the columns are."""
        if orientation != Qt.Orientation.Horizontal:
            return None
        if role == Qt.ItemDataRole.DisplayRole:
            return (
                self.tr("demonstration"),
                self.tr("uncertainty"),
                self.tr("probably wrong"),
                self.tr("labelled"),
            )[section]
        if role == Qt.ItemDataRole.TextAlignmentRole and section >= WRONG:
            return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What stands in a cell."""
        if not index.isValid():
            return None
        row, column = self.rows[index.row()], index.column()
        if role == Qt.ItemDataRole.DisplayRole:
            return self._text(row, column)
        if role == Qt.ItemDataRole.UserRole and column == UNCERTAINTY:
            return row.uncertainty
        if role == Qt.ItemDataRole.TextAlignmentRole and column >= WRONG:
            return Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        if role == Qt.ItemDataRole.ToolTipRole:
            return self._tip(row)
        return None

    def _text(self, row: Proposal, column: int) -> str:
        """The text of a cell."""
        if column == NAME:
            return row.name
        if column == UNCERTAINTY:
            return f"{100 * row.uncertainty:.0f} %"
        if column == WRONG:
            return f"{row.wrong:.1f} s"
        share = self._labelled.get(row.id, 0.0)
        return f"{100 * share:.0f} %" if share else "–"

    def _tip(self, row: Proposal) -> str:
        """What the figures mean."""
        text = self.tr(
            "{name} ({task}), {seconds:.1f} s: of moments as uncertain as these, tested "
            "demonstrations had so many wrong that about {wrong:.1f} s are expected to be wrong "
            "here. Labelling it is expected to put these right."
        ).format(name=row.name, task=row.task, seconds=row.seconds, wrong=row.wrong)
        if row.typicality is None:
            return text
        typical = self.tr("It is {0:.0f} % like all that are listed.")
        return f"{text} {typical.format(100 * row.typicality)}"


class BarDelegate(QStyledItemDelegate):
    """Draws a share as a bar with its number."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw the ground as always, then bar and number."""
        share = index.data(Qt.ItemDataRole.UserRole)
        text = index.data(Qt.ItemDataRole.DisplayRole)
        self.initStyleOption(option, index)
        option.text = ""
        style = option.widget.style()
        style.drawControl(QStyle.ControlElement.CE_ItemViewItem, option, painter)
        theme = colours()
        box = QRectF(option.rect).adjusted(4, 4, -4, -4)
        bar = QRectF(box.left() + 42, box.top(), max(box.width() - 42, 0), box.height())
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        painter.save()
        painter.setPen(QColor(theme.accent_text if chosen else theme.text))
        painter.drawText(
            QRectF(box.left(), box.top(), 36, box.height()),
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter,
            str(text),
        )
        painter.fillRect(bar, QColor(theme.panel_edge))
        painter.fillRect(
            QRectF(bar.left(), bar.top(), bar.width() * float(share or 0.0), bar.height()),
            QColor(theme.muted),
        )
        painter.restore()

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """Room for a bar that can be compared."""
        return QSize(140, super().sizeHint(option, index).height())
