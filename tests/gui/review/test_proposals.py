"""Proposals: what to label next, and taking predictions over as edits that can be undone."""

from dataclasses import replace

import pytest
from factories import PREDICTED_TRACK, grab_probabilities, run_result_of
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication
from window_helpers import open_training_document, status_messages

from forcelab.gui.document import ReviewState
from forcelab.gui.review.proposals import ProposalsView
from forcelab.labels import Interval, Segment
from forcelab.recognition.results import DemonstrationResult


@pytest.fixture
def document(app):
    with open_training_document() as document:
        yield document


@pytest.fixture
def view(document, jobs, show):
    return show(ProposalsView(document, jobs), 480, 300)


def proposed(document):
    """The run with two proposals more: a certain one, and a very uncertain one."""
    run = run_result_of(document.project)
    (third,) = run.proposals
    others = [info for info in document.infos if info.task == "stylus"][:2]
    proposals = [
        DemonstrationResult(
            info.id, f"stylus {info.name}", "stylus", 0.0, 10.0, (), third.stages, sure
        )
        for info, sure in zip(
            others,
            (grab_probabilities((10, 0.99)), grab_probabilities((4, 0.7), (1, 0.5), (5, 0.7))),
            strict=True,
        )
    ]
    return run_result_of(document.project, proposals=(third, *proposals))


def test_the_most_uncertain_comes_first_and_it_says_so(view, document, until):
    assert not view.order.isVisible()
    document.review.set_run(proposed(document))
    until(lambda: len(view.rows) == 3)
    assert [row.name for row in view.rows] == ["stylus 02", "03", "stylus 01"]
    assert view.model.data(view.model.index(0, 1)) == "32 %"
    assert view.order.isVisible()
    assert view.order.text() == "The most uncertain comes first."


def test_what_is_labelled_by_now_comes_last(view, document, until):
    document.review.set_run(proposed(document))
    until(lambda: len(view.rows) == 3)
    document.open_demonstration(view.rows[0].id)
    document.editor.paint(0.0, 5.0, "hold")
    assert [row.name for row in view.rows] == ["stylus 02", "03", "stylus 01"]
    document.editor.paint(0.0, 9.5, "hold")
    assert [row.name for row in view.rows] == ["03", "stylus 01", "stylus 02"]
    assert view.model.data(view.model.index(2, 0)) == "stylus 02"
    assert view.order.text().startswith("The most uncertain comes first")
    document.editor.undo_everywhere()
    assert view.rows[0].name == "stylus 02"
    document.editor.undo_everywhere()


def test_once_all_are_labelled_it_is_said_to_train(view, document, until):
    document.review.set_run(run_result_of(document.project))
    until(lambda: len(view.rows) == 1)
    document.open_demonstration(view.rows[0].id)
    document.editor.paint(0.0, 9.5, "hold")
    assert view.order.text() == "All of these are labelled by now. Train again with them."
    document.editor.undo_everywhere()


def test_training_again_is_not_proposed_where_it_would_learn_from_another(view, document, until):
    document.review.set_run(run_result_of(document.project))
    until(lambda: len(view.rows) == 1)
    document.set_author("Ben")
    document.open_demonstration(view.rows[0].id)
    document.editor.paint(0.0, 9.5, "hold")
    sentence = "You have labelled all of these by now; this run learnt from Ann's labels."
    assert view.order.text() == sentence
    document.editor.undo_everywhere()
    document.set_author("Ann")


def test_a_click_leads_to_its_most_uncertain_stretch(view, document, until):
    document.review.set_run(proposed(document))
    until(lambda: len(view.rows) == 3)
    view._go(view.model.index(0, 0))
    assert document.id == view.rows[0].id
    assert (document.review.examined.start, document.review.examined.end) == pytest.approx(
        (4.0, 5.0)
    )
    assert document.view.cursor == pytest.approx(4.0)


def test_what_is_coded_blind_is_not_listed(view, document, until):
    run = proposed(document)
    document.project.coding.assign(run.proposals[0].id, "Ann", blind=True)
    document.review.set_run(run)
    until(lambda: len(view.rows) == 2)
    assert all(row.id != run.proposals[0].id for row in view.rows)


