"""The page "Accuracy and speed": measuring, adopting settings, the plot, the table, its texts."""

from dataclasses import replace
from datetime import datetime, timezone
from itertools import combinations

import numpy as np
import pytest
from factories import TRAINING_TRACK, synthetic_set
from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtTest import QTest
from window_helpers import FakeTrainingBackend, open_training_document, play, shown_widget

from forcelab.errors import InputError
from forcelab.gui.figures.axes import covered_area
from forcelab.gui.review import tradeoff
from forcelab.gui.review.tradeoff import (
    ERRORS,
    TIMES,
    TradeoffController,
    TradeoffView,
    drawn_rows,
    points_of,
)
from forcelab.gui.review.tradeoff_plot import MARK, Point, TradeoffPlot
from forcelab.gui.review.trainer import Trainer
from forcelab.gui.review.training_preferences import PRESET
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment, Track
from forcelab.measure.recognition import Measured, Variant, measure_and_store
from forcelab.measure.rows import Row, with_front
from forcelab.project import LabelsUsed, Project
from forcelab.recognition.presets import preset

PAPER = preset("paper")
#: Kind, setting, 1 - F1@50, CPU s to recognise and to train, ms, and how it is set.
FIGURES = (
    ("preset", "paper", 0.5, 0.8, 20.0, 40.0, PAPER),
    ("preset", "fast", 0.3, 0.2, 1.0, 10.0, preset("fast")),
    ("phase", "none", 0.6, 0.4, 9.0, 60.0, PAPER.replace(phase=False)),
    ("classifier", "logistic", 0.2, 2.0, 0.5, 5.0, PAPER.replace(classifier="logistic")),
)


def row_of(kind, setting, error, recognise, train, edges):
    further = {
        "accuracy": 1 - error / 2,
        "balanced": 0.5,
        "edit": 0.4,
        "F1@50": 1 - error,
        "boundary (ms)": edges,
        "boundary p90 (ms)": 3 * edges,
        "features (s/min)": 0.1,
        "fit (s/min)": train - 0.1,
        "predict (s/min)": 0.1,
    }
    reference = "the coder's labels"
    return Row(kind, setting, "foam", reference, error, recognise, 0.01, 2_000_000, further)


def spot_of(plot, row):
    """Where the point of a row lies, in pixels of the plot."""
    return plot.spots[row]


def measured_of(project, task="foam", author="Ann", number=1, extra=()):
    """A measurement as it is read from a project."""
    infos = project.demonstrations.infos(task)
    return Measured(
        number=number,
        time=datetime(2026, 3, 1, 12, tzinfo=timezone.utc),
        task=task,
        author=author,
        labels=tuple(LabelsUsed(i.id, author, project.tracks.head(i.id, author)) for i in infos),
        variants=(
            *(Variant(kind, setting, settings) for kind, setting, *_, settings in FIGURES),
            *(Variant(row.name, row.setting, PAPER.replace(stride=3)) for row in extra),
        ),
        rows=with_front([*(row_of(*figures[:-1]) for figures in FIGURES), *extra]),
    )


class FakeMeasuring:
    """The jobs of the page, with results that are set."""

    def __init__(self):
        self.requests = []
        self.read = []
        self.steps = []
        self.gate = True
        self.closed = 0
        self.result = None
        self.tables = {}

    def measure(self, path, task, author, settings):
        self.requests.append((path, task, author, settings))
        return (yield from play(self))

    def latest(self, _path, task, viewer):
        self.read.append((task, viewer))
        yield None
        found = self.tables.get(task)
        if isinstance(found, Exception):
            raise found
        return found


@pytest.fixture
def document(app):
    with open_training_document() as document:
        yield document


@pytest.fixture
def work(document):
    work = FakeMeasuring()
    work.tables["foam"] = measured_of(document.project)
    return work


@pytest.fixture
def hidden_controller(document, jobs, work, until, monkeypatch):
    PRESET.set_value("paper")
    monkeypatch.setattr(tradeoff, "COUNT_DELAY", 20)
    monkeypatch.setattr(tradeoff, "measure_task", work.measure)
    monkeypatch.setattr(tradeoff, "read_latest", work.latest)
    trainer = Trainer(document, jobs, backend=FakeTrainingBackend())
    until(lambda: not jobs.busy)
    controller = TradeoffController(trainer)
    yield controller
    controller.set_visible(False)
    controller.cancel()
    document.close()


