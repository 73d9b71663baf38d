"""Two windows on one project, and what stays of one demonstration in the next."""

import time

import numpy as np
import pytest
from factories import cached_project, remove_demonstration
from PySide6.QtWidgets import QWidget
from window_helpers import status_messages

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.gui.document import Document
from forcelab.gui.label.segment_commands import erase_range, fill_range
from forcelab.gui.label.segment_list import SegmentTable
from forcelab.gui.label.track_menus import own_menu
from forcelab.labels import Interval, Segment, Track
from forcelab.project import Project
from forcelab.project.demonstrations import DemonstrationStore
from forcelab.vocabulary import Vocabulary

ONE, TWO, THREE = Segment(1, 2, "grab"), Segment(3, 4, "pull"), Segment(5, 6, "grab")


def demonstration(name, task):
    times = np.arange(1000) / 100
    return Demonstration(name, task, times, np.full((1000, 1), float(len(name))), (Channel("f"),))


def study(path):
    with Project.create(path) as project:
        project.demonstrations.add(
            demonstration("pen", "stylus"), [Track("Ada", (ONE, TWO, THREE))]
        )
        project.demonstrations.add(
            demonstration("brick", "LEGO"), [Track("Ben", (Segment(1, 2, "press"),))]
        )


@pytest.fixture
def path(tmp_path):
    return cached_project(study, tmp_path / "study.forcelab")


@pytest.fixture
def window(app, path):
    """Make documents of one coder, as two windows have them."""
    created = []

    def make(author="Ada", name="pen"):
        document = Document(author)
        document.open_project(path)
        document.open_demonstration(name)
        created.append(document)
        return document

    yield make
    for document in created:
        document.close()


def broken(*_, **__):
    raise InputError("The disk is gone.")


def test_a_brush_stays_behind_only_where_the_task_has_no_such_action(window):
    document = window()
    document.set_action("pull")
    document.open_demonstration("brick")
    assert document.action is None
    assert document.vocabulary.names == ("press",)
    document.open_demonstration("pen")
    document.project.actions.set_vocabulary("LEGO", Vocabulary().with_actions("press", "pull"))
    document.set_action("pull")
    document.open_demonstration("brick")
    assert document.action == "pull"


def test_who_cannot_be_labelled_as_is_not_shown_as_the_coder(window, monkeypatch):
    document = window()
    monkeypatch.setattr(document.project.tracks, "get", broken)
    document.set_author("Ben")
    assert document.author == "Ada"
    monkeypatch.undo()
    assert document.editor.paint(7, 8, "pull")
    with Project.open(document.project.path) as project:
        assert project.tracks.get(document.id, document.author).segments == document.editor.segments


def test_a_project_whose_list_cannot_be_read_leaves_the_open_one(window, path, monkeypatch):
    document = window()
    monkeypatch.setattr(DemonstrationStore, "infos", broken)
    with pytest.raises(InputError):
        document.open_project(path)
    assert document.editor.segments == (ONE, TWO, THREE)
    assert document.infos


def test_a_demonstration_that_cannot_be_read_leaves_the_open_one(window, monkeypatch):
    document = window()
    messages = status_messages(document)
    monkeypatch.setattr(document.project.tracks, "of", broken)
    assert not document.open_demonstration("brick")
    assert messages == [("The disk is gone.", True)]
    assert document.demonstration.name == "pen"
    assert document.editor.segments == (ONE, TWO, THREE)


def test_nothing_of_a_closed_project_is_left(window):
    document = window()
    document.set_action("pull")
    document.close()
    assert (document.vocabulary.names, document.action, document.infos) == ((), None, ())


def test_actions_that_two_windows_add_are_both_there(window):
    first, second = window(), window("Ben")
    second.editor.paint(7, 8, "slip")
    slip = second.vocabulary["slip"]
    first.editor.paint(8, 9, "drop")
    first.refresh()
    second.refresh()
    assert first.vocabulary["slip"] == second.vocabulary["slip"] == slip
    assert first.vocabulary["drop"] == second.vocabulary["drop"]
    assert first.project.actions.vocabulary("stylus").names == ("grab", "pull", "slip", "drop")


def test_a_vocabulary_changed_elsewhere_is_not_written_over(window):
    first, second = window(), window("Ben")
    second.set_vocabulary(second.vocabulary.with_actions("slip"))
    assert not first.set_vocabulary(first.vocabulary.recoloured("grab", "#123456"))
    assert "slip" in first.vocabulary
    assert first.set_vocabulary(first.vocabulary.recoloured("grab", "#123456"))
    assert first.project.actions.vocabulary("stylus")["grab"].colour == "#123456"
    assert "slip" in first.project.actions.vocabulary("stylus")


def test_undoing_what_another_window_painted_keeps_the_selection(window):
    first, second = window(), window()
    first.select(2)
    second.editor.paint(0, 0.5, "still")
    assert first.editor.undo_everywhere()
    assert first.editor.segments[first.selected] == THREE


