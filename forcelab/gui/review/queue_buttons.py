"""The verdicts as buttons, with their keys printed on them."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QSizePolicy, QWidget

from forcelab.gui.arranging import allow
from forcelab.gui.shortcuts import keys

__all__ = ["VerdictButtons"]

#: What a button needs beside its text, in pixels.
ROOM = 20


class VerdictButtons(QWidget):
    """Three verdicts; for what is judged already, one button to take the verdict back.

    Attributes
    ----------
    judged : Signal
        With ``"human"``, ``"model"`` or ``"ambiguous"``.
    withdrawn : Signal
    """

    judged = Signal(str)
    withdrawn = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._texts = {
            "human": ("Human right", "Human"),
            "model": ("Model right", "Model"),
            "ambiguous": ("Ambiguous", "Unclear"),
        }
        told = {
            "human": "The label is right; it stays.",
            "model": "The prediction is right; your label is changed to it, undoably.",
            "ambiguous": "It cannot be told; the label stays.",
        }
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(4)
        self.verdicts: dict[str, QPushButton] = {}
        for verdict, (text, _) in self._texts.items():
            button = QPushButton()
            button.setAccessibleName(text)
            button.setToolTip(told[verdict])
            button.clicked.connect(lambda _=False, v=verdict: self.judged.emit(v))
            row.addWidget(button, 1)
            self.verdicts[verdict] = button
        self.withdraw = QPushButton("Withdraw the verdict")
        self.withdraw.setAccessibleName(self.withdraw.text())
        self.withdraw.clicked.connect(self.withdrawn)
        row.addWidget(self.withdraw, 1)
        for button in (*self.verdicts.values(), self.withdraw):
            button.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        keys().changed.connect(self._print_keys)
        self._print_keys()
        self.offer(open_=False, judged=False)

    def offer(self, *, open_: bool, judged: bool) -> None:
        """Offer verdicts on what is open, or to withdraw the one on what is judged."""
        for button in self.verdicts.values():
            button.setHidden(judged)
            allow(button, "" if open_ else "Choose a place in the queue first (N).")
        self.withdraw.setHidden(not judged)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say it shorter where there is little room."""
        super().resizeEvent(event)
        self._print_keys()

    def _print_keys(self) -> None:
        """Write each key below what it says."""
        longest = max(
            self.fontMetrics().horizontalAdvance(text) for text, _ in self._texts.values()
        )
        short = self.width() < len(self._texts) * (longest + ROOM)
        for verdict, button in self.verdicts.items():
            key = keys().shown(f"verdict_{verdict}")
            text = self._texts[verdict][short]
            button.setText(f"{text}\n{key}" if key else text)