@pytest.fixture
def controller(hidden_controller, until):
    """Visible, with the measurement of the task read."""
    hidden_controller.set_visible(True)
    until(lambda: hidden_controller.measured is not None)
    return hidden_controller


# Measuring


def test_nothing_is_read_while_it_is_hidden(hidden_controller, work, until):
    hidden_controller.trainer.set_task("stylus")
    assert work.read == []
    assert hidden_controller.measured is None
    hidden_controller.trainer.set_task("foam")
    hidden_controller.set_visible(True)
    until(lambda: hidden_controller.measured is not None)
    assert work.read == [("foam", "Ann")]
    assert hidden_controller.measured is work.tables["foam"]
    assert hidden_controller.edits == 0


def test_another_task_shows_its_own_measurement(controller, work, until):
    controller.trainer.set_task("stylus")
    assert controller.measured is None
    until(lambda: not controller.reading)
    assert controller.measured is None
    controller.trainer.set_task("foam")
    until(lambda: controller.measured is not None)


def test_measuring_tells_how_far_it_is_and_shows_what_came_of_it(controller, document, work, until):
    work.steps = [Progress(n, 3, f"{n} of 3") for n in range(3)]
    work.gate = False
    work.result = measured_of(document.project, number=2)
    reported = []
    controller.progressed.connect(lambda: reported.append(controller.progress))
    controller.measure()
    controller.measure()  # never two at once
    until(lambda: reported and reported[-1] == work.steps[-1])
    assert controller.running
    assert controller.measured.number == 1  # stays until the new one is there
    work.gate = True
    until(lambda: not controller.running)
    assert controller.measured.number == 2
    assert work.requests == [(document.project.path, "foam", "Ann", PAPER)]


def test_cancel_ends_the_work_and_keeps_what_is_shown(controller, work, until):
    work.gate = False
    controller.measure()
    until(lambda: work.requests)
    controller.cancel()
    assert not controller.running
    until(lambda: work.closed)
    assert controller.measured.number == 1


def test_it_goes_on_while_another_workspace_is_in_front(controller, document, work, until):
    work.gate = False
    work.result = measured_of(document.project, number=2)
    controller.measure()
    controller.set_visible(False)
    controller.trainer.changed.emit()
    controller.trainer.changed.emit()
    assert controller.running
    work.gate = True
    until(lambda: not controller.running)
    assert controller.measured.number == 2


def test_another_project_ends_it(controller, document, work, until):
    work.gate = False
    controller.measure()
    until(lambda: work.requests)
    document.close()
    assert not controller.running
    until(lambda: work.closed)
    assert controller.measured is None


def test_a_refusal_is_said(controller, document, work, until, messages):
    work.result = InputError("There is too little.")
    controller.measure()
    until(lambda: not controller.running)
    assert controller.trouble == "There is too little."
    assert ("There is too little.", True) in messages


def test_what_cannot_be_read_is_said(hidden_controller, work, until):
    work.tables["foam"] = InputError("It is damaged; measure again.")
    hidden_controller.set_visible(True)
    until(lambda: hidden_controller.trouble)
    assert hidden_controller.trouble == "It is damaged; measure again."
    assert not hidden_controller.reading


def test_edits_since_are_counted(controller, document, until):
    with Project.open(document.project.path) as another:
        another.tracks.edit(document.id, "Ann", TRAINING_TRACK, TRAINING_TRACK[:1], "deleted")
    document.refresh()
    until(lambda: controller.edits == 1)


def test_adopting_changes_what_is_trained_with_and_can_be_taken_back(
    controller, document, messages
):
    own = PAPER.replace(stride=7)  # not measured, so no point leads back to it
    controller.trainer.set_settings(own)
    assert controller.current is None
    controller.adopt(3)
    assert controller.current == 3
    assert controller.trainer.settings == PAPER.replace(classifier="logistic")
    assert messages[-1] == (
        "'foam' is trained with “classifier: logistic” from now on.", False)  # fmt: skip
    assert controller.can_undo
    controller.undo()
    assert controller.trainer.settings == own
    assert not controller.can_undo
    controller.adopt(0)
    controller.trainer.set_settings(PAPER.replace(stride=9))  # changed elsewhere
    assert not controller.can_undo


