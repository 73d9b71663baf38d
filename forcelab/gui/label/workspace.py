"""The Label workspace: panels on one time axis, video and lists beside them, playback below."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
from itertools import accumulate

import numpy as np
from PySide6.QtCore import QByteArray, QEvent, QObject, QSize, Qt, QTimer
from PySide6.QtGui import QAction, QResizeEvent, QShowEvent
from PySide6.QtWidgets import QDockWidget, QSplitter, QStackedWidget, QTabBar, QWidget

from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.label.actions import ActionList
from forcelab.gui.label.history import HistoryView
from forcelab.gui.label.key_labelling import KeyLabelling
from forcelab.gui.label.overview import Overview
from forcelab.gui.label.playback import Player
from forcelab.gui.label.ruler import Ruler
from forcelab.gui.label.scalogram import ScalogramPanel
from forcelab.gui.label.segment_list import SegmentTable
from forcelab.gui.label.traces import ForcePanel
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.label.transport import Transport
from forcelab.gui.label.video import VideoPanels, VideoSelection
from forcelab.gui.layout import LAYOUT, Dock, DockedWindow, page_layout, placeholder
from forcelab.signals.contacts import ContactEvent, find_contacts

#: Contact events less clear than this are not snapped to: nobody sees them in the curves, and where
#: nothing is touched there are several a second, with no room between them for frames and samples.
CLEAR = 3.0


class Timeline(QWidget):
    """Ruler, tracks, panels, overview and transport, from top to bottom.

    Panels have shares of the room that the tracks leave between ruler and overview. Ruler, tracks
    and transport are always there, the tracks compact where the first panel would have no room
    else; of the panels, and of the overview after them, those are hidden that have no room.
    """

    def __init__(
        self,
        ruler: QWidget,
        tracks: TrackPanel,
        panels: dict[QWidget, int],
        overview: QWidget,
        transport: QWidget,
    ) -> None:
        super().__init__()
        self.splitter = QSplitter(Qt.Orientation.Vertical, childrenCollapsible=False)
        rows: list[tuple[QWidget, int]] = [(tracks, 0), *panels.items()]
        for i, (widget, share) in enumerate(rows):
            self.splitter.addWidget(widget)
            self.splitter.setStretchFactor(i, share)
        self._shares = tuple(panels.values())
        self._ruler, self._tracks, self._transport = ruler, tracks, transport
        self._optional: tuple[QWidget, ...] = (*panels, overview)
        self._switched_off: set[QWidget] = set()
        self._fitted = False
        page_layout(self, ruler, self.splitter, overview, transport, growing=self.splitter)

    def set_shown(self, panel: QWidget, shown: bool) -> None:
        """Show a panel where there is room for it, or hide it."""
        if shown:
            self._switched_off.discard(panel)
        else:
            self._switched_off.add(panel)
        self._fit()

    def distribute_room(self) -> None:
        """Give the tracks their rows and the panels their shares of the rest."""
        rows, total = self._tracks.sizeHint().height(), sum(self._shares)
        rest = max(self.splitter.height() - rows, total)
        self.splitter.setSizes([rows, *(rest * share // total for share in self._shares)])

    # Qt

    def minimumSizeHint(self) -> QSize:
        """Wide enough for all, high enough for what is never hidden."""
        widgets: list[QWidget] = [self._ruler, self._tracks, self._transport, *self._optional]
        width = max(_least_size(widget).width() for widget in widgets)
        return QSize(width, self._least_height(compact=True))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fitted = True
        self._fit()

    def event(self, event: QEvent) -> bool:
        """Fit again when a panel needs more room."""
        if event.type() == QEvent.Type.LayoutRequest:
            self._fit()
        return super().event(event)

    # Inside

    def _fit(self) -> None:
        """Hide what has no room or was switched off."""
        handle = self.splitter.handleWidth()
        shown = [widget for widget in self._optional if widget not in self._switched_off]
        heights = [_least_size(widget).height() + handle for widget in shown]
        room = self.height() - self._least_height(compact=False)
        compact = self._fitted and room < next(iter(heights), 0)
        self._tracks.set_compact(compact)
        room = self.height() - self._least_height(compact=compact)
        # What matters less does not overtake; before the timeline is laid out, all has room.
        needed = accumulate(heights)
        fitting = {w for w, height in zip(shown, needed, strict=True) if height <= room}
        for widget in self._optional:
            widget.setVisible(widget in fitting or (widget in shown and not self._fitted))
        self._tracks.setVisible(self._tracks not in self._switched_off)

    def _least_height(self, *, compact: bool) -> int:
        """The least height of what is never hidden."""
        return (
            _least_size(self._ruler).height()
            + self._tracks.least_height(compact=compact)
            + _least_size(self._transport).height()
        )


def _least_size(widget: QWidget) -> QSize:
    return widget.minimumSizeHint().expandedTo(widget.minimumSize())


#: From this width on, in pixels, a video gets more than the lists need.
LARGE = 1400


class LabelWorkspace(DockedWindow):
    """Everything for labelling one demonstration."""

    def __init__(self, document: Document, jobs: Jobs, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowFlags(Qt.WindowType.Widget)
        self.document = document
        self.jobs = jobs
        self.player = Player(document, parent=self)
        self.tracks = TrackPanel(document)
        self.force = ForcePanel(document, jobs)
        self.scalogram = ScalogramPanel(document, jobs)
        self.videos = VideoSelection(document, self)
        self.video = VideoPanels(document, self.videos)
        self.vocabulary = ActionList(document)
        self.segments = SegmentTable(document)
        self.history = HistoryView(document)
        self.overview = Overview(document, self.force)
        self.transport = Transport(document, self.player)
        self.tracks.play_requested.connect(self.player.play_span)
        self.toggles: dict[str, QAction] = {}
        self._contacts_of = ""
        # name, text in the View menu, panel, share of the height
        panels: tuple[tuple[str, str, QWidget, int], ...] = (
            ("force", "Forces", self.force, 5),
            ("scalogram", "Scalogram", self.scalogram, 3),
        )
        self._timeline = Timeline(
            Ruler(document),
            self.tracks,
            {panel: share for _, _, panel, share in panels},
            self.overview,
            self.transport,
        )
        self._splitter = self._timeline.splitter
        self._add_action("tracks", "Tracks", partial(self._timeline.set_shown, self.tracks))
        for name, text, panel, _ in panels:
            self._add_action(name, text, partial(self._timeline.set_shown, panel))
        self._add_action("segments_behind", "Segments behind the signals", self._set_tinted)
        self._stack = QStackedWidget()
        self._stack.addWidget(self._empty_page())
        self._stack.addWidget(self._timeline)
        self.setCentralWidget(self._stack)
        self.key_labelling = KeyLabelling(
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
        #: The heights of the lists once there are segments; None while there are.
        self._list_heights: tuple[int, int] | None = None
        self._room_distributed = False
        #: The widths that the lists were given at first: nobody has dragged them if they have them.
        self._standard_widths: dict[QDockWidget, int] | None = None
        self._video_has_room = False  # nobody has seen one yet, or it has its place
        document.demonstration_changed.connect(self._demonstration_changed)
        document.tracks_changed.connect(self._fit_lists)
        self._demonstration_changed()

    def toggles_without(self, names: Collection[str]) -> list[QAction]:
        """What shows and hides the panels but for some."""
        return [action for name, action in self.toggles.items() if name not in names]

    @property
    def settled(self) -> bool:
        """Whether video and scalogram show what was requested."""
        return self.video.settled and self.scalogram.settled

    def release(self) -> None:
        """Stop playback and background work, before the window closes."""
        self.player.stop()
        self.video.close_video()

    # Lending

    def lend(self) -> tuple[QWidget, QWidget]:
        """Give timeline and video to another workspace, until :meth:`take_back`."""
        if self.centralWidget() is self._stack:
            self._restore_lists()
            self.takeCentralWidget()
            self.setCentralWidget(QWidget())  # or the lists would spread over the room
        return self._stack, self.video

    def take_back(self) -> None:
        if self.centralWidget() is not self._stack:
            self.setCentralWidget(self._stack)
            self._stack.show()
            self._docks["video"].setWidget(self.video)
            self.video.show()
            self._show_docks()
            self.widen()  # the window may have been smaller then
            QTimer.singleShot(0, self, self._fit_lists)

    # Layout

    def restore_layout(self) -> None:
        self.force.source.restore_choices()
        if self.restore_docks("label"):
            self._room_distributed = self._video_has_room = True
            self._splitter.restoreState(QByteArray(settings.data("label/panels")))
        if settings.flag("label/side_by_side"):
            self.videos.show_all()
        for name in settings.strings("label/hidden"):
            if name in self.toggles:
                self.toggles[name].setChecked(False)

    def remember_layout(self) -> None:
        """Store the layout, and what panels show."""
        self.force.source.save_choices()
        self._restore_lists()
        self.store_docks("label")
        settings.store("label/panels", bytes(self._splitter.saveState().data()))
        settings.store("label/side_by_side", self.videos.side_by_side)
        hidden = [name for name, action in self.toggles.items() if not action.isChecked()]
        settings.store("label/hidden", hidden)

    def reset_layout(self) -> None:
        """Put every panel back where it was at first."""
        for action in self.toggles.values():
            action.setChecked(True)
        self.restoreState(self._standard, LAYOUT)
        self._show_docks()
        self._distribute_room()

    # Qt

    def showEvent(self, event: QShowEvent) -> None:
        """Share out the room once there is some, unless a layout was restored."""
        super().showEvent(event)
        if not self._room_distributed:
            self._room_distributed = True
            QTimer.singleShot(0, self, self._distribute_room)  # not once it is gone
        elif not self._widths:  # a layout was remembered
            QTimer.singleShot(0, self, self.note_widths)
        QTimer.singleShot(0, self, self._fit_lists)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep an empty list small, and a video as large as a large screen allows."""
        wide_before = event.oldSize().width() >= LARGE
        super().resizeEvent(event)
        if wide_before != (self.width() >= LARGE) and self._widths == self._standard_widths:
            self._size_docks()
        if self._list_heights is not None:
            self._share_height(0.0)

    # Inside

    def _set_tinted(self, tinted: bool) -> None:
        for panel in (self.force, self.scalogram):
            panel.set_tinted(tinted)

    def _add_dock(self, name: str, text: str, content: QWidget) -> None:
        """Put a list beside the panels, with the action that shows and hides it."""
        dock = Dock(text)
        dock.setObjectName(name)
        dock.setWidget(content)
        self.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, dock)
        self._docks[name] = dock
        self._add_action(name, text, lambda _: self._show_docks())
        # Closed by its own button, and not merely behind another tab or with nothing to show.
        dock.installEventFilter(self)

    def _add_action(self, name: str, text: str, show: Callable[[bool], object]) -> None:
        """Add the entry of a panel in the View menu."""
        action = QAction(text, self, checkable=True, checked=True)
        action.toggled.connect(show)
        self.toggles[name] = action

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Uncheck the action of a dock that was closed by its own button."""
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

    def _distribute_room(self) -> None:
        """Give lists and video their first shares of the room, and tracks their rows."""
        self._size_docks()
        self._timeline.distribute_room()

    def _size_docks(self) -> None:
        """Give the lists a quarter of the width, and the video a picture's shape.

        On a large screen a video gets more than that: it is what the coder looks at most.
        """
        video, actions, segments, *_ = self._docks.values()
        width = min(max(self.width() // 4, 230), 420)
        if self.video.has_video and self.width() >= LARGE:
            width = min(self.width() * 3 // 8, 720)
        # All of them: one that is hidden, as the video may be, has no say.
        self.set_widths([video, actions, segments], width)
        self._standard_widths = dict(self._widths)
        rest = max(self.height() - width * 3 // 4, 2)
        heights = [width * 3 // 4, rest // 2, rest // 2]
        self.resizeDocks([video, actions, segments], heights, Qt.Orientation.Vertical)
        self._list_heights = None  # which they have now
        self._fit_lists()

    def _fit_lists(self) -> None:
        """Give the actions the room of the list of segments while that is empty."""
        if not self.isVisible() or self.centralWidget() is not self._stack:
            return
        if self.document.editor.segments or self.document.demonstration is None:
            self._restore_lists()
        elif self._list_heights is None:
            actions, below = self._stacked_lists()
            floating = actions.isFloating() or below.isFloating()
            if actions.isVisible() and not floating and actions.x() == below.x():
                self._list_heights = actions.height(), below.height()
                self._share_height(0.0)

    def _restore_lists(self) -> None:
        """Give the lists the shares back that they had before one was empty."""
        if self._list_heights is not None:
            actions, below = self._list_heights
            self._list_heights = None
            self._share_height(below / max(actions + below, 1))

    def _share_height(self, share: float) -> None:
        """Give the lower list a share of the height of both, or the least that it needs."""
        video, (actions, below) = self._docks["video"], self._stacked_lists()
        both = actions.height() + below.height()
        lower = max(round(share * both), below.minimumSizeHint().height())
        tabs = max((bar.height() for bar in self._tab_bars()), default=0)
        docks, heights = [actions, below], [both - lower, lower + tabs]
        if video.isVisibleTo(self) and not video.isFloating():  # or it would give some of its own
            docks, heights = [video, *docks], [video.height(), *heights]
        self.resizeDocks(docks, heights, Qt.Orientation.Vertical)

    def _stacked_lists(self) -> tuple[QDockWidget, QDockWidget]:
        """The actions, and below them the segments or the history, whichever is in front."""
        if (layout := self.layout()) is not None:
            layout.activate()  # for the heights of a layout that was changed just now
        history = self._docks["history"]
        raised = any(bar.tabText(bar.currentIndex()) == "History" for bar in self._tab_bars())
        return self._docks["actions"], history if raised else self._docks["segments"]

    def _tab_bars(self) -> list[QTabBar]:
        """The tabs of docks that stand behind one another."""
        bars = self.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly)
        return [bar for bar in bars if bar.isVisibleTo(self)]

    def _show_docks(self) -> None:
        """Show the docks whose action is checked; the video only where there is one."""
        for name, dock in self._docks.items():
            available = name != "video" or self.video.has_video
            dock.setVisible(available and self.toggles[name].isChecked())

    def _empty_page(self) -> QWidget:
        """The page that is shown while no demonstration is open."""
        label = placeholder()
        choose = "Choose a demonstration on the left to label it."
        sentence = "Import a recording to label it here."
        document = self.document
        document.listing_changed.connect(
            lambda: label.setText(choose if document.infos else sentence)
        )
        return label

    def _demonstration_changed(self) -> None:
        """Show the demonstration that is open, and find its contact events."""
        is_open = self.document.demonstration is not None
        self._stack.setCurrentIndex(1 if is_open else 0)
        self._show_docks()
        if self.video.has_video and not self._video_has_room:
            self._video_has_room = True
            QTimer.singleShot(0, self, self._distribute_room)
        demonstration = self.document.demonstration
        if self._contacts_of == self.document.id:
            return
        self._contacts_of = self.document.id
        self.jobs.cancel("contacts")
        if demonstration is not None:
            finding = find_contacts(demonstration.times, demonstration.signals)
            self.jobs.run(finding, self._contacts_found, key="contacts")

    def _contacts_found(self, events: tuple[ContactEvent, ...]) -> None:
        clear = [event.time for event in events if event.clearness >= CLEAR]
        self.document.view.contacts = np.array(clear, dtype=np.float64)
