"""The fields that choose a recogniser and its latency."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QSpinBox, QWidget

from forcelab.gui.capture.phase import Phase
from forcelab.gui.capture.recognising import LATENCIES, Choice
from forcelab.gui.capture.session import Session
from forcelab.gui.choosing import ask_file
from forcelab.gui.review.narrow_list import NarrowList

__all__ = ["RecogniserChoice"]

#: Milliseconds by which the arrows change the latency.
STEP = 50
#: Under which a row of the list keeps what is said of it.
TIP = Qt.ItemDataRole.ToolTipRole


class RecogniserChoice:
    """Fields for a form; changed by nobody while something is recorded.

    Parameters
    ----------
    session : Session
    parent : QWidget
        Over which the dialog for files stands.

    Attributes
    ----------
    which : NarrowList
    latency : QSpinBox
    nothing : QLabel
        What to do where no recogniser is trained.
    """

    def __init__(self, session: Session, parent: QWidget) -> None:
        self._session, self._parent = session, parent
        self._offered: tuple[Choice, ...] = ()
        self.which = NarrowList()
        self.which.setAccessibleName("Recogniser that labels what comes")
        self.which.activated.connect(self._chosen)
        self.latency = QSpinBox()
        self.latency.setRange(LATENCIES[0], LATENCIES[-1])
        self.latency.setSingleStep(STEP)
        self.latency.setSuffix(" ms")
        self.latency.setValue(session.recognising.latency)
        self.latency.setKeyboardTracking(False)
        self.latency.setAccessibleName("Latency of the labels in milliseconds")
        self.latency.setToolTip(
            "How long a label waits for what follows its force: the longer, the surer"
        )
        self.latency.valueChanged.connect(session.recognising.set_latency)
        self.nothing = QLabel(
            "No recogniser is trained in this project; train one in Review, or choose a file.",
            parent,  # alone it would be a window for a moment
        )
        self.nothing.setWordWrap(True)
        session.changed.connect(self._enable)
        session.recognising.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Offer what there is now."""
        recognising = self._session.recognising
        self._offered = recognising.choices()
        self.which.clear()
        self.which.addItem("none")
        for choice in self._offered:
            self.which.addItem(choice.name)
            self.which.setItemData(self.which.count() - 1, choice.about or str(choice.path), TIP)
        self.which.addItem("From a file…")
        chosen = recognising.choice
        paths = [one.path for one in self._offered]
        self.which.setCurrentIndex(0 if chosen is None else 1 + paths.index(chosen.path))
        self.which.setToolTip(self.which.currentData(TIP) or "")
        self._enable()

    def _enable(self) -> None:
        """The recogniser of a recording stays the same from its start to its end."""
        free = self._session.phase in (Phase.APART, Phase.CONNECTING, Phase.READY)
        there = self._session.document.project is not None
        self.which.setEnabled(free and there)
        self.latency.setEnabled(free and self._session.recognising.choice is not None)
        self.nothing.setVisible(there and not self._offered)

    def _chosen(self, row: int) -> None:
        """Take what was chosen in the list."""
        if 1 <= row <= len(self._offered):
            self._session.recognising.choose(self._offered[row - 1])
        elif row == 0:
            self._session.recognising.choose(None)
        else:
            self._ask()
        self.refresh()

    def _ask(self) -> None:
        """Let a file be chosen."""
        kinds = "Recognisers (*.skops)"
        path = ask_file(self._parent, "Recogniser", "recogniser", kinds)
        if path is not None:
            self._session.recognising.choose(Choice(path.stem, path))
