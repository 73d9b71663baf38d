"""The page on which a place is explained: its parts, and where they stand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QPalette, QResizeEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui.arranging import copyable, muted, stress
from forcelab.gui.document import Document
from forcelab.gui.review import why_words
from forcelab.gui.review.why_chart import ProbabilityChart
from forcelab.gui.review.why_neighbours import Neighbours
from forcelab.gui.review.why_painting import BandMap

if TYPE_CHECKING:
    from forcelab.recognition.probability_trace import Certainty
    from forcelab.review.differences import Interval
    from forcelab.review.explanation import Why

__all__ = ["WhyPage"]

#: From this width on, in pixels, what speaks and what is alike stand side by side.
WIDE = 860


class WhyPage(QScrollArea):
    """Sentence, probabilities, progress, bands and neighbours.

    What was found is grey while it is of an older place.

    Attributes
    ----------
    back, stop : QPushButton
        To the place that is explained; ends the training, or begins it again.
    neighbours : Neighbours
    """

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName("Explanation")
        plain = Qt.TextFormat.PlainText  # names in it are anybody's
        self.sentence = QLabel(wordWrap=True, textFormat=plain)
        self.state_text = QLabel(wordWrap=True, textFormat=plain)
        self.strongest, self.method = copyable(), copyable()
        stress(self.sentence)
        small = self.method.font()
        small.setPointSizeF(max(small.pointSizeF() * 0.86, 7.0))
        self.method.setFont(small)
        self.method.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self.back, self.stop = QPushButton("Back to the place"), QPushButton()
        self.back.setAccessibleName("Back to the place that is explained")
        self.back.hide()
        self.chart, self.bands = ProbabilityChart(document), BandMap()
        self.neighbours = Neighbours(document)
        self._arrange()

    def _arrange(self) -> None:
        """Put the parts in their places."""
        top, alike, speaking = QHBoxLayout(), QVBoxLayout(), QVBoxLayout()
        top.addWidget(self.sentence, 1)
        top.addWidget(self.back, 0, Qt.AlignmentFlag.AlignTop)
        self.state = QWidget()
        line = QHBoxLayout(self.state)
        line.setContentsMargins(0, 0, 0, 0)
        line.addWidget(self.state_text, 1)
        line.addWidget(self.stop)
        speaking.addWidget(self.bands)
        speaking.addWidget(self.strongest)
        speaking.addWidget(self.method)
        speaking.addStretch(1)
        title = QLabel("Nearest in training")
        title.setFont(self.sentence.font())
        note = muted("d: distance, in standard deviations of the training segments")
        note.setFont(self.method.font())
        alike.addWidget(title)
        alike.addWidget(note)
        alike.addWidget(self.neighbours)
        alike.addStretch(1)
        self.found = QWidget()
        self._halves = QBoxLayout(QBoxLayout.Direction.TopToBottom, self.found)
        self._halves.setContentsMargins(0, 0, 0, 0)
        self._halves.setSpacing(14)
        self._halves.addLayout(speaking, 1)
        self._halves.addLayout(alike, 1)
        inner = QWidget()
        column = QVBoxLayout(inner)
        column.setContentsMargins(10, 8, 10, 8)
        column.addLayout(top)
        column.addWidget(self.chart)
        column.addWidget(self.state)
        column.addWidget(self.found)
        column.addStretch(1)
        self.setWidget(inner)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Side by side where there is room."""
        way = QBoxLayout.Direction
        wide = event.size().width() >= WIDE
        self._halves.setDirection(way.LeftToRight if wide else way.TopToBottom)
        super().resizeEvent(event)

    @property
    def stale(self) -> bool:
        """Whether what was found is of an older place, or not there yet."""
        return not self.found.isEnabled()

    def begin(self, place: Interval, certainty: Certainty | None, threshold: float | None) -> None:
        """Show what is known of another place at once; what was found so far turns grey."""
        self.sentence.setText(why_words.sentence(place))
        missing = "the run kept no probabilities; they are computed anew"
        self.chart.show_place(place, certainty, threshold, missing)
        self.found.setVisible(self.bands.why is not None)
        self.found.setEnabled(False)

    def forget(self) -> None:
        """Nothing is found any more."""
        self.bands.set_why(None)

    def show_why(self, why: Why, name_of: Callable[[str], str], threshold: float | None) -> None:
        """Show what was found; `name_of` gives the name of a demonstration."""
        self.state.hide()
        self.sentence.setText(why_words.sentence(_sure(why)))
        missing = "this classifier gives no probabilities"
        self.chart.show_place(why.place, why.certainty, threshold, missing)
        self.bands.set_why(why)
        self.strongest.setText(why_words.strongest(why))
        name = name_of(why.place.demonstration)
        lines = [why_words.method(why), why_words.recogniser(why, name)]
        if not why.kept and why.certainty is not None:
            lines.append("The run kept no probabilities; those above are of this recogniser.")
        self.method.setText("\n".join([*lines, *why.remarks]))
        columns = [
            (action, self._role(action, why.place), why.neighbours[action])
            for action in (why.favoured, why.against)
        ]
        self.neighbours.show_neighbours(columns, name_of)
        self.found.setEnabled(True)
        self.found.show()

    def _role(self, action: str, place: Interval) -> str:
        """What an action is at the place."""
        if action == place.predicted:
            return "predicted"
        if action == place.human:
            return "coded"
        return "most probable other one"

    def say(self, told: str, verb: str) -> None:
        """Tell how far it is, beside a button."""
        self.state_text.setText(told)
        self.stop.setText(verb)
        self.stop.setAccessibleName(verb)
        self.state.show()


def _sure(why: Why) -> Interval:
    """The place with how probable its prediction is, where only the explanation knows that."""
    place = why.place
    if place.confidence is not None or place.predicted is None or why.certainty is None:
        return place
    sure = why.certainty.of_action(place.predicted, place.start, place.end)
    return replace(place, confidence=sure)
