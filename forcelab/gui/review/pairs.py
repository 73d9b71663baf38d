"""Timeline pairs: human tracks above predicted ones, with search, order and legend."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QHBoxLayout,
    QLabel,
    QMenu,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.document import Document
from forcelab.gui.figures import text
from forcelab.gui.figures.axes import Axis, draw_bottom
from forcelab.gui.figures.pairs import TimelinePairs
from forcelab.gui.figures.tracks import LabelStyle, Legend, styles_in_order
from forcelab.gui.file_dialogs import export_picture
from forcelab.gui.jobs import Jobs
from forcelab.gui.kit import text_size
from forcelab.gui.label.swatches import style_of
from forcelab.gui.layout import PageOrPlaceholder, fill_layout, page_layout, search_field
from forcelab.gui.review.pair_entries import (
    ExtraRows,
    PairEntry,
    PairOrder,
    filter_and_sort,
    other_coders,
    read_tracks,
    tracks_by_coder,
)
from forcelab.gui.review.pairs_list import MARGIN, Hit, PairsList, hit_interval
from forcelab.gui.review.reviewed_run import blind_demonstrations, untested_text, with_keys
from forcelab.gui.shortcuts import keys
from forcelab.gui.text import escape_ampersands
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import combo_box
from forcelab.labels import Segments
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.run_result import RunResult, action_styles
from forcelab.vocabulary import Vocabulary


class ActionStyles(dict[str, LabelStyle]):
    """Looks of actions; grey where an action is not known."""

    def __missing__(self, action: str) -> LabelStyle:
        return style_of(Vocabulary(), action)


ROWS_SETTING, ORDER_SETTING = "review/pairs/rows", "review/pairs/order"
STRETCHED_SETTING = "review/pairs/stretched"
#: The steps of recognition that can be shown below a pair.
STAGES = ("raw", "threshold", "median")
#: How the choice of a coder's row is remembered, apart from the stages.
CODER_PREFIX = "coder "


class PairsTools(QWidget):
    """Search, order, time axis, further rows and export."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._extra_rows = set(settings.strings(ROWS_SETTING))
        self.coders: tuple[str, ...] = ()
        self.search = search_field("Filter pairs", "Filter timeline pairs by name or task")
        self.search.setMinimumWidth(60)
        self.order = combo_box(
            "Order of the timeline pairs",
            {"By name": "name", "Worst first": "worst", "Longest first": "longest"},
        )
        self.order.setCurrentIndex(max(0, self.order.findData(settings.text(ORDER_SETTING))))
        self.stretched = QCheckBox("Full width")
        self.stretched.setAccessibleName("Stretch each demonstration to the full width")
        self.stretched.setToolTip(self.stretched.accessibleName())
        self.stretched.setChecked(settings.flag(STRETCHED_SETTING))
        self.rows = _tool_button("Rows", "Further rows below each pair")
        self.menu = QMenu(self.rows)
        self.rows.setMenu(self.menu)
        self.rows.setStyleSheet(
            "QToolButton { padding-right: 1.2em; }"
            "QToolButton::menu-indicator { subcontrol-position: right center; right: 0.3em; }"
        )
        self.rows.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.export = _tool_button("Export…", "Save the pairs as SVG, PDF or PNG")
        parts = (self.search, 1), self.order, self.stretched, self.rows, self.export
        margins = int(MARGIN), 6, int(MARGIN), 6
        fill_layout(QHBoxLayout(self), *parts, margins=margins, spacing=6)
        self.search.textChanged.connect(self.changed)
        self.order.currentIndexChanged.connect(self._remember)
        self.stretched.toggled.connect(self._remember)
        self.offer(())

    @property
    def chosen_order(self) -> PairOrder:
        order: PairOrder = self.order.currentData()
        return order

    @property
    def extra_rows(self) -> ExtraRows:
        stages = tuple(stage for stage in STAGES if stage in self._extra_rows)
        coders = tuple(name for name in self.coders if CODER_PREFIX + name in self._extra_rows)
        return ExtraRows(stages, coders)

    def offer(self, coders: Collection[str]) -> None:
        """Offer the rows of these coders besides those of the recogniser."""
        self.coders = tuple(coders)
        self.menu.clear()
        self.menu.addSection("Before the filtered prediction")
        for key in STAGES:
            self._add(key, key)
        if coders:
            self.menu.addSection("Other coders")
        for name in coders:
            self._add(CODER_PREFIX + name, name)

    def _add(self, key: str, title: str) -> None:
        action = self.menu.addAction(escape_ampersands(title))
        action.setCheckable(True)
        action.setChecked(key in self._extra_rows)
        action.toggled.connect(partial(self._choose, key))

    def _choose(self, key: str, on: bool) -> None:
        (self._extra_rows.add if on else self._extra_rows.discard)(key)
        settings.store(ROWS_SETTING, sorted(self._extra_rows))
        self.changed.emit()

    def _remember(self, *_: object) -> None:
        settings.store(ORDER_SETTING, self.chosen_order)
        settings.store(STRETCHED_SETTING, self.stretched.isChecked())
        self.changed.emit()


