"""Why in the window: what it says, what it computes for whom, the way to neighbours and back."""

import time
from dataclasses import replace

import numpy as np
import pytest
from factories import QUICK_SETTINGS, make_evaluated_project
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from forcelab.gui.document import Document
from forcelab.gui.review import explanation as why_module
from forcelab.gui.review import explanation_plots
from forcelab.gui.review.explanation import ExplanationView, ModelCache
from forcelab.gui.review.explanation_plots import balance_colours
from forcelab.jobs import Progress, finish
from forcelab.labels import Interval
from forcelab.review.differences import interval_at
from forcelab.review.held_out import train_held_out

SETTINGS = QUICK_SETTINGS.replace(classifier="naive-bayes")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("why") / "study.forcelab"
    return path, make_evaluated_project(path, SETTINGS, count=3)


@pytest.fixture(scope="module")
def trained(study):
    """Withheld recognisers, each trained once for all tests."""
    return {}


class Trainings:
    """Stands for the training in a process of its own: counts, and waits to be let go on."""

    def __init__(self, trained):
        self.trained, self.requests, self.held, self.closed = trained, [], False, []

    def __call__(self, path, run, id_):
        self.requests.append(id_)
        try:
            while self.held:
                time.sleep(0.001)
                yield Progress(1, 200, "fit")
            key = run.number, id_
            if key not in self.trained:
                self.trained[key] = finish(train_held_out(path, run, id_))
            yield Progress(200, 200, "fit")
        except GeneratorExit:
            self.closed.append(id_)
            raise
        return self.trained[key]


@pytest.fixture
def trainings(monkeypatch, trained):
    replaced = Trainings(trained)
    monkeypatch.setattr(why_module, "train_without", replaced)
    return replaced


@pytest.fixture
def document(app, study):
    document = Document("Bob")
    document.open_project(study[0])
    yield document
    document.close()


@pytest.fixture
def view(document, jobs, trainings, until):
    view = ExplanationView(document, jobs)
    view.resize(460, 800)
    yield view
    view.close()
    view.deleteLater()


def place_in(study, number=0, action="hold"):
    result = study[1].tested[number]
    segment = next(s for s in result.human if s.action == action)
    return Interval(result.id, segment.start, segment.end, "hold", "grab", 0.83)


@pytest.fixture
def explained(view, document, study, until):
    """The view with an explanation of a place in the first demonstration."""
    document.review.set_run(study[1])
    view.show()
    document.review.examine(place_in(study))
    until(lambda: view.settled and view.why is not None)
    return view


def message_of(view):
    note = view.pages.note
    return note.text() if note.isVisible() else ""


def test_it_says_what_is_missing(view, document, study, until):
    view.show()
    until(lambda: "Open a demonstration" in message_of(view))
    document.open_demonstration(study[1].tested[0].id)
    until(lambda: "Train a recogniser" in message_of(view))
    document.review.set_run(replace(study[1], tested=study[1].tested[1:]))
    until(lambda: "not part of the training" in message_of(view))
    document.review.set_run(study[1])
    result = study[1].tested[0]
    silent = next(t / 100 for t in range(1000) if interval_at(result, t / 100) is None)
    document.view.seek(silent)
    until(lambda: "Nothing is labelled or predicted" in message_of(view))


def test_whoever_codes_blind_is_told_nothing(view, document, study, until, trainings):
    result = study[1].tested[0]
    document.review.set_run(study[1])
    document.project.coding.assign(result.id, "Bob", blind=True)
    try:
        view.show()
        document.review.examine(place_in(study))
        until(lambda: "blind" in message_of(view))
        assert view.why is None
        assert not trainings.requests
    finally:
        document.project.coding.unassign(result.id, "Bob")


def test_neighbours_in_a_demonstration_that_is_coded_blind_are_left_out(
    view, document, study, until
):
    other = study[1].tested[1].id
    document.project.coding.assign(other, "Bob", blind=True)
    try:
        document.review.set_run(study[1])
        view.show()
        document.review.examine(place_in(study))
        until(lambda: view.settled and view.why is not None)
        shown = {card.neighbour.place.demonstration for card in view.page.neighbours.cards}
        assert shown == {study[1].tested[2].id}
    finally:
        document.project.coding.unassign(other, "Bob")


