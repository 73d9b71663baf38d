"""Buttons that take predictions of the open demonstration over."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from operator import attrgetter

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QDoubleSpinBox, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from forcelab.gui import settings
from forcelab.gui.arranging import allow
from forcelab.gui.document import Document
from forcelab.gui.shortcuts import keys

__all__ = ["AcceptButtons"]

#: A stretch that is too short to hold anything but what lies at its start, in seconds.
MOMENT = 1e-6


class AcceptButtons(QWidget):
    """Take over what is predicted at the cursor, in view, or with a probability.

    Each can be pressed only where there is something to take over.
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.document = document
        self._lay_out()
        for signal in (
            document.tracks_changed,
            document.outcome_changed,
            document.demonstration_changed,
        ):
            signal.connect(self._follow)
        document.cursor_moved.connect(self._follow_cursor)
        document.span_changed.connect(self._follow_span)
        keys().changed.connect(self._name_buttons)
        self._name_buttons()

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._follow()

    # What it is made of

    def _lay_out(self) -> None:
        """Two rows: beside the pairs is little room."""
        self.here = QPushButton()
        self.here.clicked.connect(self.accept_here)
        self.in_view = QPushButton()
        self.in_view.clicked.connect(self.accept_in_view)
        self.above = QPushButton("Accept a&bove")
        self.above.setAccessibleName("Accept all segments above this probability")
        self.above.clicked.connect(self.accept_above)
        self.at_least = QDoubleSpinBox()
        self.at_least.setRange(0.0, 1.0)
        self.at_least.setDecimals(2)
        self.at_least.setSingleStep(0.05)
        self.at_least.setValue(settings.number("review/accept_above", 0.9, lowest=0, highest=1))
        self.at_least.setAccessibleName("Least mean probability")
        self.at_least.valueChanged.connect(lambda _: self._follow())
        self.at_least.editingFinished.connect(
            lambda: settings.put("review/accept_above", self.at_least.value())
        )
        rows = QVBoxLayout(self)
        rows.setContentsMargins(0, 0, 0, 0)
        rows.setSpacing(4)
        for widgets in ((self.here, self.in_view), (self.above, self.at_least)):
            row = QHBoxLayout()
            row.setSpacing(4)
            for widget in widgets:
                row.addWidget(widget)
            row.addStretch(1)
            rows.addLayout(row)
        for button in (self.here, self.in_view, self.above):
            button.setAutoDefault(False)
            button.setMinimumWidth(0)

    def _name_buttons(self) -> None:
        """Print the keys on the buttons."""
        for button, text, command in (
            (self.here, "Accept &here", "accept"),
            (self.in_view, "Accept all in &view", "accept_all"),
        ):
            key = keys().shown(command)
            # Below it: beside it, the longer one is cut off where the lists are narrow.
            button.setText(f"{text}\n{key}" if key else text)
            button.setAccessibleName(text.replace("&", ""))

    # Accepting

    def accept_here(self) -> bool:
        """Take over what is predicted at the cursor."""
        return self._told(self.document.accept_here)

    def accept_in_view(self) -> bool:
        """Take over everything predicted that is in view, where the coder labelled nothing."""
        return self._told(self.document.accept_in_view)

    def accept_above(self) -> bool:
        """Take over what is that probable anywhere, where the coder labelled nothing."""
        document, at_least = self.document, self.at_least.value()
        return self._told(lambda: document.accept(*document.bounds, at_least, replace=False))

    def _told(self, accept: Callable[[], bool]) -> bool:
        """Take over, and say how many and how to take it back."""
        before = set(self.document.segments)
        done = accept()
        if done:
            count = len(set(self.document.segments) - before)
            text = (
                "1 predicted segment was accepted; {key} takes it back."
                if count == 1
                else "{count} predicted segments were accepted; {key} takes them back."
            )
            key = keys().shown("undo").split(",")[0]
            self.document.say(text.format(count=count, key=key))
        return done

    def _count(self, start: float, end: float, at_least: float = 0.0) -> int:
        """How many predicted segments would be taken over."""
        from forcelab.review.active_learning import acceptable

        reviewed = self.document.reviewed
        return 0 if reviewed is None else len(acceptable(reviewed, start, end, at_least))

    def _is_there(self, start: float, end: float) -> bool:
        """Whether anything is predicted there."""
        predicted = self.document.prediction  # asked at each step of playback: not all of it
        first = bisect_right(predicted, start, key=attrgetter("end"))
        return first < len(predicted) and predicted[first].start < end

    def _follow_cursor(self, cursor: float) -> None:
        """Offer what lies at the cursor."""
        if self.isVisible():
            there = self._is_there(cursor, cursor + MOMENT)
            allow(self.here, "" if there else "Nothing is predicted at the cursor.")

    def _follow_span(self, start: float, end: float) -> None:
        """Offer what is in view."""
        if self.isVisible():
            there = self._is_there(start, end)
            allow(self.in_view, "" if there else "Nothing is predicted in view.")

    def _follow(self, *_: object) -> None:
        """Offer what can be accepted."""
        if not self.isVisible():
            return
        document = self.document
        self._follow_cursor(document.cursor)
        self._follow_span(document.start, document.end)
        count = self._count(*document.bounds, self.at_least.value())
        none = "No predicted segment of the open demonstration is that probable."
        allow(self.above, "" if count else none)
        self.above.setToolTip(f"{count} segments of the open demonstration are that probable")
