"""Places in Qt's models: what every model and delegate is asked about."""

from __future__ import annotations

from typing import Final

from PySide6.QtCore import QModelIndex, QPersistentModelIndex

__all__ = ["NOWHERE", "Index"]

Index = QModelIndex | QPersistentModelIndex
#: No place: the parent of rows that have none.
NOWHERE: Final = QModelIndex()