class LegendStrip(QWidget):
    """The legend above the pairs, with the key of each action; `fitted` follows its height."""

    fitted = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._styles: Mapping[str, LabelStyle] = {}
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Legend of the actions")
        themes().changed.connect(self.update)

    def show_styles(self, styles: Mapping[str, LabelStyle]) -> None:
        self._styles = styles
        self.setAccessibleDescription(
            ", ".join(f"{style.sign.upper()} {name}".lstrip() for name, style in styles.items())
        )
        self._fit()
        self.update()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._fit()

    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().background))
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.scale(text_size.scale(), text_size.scale())
            self._legend.paint(painter, MARGIN, 6, colours())

    @property
    def _legend(self) -> Legend:
        return Legend(self._styles, max(self.width() / text_size.scale() - 2 * MARGIN, 1.0))

    def _fit(self) -> None:
        height = round(text_size.pixels(self._legend.height + 10))
        if height != self.minimumHeight():
            self.setFixedHeight(height)
            self.fitted.emit()


class LegendRoom(QScrollArea):
    """The room of the legend: that of some lines, beyond which it scrolls."""

    #: Pixels: as many lines as leave room for the pairs, and the first line.
    MOST, LEAST = 76, 30

    def __init__(self, legend: LegendStrip) -> None:
        super().__init__()
        self._legend = legend
        self.setWidget(legend)
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Maximum)
        legend.fitted.connect(self.updateGeometry)

    def sizeHint(self) -> QSize:
        """All lines, if they are few."""
        return QSize(160, min(self._legend.height(), round(text_size.pixels(self.MOST))))

    def minimumSizeHint(self) -> QSize:
        """One line: in a small window the timeline needs the room."""
        return QSize(60, min(self._legend.height(), round(text_size.pixels(self.LEAST))))


class AxisStrip(QWidget):
    """The time axis below the pairs, which all share."""

    HEIGHT = 38

    def __init__(self) -> None:
        super().__init__()
        self._axis: Axis | None = None
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)
        self.setAccessibleName("Time axis of the pairs")
        themes().changed.connect(self.update)

    def show_axis(self, axis: Axis | None) -> None:
        """Show this axis; none where each pair has one of its own."""
        self._axis = axis
        self.setHidden(axis is None)
        self.update()

    def sizeHint(self) -> QSize:
        return QSize(400, round(text_size.pixels(self.HEIGHT)))

    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            painter.fillRect(self.rect(), QColor(colours().background))
            text.ensure_application()
            if self._axis is not None:
                painter.setRenderHint(QPainter.RenderHint.Antialiasing)
                painter.scale(text_size.scale(), text_size.scale())
                draw_bottom(painter, self._axis, 0.5, "time (s)", colours())


def _tool_button(title: str, name: str) -> QToolButton:
    button = QToolButton()
    button.setText(title)
    button.setAccessibleName(name)
    button.setToolTip(name)
    button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    return button


#: The job that reads tracks.
TRACKS_JOB = "pairs tracks"
#: The suggested name of an exported file.
SUGGESTED_FILE = "pairs.svg"