def test_accepting_says_how_many_and_how_to_take_it_back(view, document, messages):
    document.review.set_run(run_result_of(document.project))
    third = document.review.run.proposals[0].id
    document.open_demonstration(third)
    assert document.editor.segments == ()
    document.view.seek(3.0)
    assert view.accepting.here.isEnabled()
    view.accepting.here.click()
    assert document.editor.segments == PREDICTED_TRACK[1:2]
    assert messages[-1][0].startswith("1 predicted segment was accepted; Ctrl+Z")
    view.accepting.in_view.click()
    assert document.editor.segments == PREDICTED_TRACK
    document.editor.undo_everywhere()
    document.editor.undo_everywhere()
    assert document.editor.segments == ()


def test_one_prediction_after_the_other_is_accepted_by_the_same_key(document):
    document.review.set_run(run_result_of(document.project))
    document.open_demonstration(document.review.run.proposals[0].id)
    document.editor.paint(2.5, 6.0, "hold")
    document.editor.paint(6.0, 7.0, "release")
    document.view.seek(1.0)
    cursors = []
    while document.review.accept_here():
        cursors.append(document.view.cursor)
    assert cursors == [6.0, 7.0]  # past what is labelled like that already; then where it ends
    assert document.editor.segments == PREDICTED_TRACK
    document.editor.undo_everywhere()
    assert document.editor.segments[-1] == Segment(6.0, 7.0, "release")
    document.editor.undo_everywhere()
    assert document.editor.segments[0] == PREDICTED_TRACK[1]
    while document.editor.undo_everywhere():
        pass


def test_accepting_moves_neither_playback_nor_what_is_examined(document):
    document.review.set_run(proposed(document))
    place = document.review.run.proposals[0]
    document.review.examine(Interval(place.id, 1.0, 2.0))
    document.view.set_playing(True)
    assert document.review.accept_here()
    assert document.view.cursor == 1.0
    document.view.set_playing(False)
    document.editor.undo_everywhere()
    assert document.review.accept_here()
    assert document.view.cursor == 2.5
    assert (document.review.examined, document.view.range) == (
        Interval(place.id, 1.0, 2.0),
        (1.0, 2.0),
    )
    document.editor.undo_everywhere()


def test_only_what_is_probable_enough_is_accepted(view, document):
    document.review.set_run(run_result_of(document.project))
    document.open_demonstration(document.review.run.proposals[0].id)
    view.accepting.at_least.setValue(0.9)
    assert view.accepting.above.isEnabled()
    view.accepting.above.click()
    assert document.editor.segments == PREDICTED_TRACK[:1]


def test_what_the_coder_labelled_stays_when_many_are_accepted(view, document):
    document.review.set_run(run_result_of(document.project))
    document.open_demonstration(document.review.run.proposals[0].id)
    document.editor.paint(1.0, 3.0, "release")
    view.accepting.at_least.setValue(0.0)
    view.accepting.above.click()
    assert Segment(1.0, 3.0, "release") in document.editor.segments
    assert document.editor.segments[-1] == PREDICTED_TRACK[-1]


def test_what_is_accepted_has_no_suffix_of_its_task(view, document):
    run = run_result_of(document.project)
    (proposal,) = run.proposals
    stages = {
        "filtered": tuple(
            replace(s, action=f"{s.action}_{proposal.task}") for s in proposal.predicted
        )
    }
    apart = replace(run, apart=True, proposals=(replace(proposal, stages=stages),))
    document.review.set_run(apart)
    document.open_demonstration(proposal.id)
    view.accepting.in_view.click()
    assert document.editor.segments == proposal.predicted
    stored = document.project.actions.vocabulary(proposal.task).names
    assert not any(name.endswith(proposal.task) for name in stored)


def test_where_nothing_is_predicted_nothing_can_be_accepted(view, document):
    assert not view.accepting.here.isEnabled()
    document.review.set_run(run_result_of(document.project))
    document.open_demonstration(document.review.run.proposals[0].id)
    document.view.seek(9.0)
    assert not view.accepting.here.isEnabled()
    assert view.accepting.in_view.isEnabled()
    view.accepting.at_least.setValue(1.0)
    assert not view.accepting.above.isEnabled()


