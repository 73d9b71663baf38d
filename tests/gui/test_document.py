"""The document: what views are told, and what the store has by then."""

from dataclasses import replace

import numpy as np
import pytest
from factories import cached_project, demonstration_result, run_result
from PySide6.QtCore import QObject
from window_helpers import status_messages

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import ForcelabError, StoreBusyError
from forcelab.gui.document import Document
from forcelab.gui.review.reviewed_run import reviewed_vocabulary
from forcelab.labels import Segment, Track
from forcelab.project import NewDemonstration, Project
from forcelab.project.demonstrations import DemonstrationStore


def demonstration(name="pen 1", seconds=10.0, rate=1000.0):
    times = np.arange(int(seconds * rate)) / rate
    signals = np.full((len(times), 2), float(len(name)))
    signals[:, 0] = np.sin(times)
    return Demonstration(name, "stylus", times, signals, (Channel("f", "N"), Channel("g", "N")))


def study(path):
    with Project.create(path) as project:
        project.demonstrations.add_all(
            [
                NewDemonstration(
                    demonstration("pen 1"),
                    (
                        Track("Ada", (Segment(1, 2, "grab"),)),
                        Track("Ben", (Segment(3, 4, "pull"),)),
                    ),
                ),
                NewDemonstration(demonstration("pen 2", 5.0)),
            ]
        )


@pytest.fixture
def path(tmp_path):
    return cached_project(study, tmp_path / "study.forcelab")


@pytest.fixture
def document(app, path):
    document = Document("Ada")
    document.open_project(path)
    document.open_demonstration("pen 1")
    yield document
    document.close()


class Heard(QObject):
    """What a document said, in order."""

    def __init__(self, document):
        super().__init__()
        self.messages = status_messages(document)
        self.events = []
        document.tracks_changed.connect(lambda: self.events.append("tracks_changed"))


def stored(document, author="Ada"):
    with Project.open(document.project.path) as project:
        return project.tracks.get(document.id, author).segments


def test_a_view_that_hears_of_an_edit_finds_it_in_the_store(document):
    agreements = []
    document.tracks_changed.connect(
        lambda: agreements.append(stored(document) == document.editor.segments)
    )
    assert document.editor.paint(5, 6, "hold")
    assert document.editor.move_edge(1, "end", 6.5)
    assert document.editor.undo_everywhere()
    assert document.editor.redo_everywhere()
    assert agreements == [True] * 4
    assert stored(document) == (Segment(1, 2, "grab"), Segment(5, 6.5, "hold"))


def test_what_an_undo_changes_comes_into_view(document):
    assert document.editor.paint(5, 6, "hold")
    document.view.set_span(0, 2)
    assert document.editor.undo_everywhere()
    assert document.view.start <= 5
    assert document.view.end >= 6
    assert document.view.end - document.view.start == pytest.approx(2)
    document.view.set_span(4.5, 9)
    assert document.editor.redo_everywhere()
    assert (document.view.start, document.view.end) == (4.5, 9)  # it is in view already


def test_what_stands_in_the_way_is_said_and_nothing_changes(document):
    listener = Heard(document)
    assert not document.editor.paint(3, 3, "hold")
    assert not document.editor.split(8)
    assert not document.editor.move_edge(0, "start", 2.5)
    assert [trouble for _, trouble in listener.messages] == [True] * 3
    assert "tracks_changed" not in listener.events
    assert stored(document) == (Segment(1, 2, "grab"),)


def test_an_edit_from_elsewhere_is_not_written_over_but_shown(document):
    with Project.open(document.project.path) as other:
        other.tracks.edit(document.id, "Ada", document.editor.segments, (), "emptied")
    listener = Heard(document)
    assert not document.editor.paint(1, 3, "hold")
    assert listener.messages[-1][1]
    assert document.editor.segments == ()
    assert document.editor.paint(1, 3, "hold")
    assert stored(document) == (Segment(1, 3, "hold"),)


def test_what_another_process_painted_appears_when_one_looks(document):
    assert document.other_tracks == {"Ben": (Segment(3, 4, "pull"),)}
    with Project.open(document.project.path) as other:
        other.tracks.edit(document.id, "Ben", (Segment(3, 4, "pull"),), (), "emptied")
        other.tracks.edit(document.id, "Cleo", (), (Segment(0, 1, "wobble"),), "painted")
    listener = Heard(document)
    document.refresh()
    assert document.other_tracks == {"Ben": (), "Cleo": (Segment(0, 1, "wobble"),)}
    assert "wobble" in document.vocabulary
    assert listener.events.count("tracks_changed") == 1
    document.refresh()
    assert listener.events.count("tracks_changed") == 1


