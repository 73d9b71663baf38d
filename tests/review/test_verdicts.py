"""What is judged leaves the queue, and comes back when the verdict counts no more."""

from dataclasses import replace

import pytest
from factories import foam_demonstration, folder_in_memory, unscored_run_result

from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.project.track_editor import TrackEditor
from forcelab.recognition.results import DemonstrationResult
from forcelab.review.differences import find_differences
from forcelab.review.queue import review_queue
from forcelab.review.verdicts import count_verdicts, model_action, record_verdict, withdraw_verdict

HUMAN = (Segment(0, 2, "grab"), Segment(2, 6, "hold"), Segment(6, 8, "release"))
SEEN = (
    Segment(0, 2.1, "grab"),
    Segment(2.1, 3, "hold"),
    Segment(3, 4.5, "release"),
    Segment(5, 6, "hold"),
    Segment(6, 8, "release"),
    Segment(8.5, 9, "hold"),
)


@pytest.fixture
def study():
    """A project in which Ann labelled, and what a recogniser makes of it."""
    with (
        folder_in_memory() as folder,
        Project.create(folder / "study.forcelab") as project,
    ):
        d = foam_demonstration()
        project.demonstrations.add(d)
        project.tracks.edit(d.id, "Ann", (), HUMAN, "made")
        tested = DemonstrationResult(d.id, d.name, "foam", 0, 10, HUMAN, {"filtered": SEEN})
        yield project, unscored_run_result([tested], number=0)  # no run of the project


def spans(section):
    return [(d.start, d.end) for d in section]


def test_each_kind_has_its_section(study):
    found = review_queue(*study)
    assert spans(found.actions) == [(3, 4.5)]
    assert spans(found.missed) == [(4.5, 5)]
    assert spans(found.boundaries) == [(2, 2.1)]
    assert found.invented == ()
    assert spans(review_queue(*study, invented=True).invented) == [(8.5, 9)]


def test_within_a_section_the_longest_and_most_confident_come_first(study):
    project, run = study
    segments = (Segment(0, 0.5, "hold"), Segment(1, 2, "grab"), Segment(2.5, 6, "release"))
    reviewed = replace(run.tested[0], stages={"filtered": segments})
    found = review_queue(project, replace(run, tested=(reviewed,)))
    lengths = [d.duration for d in found.actions]
    assert lengths == sorted(lengths, reverse=True)
    assert len(lengths) == 2


@pytest.mark.parametrize("verdict", ["human", "ambiguous"])
def test_what_is_judged_leaves_the_open_queue_until_it_is_withdrawn(study, verdict):
    project, run = study
    before = review_queue(project, run)
    record_verdict(project, run, before.actions[0], verdict, "Ann")
    after = review_queue(project, run)
    assert after.actions == ()
    assert [(v.start, v.end, v.verdict) for v in after.judged] == [(3, 4.5, verdict)]
    assert after.missed == before.missed
    withdraw_verdict(project, after.judged[0], "Ann")
    assert review_queue(project, run) == before
    assert [v.verdict for v in project.coding.verdict_events()] == [verdict, "withdrawn"]


def test_if_the_model_is_right_the_change_makes_both_agree_and_undo_opens_it_again(study):
    project, run = study
    before = review_queue(project, run)
    wrong = before.actions[0]
    assert (wrong.start, wrong.end, model_action(run, wrong)) == (3, 4.5, "release")
    track = TrackEditor(project, run.tested[0].id, "Ann")
    track.paint(wrong.start, wrong.end, model_action(run, wrong))
    record_verdict(project, run, wrong, "model", "Ann")
    after = review_queue(project, run)
    assert after.actions == ()
    assert len(after.judged) == 1
    track.undo()
    again = review_queue(project, run)
    assert (again.actions, again.judged) == (before.actions, ())


def test_another_author_who_finds_the_model_right_closes_it_without_an_edit(study):
    project, run = study
    record_verdict(project, run, review_queue(project, run).actions[0], "model", "Bob")
    assert review_queue(project, run).actions == ()


def test_a_verdict_speaks_also_of_what_the_next_recogniser_finds_a_bit_beside(study):
    project, run = study
    record_verdict(project, run, review_queue(project, run).actions[0], "human", "Ann")
    moved = tuple(
        replace(s, start=3.2, end=4.5) if s.start == 3 else replace(s, end=3.2) if s.end == 3 else s
        for s in SEEN
    )
    reviewed = replace(run.tested[0], stages={"filtered": moved})
    assert review_queue(project, replace(run, tested=(reviewed,))).actions == ()
    other = tuple(replace(s, action="grab") if s.start == 3 else s for s in SEEN)
    reviewed = replace(run.tested[0], stages={"filtered": other})
    assert len(review_queue(project, replace(run, tested=(reviewed,))).actions) == 1


def test_a_change_is_spelt_as_the_coder_spells_it(study):
    _, run = study
    run = replace(run, apart=True)
    result = run.tested[0]
    (found,) = find_differences(
        result.id, (Segment(0, 1, "hold_foam"),), (Segment(0, 1, "grab_foam"),), None
    )
    assert model_action(run, found) == "grab"
    assert model_action(run, replace(found, predicted=None)) is None


def test_the_report_counts_who_was_right_by_pair(study):
    project, run = study
    found = review_queue(project, run)
    record_verdict(project, run, found.actions[0], "human", "Ann")
    record_verdict(project, run, found.missed[0], "ambiguous", "Ann")
    record_verdict(project, run, found.actions[0], "ambiguous", "Ann")  # a second thought counts
    counts = {(p.human, p.predicted): p for p in count_verdicts(project.coding.verdicts())}
    pair = counts["hold", "release"]
    assert (pair.human_right, pair.model_right, pair.ambiguous) == (0, 0, 1)
    assert counts["hold", None].total == 1
