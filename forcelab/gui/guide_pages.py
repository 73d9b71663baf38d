"""Which page of the guide is about what is in front, and the key that opens it in any dialog."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import QTabWidget, QWidget

from forcelab.gui.key_events import KeyEventFilter, wants_key
from forcelab.gui.shortcuts import keys

#: The place in the guide by the class of a view or dialog; the innermost one counts.
PAGES = {
    "Welcome": "index",
    "LabelWorkspace": "label",
    "ActionList": "label#actions",
    "DemonstrationList": "label#done-and-what-is-left",
    "SynchroniseDialog": "label#put-a-video-in-time",
    "HelpPage": "label#keys",
    "PreferencesDialog": "label#keys",
    "ReviewTab": "review",
    "QueueView": "review#queue-and-verdicts",
    "ConfusionView": "review#confusion-scores-and-why",
    "ScoresView": "review#confusion-scores-and-why",
    "ExplanationView": "review#confusion-scores-and-why",
    "ProposalsView": "review#proposals",
    "AgreementView": "review#coders",
    "LossView": "review#train",
    "TradeoffView": "review#accuracy-and-speed",
    "SettingsDialog": "method#presets",
    "TaskChoiceDialog": "recognise#what-is-tested-on-what",
    "ComparisonDialog": "recognise#runs",
    "CaptureTab": "capture",
    "DeviceList": "capture#devices",
    "RecordedDeviceDialog": "capture#devices",
    "ImportDialog": "formats#recordings",
    "LabelImportDialog": "formats#labels-in",
    "ExportDialog": "formats#labels-out",
    "FaultDialog": "questions#it-does-not-start-or-something-went-wrong",
    "GuideWindow": "index",
}


def page_about(widget: QWidget | None, front: QWidget | None) -> str:
    """The place in the guide about a widget, else about the part of the window in `front`."""
    for start in (widget, front):
        part = start
        while part is not None:
            # In tabs the keyboard may be at their names, above the page that is seen.
            shown = _page_in(part) if isinstance(part, QTabWidget) else None
            for known in (shown, part):
                if place := PAGES.get(type(known).__name__):
                    return place
            part = part.parentWidget()
    return "index"


def _page_in(tabs: QTabWidget) -> QWidget | None:
    """The page in front, which may lie alone in a room of its own."""
    page = tabs.currentWidget()
    inside = page.findChildren(QWidget, options=Qt.FindChildOption.FindDirectChildrenOnly)
    return inside[0] if type(page) is QWidget and len(inside) == 1 else page


class GuideKey(KeyEventFilter):
    """Opens the guide where the window's own shortcut does not reach: in dialogs."""

    def __init__(self, window: QWidget, open_guide: Callable[[], object]) -> None:
        super().__init__(window)
        self._window, self._open = window, open_guide
        self.follow_keys()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if (
            event.type() != QEvent.Type.KeyPress
            or not isinstance(event, QKeyEvent)
            or not isinstance(watched, QWidget)
            or watched.window() is self._window
            or wants_key(watched, event)
        ):
            return False
        key = QKeySequence(event.keyCombination())
        if key.toString(QKeySequence.SequenceFormat.PortableText) not in keys()["manual"]:
            return False
        self._open()
        return True