class PairsView(QWidget):
    """The timeline pairs of the run that is reviewed."""

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document = document
        self._jobs = jobs
        self._stale = True
        self._entries: tuple[PairEntry, ...] = ()
        #: By demonstration and coder, spelt as in the run; of tested demonstrations only.
        self._tracks: dict[str, dict[str, Segments]] = {}
        self._hidden: frozenset[str] = frozenset()
        self._vocabulary = Vocabulary()
        #: Of the run's actions, as stored; None before they are read.
        self._stored_styles: Vocabulary | None = None
        self._styles: Mapping[str, LabelStyle] = {}
        self.setAccessibleName("Timeline pairs")
        self.tools = PairsTools()
        self.legend = LegendStrip()
        self.area = PairsList(document)
        self.strip = AxisStrip()
        self.note = QLabel(wordWrap=True)
        self.note.setContentsMargins(12, 2, 12, 2)
        rows = QWidget()
        page_layout(rows, LegendRoom(self.legend), self.area, self.strip, growing=self.area)
        self.pages = PageOrPlaceholder(rows)
        page_layout(self, self.tools, self.note, self.pages, growing=self.pages)
        self._connect()

    # Verbs

    def figure(self) -> TimelinePairs | None:
        """The same pairs in the same order as a figure; None where none is shown."""
        run = self.document.review.run
        if run is None or not self.area.entries:
            return None
        return TimelinePairs(
            run.title,
            tuple(
                replace(entry.pair, note=_figure_note(entry), marks=entry.marks)
                for entry in self.area.entries
            ),
            self._vocabulary,
            tuple(self._styles),
            stretched=self.tools.stretched.isChecked(),
        )

    def export(self) -> None:
        figure, title = self.figure(), "Export timeline pairs"
        if figure is None:
            self.document.show_message("There is no timeline pair to save.", True)
        else:
            export_picture(figure, self, title, SUGGESTED_FILE, self.document, self._jobs)

    # Inside

    def _connect(self) -> None:
        document = self.document
        document.review.run_changed.connect(self._run_changed)
        document.review.training_changed.connect(self._show_missing)
        document.tracks_changed.connect(self._read_open)
        document.vocabulary_changed.connect(self._recolour)
        document.listing_changed.connect(self._check_blind)
        document.author_changed.connect(self._check_blind)
        keys().changed.connect(self._show_missing)
        self.tools.changed.connect(self._choose)
        bar = self.area.verticalScrollBar()
        self.tools.order.currentIndexChanged.connect(lambda _: bar.setValue(0))
        self.tools.export.clicked.connect(self.export)
        self.area.chosen.connect(self._go_to)

    def showEvent(self, event: QShowEvent) -> None:
        """Catch up with what happened while it was hidden."""
        super().showEvent(event)
        self._stored_styles = None
        if self._stale or blind_demonstrations(self.document) != self._hidden:
            self._build()
        else:
            self._recolour()
        self._read_all()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_axis()

    def _run_changed(self) -> None:
        self._jobs.cancel(TRACKS_JOB)
        self._tracks, self._stored_styles = {}, None
        self._build()
        self._read_all()

    def _choose(self) -> None:
        self._build()
        read = {coder for tracks in self._tracks.values() for coder in tracks}
        if set(self.tools.extra_rows.coders) - read:
            self._read_all()

    def _build(self) -> None:
        self._stale = not self.isVisible()
        run, project = self.document.review.run, self.document.project
        if self._stale:
            return
        self._hidden = blind_demonstrations(self.document)
        if run is None or project is None:
            self._entries = ()
        else:
            coders = other_coders(self.document, self._hidden)
            if coders != self.tools.coders:
                self.tools.offer(coders)
            lanes = self.tools.extra_rows.lanes
            tested = (self._tested_entry(run, reviewed) for reviewed in run.tested)
            proposals = (
                PairEntry(reviewed, None, lanes(reviewed, {})) for reviewed in run.proposals
            )
            entries = (*tested, *proposals)
            self._entries = tuple(entry for entry in entries if entry.id not in self._hidden)
        self._show()

    def _tested_entry(self, run: RunResult, reviewed: DemonstrationResult) -> PairEntry:
        """A demonstration with the coder's track as it is now, as far as that is known."""
        tracks = self._tracks.get(reviewed.id, {})
        human = tracks.get(run.author, reviewed.human)
        return PairEntry(reviewed, human, self.tools.extra_rows.lanes(reviewed, tracks))

    def _show(self) -> None:
        self._vocabulary = self._current_vocabulary()
        key_of = {action: self._vocabulary[action].key for action in self._actions()}
        actions = sorted(key_of, key=lambda action: (not key_of[action], key_of[action]))
        self._styles = ActionStyles(styles_in_order(actions, self._vocabulary))
        styles, tools = self._styles, self.tools
        rows = filter_and_sort(self._entries, tools.chosen_order, tools.search.text())
        self.legend.show_styles(styles)
        self._show_missing(len(rows))
        self.area.show_entries(rows, styles, tools.stretched.isChecked())
        self._show_axis()

    def _show_axis(self) -> None:
        common = bool(self.area.entries) and not self.area.stretched
        self.strip.show_axis(self.area.arrangement.axis() if common else None)

    def _actions(self) -> tuple[str, ...]:
        """All actions in the order of occurrence: those of the run first.

        What a recogniser sees on the way to its prediction is among those, and need not be looked
        through.
        """
        run = self.document.review.run
        known = () if run is None else run.actions
        tracks = (track for entry in self._entries for track in entry.final_tracks)
        return tuple(dict.fromkeys((*known, *(s.action for track in tracks for s in track))))

    def _current_vocabulary(self) -> Vocabulary:
        document, run = self.document, self.document.review.run
        if run is None or document.project is None:
            return self._vocabulary  # pairs that are shown still keep their looks until they go
        if self._stored_styles is None:
            self._stored_styles = action_styles(document.project, run)
        vocabulary = self._stored_styles.with_actions(*self._actions())
        task = "" if document.demonstration is None else document.demonstration.task
        return with_keys(vocabulary, document.vocabulary, task=task, apart=run.apart)

    def _show_missing(self, shown: int | None = None) -> None:
        """Say why there is nothing to show, or not all."""
        run = self.document.review.run
        shown = len(self.area.entries) if shown is None else shown
        self.pages.say("" if run is not None and shown else self._missing(run))
        self.tools.setHidden(not self._entries)
        count = 0
        if run is not None and self._entries:
            demonstrations = (*run.tested, *run.proposals)
            count = sum(reviewed.id in self._hidden for reviewed in demonstrations)
        self.note.setText(f"Demonstrations left out while you code them blind: {count}.")
        self.note.setHidden(not count)

    def _missing(self, run: RunResult | None) -> str:
        """Why there is nothing to show."""
        if run is None and self.document.review.training:
            return (
                "A recogniser is being trained; human and predicted timelines appear here when it "
                "is."
            )
        if run is None:
            key = keys().shown("train")
            train = f"Press {key} to train" if key else "Train a recogniser"
            return f"{train}; human and predicted timelines then appear here in pairs."
        if self._entries:
            return "No demonstration fits the filter."
        if self._hidden:
            return "All demonstrations of this run are hidden while you code them blind."
        return untested_text(run, "This run tested no demonstration.")

    # Going there

    def _go_to(self, entry: PairEntry, hit: Hit) -> None:
        document = self.document
        if hit.target is not None:
            document.review.examine(hit_interval(entry, hit.target))
        elif document.open_demonstration(entry.id) and hit.time is not None:
            document.view.seek(hit.time)

    # What the project holds now

    def _read_all(self) -> None:
        """Read the tracks of all demonstrations but the hidden ones, in the background."""
        run, project = self.document.review.run, self.document.project
        if run is None or project is None or not self.isVisible():
            return
        ids = {info.id for info in self.document.infos}.difference(self._hidden)
        job = read_tracks(project.path, run, (run.author, *self.tools.extra_rows.coders), ids)
        self._jobs.run(job, self._take_tracks, key=TRACKS_JOB)

    def _take_tracks(self, tracks: dict[str, dict[str, Segments]]) -> None:
        if tracks != self._tracks:
            self._tracks = tracks
            self._build()

    def _read_open(self) -> None:
        """Read the open demonstration's tracks at once."""
        document, run, project = self.document, self.document.review.run, self.document.project
        old = next((entry for entry in self._entries if entry.id == document.id), None)
        if run is None or project is None or old is None or old.human is None:
            return
        if not self.isVisible():
            return
        coders = (run.author, *self.tools.extra_rows.coders)
        try:
            tracks = tracks_by_coder(project, run, old.reviewed, coders)
        except ForcelabError as error:
            document.show_message(str(error), True)
            return
        if tracks == self._tracks.get(old.id):
            return
        self._tracks[old.id] = tracks
        if self._jobs.awaits(TRACKS_JOB):
            self._read_all()  # once more, as it may have read what was there before
        new = self._tested_entry(run, old.reviewed)
        self._entries = tuple(new if entry is old else entry for entry in self._entries)
        names = set(self._vocabulary.names)
        if any(s.action not in names for track in new.final_tracks for s in track):
            self._show()
        else:
            self.area.replace_entry(new)

    def _recolour(self) -> None:
        self._stored_styles = None
        shown = self.isVisible() and self._entries
        if shown and self._current_vocabulary() != self._vocabulary:
            self._show()

    def _check_blind(self) -> None:
        """Follow what is coded blind from now on, or no more."""
        reviewing = self.isVisible() and self.document.review.run is not None
        if reviewing and blind_demonstrations(self.document) != self._hidden:
            self._build()
            self._read_all()


def _figure_note(entry: PairEntry) -> str:
    if entry.human is None:
        return "proposed"
    return "" if entry.share is None else f"{100 * entry.share:.1f} %"
