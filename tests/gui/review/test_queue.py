"""The queue in the window: it leads to every difference, and a key judges it."""

import threading
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from factories import FOAM_ACTIONS, add_foam_demonstration, unscored_run_result
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QShortcut
from PySide6.QtTest import QTest
from window_helpers import open_foam_document, status_messages, stored_rows

from forcelab.gui.jobs import Jobs
from forcelab.gui.key_events import guard_typing
from forcelab.gui.review.queue import QUEUE_JOB, QueueView
from forcelab.gui.review.queue_list import QueueModel, QueueSection
from forcelab.labels import Interval, Segment
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.differences import Difference
from forcelab.review.queue import Queue

HUMAN = (Segment(0, 2, "grab"), Segment(2, 6, "hold"), Segment(6, 8, "release"))
#: An edge 0.1 s late, a wrong action, a hole, and something after the last label.
SEEN = (
    Segment(0, 2.1, "grab"),
    Segment(2.1, 3, "hold"),
    Segment(3, 4.5, "release"),
    Segment(5, 6, "hold"),
    Segment(6, 8, "release"),
    Segment(8.5, 9.5, "hold"),
)


def certain(segments, length=10.0):
    times = np.arange(int(length * 100)) / 100
    probabilities = np.full((len(times), 3), 0.05)
    for s in segments:
        inside = (times >= s.start) & (times < s.end)
        probabilities[inside, FOAM_ACTIONS.index(s.action)] = 0.9
    return ProbabilityTrace.from_probabilities(times, probabilities, FOAM_ACTIONS)


def reviewed(id_, name="01", predicted=SEEN):
    stages = {"raw": predicted, "filtered": predicted}
    return DemonstrationResult(id_, name, "foam", 0.0, 10.0, HUMAN, stages, certain(predicted))


def run_of(*tested, author="Ann"):
    return unscored_run_result(tested, number=0, author=author)


@pytest.fixture
def open_queue(app, until):
    """Open the queue of Ann's window, by default on a run tested on her labels."""

    @contextmanager
    def opened(author="Ann", predicted=SEEN, visible=True, train=True):
        tracks = {} if author == "Ann" else {author: HUMAN}
        with open_foam_document(HUMAN if author == "Ann" else (), **tracks) as document:
            jobs = Jobs()
            view = QueueView(document, jobs)
            view.messages = status_messages(document)
            if visible:
                view.resize(340, 420)
                view.show()
            if train:
                document.review.set_run(
                    run_of(reviewed(document.id, predicted=predicted), author=author)
                )
            if visible:
                until(lambda: not view.reader.stale)
            try:
                yield view
            finally:
                view.hide()
                jobs.close()
                view.deleteLater()
                app.processEvents()

    return opened


@pytest.fixture
def view(open_queue):
    with open_queue() as view:
        yield view


def kinds(view):
    return [(section.kind, len(section)) for section in view.model.sections]


def examined(view):
    place = view.document.review.examined
    return place and (place.start, place.end, place.human, place.predicted)


WRONG = (3, 4.5, "hold", "release")
MISSED = (4.5, 5, "hold", None)
EDGE = (2, 2.1, "hold", "grab")


def test_what_differs_is_listed_by_section(view):
    assert kinds(view) == [("actions", 1), ("missed", 1), ("boundaries", 1), ("invented", 1)]
    assert (
        view.model.index(1).data().endswith("01, 3.000 to 4.500 s; Confidence of the model: 90 %")
    )


def test_every_section_says_what_its_percentages_are(view):
    entry = view.model.sections[0].listed[0]
    suspected = QueueSection("suspected", (entry,), 1)
    actions = QueueSection("actions", (entry,), 1)
    assert (suspected.percentages, actions.percentages) == ("suspicion", "confidence")
    assert "error of the coder" in suspected.tip
    assert "how sure the model is" in actions.tip
    assert "human → model" in actions.explained  # which way round a row is read
    unknown = QueueSection("actions", (replace(entry, confidence=None),), 1)
    assert unknown.percentages == ""
    assert unknown.tip == unknown.explained


def test_next_and_previous_go_round_what_is_unfolded_and_say_so(view):
    places = []
    for _ in range(3):
        view.step(1)
        places.append(examined(view))
    assert places == [WRONG, MISSED, WRONG]
    assert view.messages[-1] == ("Back at the first.", False)
    view.step(-1)
    assert examined(view) == MISSED
    assert view.messages[-1] == ("Back at the last.", False)
    assert view.document.view.range == (4.5, 5)


def test_next_works_while_the_queue_is_hidden_and_nothing_was_compared_yet(open_queue, until):
    with open_queue(visible=False) as view:
        assert view.reader.read is None
        view.step(1)
        until(lambda: view.document.review.examined is not None)
        assert examined(view) == WRONG
        assert view.messages == [("Human: hold; model: release.", False)]
        view.step(1)
        assert view.messages[1:] == [("Human: hold; model: unlabelled.", False)]


