"""The explanation view: what spoke for the predicted action, and which segments are alike."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QHideEvent, QPalette, QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from forcelab.errors import ForcelabError
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs
from forcelab.gui.layout import (
    PageOrPlaceholder,
    copyable,
    emphasise,
    fill_layout,
    muted_label,
    page_layout,
    sentence_label,
)
from forcelab.gui.review import explanation_plots
from forcelab.gui.review.explanation_plots import BandMap, NearestSegments, ProbabilityChart
from forcelab.gui.review.reviewed_run import blind_demonstrations
from forcelab.jobs import Progress
from forcelab.labels import Interval
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.review.differences import interval_at, interval_of
from forcelab.review.run_result import RunResult

if TYPE_CHECKING:
    from forcelab.review.explanation import Explanation
    from forcelab.review.held_out import HeldOutModel


#: Recognisers that are kept at most, and the memory that they may take in bytes.
MODELS_KEPT, MODEL_BYTES = 12, 128 * 2**20


class ModelCache:
    """Recognisers that have not seen one demonstration each, by run and demonstration.

    The ones longest unused make room; the latest one stays in any case.
    """

    def __init__(self) -> None:
        self._models: OrderedDict[tuple[Path, int, str], HeldOutModel] = OrderedDict()

    def get(self, path: Path, run: RunResult, id_: str) -> HeldOutModel | None:
        key = path, run.number, id_
        if key in self._models:
            self._models.move_to_end(key)
        return self._models.get(key)

    def put(self, path: Path, run: RunResult, id_: str, withheld: HeldOutModel) -> None:
        self._models[path, run.number, id_] = withheld
        while len(self._models) > 1 and (
            len(self._models) > MODELS_KEPT
            or sum(model.bytes for model in self._models.values()) > MODEL_BYTES
        ):
            self._models.popitem(last=False)

    def clear(self) -> None:
        self._models.clear()


def train_without(path: Path, run: RunResult, id_: str) -> Generator[Progress, None, HeldOutModel]:
    """Train without a demonstration, in a process of its own."""
    from forcelab.process import run_in_process
    from forcelab.review.held_out import train_held_out  # takes a second to load

    return (yield from run_in_process(train_held_out, path, run, id_))


#: From this width on, in pixels, what speaks and what is alike stand side by side.
WIDE_PAGE = 860


class ExplanationPage(QScrollArea):
    """Sentence, probabilities, progress, bands and neighbours; grey while of an older interval."""

    def __init__(self, document: Document) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName("Explanation")
        self.sentence, self.state_text = sentence_label(), sentence_label()
        self.strongest, self.method = copyable(), copyable()
        emphasise(self.sentence)
        small = self.method.font()
        small.setPointSizeF(max(small.pointSizeF() * 0.86, 7.0))
        self.method.setFont(small)
        self.method.setForegroundRole(QPalette.ColorRole.PlaceholderText)
        self.back, self.stop = QPushButton("Back to the place"), QPushButton()
        self.back.setAccessibleName("Back to the place that is explained")
        self.back.hide()
        self.chart, self.bands = ProbabilityChart(document), BandMap()
        self.neighbours = NearestSegments(document)
        self._arrange()

    def _arrange(self) -> None:
        top = fill_layout(QHBoxLayout(), (self.sentence, 1))
        top.addWidget(self.back, 0, Qt.AlignmentFlag.AlignTop)
        self.state = QWidget()
        fill_layout(QHBoxLayout(self.state), (self.state_text, 1), self.stop, margins=0)
        evidence = fill_layout(QVBoxLayout(), self.bands, self.strongest, self.method, 1)
        title = QLabel("Nearest in training")
        title.setFont(self.sentence.font())
        note = muted_label("d: distance, in standard deviations of the training segments")
        note.setFont(self.method.font())
        comparison = fill_layout(QVBoxLayout(), title, note, self.neighbours, 1)
        self.content = QWidget()
        self._halves = QBoxLayout(QBoxLayout.Direction.TopToBottom, self.content)
        fill_layout(self._halves, (evidence, 1), (comparison, 1), margins=0, spacing=14)
        inner = QWidget()
        parts = top, self.chart, self.state, self.content, 1
        fill_layout(QVBoxLayout(inner), *parts, margins=(10, 8, 10, 8))
        self.setWidget(inner)

    def resizeEvent(self, event: QResizeEvent) -> None:
        direction = QBoxLayout.Direction
        wide = event.size().width() >= WIDE_PAGE
        self._halves.setDirection(direction.LeftToRight if wide else direction.TopToBottom)
        super().resizeEvent(event)

    @property
    def stale(self) -> bool:
        """Whether what is shown is of an older interval, or not there yet."""
        return not self.content.isEnabled()

    def begin(
        self, place: Interval, certainty: ProbabilityTrace | None, threshold: float | None
    ) -> None:
        """Show what is known of another interval at once; the explanation before it turns grey."""
        self.sentence.setText(explanation_plots.interval_sentence(place))
        missing = "the run kept no probabilities; they are computed anew"
        self.chart.show_place(place, certainty, threshold, missing)
        self.content.setVisible(self.bands.why is not None)
        self.content.setEnabled(False)

    def forget(self) -> None:
        self.bands.set_why(None)

    def show_why(
        self, why: Explanation, name_of: Callable[[str], str], threshold: float | None
    ) -> None:
        """Show an explanation; `name_of` gives the name of a demonstration."""
        self.state.hide()
        self.sentence.setText(explanation_plots.interval_sentence(_with_probability(why)))
        missing = "this classifier gives no probabilities"
        self.chart.show_place(why.place, why.probability_trace, threshold, missing)
        self.bands.set_why(why)
        self.strongest.setText(explanation_plots.strongest_bands(why))
        lines = [explanation_plots.method_sentence(why)]
        lines.append(explanation_plots.recogniser_sentence(why, name_of(why.place.demonstration)))
        if not why.trace_from_run and why.probability_trace is not None:
            lines.append("The run kept no probabilities; those above are of this recogniser.")
        self.method.setText("\n".join([*lines, *why.remarks]))
        columns = [
            (action, self._role_text(action, why.place), why.neighbours[action])
            for action in (why.favoured, why.against)
        ]
        self.neighbours.show_neighbours(columns, name_of)
        self.content.setEnabled(True)
        self.content.show()

    def _role_text(self, action: str, place: Interval) -> str:
        """Whether an action is labelled, predicted or neither."""
        if action == place.predicted:
            return "predicted"
        if action == place.human:
            return "coded"
        return "most probable other one"

    def say(self, state: str, verb: str) -> None:
        """Show how far it is, beside a button."""
        self.state_text.setText(state)
        self.stop.setText(verb)
        self.stop.setAccessibleName(verb)
        self.state.show()


def _with_probability(why: Explanation) -> Interval:
    """The interval with the probability of its prediction, where only the explanation has it."""
    place = why.place
    if place.confidence is not None or place.predicted is None or why.probability_trace is None:
        return place
    sure = why.probability_trace.of_action(place.predicted, place.start, place.end)
    return replace(place, confidence=sure)


#: Keys of the jobs.
JOB_KEYS = HELD_OUT_JOB, EXPLAINING_JOB, TRACES_JOB = "why training", "why", "why traces"
#: ms in which several things that change at once are answered once.
SETTLE_TIME = 20


class ExplanationView(QWidget):
    """Explains the examined interval, the selected segment, or what is at the cursor.

    Nothing is computed while it is hidden. The recogniser that has not seen the demonstration is
    trained in the background the first time that an interval of it is explained, and then kept.
    """

    def __init__(self, document: Document, jobs: Jobs) -> None:
        super().__init__()
        self.document, self.jobs = document, jobs
        self.place: Interval | None = None
        self.why: Explanation | None = None
        self.model_cache = ModelCache()
        self._run: RunResult | None = None
        self._hidden: frozenset[str] = frozenset()  # what the coder codes blind
        self._away: Interval | None = None  # the neighbour that is looked at meanwhile
        self._selecting = False  # whether the selection is newer than what was examined
        self._training: tuple[int, str] | None = None  # run and demonstration being withheld
        self._stopped = False
        self._begun = 0.0
        self.setAccessibleName("Why")
        self.page = ExplanationPage(document)
        self.page.back.clicked.connect(self.go_back)
        self.page.stop.clicked.connect(self._toggle_training)
        self.page.neighbours.chosen.connect(self._go_to)
        self.pages = PageOrPlaceholder(self.page)
        page_layout(self, self.pages)
        self._timer = QTimer(self, singleShot=True, interval=SETTLE_TIME)
        self._timer.timeout.connect(self.refresh)
        for changed in (
            document.review.run_changed,
            document.demonstration_changed,
            document.tracks_changed,
            document.author_changed,
            document.listing_changed,
        ):
            changed.connect(self._ask)
        document.review.examined_changed.connect(self._examined)
        document.selection_changed.connect(self._selected)
        document.view.cursor_moved.connect(self._moved)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if blind_demonstrations(self.document) != self._hidden:
            self.refresh()  # before anything is painted that may not be seen any more
        self._ask()

    def hideEvent(self, event: QHideEvent) -> None:
        super().hideEvent(event)
        self._timer.stop()
        self._cancel()
        if self.page.stale or not self.page.neighbours.all_traced:
            self.place = None  # to be begun again

    @property
    def settled(self) -> bool:
        """Whether all is on the screen that there is to show."""
        waiting = self._timer.isActive() or any(map(self.jobs.awaits, JOB_KEYS))
        return not (self.isVisible() and waiting)

    # Which place

    def _ask(self, *_: object) -> None:
        """Refresh soon."""
        if self.isVisible():
            self._timer.start()

    def _examined(self) -> None:
        self._selecting = False
        self._ask()

    def _selected(self) -> None:
        self._selecting = self.document.selected is not None
        self._ask()

    def _moved(self, *_: object) -> None:
        """The cursor counts only where nothing was chosen."""
        if self.isVisible() and not self.document.view.playing and self._chosen_interval is None:
            self._ask()

    @property
    def _chosen_interval(self) -> Interval | None:
        """The examined interval, or the segment if it was selected later; None without either."""
        document, run = self.document, self.document.review.run
        reviewed, examined = document.review.reviewed, document.review.examined
        if reviewed is None or run is None:
            return None
        if examined is not None and examined.demonstration != document.id:
            examined = None
        if document.selected is None or (examined is not None and not self._selecting):
            return examined
        segment = document.editor.segments[document.selected]
        # What was trained may have merged it with another action.
        human = segment.action if segment.action in run.actions else None
        return interval_of(reviewed, segment.start, segment.end, human)

    def _selected_interval(self) -> Interval | None:
        """What is to be explained now."""
        if self._away is not None and self.document.review.examined == self._away:
            at_neighbour = self.document.id == self._away.demonstration and not self._selecting
            if at_neighbour and not self.document.coding_blind:
                return self.place
        self._away = None
        reviewed, chosen = self.document.review.reviewed, self._chosen_interval
        if chosen is not None or reviewed is None:
            return chosen
        return interval_at(reviewed, self.document.view.cursor)

    # Showing

    def refresh(self) -> None:
        """Explain what is to be explained, unless it is on the screen already."""
        document = self.document
        place = self._selected_interval()
        self.page.back.setVisible(self._away is not None)
        self.page.neighbours.mark(self._away)
        if place is None or document.review.run is None:
            self._cancel()
            self.place = self.why = None
            self.page.forget()
            self.pages.say(self._missing)
            return
        hidden = blind_demonstrations(document)
        if (place, hidden) == (self.place, self._hidden) and document.review.run is self._run:
            return
        if hidden - self._hidden:  # a neighbour may be among those
            self.page.forget()
        self._hidden = hidden
        if document.review.run is not self._run:
            self.model_cache.clear()
        self.place, self._run, self._stopped = place, document.review.run, False
        self.pages.say("")
        reviewed = self._run.find(place.demonstration)
        certainty = None if reviewed is None else reviewed.probability_trace
        self.page.begin(place, certainty, self._run.settings.threshold)
        self._cancel(EXPLAINING_JOB, TRACES_JOB)
        self._begin()

    @property
    def _missing(self) -> str:
        document = self.document
        if document.project is None or not document.id:
            return "Open a demonstration to see why something was predicted in it."
        if document.coding_blind:
            return "You code this demonstration blind: what was predicted is shown when it is done."
        if document.review.run is None:
            return "Train a recogniser; then a mistake of it can be explained here."
        if document.review.reviewed is None:
            return (
                "This demonstration was not part of the training; choose one that was, or train "
                "again."
            )
        return (
            "Nothing is labelled or predicted at the cursor; choose a segment or a mistake to see "
            "why."
        )

    def _begin(self) -> None:
        project, place, run = self.document.project, self.place, self._run
        if project is None or place is None or run is None:
            return
        id_ = place.demonstration
        withheld = self.model_cache.get(project.path, run, id_)
        if withheld is not None:
            self.jobs.cancel(HELD_OUT_JOB)  # of another demonstration
            self._explain(withheld)
            return
        ticket = run.number, id_
        if self.jobs.awaits(HELD_OUT_JOB) and self._training == ticket:
            return  # on its way
        self._training, self._begun = ticket, time.monotonic()
        path = project.path

        def done(withheld: HeldOutModel) -> None:
            self.model_cache.put(path, run, id_, withheld)
            self._begin()

        job = train_without(path, run, id_)
        self.jobs.run(job, done, self._failed, self._show_progress, HELD_OUT_JOB)
        self._show_progress(Progress(0, 1, "features"))

    def _explain(self, withheld: HeldOutModel) -> None:
        from forcelab.review.explanation import explain

        project, place, run = self.document.project, self.place, self._run
        assert project is not None
        assert place is not None
        assert run is not None
        self.page.state.hide()
        job = explain(withheld, run, place, self._hidden)
        self.jobs.run(job, self._show, self._failed, key=EXPLAINING_JOB)

    def _show(self, why: Explanation) -> None:
        assert self._run is not None
        self.why = why
        self.page.show_why(why, self._name_of, self._run.settings.threshold)
        self._trace()

    def _trace(self) -> None:
        project = self.document.project
        places = [card.neighbour.place for card in self.page.neighbours.cards]
        if project is None or not places:
            return
        from forcelab.review.similar_segments import preview_job

        job, show = preview_job(project.path, places), self.page.neighbours.show_traces
        self.jobs.run(job, show, self._failed, key=TRACES_JOB)

    def _name_of(self, id_: str) -> str:
        return next((info.name for info in self.document.infos if info.id == id_), id_)

    # Jobs, their progress, and their end

    def _cancel(self, *keys: str) -> None:
        """Cancel jobs by their keys; without keys, all that are under way."""
        for key in keys or JOB_KEYS:
            self.jobs.cancel(key)

    def _show_progress(self, progress: object) -> None:
        if isinstance(progress, Progress) and self.place and self._run:
            name = self._name_of(self.place.demonstration)
            elapsed = time.monotonic() - self._begun
            state = explanation_plots.held_out_progress(progress, name, elapsed, self._run)
            self.page.say(state, "Stop")

    def _failed(self, error: Exception) -> None:
        self._stopped = True
        state = str(error) if isinstance(error, ForcelabError) else "This did not work."
        self.page.say(state, "Try again")

    def _toggle_training(self) -> None:
        self._stopped = not self._stopped
        if self._stopped:
            self._cancel()
            self.page.say("Stopped before it was explained.", "Explain")
        else:
            self._begin()

    # Going there and back

    def _go_to(self, place: Interval) -> None:
        """Show a neighbour; the explanation stays."""
        self._away, before = place, self._away
        if not self.document.review.examine(place):
            self._away = before
        self.refresh()

    def go_back(self) -> None:
        self._away = None
        if self.place is not None:
            self.document.review.examine(self.place)
        self.refresh()