def test_a_new_action_gets_a_look_and_the_others_keep_theirs(document):
    before = {action.name: action for action in document.vocabulary}
    document.editor.paint(5, 6, "polish")
    assert all(document.vocabulary[name] == action for name, action in before.items())
    with Project.open(document.project.path) as project:
        assert "polish" in project.actions.vocabulary("stylus")


def test_while_coding_blind_nobody_elses_labels_can_be_reached(document):
    document.project.coding.assign(document.id, "Ada", blind=True)
    document.open_demonstration("pen 2")
    document.open_demonstration("pen 1")
    assert document.other_tracks == {}
    assert not document.editor.copy_from("Ben", 0, 9)
    assert document.editor.segments == (Segment(1, 2, "grab"),)
    assert document.set_done()
    assert document.other_tracks == {"Ben": (Segment(3, 4, "pull"),)}


def test_a_busy_store_is_told_where_others_tracks_are_asked_for(document, monkeypatch):
    def busy(demonstration, author):
        raise StoreBusyError("Kept busy.")

    monkeypatch.setattr(document.project.coding, "is_blind", busy)
    listener = Heard(document)
    assert document.other_authors() == ()
    assert listener.messages == [("Kept busy.", True)]
    assert not document.set_done()
    assert listener.messages[1:].count(("Kept busy.", True)) == len(listener.messages) - 1 > 0
    monkeypatch.undo()
    assert document.project.coding.assignments() == ()
    assert document.other_authors() == ("Ben",)


def test_the_selection_stays_with_its_segment(document):
    for start in (3, 5, 7):
        document.editor.paint(start, start + 1, "hold")
    document.select(2)
    document.editor.paint(0, 0.5, "still")
    assert document.editor.segments[document.selected] == Segment(5, 6, "hold")
    document.editor.delete(0)
    assert document.editor.segments[document.selected] == Segment(5, 6, "hold")
    document.editor.paint(7, 7.5, "pull")
    assert document.editor.segments[document.selected] == Segment(5, 6, "hold")
    document.editor.delete(document.selected)
    assert document.selected is None


def test_the_selection_ends_where_the_cursor_leaves_it(document):
    document.select(0)
    document.view.seek(1.5)
    assert document.selected == 0
    document.view.seek(2.5)
    assert document.selected is None


def test_the_span_stays_inside_and_zooms_about_the_pointer(document):
    document.view.set_span(2, 4)
    document.view.zoom(0.5, 2.5)
    assert (document.view.start, document.view.end) == pytest.approx((2.25, 3.25))
    document.view.pan(-100)
    assert (document.view.start, document.view.end) == pytest.approx((0, 1))
    document.view.zoom(1000, 0.5)
    assert (document.view.start, document.view.end) == document.view.bounds
    document.view.zoom(1e-12, 5)
    period = document.demonstration.period
    assert document.view.end - document.view.start == pytest.approx(5 * period)  # a few samples
    document.view.seek(9)
    assert document.view.start <= 9 <= document.view.end


def test_a_step_is_a_sample_or_with_video_a_frame(document):
    document.view.seek(2.0005)
    document.view.step(1)
    assert document.view.cursor == pytest.approx(2.001)
    document.view.seek(2.0005)
    document.view.step(-1)
    assert document.view.cursor == pytest.approx(2.0)
    document.view.set_frame_times(np.array([0.1, 0.5, 3.0, 3.2]))
    document.view.seek(0.7)
    document.view.step(1)
    assert document.view.cursor == 3.0
    document.view.step(-1)
    assert document.view.cursor == 0.5
    document.view.step(-5)
    assert document.view.cursor == 0.1


def test_outside_the_video_a_step_is_a_sample_and_never_goes_the_other_way(document):
    document.view.set_frame_times(np.array([2.0, 2.5, 8.0]))
    for start, count, end in (
        (9, 1, 9.001),
        (9, -1, 8.0),
        (8, 1, 8.001),
        (1, -1, 0.999),
        (1, 1, 2.0),
        (2, -1, 1.999),
        (9, 10, 9.010),
    ):
        document.view.seek(start)
        document.view.step(count)
        assert document.view.cursor == pytest.approx(end)
    document.view.seek(0)
    document.view.step(-1)
    assert document.view.cursor == 0


def test_a_range_is_marked_from_either_side(document):
    document.view.seek(4)
    document.view.mark_in()
    assert (document.view.range, document.view.range_start) == (None, 4)
    document.view.seek(6)
    document.view.mark_out()
    assert document.view.range == (4, 6)
    document.view.seek(3)
    document.view.mark_out()
    assert document.view.range is None
    document.view.set_range(8, 7)
    assert document.view.range == (7, 8)
    document.view.clear_range()
    assert document.view.range is None