def test_next_while_the_queue_is_hidden_outlasts_labelling_during_the_comparison(open_queue, until):
    with open_queue(visible=False) as view:
        view.step(1)
        assert view.document.editor.paint(9, 10, "grab")  # before the comparison is delivered
        until(lambda: view.document.review.examined is not None)
        assert examined(view) == (9, 10, "grab", "hold")  # it goes to what was painted
        assert not view.reader.stale


@pytest.mark.parametrize("visible", [True, False])
def test_who_looks_next_sees_at_once_nothing_that_he_codes_blind(view, until, visible):
    document = view.document
    document.project.coding.assign(document.id, "Bob", blind=True)
    view.setVisible(visible)
    document.set_author("Bob")
    assert kinds(view) == []
    assert not view.judge("model")
    view.show()
    until(lambda: not view.reader.stale)
    assert kinds(view) == []


def test_no_place_stays_marked_for_who_looks_next_and_codes_blind(view):
    document = view.document
    view.step(1)
    place, marked = document.review.examined, document.view.range
    document.project.coding.assign(document.id, "Bob", blind=True)
    document.set_author("Cleo")  # who may see it
    assert (document.review.examined, document.view.range) == (place, marked)
    document.set_author("Bob")
    assert (document.review.examined, document.view.range) == (None, None)


@pytest.mark.parametrize("visible", [True, False])
def test_what_was_compared_for_another_coder_is_not_shown(view, until, app, visible):
    document, listed = view.document, []
    view.reader.changed.connect(lambda: listed.extend(kinds(view)))
    view.reader.compare()
    for thread in threading.enumerate():  # it ends; the window has not heard of it yet
        if thread.name == f"forcelab {QUEUE_JOB}":
            thread.join(0.5)
    document.project.coding.assign(document.id, "Bob", blind=True)
    view.setVisible(visible)
    document.set_author("Bob")
    for _ in range(5):
        app.processEvents()
    assert listed == []
    assert kinds(view) == []


def test_human_right_keeps_the_label_and_goes_on(view, until):
    view.step(1)
    before = stored_rows(view.document)
    assert view.judge("human")
    assert examined(view) == MISSED
    until(lambda: not view.reader.stale)
    assert kinds(view) == [("missed", 1), ("boundaries", 1), ("invented", 1), ("judged", 1)]
    (verdict,) = view.document.project.coding.verdicts()
    assert (verdict.verdict, verdict.author, verdict.coder) == ("human", "Ann", "Ann")
    assert stored_rows(view.document) == before


def test_after_the_last_unfolded_place_it_says_what_is_left_and_where(view, until):
    view.step(1)
    assert view.judge("human")
    assert view.judge("human")
    assert view.messages[-1][0] == (
        "All unfolded places are judged. Left: Boundaries only (1), Labelled by the model only "
        "(1); N unfolds them."
    )
    view.step(1)
    until(lambda: examined(view) == EDGE)


def test_model_right_repaints_as_one_edit_and_undo_opens_it_again(view, until):
    view.step(1)
    assert view.judge("model")
    until(lambda: not view.reader.stale)
    assert (3, 4.5, "release") in stored_rows(view.document)
    assert "release" in view.messages[-1][0]
    assert kinds(view)[0] == ("missed", 1)
    assert kinds(view)[-1] == ("judged", 1)
    assert view.document.editor.undo_everywhere()
    until(lambda: not view.reader.stale)
    assert kinds(view)[0] == ("actions", 1)
    assert ("judged", 1) not in kinds(view)
    assert stored_rows(view.document) == [(s.start, s.end, s.action) for s in HUMAN]


def verdicts(view):
    return [(v.start, v.verdict) for v in view.document.project.coding.verdicts()]


@pytest.mark.parametrize("in_the_queue", [True, False])
def test_an_undone_verdict_does_not_come_back_with_the_one_beside_it(view, until, in_the_queue):
    view.step(1)
    assert view.judge("model")  # 3 to 4.5 s; the next place begins where it ends
    assert view.revert("undo") if in_the_queue else view.document.editor.undo_everywhere()
    until(lambda: not view.reader.stale)
    assert verdicts(view) == []
    view.document.review.examine(view.queue.missed[0])
    assert view.judge("model")
    until(lambda: not view.reader.stale)
    assert verdicts(view) == [(4.5, "model")]
    assert [v.start for v in view.queue.judged] == [4.5]
    assert view.revert("undo")
    assert view.revert("redo")
    assert verdicts(view) == [(4.5, "model")]
    assert (2, 4.5, "hold") in stored_rows(view.document)


