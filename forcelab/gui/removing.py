"""Asking whether a demonstration is to be removed: what goes with it, and what stays."""

from __future__ import annotations

from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.listing_rows import Row, percent
from forcelab.labels import is_model

__all__ = ["RemoveDialog"]


class RemoveDialog(QDialog):
    """Names what goes; where others may have labelled, that has to be agreed to apart.

    Parameters
    ----------
    row : Row
        The demonstration as the coder may see it.
    author : str
        The coder.
    parent : QWidget, optional
    """

    def __init__(self, row: Row, author: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle(self.tr("Remove from the project"))
        text = QLabel(self._told(row, author))
        text.setWordWrap(True)
        text.setMinimumWidth(360)
        self.others = QCheckBox(self._others(row))
        self.others.setVisible(bool(self.others.text()))
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Cancel)
        self.remove = buttons.addButton(
            self.tr("Remove"), QDialogButtonBox.ButtonRole.DestructiveRole
        )
        self.remove.setAutoDefault(False)
        self.remove.setEnabled(self.others.isHidden())
        self.remove.clicked.connect(self.accept)
        self.others.toggled.connect(self.remove.setEnabled)
        buttons.rejected.connect(self.reject)
        buttons.button(QDialogButtonBox.StandardButton.Cancel).setDefault(True)
        column = QVBoxLayout(self)
        column.setSpacing(10)
        for widget in (text, self.others, buttons):
            column.addWidget(widget)

    def _told(self, row: Row, author: str) -> str:
        """What goes and what stays."""
        goes = [self.tr("the recording ({0:.2f} s)").format(row.info.duration)]
        if row.info.has_video:
            goes.append(self.tr("its video"))
        if row.share:
            goes.append(self.tr("your labels ({0} %)").format(percent(row.share)))
        elif author in row.info.labelled:
            goes.append(self.tr("the history of your labels"))
        goes += [
            self.tr("the labels of {0} ({1} %)").format(name, percent(share))
            for name, share in row.others
        ]
        if row.assignment is not None or row.assigned_to:
            goes.append(self.tr("assignments"))
        return self.tr(
            "Remove '{0}' for good? With it go: {1}.\n\nThis cannot be undone. The file that it "
            "was imported from stays, and so do runs and recognisers."
        ).format(row.info.name, ", ".join(goes))

    def _others(self, row: Row) -> str:
        """What is to be agreed to about others' labels; the same to whoever codes blind."""
        if row.blind:
            return self.tr("Remove it whatever others have labelled on it")
        names = [name for name, _ in row.others if not is_model(name)]
        if not names:
            return ""
        return self.tr("Remove the labels of {0} too").format(", ".join(names))