def test_a_coder_who_is_blind_measures_on_his_own_labels_alone(hidden_controller, document):
    document.set_author("Bo")
    # Whoever looks at a project of others can measure at once.
    assert hidden_controller.author == "Ann"
    assert hidden_controller.labelled == 2
    document.project.coding.assign(document.infos[0].id, "Bo", blind=True)
    assert hidden_controller.author == "Bo"
    assert hidden_controller.labelled == 0


FAST = preset("paper").replace(classifier="naive-bayes", max_scale=32.0)


@pytest.fixture(scope="module")
def measured_project(tmp_path_factory):
    """A project measured on the labels of Ada, with labels of Bo."""
    path = tmp_path_factory.mktemp("measured") / "study.forcelab"
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(2, 100.0)):
            own = [Track("Bo", (Segment(0.0, 1.0, "grab"),))] if number else []
            project.demonstrations.add(demonstration, [Track("Ada", segments), *own])
    finish(
        measure_and_store(path, "foam", "Ada", FAST, [Variant("classifier", "naive-bayes", FAST)])
    )
    return path


def latest(path, viewer, task="foam"):
    return finish(tradeoff.read_latest(path, task, viewer))


def test_the_latest_measurement_that_a_coder_may_see_is_found(measured_project):
    assert latest(measured_project, "Ada").place_of(FAST) == 0
    assert latest(measured_project, "Bo").author == "Ada"
    assert latest(measured_project, "Ada", "pen") is None
    with Project.open(measured_project) as project:
        id_ = project.demonstrations.infos()[0].id
        project.coding.assign(id_, "Bo", blind=True)
        assert project.coding.is_blind(id_, "Bo")
    # What a model makes of hidden labels says something about them.
    assert latest(measured_project, "Bo") is None
    assert latest(measured_project, "Ada") is not None


def test_every_adopted_setting_can_be_taken_back_to_what_was_in_use_at_first(controller, document):
    first = controller.trainer.settings
    others = [place for place in range(4) if place != controller.current]
    for place in others:
        controller.adopt(place)
    for place in reversed(others[:-1]):
        controller.undo()
        assert controller.current == place
    controller.undo()
    assert controller.trainer.settings == first
    assert not controller.can_undo


def test_nothing_is_shown_anew_while_it_is_hidden_though_labels_change(controller, document):
    reported = []
    controller.changed.connect(lambda: reported.append(True))
    controller.set_visible(False)
    document.refresh_listing()
    assert reported == []
    controller.set_visible(True)
    assert reported


def test_what_comes_for_another_coder_than_asked_is_read_as_that_one_may_see_it(
    controller, document, work, until
):
    work.result, work.gate = measured_of(document.project, number=2), False
    work.steps = [None]
    controller.measure()
    work.tables["foam"] = None  # nothing that Bo may see
    document.set_author("Bo")
    work.gate = True
    until(lambda: not controller.running and not controller.reading)
    assert controller.measured is None
    assert work.read[-1] == ("foam", "Bo")


# The plot


ROWS = [row_of(*figures[:-1]) for figures in FIGURES]


def points(rows, error, time):
    return points_of(drawn_rows(rows, ERRORS[error], TIMES[time]))


def front(error, time):
    return [p.text for p in points(ROWS, error, time) if p.front]


def test_the_front_follows_what_is_drawn():
    assert front(0, 0) == ["fast", "classifier: logistic"]
    assert front(0, 1) == ["classifier: logistic"]  # trained faster than all others
    drawn = points(ROWS, 2, 1)
    assert [(p.error, p.seconds) for p in drawn] == [(f[5], pytest.approx(f[4])) for f in FIGURES]
    drawn = points(ROWS, 1, 0)
    assert [p.error for p in drawn] == pytest.approx([f[2] / 2 for f in FIGURES])