def test_undo_takes_back_verdicts_and_edits_in_their_order_and_shows_where(view, until):
    document = view.document
    project, first = document.project, document.id
    second = add_foam_demonstration(project, "02")
    project.tracks.edit(second, "Ann", (), HUMAN, "painted")
    document.refresh_listing()
    document.review.set_run(run_of(reviewed(first), reviewed(second, "02")))
    until(lambda: not view.reader.stale and len(view.queue.actions) == 2)
    places = {place.demonstration: place for place in view.queue.actions}
    document.review.examine(places[first])
    assert view.judge("model")
    document.review.examine(places[second])
    document.editor.paint(9, 10, "grab")
    document.review.examine(places[second])
    until(lambda: not view.reader.stale)
    assert view.judge("human")
    document.review.examine(places[first])
    labels = [project.tracks.get(id_, "Ann").segments for id_ in (first, second)]

    assert view.revert("undo")  # the verdict that was given last, and no label
    assert (document.id, examined(view)) == (second, (3, 4.5, "hold", "release"))
    assert [v.verdict for v in project.coding.verdicts()] == ["model"]
    assert [project.tracks.get(id_, "Ann").segments for id_ in (first, second)] == labels
    assert view.revert("undo")  # what was painted before it
    assert (document.id, stored_rows(document)[-1]) == (second, (6, 8, "release"))
    assert len(project.coding.verdicts()) == 1
    assert view.revert("undo")  # the first verdict, with its edit, in the other demonstration
    assert document.id == first
    assert project.coding.verdicts() == ()
    assert project.tracks.get(first, "Ann").segments == HUMAN

    assert view.revert("redo")
    assert [v.verdict for v in project.coding.verdicts()] == ["model"]
    assert project.tracks.get(first, "Ann").segments == labels[0]
    assert view.revert("redo")
    assert project.tracks.get(second, "Ann").segments == labels[1]
    assert view.revert("redo")
    assert {(v.demonstration, v.verdict) for v in project.coding.verdicts()} == {
        (first, "model"),
        (second, "human"),
    }


def test_undo_gives_a_withdrawn_verdict_back(view, until):
    view.step(1)
    view.judge("human")
    until(lambda: not view.reader.stale)
    view.document.review.examine(view.model.sections[-1].listed[0])
    assert view.withdraw()
    assert view.revert("undo")
    assert verdicts(view) == [(3, "human")]
    assert view.revert("undo")
    assert verdicts(view) == []
    assert view.document.editor.segments == HUMAN
    assert view.revert("redo")
    assert verdicts(view) == [(3, "human")]


def test_nobody_changes_the_labels_of_another_coder(open_queue, until):
    with open_queue(author="Bob") as view:
        view.step(1)
        assert view.judge("model")
        assert "only Bob can change Bob's labels" in view.messages[-1][0]
        with_bob = view.document.project.tracks.get(view.document.id, "Bob").segments
        assert with_bob == HUMAN
        assert stored_rows(view.document) == []
        until(lambda: not view.reader.stale)
        assert kinds(view)[0] == ("missed", 1)  # judged all the same
        count = len(view.messages)
        view.judge("human")
        assert view.messages[count][0] == ""  # what was said of the verdict before is gone
        assert view.document.project.coding.verdicts()[0].coder == "Bob"


def test_delete_in_the_queue_withdraws_the_verdict_and_erases_no_label(view, until):
    guard_typing()
    document = view.document
    erased = QShortcut(QKeySequence("Del"), view)
    erased.activated.connect(lambda: document.editor.delete(document.editor.segments[0]))
    view.show()
    view.activateWindow()
    view.step(1)
    view.judge("ambiguous")
    until(lambda: not view.reader.stale)
    before = document.editor.segments
    view.list.setFocus()
    QTest.keyClick(view.list, Qt.Key.Key_Delete)
    assert document.editor.segments == before
    assert len(document.project.coding.verdicts()) == 1  # an open place has none to withdraw
    document.review.examine(view.model.sections[-1].listed[0])
    assert not view.buttons.withdraw.isHidden()
    QTest.keyClick(view.list, Qt.Key.Key_Delete)
    until(lambda: not view.reader.stale)
    assert kinds(view)[0] == ("actions", 1)
    assert document.editor.segments == before
    assert document.project.coding.verdicts() == ()


def test_painting_brings_the_queue_up_to_date(view, until):
    view.document.editor.paint(3, 4.5, "release")
    until(lambda: not view.reader.stale)
    assert kinds(view)[0] == ("missed", 1)