@pytest.mark.parametrize("visible", [True, False])
def test_neighbours_go_when_whoever_looks_next_codes_them_blind(
    explained, document, study, until, visible
):
    view, other = explained, study[1].tested[1].id
    assert other in {card.neighbour.place.demonstration for card in view.page.neighbours.cards}
    document.project.coding.assign(other, "Cleo", blind=True)
    try:
        view.setVisible(visible)
        document.set_author("Cleo")
        view.show()
        until(lambda: view.settled and not view.page.stale)
        shown = {card.neighbour.place.demonstration for card in view.page.neighbours.cards}
        assert shown == {study[1].tested[2].id}
    finally:
        document.project.coding.unassign(other, "Cleo")
        document.set_author("Bob")


def test_nothing_is_computed_while_it_is_hidden(view, document, study, app, trainings, jobs):
    document.review.set_run(study[1])
    document.review.examine(place_in(study))
    app.processEvents()
    QTest.qWait(60)
    assert not trainings.requests
    assert not jobs.busy
    assert view.place is None


def test_what_is_explained_is_what_was_examined(explained, study):
    view = explained
    assert view.page.sentence.text().endswith("coded hold, predicted grab with 0.83")
    assert (view.why.favoured, view.why.against) == ("grab", "hold")
    lines = view.page.strongest.text().splitlines()
    assert [
        explanation_plots.band_sentence(band, view.why) for band in view.why.strongest()
    ] == lines
    assert "Permutation" in view.page.method.text()
    assert "predicts the same" in view.page.method.text()
    actions = [card.neighbour.place.human for card in view.page.neighbours.cards]
    assert actions == ["grab", "grab", "hold", "hold"]
    assert all(card.trace.low.shape[1] == 6 for card in view.page.neighbours.cards)
    assert not view.page.stale


def test_a_second_place_of_the_demonstration_needs_no_training(
    explained, document, study, until, trainings
):
    view, first = explained, explained.why
    assert len(trainings.requests) == 1
    document.review.examine(place_in(study, action="release"))
    until(lambda: view.why is not first)
    assert len(trainings.requests) == 1
    document.review.examine(place_in(study, 1))
    until(lambda: view.settled)
    assert trainings.requests == [result.id for result in study[1].tested[:2]]


def test_the_old_explanation_is_grey_until_the_new_one_is_there(
    explained, document, study, until, trainings
):
    view, first = explained, explained.why
    trainings.held = True
    document.review.examine(place_in(study, 1))
    until(lambda: view.page.stale)
    assert view.why is first
    assert view.page.content.isVisible()
    until(lambda: view.page.state_text.text().startswith("Training without foam"))
    trainings.held = False
    until(lambda: not view.page.stale)
    assert view.why.place.demonstration == study[1].tested[1].id
    assert not view.page.state.isVisible()


def test_another_place_ends_the_training_that_nobody_waits_for(
    view, document, study, until, trainings
):
    trainings.held = True
    document.review.set_run(study[1])
    view.show()
    document.review.examine(place_in(study, 0))
    until(lambda: trainings.requests == [study[1].tested[0].id])
    document.review.examine(place_in(study, 0, "release"))
    QTest.qWait(60)
    assert not trainings.closed  # another place, but of the same demonstration
    document.review.examine(place_in(study, 1))
    until(lambda: trainings.closed == [study[1].tested[0].id])
    until(lambda: len(trainings.requests) == 2)
    view.hide()
    until(lambda: len(trainings.closed) == 2)


def test_the_training_can_be_stopped_and_begun_again(view, document, study, until, trainings):
    trainings.held = True
    document.review.set_run(study[1])
    view.show()
    document.review.examine(place_in(study))
    until(lambda: view.page.stop.text() == "Stop")
    QTest.mouseClick(view.page.stop, Qt.MouseButton.LeftButton)
    until(lambda: trainings.closed)
    assert view.page.stop.text() == "Explain"
    trainings.held = False
    QTest.mouseClick(view.page.stop, Qt.MouseButton.LeftButton)
    until(lambda: view.why is not None)


def test_a_card_leads_to_its_segment_and_back_leads_to_the_place(
    explained, document, study, until, trainings, app
):
    view, why = explained, explained.why
    card = view.page.neighbours.cards[-1]
    card.setFocus()
    QTest.keyClick(card, Qt.Key.Key_Space)
    assert document.review.examined == card.neighbour.place
    assert document.id == card.neighbour.place.demonstration
    QTest.qWait(60)
    assert view.why is why
    assert not view.page.stale
    assert card.isChecked()
    QTest.mouseClick(view.page.back, Qt.MouseButton.LeftButton)
    assert document.review.examined == why.place
    assert document.id == why.place.demonstration
    QTest.qWait(60)
    assert view.why is why
    assert not view.page.back.isVisible()
    assert not card.isChecked()
    assert len(trainings.requests) == 1