def test_rows_without_a_figure_are_left_out():
    refused = Row("phase", "cos and sin", "foam", "labels", refusal="It cannot be trained.")
    bare = {k: v for k, v in ROWS[0].further.items() if not k.startswith("boundary")}
    rows = [refused, replace(ROWS[0], further=bare), ROWS[1]]
    assert [p.row for p in points(rows, 0, 0)] == [1, 2]
    assert [p.row for p in points(rows, 2, 0)] == [2]
    assert points([refused], 0, 0) == ()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("size", [(260, 200), (620, 460), (1200, 900)])
def test_names_cover_neither_each_other_nor_marks(app, seed, size):
    random = np.random.default_rng(seed)
    points = [
        Point(i, "preset" if i < 3 else "scales", f"setting number {i}",
              float(10 ** random.uniform(-2, 1)), float(random.uniform(0, 0.9)), i % 5 == 0)
        for i in range(22)
    ]  # fmt: skip
    plot = TradeoffPlot()
    plot.show_points(points, 1, "error", "time")
    with shown_widget(app, plot, size):
        spots, names, area = plot.spots.values(), plot.names.values(), plot.area
    marks = [QRectF(s.x() - MARK, s.y() - MARK, 2 * MARK, 2 * MARK) for s in spots]
    for label, another in combinations(names, 2):
        assert not covered_area(label, [another])
    for name in names:
        assert not covered_area(name, marks)
        assert area.contains(name)
    assert all(area.contains(spot) for spot in spots)
    assert size[0] < 300 or len(names) > 8  # in a thumbnail there is no room


@pytest.mark.parametrize("count", [1, 2])
def test_points_in_one_place_have_axes_too(app, count):
    points = [Point(i, "preset", f"p{i}", 0.5, 0.0, True) for i in range(count)]
    plot = TradeoffPlot()
    plot.show_points(points, None, "error", "time")
    with shown_widget(app, plot, (500, 400)):
        start, end = plot.bottom.range
        assert 10**start < 0.5 < 10**end
        assert plot.area.contains(plot.spots[0])
        assert plot.bottom.numbers()


@pytest.fixture
def plot(app):
    plot = TradeoffPlot()
    plot.show_points(points(ROWS, 0, 0), 0, "error", "time")
    plot.highlights, plot.rows = [], []
    plot.highlight_changed.connect(plot.highlights.append)
    plot.activated.connect(plot.rows.append)
    with shown_widget(app, plot, (640, 480)):
        yield plot


def test_faster_is_left_and_better_is_down(plot):
    spots = [spot_of(plot, row) for row in range(len(ROWS))]
    assert sorted(range(4), key=lambda i: spots[i].x()) == [1, 2, 0, 3]
    assert sorted(range(4), key=lambda i: -spots[i].y()) == [3, 1, 0, 2]
    # A logarithmic axis: twice the time is equally far wherever.
    a, b, c = (spots[i].x() for i in (1, 2, 0))
    assert b - a == pytest.approx(c - b, abs=0.01)


def test_pointing_tells_and_a_click_chooses(plot):
    spot = spot_of(plot, 3)
    QTest.mouseMove(plot.viewport(), spot.toPoint())
    assert plot.highlights == [3]
    assert plot.rows == []
    QTest.mouseClick(plot.viewport(), Qt.MouseButton.LeftButton, pos=spot.toPoint())
    assert plot.rows == [3]
    QTest.mouseClick(plot.viewport(), Qt.MouseButton.RightButton, pos=spot_of(plot, 1).toPoint())
    QTest.mouseClick(plot.viewport(), Qt.MouseButton.LeftButton, pos=QPointF(120, 60).toPoint())
    assert plot.rows == [3]


def test_the_keyboard_goes_by_time_and_by_error_and_enter_chooses(plot):
    plot.setFocus()
    QTest.keyClick(plot, Qt.Key.Key_Return)
    assert plot.rows == []  # nothing is looked at yet
    for key, row in ((Qt.Key.Key_Right, 0), (Qt.Key.Key_Right, 3), (Qt.Key.Key_Right, 3),
                     (Qt.Key.Key_Left, 0), (Qt.Key.Key_Up, 2), (Qt.Key.Key_Down, 0),
                     (Qt.Key.Key_Down, 1)):  # fmt: skip
        QTest.keyClick(plot, key)
        assert plot.highlighted == row
    QTest.keyClick(plot, Qt.Key.Key_Return)
    assert plot.rows == [1]