def test_a_stroke_may_run_backwards_and_needs_time(document):
    document.begin_stroke("pull", 8)
    assert document.end_stroke(7)
    assert Segment(7, 8, "pull") in stored(document)
    document.begin_stroke("pull", 5)
    assert not document.end_stroke(5)
    document.begin_stroke("pull", 5)
    document.cancel_stroke()
    assert not document.end_stroke(6)
    assert len(stored(document)) == 2


def test_what_a_key_began_is_stored_before_it_is_left(document):
    messages = status_messages(document)
    pens = [info.id for info in document.infos]
    ended = "pull from {:.2f} s was ended at the cursor, at {:.2f} s."
    ways_to_leave = (
        (document.set_done, "Marked as done."),
        (lambda: document.open_demonstration(pens[1]), ended),
        (lambda: document.set_author("Ben"), ended),
    )
    for start, (leave, message) in zip((3, 5, 7), ways_to_leave, strict=True):
        document.set_author("Ada")
        document.open_demonstration(pens[0])
        document.begin_stroke("pull", start)
        document.view.seek(start + 1)
        leave()
        with Project.open(document.project.path) as project:
            track = project.tracks.get(pens[0], "Ada").segments
        assert track[-1] == Segment(start, start + 1, "pull")
        assert document.stroke is None
        assert messages[-1] == (message.format(start, start + 1), False)


def test_what_a_key_began_paints_over_nothing_unless_it_is_ended(document):
    messages = status_messages(document)
    pens = [info.id for info in document.infos]
    document.begin_stroke("pull", 0.5)
    document.view.seek(3)
    assert not document.set_done()
    refusal = "pull from 0.50 s is not ended: press its key again, or Esc to cancel it."
    assert messages[-1] == (refusal, True)
    assert not any(assignment.done for assignment in document.project.coding.assignments("Ada"))
    assert document.open_demonstration(pens[1])
    assert messages[-1] == ("pull from 0.50 s was not ended: it is not stored.", True)
    document.open_demonstration(pens[0])
    assert stored(document) == (Segment(1, 2, "grab"),)
    document.begin_stroke("pull", 7)  # and nothing was begun where the cursor has not moved
    document.view.seek(7)
    assert document.set_done()
    assert stored(document) == (Segment(1, 2, "grab"),)


def test_what_was_changed_elsewhere_is_read_once_the_store_can_be_read(document, monkeypatch):
    with Project.open(document.project.path) as other:
        other.tracks.edit(document.id, "Ada", document.editor.segments, (), "emptied")
        other.demonstrations.rename(document.infos[1].id, "pen 3")
    for verbs in (("infos", "load"), ("infos",)):
        with monkeypatch.context() as failing:
            for verb in verbs:
                failing.setattr(DemonstrationStore, verb, refusing)
            document.refresh()
        assert bool(document.editor.segments) == ("load" in verbs)
        assert [info.name for info in document.infos] == ["pen 1", "pen 2"]
    document.refresh()
    assert [info.name for info in document.infos] == ["pen 1", "pen 3"]


def refusing(*_):
    raise ForcelabError("The disk is away.")


def test_a_coder_cannot_take_a_models_name(document):
    listener = Heard(document)
    document.set_author("model LEGO")
    assert document.author == "Ada"
    assert listener.messages[-1][1]
    document.set_author("Ben")
    assert document.editor.segments == (Segment(3, 4, "pull"),)
    assert set(document.other_tracks) == {"Ada"}


def test_a_project_that_cannot_be_opened_leaves_the_open_one(document, tmp_path):
    with pytest.raises(Exception, match="holds no project|no project|There is no"):
        document.open_project(tmp_path / "nothing")
    assert document.project is not None
    assert document.editor.segments


def test_what_only_a_model_predicts_looks_as_in_the_review(document):
    document.open_demonstration(document.infos[0].id)
    tested = demonstration_result(
        document.id, (), [(1, 2, "polish"), (3, 4, "grab")], task="stylus"
    )
    # Of the other actions of the run none is predicted here, yet they come first.
    result = run_result([tested], ("grab", "twist", "tear", "polish"))
    document.review.set_run(replace(result, tasks=("stylus",)))
    vocabulary = reviewed_vocabulary(document)
    assert "twist" not in document.vocabulary
    assert document.vocabulary["polish"].look == vocabulary["polish"].look
    assert document.vocabulary["grab"].look == vocabulary["grab"].look
    assert document.vocabulary["polish"].key  # it can be painted
    assert "polish" not in document.project.actions.vocabulary("stylus")