def test_a_click_into_the_chart_moves_the_cursor_there(explained, document):
    chart = explained.page.chart
    start, end = chart.box.viewRange()[0]
    time = 0.3 * start + 0.7 * end
    where = QPoint(round(chart.spot(time, 0.5).x()), 40)
    QTest.mouseClick(chart.viewport(), Qt.MouseButton.LeftButton, pos=where)
    pixel = (end - start) / chart.area.width()
    assert document.view.cursor == pytest.approx(time, abs=1.1 * pixel)


def test_a_selected_segment_is_explained_and_so_is_what_is_at_the_cursor(
    view, document, study, until
):
    result = study[1].tested[0]
    document.review.set_run(study[1])
    document.open_demonstration(result.id)
    view.show()
    place = interval_at(result, 2.0)
    document.view.seek(2.0)
    until(lambda: view.place == place)
    document.set_author("Ann")  # who has segments to select
    document.select(1)
    segment = document.editor.segments[1]
    until(lambda: (view.place.start, view.place.end) == (segment.start, segment.end))
    assert view.place.human == segment.action


def test_a_band_is_told_where_the_pointer_is(explained):
    bands, why = explained.page.bands, explained.why
    first = why.strongest()[0]
    cell = bands.cell(why.channels.index(first.channel), why.hertz.tolist().index(first.hertz))
    assert bands.readout(cell.center()) == explanation_plots.band_sentence(first, why)
    assert bands.readout(QPointF(1, 1)) == ""
    before = bands.grab().toImage()
    QTest.mouseMove(bands.viewport(), cell.center().toPoint())
    assert bands.grab().toImage() != before


def test_the_chart_has_the_cursor_only_while_its_demonstration_is_open(explained, document):
    chart, time = explained.page.chart, explained.place.start
    document.view.seek(time)
    cursor = chart.box.addedItems[-1]
    assert (cursor.isVisible(), cursor.value()) == (True, time)
    other = next(info.id for info in document.infos if info.id != document.id)
    document.open_demonstration(other)
    assert not chart.box.addedItems[-1].isVisible()


def test_the_chart_reads_the_most_probable_actions_at_the_pointer(explained):
    chart, trace = explained.page.chart, explained.why.probability_trace
    at = int(np.searchsorted(trace.times, explained.place.start)) + 3
    spot = chart.spot((trace.times[at] + trace.times[at + 1]) / 2, 0.5)
    values = trace.values[at] / 255
    best = int(values.argmax())
    assert f" s: {trace.actions[best]} {values[best]:.2f}" in chart.readout(spot)
    assert chart.readout(QPointF(1, 1)) == ""


@pytest.mark.parametrize("dark", [False, True])
def test_colours_of_for_and_against_are_told_apart_without_red_and_green(dark):
    colours = balance_colours(dark).astype(float)
    middle = len(colours) // 2
    grey = colours @ [0.2126, 0.7152, 0.0722]
    for side in (grey[middle:], grey[middle::-1]):
        steps = np.diff(side)
        assert ((steps >= -0.5) if dark else (steps <= 0.5)).all()
    # Blue against yellow is what every dichromat sees.
    yellow = colours[:, :2].mean(axis=1) - colours[:, 2]
    assert yellow[-1] - yellow[0] > 150


def test_the_shelf_keeps_what_was_used_last(study):
    class Heavy:
        bytes = 50 * 2**20

    shelf, (path, run) = ModelCache(), study
    for name in "abc":
        shelf.put(path, run, name, Heavy())
        shelf.get(path, run, "a")
    assert [shelf.get(path, run, name) is not None for name in "abc"] == [True, False, True]


def test_time_left_is_that_of_a_fold_of_the_run(study):
    run = replace(study[1], seconds={"features": 3.0, "fit": 30.0})
    sentence = explanation_plots.held_out_progress(Progress(3, 200, "fit"), "foam 01", 4.0, run)
    assert sentence == "Training without foam 01 … about 9 s left"
    halves = explanation_plots.held_out_progress(
        Progress(3, 200, "fit"), "foam 01", 4.0, replace(run, folds=2)
    )
    assert halves == "Training without foam 01 … about 14 s left"
    late = explanation_plots.held_out_progress(Progress(3, 200, "fit"), "foam 01", 40.0, run)
    assert late == "Training without foam 01 … nearly done"