def test_undoing_a_deletion_made_elsewhere_keeps_the_selection(window):
    first, second = window(), window()
    second.editor.delete(0)
    first.select(1)
    assert first.editor.undo_everywhere()
    assert first.editor.segments[first.selected] == TWO


@pytest.mark.parametrize(("deleted", "left"), [(0, (THREE,)), (1, (ONE, THREE))])
def test_a_menu_means_the_segment_that_it_was_opened_on_if_it_is_there(window, deleted, left):
    first, second = window(), window()
    holder = QWidget()
    menu = own_menu(holder, first, 3.5, lambda *_: None)
    second.editor.delete(deleted)
    first.refresh()
    next(entry for entry in menu.actions() if entry.text() == "Delete").trigger()
    assert first.editor.segments == left


def test_the_tables_menu_means_the_segment_that_it_was_opened_on(app, window):
    first, second = window(), window()
    table = SegmentTable(first)
    table.show()
    first.select(1)
    menu = table.menu()
    second.editor.delete(0)
    first.refresh()
    next(entry for entry in menu.actions() if entry.text() == "Delete").trigger()
    assert first.editor.segments == (THREE,)
    table.close()


def test_a_name_and_a_clock_given_elsewhere_are_taken_over(window, path, tmp_path):
    film = tmp_path / "film.mp4"
    film.write_bytes(b"film")
    document = window()
    document.project.media.attach_video(document.id, film)
    document.reread()
    listener = []
    document.demonstration_changed.connect(lambda: listener.append(document.id))
    with Project.open(path) as other:
        other.media.set_video_clock(document.id, ClockMap(1.5))
        other.demonstrations.rename(document.id, "pencil")
    document.view.seek(3)
    document.refresh()
    assert document.demonstration.video.clock.offset == 1.5
    assert document.demonstration.name == "pencil"
    assert listener == [document.id]
    assert document.view.cursor == 3


def test_what_was_removed_elsewhere_is_put_down_and_said(window, path):
    document = window()
    messages = status_messages(document)
    with Project.open(path) as other:
        remove_demonstration(other, document.id)
    document.refresh()
    assert document.demonstration is None
    assert messages == [("'pen' was removed elsewhere.", False)]


def test_blindness_given_elsewhere_hides_labels_and_their_actions(window, path):
    document = window("Ben")
    assert "pull" in document.vocabulary
    with Project.open(path) as other:
        other.actions.set_vocabulary("stylus", Vocabulary().with_actions("grab"))
        other.coding.assign(document.id, "Ben", blind=True)
    document.refresh()
    assert document.other_tracks == {}
    assert document.vocabulary.names == ("grab",)
    document.set_done()
    assert "pull" in document.vocabulary
    document.set_author("Cleo")
    assert set(document.other_tracks) == {"Ada"}
    document.project.coding.set_done(document.id, "Ben", False)
    document.set_author("Ben")
    assert document.vocabulary.names == ("grab",)


def test_blindness_given_elsewhere_unmarks_the_place_that_is_examined(window, path):
    document = window("Ben")
    document.review.examine(Interval(document.id, 1.0, 2.0))  # where Ada's segment begins and ends
    with Project.open(path) as other:
        other.coding.assign(document.id, "Ben", blind=True)
    document.refresh()
    assert (document.review.examined, document.view.range) == (None, None)


def test_what_the_store_refuses_can_be_asked_once_more(window, monkeypatch):
    document = window()
    for action in ("grab", "slip"):  # known, and new
        document.begin_stroke(action, 7)
        with monkeypatch.context() as patched:
            patched.setattr(document.project.tracks, "edit", broken)
            patched.setattr(document.project.actions, "add", broken)
            assert not document.end_stroke(7.5)
            document.view.set_range(1, 2)
            assert not erase_range(document)
            assert document.view.range == (1, 2)
            document.view.set_range(8, 9)
            assert not fill_range(document, action)
        assert document.editor.segments[-1] == THREE
        assert document.end_stroke(7.5)
        assert fill_range(document, action)
        assert (document.stroke, document.view.range) == (None, None)
        document.editor.erase(7, 9)


def test_a_large_undo_with_a_selection_is_quick(window):
    document = window()
    many = tuple(Segment(n / 1000, (n + 0.5) / 1000, "grab") for n in range(5000))
    less = tuple(Segment(s.start, s.end + 1e-4, "grab") for s in many)
    document.project.tracks.edit(document.id, "Ada", document.editor.segments, many, "many")
    document.project.tracks.edit(document.id, "Ada", many, less, "less")
    document.reread()
    document.select(2500)
    began = time.thread_time()  # what other programs take does not count
    assert document.editor.undo_everywhere()
    assert time.thread_time() - began < 1
    assert document.selected == 2500