def test_what_is_in_use_and_what_is_highlighted_are_seen(plot):
    before = plot.grab().toImage()
    plot.highlight(2)
    looked = plot.grab().toImage()
    assert looked != before
    plot.show_points(plot.points, 1, "error", "time")
    assert plot.grab().toImage() != looked
    assert plot.highlighted == 2
    plot.show_points(plot.points[:1], 1, "error", "time")
    assert plot.highlighted is None  # it is not drawn any more
    plot.show_points((), 1, "error", "time")
    assert plot.sentence == "No setting was measured for both axes."
    assert not plot.box.isVisible()


def test_zoomed_in_more_names_have_room(app):
    crowd = [Point(i, "scales", f"a setting {i}", 0.1 + 0.01 * i, 0.5 + 0.01 * i, False)
             for i in range(12)]  # fmt: skip
    far = Point(99, "scales", "far", 10.0, 0.1, True)
    plot = TradeoffPlot()
    plot.show_points([*crowd, far], None, "error", "time")
    with shown_widget(app, plot, (420, 320)):
        before = len(plot.names)
        plot.box.setRange(xRange=(-1.1, -0.6), yRange=(0.45, 0.65), padding=0)
        app.processEvents()
        assert len(plot.names) > before
        assert 99 not in plot.names
        QTest.mouseDClick(plot.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(80, 290))
        assert len(plot.names) == before


# The page


@pytest.fixture
def view(app, document, controller, until, monkeypatch):
    monkeypatch.setattr(tradeoff, "TradeoffController", lambda *_: controller)
    view = TradeoffView(controller.trainer)
    with shown_widget(app, view, (460, 600)):
        until(lambda: not controller.reading)
        yield view


def choose(box, index):
    """As a click on an entry does."""
    box.setCurrentIndex(index)
    box.activated.emit(index)


def table_of(view):
    model = view.table.model()
    return [
        [model.index(row, column).data() for column in range(model.columnCount())]
        for row in range(model.rowCount())
    ]


def test_the_table_has_every_figure_and_marks_use_and_front(view):
    rows = table_of(view)
    assert rows[0] == [
        "●", "paper", "50.0", "75.0", "50.0", "40.0", "40", "120", "0.80", "20.00", "2.0"
    ]  # fmt: skip
    assert [row[0] for row in rows] == ["●", "◆", "", "◆"]
    assert view.summary.text().startswith("paper: F1@50 50.0 %")
    off = "half of the boundaries at most 40 ms off, nine in ten 120 ms"
    assert off in view.summary.text()


def test_other_axes_draw_another_front(view):
    choose(view.time, 1)
    assert [row[0] for row in table_of(view)] == ["●", "", "", "◆"]
    choose(view.error, 2)
    assert [point.error for point in view.plot.points] == [40.0, 10.0, 60.0, 5.0]


def test_a_click_in_the_plot_adopts(view, controller):
    spot = spot_of(view.plot, 1).toPoint()
    assert not view.undo.isVisible()
    QTest.mouseClick(view.plot.viewport(), Qt.MouseButton.LeftButton, pos=spot)
    assert controller.trainer.settings.preset == "fast"
    assert [row[0] for row in table_of(view)] == ["", "●◆", "", "◆"]
    assert view.plot.current == 1
    QTest.mouseClick(view.undo, Qt.MouseButton.LeftButton)
    assert controller.trainer.settings == PAPER
    assert view.plot.current == 0


def test_enter_in_the_table_adopts_and_its_rows_are_marked_in_the_plot(view, controller):
    view.table.setFocus()
    view.table.selectRow(3)
    assert view.plot.highlighted == 3
    assert view.summary.text().startswith("classifier: logistic")
    assert controller.trainer.settings == PAPER  # to look at it changes nothing
    QTest.keyClick(view.table, Qt.Key.Key_Return)
    assert controller.trainer.settings.classifier == "logistic"


def test_what_is_pointed_at_in_the_plot_is_selected_in_the_table(view):
    QTest.mouseMove(view.plot.viewport(), spot_of(view.plot, 2).toPoint())
    assert view.table.currentIndex().row() == 2
    assert view.summary.text().startswith("phase: none")


