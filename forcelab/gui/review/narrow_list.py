"""A list to choose from that may become narrower than what stands in it."""

from __future__ import annotations

from PySide6.QtWidgets import QComboBox, QSizePolicy, QWidget

__all__ = ["NAME", "NarrowList"]

#: Characters that are always seen.
NAME = 12


class NarrowList(QComboBox):
    """A list in a row that has little room.

    Parameters
    ----------
    parent : QWidget, optional
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(NAME)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def set_name(self, name: str) -> None:
        """Say what is chosen, to the eye and to a screen reader."""
        self.setAccessibleName(name)
        self.setToolTip(name)