def test_a_step_of_playback_looks_at_few_predictions_of_many(view, document, monkeypatch):
    class Counted(tuple):
        looked = 0

        def __getitem__(self, place):
            Counted.looked += 1
            return super().__getitem__(place)

        def __iter__(self):
            Counted.looked += len(self)
            return super().__iter__()

    many = Counted(Segment(i / 1000, (i + 0.5) / 1000, "hold") for i in range(8000))
    monkeypatch.setattr(ReviewState, "prediction", property(lambda _: many))
    document.review.set_run(run_result_of(document.project))
    document.open_demonstration(document.review.run.proposals[0].id)
    for time, enabled in ((7.9902, True), (7.9907, False), (0.0, True), (9.5, False)):
        Counted.looked = 0
        document.view.cursor = time
        document.view.cursor_moved.emit(time)
        assert view.accepting.here.isEnabled() == enabled
        assert 0 < Counted.looked < 40


def test_who_codes_blind_is_not_told_to_train(document):
    document.review.set_run(run_result_of(document.project))
    third = document.review.run.proposals[0].id
    document.project.coding.assign(third, document.author, blind=True)
    document.open_demonstration(third)
    messages = status_messages(document)
    assert not document.review.accept_in_view()
    sentence = "Predictions are hidden until you are done; nothing accepted."
    assert messages == [(sentence, True)]


def test_how_much_is_labelled_by_now_is_shown(view, document, until):
    document.review.set_run(run_result_of(document.project))
    until(lambda: len(view.rows) == 1)
    document.open_demonstration(document.review.run.proposals[0].id)
    assert view.model.data(view.model.index(0, 3)) == "–"
    view.accepting.in_view.click()  # at once: the list of demonstrations is read again later
    assert view.model.data(view.model.index(0, 3)) == "70 %"
    document.editor.undo_everywhere()
    assert view.model.data(view.model.index(0, 3)) == "–"


def test_nothing_is_ranked_while_hidden(document, jobs):
    view = ProposalsView(document, jobs)
    document.review.set_run(run_result_of(document.project))
    assert not jobs.busy
    assert view._run is None
    view.deleteLater()


def test_what_is_painted_leaves_the_chosen_row_chosen_and_letters_to_the_window(
    view, document, until
):
    document.review.set_run(proposed(document))
    until(lambda: len(view.rows) == 3)
    view.table.selectRow(1)
    document.open_demonstration(view.rows[1].id)
    document.editor.paint(0.0, 1.0, "grab")
    assert view.model.data(view.model.index(1, 3)) == "10 %"
    assert view.table.currentIndex().row() == 1
    key = QKeyEvent(QKeyEvent.Type.KeyPress, Qt.Key.Key_S, Qt.KeyboardModifier.NoModifier, "s")
    QApplication.sendEvent(view.table, key)
    assert not key.isAccepted()
    assert view.table.currentIndex().row() == 1


def test_an_empty_list_says_why(view, document, until):
    assert "Train a recogniser" in view.pages.note.text()
    document.review.set_run(proposed(document))
    assert view.pages.note.text().startswith("Ranking")
    until(lambda: view.rows)
    document.review.set_run(run_result_of(document.project, proposals=()))
    assert "Train again" in view.pages.note.text()  # as of the command line, which tests only
    bare = [info.id for info in document.infos if "Ann" not in info.labelled]
    for id_ in bare:
        document.project.tracks.edit(id_, "Ann", (), (Segment(0.0, 1.0, "grab"),), "made")
    document.refresh_listing()
    until(lambda: "nothing to propose" in view.pages.note.text())


def test_who_codes_blind_does_not_learn_whether_others_have_labelled_it(view, document, until):
    document.review.set_run(run_result_of(document.project, proposals=()))
    document.set_author("Bob")
    notes = []
    for info in document.infos:
        if info.task in document.review.run.tasks:
            document.project.coding.assign(info.id, "Bob", blind=True)
            document.refresh_listing()
            until(lambda: "may be seen" in view.pages.note.text())
            notes.append((view.pages.note.text(), bool(info.labelled)))
            document.project.coding.unassign(info.id, "Bob")
            document.refresh_listing()
    assert {labelled for _, labelled in notes} == {False, True}
    assert len({text for text, _ in notes}) == 1
