"""The Label workspace: panels on one time axis, video and lists beside them, playback below."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol, runtime_checkable

import numpy as np
from PySide6.QtCore import QByteArray, QEvent, QObject, QSize, Qt, QTimer
from PySide6.QtGui import QAction, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QDockWidget, QSplitter, QStackedWidget, QVBoxLayout, QWidget

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.actions import ActionList
from forcelab.gui.label.history import HistoryView
from forcelab.gui.label.key_labelling import KeyLabelling
from forcelab.gui.label.overview import Overview
from forcelab.gui.label.playback import Player, Transport
from forcelab.gui.label.ruler import Ruler
from forcelab.gui.label.scalogram import ScalogramPanel
from forcelab.gui.label.segment_list import SegmentTable
from forcelab.gui.label.traces import ForcePanel
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.label.video import CameraSelection, VideoPanel
from forcelab.gui.layout import Dock, DockedWindow, placeholder
from forcelab.signals.contacts import ContactEvent, find_contacts


@runtime_checkable
class CompactRows(Protocol):
    """A panel that can do with less height where room is short."""

    def set_slim(self, slim: bool) -> None:
        """Whether it is to do with less."""

    def least_height(self, slim: bool) -> int:
        """Its least height in pixels, so or so."""


class Timeline(QWidget):
    """Ruler, panels, overview and transport.

    Parameters
    ----------
    ruler, overview, transport : QWidget
        Above and below the panels.
    panels : sequence of QWidget
        Which share the room between them. The first one is always there, slim where the second one
        would have no room else; of the others, and of the overview after them, those are hidden
        that have no room.
    shares : sequence of int
        How much of the room each panel gets.

    Attributes
    ----------
    splitter : QSplitter
        Between the panels.
    """

    def __init__(
        self,
        ruler: QWidget,
        panels: tuple[QWidget, ...],
        shares: tuple[int, ...],
        overview: QWidget,
        transport: QWidget,
    ) -> None:
        super().__init__()
        self.splitter = QSplitter(Qt.Orientation.Vertical)
        self.splitter.setChildrenCollapsible(False)
        for i, (panel, share) in enumerate(zip(panels, shares, strict=True)):
            self.splitter.addWidget(panel)
            self.splitter.setStretchFactor(i, share)
        self._always = (ruler, panels[0], transport)
        self._optional = (*panels[1:], overview)
        self._unwanted: set[QWidget] = set()
        self._fitted = False
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        for widget, share in ((ruler, 0), (self.splitter, 1), (overview, 0), (transport, 0)):
            column.addWidget(widget, share)

    def set_wanted(self, panel: QWidget, wanted: bool) -> None:
        """Show a panel where there is room for it, or do not."""
        if wanted:
            self._unwanted.discard(panel)
        else:
            self._unwanted.add(panel)
        self._fit()

    # Qt

    def minimumSizeHint(self) -> QSize:
        """Wide enough for all, high enough for what never gives way."""
        wide = max(_minimum_height(widget).width() for widget in (*self._always, *self._optional))
        return QSize(wide, self._least_always(slim=True))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show what has room."""
        super().resizeEvent(event)
        self._fitted = True
        self._fit()

    def event(self, event: QEvent) -> bool:
        """A panel may need more room than before."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._fit()
        return super().event(event)

    # Inside

    def _fit(self) -> None:
        """Hide what has no room, or is not wanted."""
        always = self._always[1]
        room = self.height() - self._least_always(slim=False)
        if isinstance(always, CompactRows):
            first = next((panel for panel in self._optional if panel not in self._unwanted), None)
            needed = (
                0
                if first is None
                else _minimum_height(first).height() + self.splitter.handleWidth()
            )
            slim = self._fitted and room < needed
            always.set_slim(slim)
            room = self.height() - self._least_always(slim)
        roomy = True
        for widget in self._optional:
            if widget not in self._unwanted:
                room -= _minimum_height(widget).height() + self.splitter.handleWidth()
                # What matters less does not overtake; before it is laid out, all has room.
                roomy = roomy and (room >= 0 or not self._fitted)
            widget.setVisible(roomy and widget not in self._unwanted)
        always.setVisible(always not in self._unwanted)

    def _least_always(self, slim: bool) -> int:
        """The least height of what never gives way."""
        return sum(
            widget.least_height(slim)
            if isinstance(widget, CompactRows)
            else _minimum_height(widget).height()
            for widget in self._always
        )


def _minimum_height(widget: QWidget) -> QSize:
    """The least size of a widget."""
    return widget.minimumSizeHint().expandedTo(widget.minimumSize())


#: The layout's version: a layout of another one is not restored.
LAYOUT = 1


class LabelWorkspace(DockedWindow):
    """Everything for labelling one demonstration.

    Parameters
    ----------
    document : Document
    jobs : Jobs
        Runs what takes long.
    """

    def __init__(self, document: Document, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowFlags(Qt.WindowType.Widget)
        self.document = document
        self.jobs = jobs
        self.player = Player(document, parent=self)
        self.tracks = TrackPanel(document)
        self.force = ForcePanel(document, jobs)
        self.scalogram = ScalogramPanel(document, jobs)
        self.cameras = CameraSelection(document, self)
        self.video = VideoPanel(document, self.cameras)
        self.vocabulary = ActionList(document)
        self.segments = SegmentTable(document)
        self.history = HistoryView(document)
        self.overview = Overview(document, self.force)
        self.transport = Transport(document, self.player)
        self.tracks.play_requested.connect(self.player.play_stretch)
        self.toggles: dict[str, QAction] = {}
        self._sought = ""
        panels = (self.tracks, self.force, self.scalogram)
        self._timeline = Timeline(Ruler(document), panels, (0, 5, 3), self.overview, self.transport)
        self._splitter = self._timeline.splitter
        self._add_panel("tracks", "Tracks", self.tracks)
        self._add_panel("force", "Forces", self.force)
        self._add_panel("scalogram", "Scalogram", self.scalogram)
        self._stack = QStackedWidget()
        self._stack.addWidget(self._nothing())
        self._stack.addWidget(self._timeline)
        self.setCentralWidget(self._stack)
        self.strokes = KeyLabelling(
            document,
            self.window(),
            lambda: 1 / self.tracks.seconds_per_pixel,
            shown=self._stack.isVisible,  # here or where it was lent to
        )
        self._docks: dict[str, QDockWidget] = {}
        self._add_dock("video", "Video", self.video)
        self._add_dock("actions", "Actions", self.vocabulary)
        self._add_dock("segments", "Segments", self.segments)
        self._add_dock("history", "History", self.history)
        self._arrange()
        self._standard = self.saveState(LAYOUT)
        self._before_lending = self._standard
        self._shared_out = False
        document.demonstration_changed.connect(self._demonstration_changed)
        self._demonstration_changed()

    @property
    def settled(self) -> bool:
        """Whether video and scalogram show what was asked for."""
        return self.video.settled and self.scalogram.settled

    def let_go(self) -> None:
        """Stop what works in the background, before the window closes."""
        self.player.stop()
        self.video.close_video()

    # Lending

    def lend(self) -> tuple[QWidget, QWidget]:
        """Give timeline and video to another workspace, until they are taken back."""
        if self.centralWidget() is self._stack:
            # The lists spread over the room that is left.
            self._before_lending = self.saveState(LAYOUT)
            self.takeCentralWidget()
        return self._stack, self.video

    def take_back(self) -> None:
        """Have timeline and video again."""
        if self.centralWidget() is not self._stack:
            self.setCentralWidget(self._stack)
            self._stack.show()
            self._docks["video"].setWidget(self.video)
            self.video.show()
            self.restoreState(self._before_lending, LAYOUT)
            self._show_docks()
            self.widen()  # the window may have been smaller then

    # Layout

    def restore_layout(self) -> None:
        """Put the panels where they were when the window was last closed."""
        self.force.source.restore_choices()
        state = settings.data("label/layout")
        if state and self.restoreState(QByteArray(state), LAYOUT):
            self._shared_out = True
            self._splitter.restoreState(QByteArray(settings.data("label/panels")))
        for name in settings.strings("label/hidden"):
            if name in self.toggles:
                self.toggles[name].setChecked(False)

    def remember_layout(self) -> None:
        """Keep where the panels are, and what they show."""
        self.force.source.save_choices()
        settings.store("label/layout", bytes(self.saveState(LAYOUT).data()))
        settings.store("label/panels", bytes(self._splitter.saveState().data()))
        hidden = [name for name, action in self.toggles.items() if not action.isChecked()]
        settings.store("label/hidden", hidden)

    def reset_layout(self) -> None:
        """Put every panel back where it was at first."""
        for action in self.toggles.values():
            action.setChecked(True)
        self.restoreState(self._standard, LAYOUT)
        self._show_docks()
        self._share_out()

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        """Share out the room once there is some, unless a layout was remembered."""
        super().showEvent(event)
        if not self._shared_out:
            self._shared_out = True
            QTimer.singleShot(0, self, self._share_out)  # not once it is gone
        elif not self._widths:  # a layout was remembered
            QTimer.singleShot(0, self, self.note_widths)

    # Inside

    def _add_panel(self, name: str, text: str, panel: QWidget) -> None:
        """Have an action show and hide a panel of the timeline."""
        self._add_action(name, text, partial(self._timeline.set_wanted, panel))

    def _add_dock(self, name: str, text: str, content: QWidget) -> None:
        """Put a list beside the panels; its action shows and hides it."""
        dock = Dock(text)
        dock.setObjectName(name)
        dock.setWidget(content)
        self.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, dock)
        self._docks[name] = dock
        self._add_action(name, text, lambda _: self._show_docks())
        # Closed by its own button, and not merely behind another tab or with nothing to show.
        dock.installEventFilter(self)

    def _add_action(self, name: str, text: str, show: Callable[[bool], object]) -> None:
        """The entry of a panel in the View menu."""
        action = QAction(text, self)
        action.setCheckable(True)
        action.setChecked(True)
        action.toggled.connect(show)
        self.toggles[name] = action

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Remember that a list was closed by its own button."""
        if event.type() == QEvent.Type.Close and isinstance(watched, QDockWidget):
            self.toggles[watched.objectName()].setChecked(False)
        return super().eventFilter(watched, event)

    def _arrange(self) -> None:
        """The first layout: video above actions, segments and history behind one another."""
        video, actions, segments, history = self._docks.values()
        vertical = Qt.Orientation.Vertical
        self.splitDockWidget(video, actions, vertical)
        self.splitDockWidget(actions, segments, vertical)
        self.tabifyDockWidget(segments, history)
        segments.raise_()

    def _share_out(self) -> None:
        """Give the lists a quarter of the width, the video a picture's shape, tracks their rows."""
        video, actions, segments, _ = self._docks.values()
        width = min(max(self.width() // 4, 230), 420)
        # All of them: one that is hidden, as the video may be, has no say.
        self.set_widths([video, actions, segments], width)
        rest = max(self.height() - width * 3 // 4, 2)
        heights = [width * 3 // 4, rest // 2, rest // 2]
        self.resizeDocks([video, actions, segments], heights, Qt.Orientation.Vertical)
        rows = self.tracks.sizeHint().height()
        rest = max(self._splitter.height() - rows, 8)
        self._splitter.setSizes([rows, rest * 5 // 8, rest * 3 // 8])

    def _show_docks(self) -> None:
        """Show the lists that are wanted; a video only where there is one."""
        for name, dock in self._docks.items():
            wanted = name != "video" or self.video.wanted
            dock.setVisible(wanted and self.toggles[name].isChecked())

    def _nothing(self) -> QWidget:
        """What is said while no demonstration is open."""
        label = placeholder()
        choose = "Choose a demonstration on the left to label it."
        bring = "Import a recording, and it can be labelled here."
        document = self.document
        document.listing_changed.connect(lambda: label.setText(choose if document.infos else bring))
        return label

    def _demonstration_changed(self) -> None:
        """Show the demonstration that is open, and find its contact events."""
        there = self.document.demonstration is not None
        self._stack.setCurrentIndex(1 if there else 0)
        self._show_docks()
        demonstration = self.document.demonstration
        if self._sought == self.document.id:
            return
        self._sought = self.document.id
        self.jobs.cancel("contacts")
        if demonstration is not None:
            finding = find_contacts(demonstration.times, demonstration.signals)
            self.jobs.run(finding, self._found, key="contacts")

    def _found(self, events: tuple[ContactEvent, ...]) -> None:
        """Offer the contact events for snapping."""
        self.document.set_contacts(np.array([event.time for event in events]))