def test_it_says_when_and_on_whose_labels_it_was_measured_and_what_was_edited_since(
    view, controller
):
    state = view.state
    assert "on 2 demonstrations labelled by Ann · no change since" in state.text
    controller.edits = 3
    controller.changed.emit()
    assert state.text.endswith("3 changes since")
    controller.trainer.set_settings(PAPER.replace(stride=77))
    assert state.text.endswith("the settings in use were not measured")


def test_a_refused_setting_stays_in_the_table_with_its_reason(view, controller, document, messages):
    refused = Row("stride", "none", "foam", "labels", refusal="Too few samples; label more.")
    controller.show_measured(measured_of(document.project, extra=[refused]))
    assert table_of(view)[4][:3] == ["", "stride: none", "–"]
    view.table.selectRow(4)
    assert view.summary.text() == "stride: none: Too few samples; label more."
    before = controller.trainer.settings
    QTest.keyClick(view.table, Qt.Key.Key_Return)
    assert controller.trainer.settings == before
    assert "Too few samples" in messages[-1][0]


def test_progress_and_cancel_are_there_while_it_measures(view, controller, work, until):
    assert view.measure.isVisible()
    assert not view.cancel.isVisible()
    work.steps, work.gate = [Progress(3, 10, "preset best: 2 of 5")], False
    QTest.mouseClick(view.measure, Qt.MouseButton.LeftButton)
    until(lambda: view.state.text == "preset best: 2 of 5")
    assert (view.progress.value(), view.progress.maximum()) == (3, 10)
    assert not view.measure.isVisible()
    QTest.mouseClick(view.cancel, Qt.MouseButton.LeftButton)
    assert view.measure.isVisible()
    assert "no change since" in view.state.text


def test_without_a_measurement_it_says_what_to_do(view, controller, until):
    assert not view.pages.note.isVisible()
    controller.trainer.set_task("stylus")
    until(lambda: not controller.reading)
    assert view.pages.note.isVisible()
    assert "Nothing was measured for 'stylus' yet" in view.pages.note.text()
    assert view.measure.isEnabled()
    assert not view.error.isVisible()


def test_without_labels_it_says_what_is_missing(view, controller, document, until):
    document.project.coding.assign(document.infos[0].id, "Bo", blind=True)
    document.set_author("Bo")
    until(lambda: not controller.reading)
    controller.show_measured(None)
    assert "two labelled demonstrations are needed" in view.pages.note.text()
    assert "Labelled so far: 0." in view.pages.note.text()
    assert not view.measure.isEnabled()


def test_a_squeezed_column_of_settings_grows_back_with_the_page(app, view, controller, document):
    long = row_of("boundary", "of each action by itself, on forces of both sensors", 0.4, 1, 2, 30)
    controller.show_measured(measured_of(document.project, extra=[long]))
    header = view.table.horizontalHeader()
    header.resizeSection(0, 70)  # by hand
    narrow = header.sectionSize(tradeoff.SETTING)
    view.resize(1500, 1200)
    app.processEvents()
    text = view.table.model().index(4, tradeoff.SETTING).data()
    assert narrow < view.fontMetrics().horizontalAdvance(text)
    assert header.sectionSize(tradeoff.SETTING) > view.fontMetrics().horizontalAdvance(text)
    view.resize(460, 600)
    app.processEvents()
    assert header.sectionSize(tradeoff.SETTING) == narrow
    assert header.sectionSize(0) == 70


def test_plot_and_table_stand_side_by_side_where_the_page_is_wide(app, view):
    assert view.table.mapTo(view, QPoint()).y() > view.plot.mapTo(view, QPoint()).y()
    view.resize(1000, 500)
    app.processEvents()
    assert view.table.mapTo(view, QPoint()).x() > view.plot.width()


def test_the_plot_is_saved_with_the_axes_that_are_shown(view, until, tmp_path, chosen_picture):
    choose(view.error, 2)
    chosen_picture(tmp_path / "figure.svg")
    view.ask_save()
    until((tmp_path / "figure.svg").exists)
    assert "median boundary error (ms)" in (tmp_path / "figure.svg").read_text("utf-8")