def test_a_queue_that_is_shown_knows_what_was_painted_while_it_was_hidden(view, until):
    document = view.document
    first, second = document.id, add_foam_demonstration(document.project, "02")
    document.refresh_listing()
    document.review.set_run(run_of(reviewed(first), reviewed(second, "02")))
    until(lambda: not view.reader.stale)
    assert WRONG in [(d.start, d.end, d.human, d.predicted) for d in view.queue.actions]
    view.hide()
    document.editor.paint(3, 4.5, "release")
    document.open_demonstration(second)
    document.editor.paint(1, 2, "grab")
    view.show()
    until(lambda: not view.reader.stale)
    assert view.queue.actions == ()
    known = view.reader.read.known
    assert known[first].segments == document.project.tracks.get(first, "Ann").segments
    assert known[second].segments == document.editor.segments


def test_only_what_is_examined_is_judged(view):
    view.step(1)
    view.document.review.examine(Interval(view.document.id, 7, 7.5))  # clicked in another view
    assert not view.judge("human")
    assert view.document.project.coding.verdicts() == ()
    assert not view.buttons.verdicts["human"].isEnabled()


def test_the_filter_looks_at_actions_and_demonstrations(view):
    view.filter.setText("grab")
    assert kinds(view) == [("boundaries", 1)]
    view.filter.setText("01")
    assert len(kinds(view)) == 4
    view.filter.setText("nothing like it")
    assert view.pages.note.isVisible()


def test_the_keyboard_opens_a_row_and_leaves_letters_to_the_window(view):

    missed = view.model.index(view.model.row(1, 0))
    view.list.setCurrentIndex(missed)
    QTest.keyClick(view.list, Qt.Key.Key_Return)
    assert examined(view) == MISSED


def test_of_thousands_of_places_only_those_in_view_are_made_into_rows(view, app, monkeypatch):
    """Otherwise each step and each verdict would take a fifth of a second."""
    calls = []
    at = QueueModel.at
    many = tuple(
        Difference(view.document.id, t, t + 0.01, "grab", "hold", 0.5)
        for t in np.linspace(0.5, 9.5, 4000).tolist()
    )
    monkeypatch.setattr(QueueModel, "at", lambda *args: calls.append(args) or at(*args))
    view.reader.put_away(Queue(actions=many))
    app.processEvents()
    assert view.model.rowCount() == 4001
    view.step(1)
    view.step(-1)
    assert view.messages[-1] == ("Back at the last.", False)
    assert view.list.currentIndex().row() == 4000
    app.processEvents()
    assert len(calls) < 200


def test_a_heading_folds_and_unfolds_its_section_and_folded_rows_are_passed_over(view):

    rows = view.model.rowCount()
    heading = view.model.index(view.model.row(0))
    box = view.list.visualRect(heading)
    left = Qt.MouseButton.LeftButton
    QTest.mouseClick(view.list.viewport(), left, pos=box.center())
    assert view.model.rowCount() == rows - 1
    assert "folded" in heading.data(Qt.ItemDataRole.AccessibleTextRole)
    view.step(1)
    assert examined(view) == MISSED
    view.list.setCurrentIndex(view.model.index(view.model.row(0)))
    QTest.keyClick(view.list, Qt.Key.Key_Return)
    assert view.model.rowCount() == rows
    view.step(1)
    assert examined(view) == WRONG


def test_without_a_run_it_says_what_to_do(open_queue):
    with open_queue(train=False) as view:
        assert "Train a recogniser" in view.pages.note.text()
        assert not view.buttons.isVisible()


def test_where_both_agree_it_says_so(open_queue):
    with open_queue(predicted=HUMAN) as view:
        assert "agree everywhere" in view.pages.note.text()


def test_where_nothing_was_tested_it_does_not_claim_that_both_agree(view, until):
    view.document.review.set_run(replace(view.document.review.run, tested=()))
    until(lambda: not view.reader.stale)
    assert "Nothing was tested" in view.pages.note.text()


def test_where_nothing_could_be_tested_it_says_why(view, until):
    reason = "Nothing could be tested: there is only still, after merging."
    untested = replace(view.document.review.run, tested=(), remarks=(reason, "Another matter."))
    view.document.review.set_run(untested)
    until(lambda: not view.reader.stale)
    assert view.pages.note.text().startswith(reason)
    assert "second demonstration" not in view.pages.note.text()


def test_what_is_coded_blind_is_not_listed(view, until):
    document = view.document
    document.project.coding.assign(document.id, "Ann", blind=True)
    document.reread()
    until(lambda: not view.reader.stale)
    assert kinds(view) == []
    assert "blind" in view.pages.note.text()


def test_another_run_replaces_the_queue(view, until):
    run = view.document.review.run
    id_ = view.document.id
    view.document.review.set_run(replace(run, number=0, tested=(reviewed(id_, "01", HUMAN),)))
    until(lambda: not view.reader.stale)
    assert kinds(view) == []


def test_the_keys_stand_on_the_buttons(view):
    assert "Shift+M" in view.buttons.verdicts["model"].text().replace("⇧", "Shift+")
    assert view.buttons.verdicts["model"].accessibleName() == "Model right"
