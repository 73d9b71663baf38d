"""What the commands of time and segments do to the document."""

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from window_helpers import open_foam_document, stored_rows

from forcelab.gui import document as document_module
from forcelab.gui.label import commands, segment_commands
from forcelab.gui.label.history import HistoryModel
from forcelab.gui.label.playback import Player
from forcelab.gui.label.track_menus import copy_menu
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.obstacles import Obstacles
from forcelab.labels import Segment

TRACK = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"), Segment(5.0, 6.0, "release"))
TIMES = [(s.start, s.end, s.action) for s in TRACK]


@pytest.fixture
def document(app):
    with open_foam_document(TRACK, Ines=(Segment(7.0, 8.0, "hold"),)) as document:
        yield document


@pytest.fixture
def tracks(document):
    panel = TrackPanel(document)
    panel.resize(1096, 100)
    yield panel
    panel.deleteLater()


@pytest.fixture
def do(document, tracks):
    handlers = commands.handlers(document, tracks, Player(document), tracks)
    obstacles = Obstacles(document)

    def carry_out(name):
        if obstacle := obstacles(name):
            document.show_local_message(obstacle, True)
        else:
            handlers[name]()

    return carry_out


def test_walking_along_the_segments(document, do, messages):
    visited = []
    for _ in range(3):
        do("next_segment")
        visited.append((document.selected, document.view.cursor))
    assert visited == [(0, 1.0), (1, 2.0), (2, 5.0)]
    assert messages == []
    do("next_segment")
    assert messages == [("There is no segment after the cursor.", True)]
    document.view.seek(4.0)
    do("previous_segment")
    assert (document.selected, document.view.cursor) == (1, 2.0)
    do("previous_segment")
    do("previous_segment")
    assert document.selected == 0
    assert messages[-1] == ("There is no segment before the cursor.", True)


def test_the_first_segment_is_reached_from_its_own_start(document, do):
    document.editor.paint(0.0, 0.5, "hold")
    do("next_segment")
    assert document.selected == 0


def test_delete_takes_the_selected_segment_or_the_range(document, do, messages):
    do("delete")
    assert messages[-1][1]
    document.select(1)
    do("delete")
    assert stored_rows(document) == [TIMES[0], TIMES[2]]
    document.select(None)
    document.view.set_range(1.5, 5.5)
    do("delete")
    assert stored_rows(document) == [(1.0, 1.5, "grab"), (5.5, 6.0, "release")]


def test_split_merge_and_erase(document, do):
    document.view.seek(1.5)
    do("split")
    assert stored_rows(document)[:2] == [(1.0, 1.5, "grab"), (1.5, 2.0, "grab")]
    document.select(0)
    do("merge")
    assert stored_rows(document) == TIMES
    document.view.set_range(1.5, 5.5)
    do("merge")
    assert stored_rows(document) == [(1.0, 6.0, "grab")]
    do("erase_range")
    assert stored_rows(document) == [(1.0, 1.5, "grab"), (5.5, 6.0, "grab")]


def test_neither_the_last_segment_nor_one_that_the_range_only_touches_is_merged(
    document, do, messages
):
    document.select(2)
    do("merge")
    assert "no segment after" in messages[-1][0]
    document.view.set_range(2.0, 4.0)
    do("merge")
    assert messages[-1][1]
    assert stored_rows(document) == TIMES


def test_gaps_are_filled_in_the_range_or_everywhere(document, messages):
    document.view.set_range(0.0, 2.5)
    assert not segment_commands.fill_gaps(document, 3.0)
    assert messages[-1] == ("There is no gap of at most 3 s to fill.", False)
    document.view.clear_range()
    assert segment_commands.fill_gaps(document, 3.0)
    assert stored_rows(document) == [TIMES[0], (2.0, 4.0, "hold"), (4.0, 6.0, "release")]


@pytest.mark.parametrize(
    ("command", "index", "after", "cursor"),
    [
        ("start_earlier", 2, (4.99, 6.0), 4.99),
        ("start_later", 2, (5.01, 6.0), 5.01),
        ("end_earlier", 2, (5.0, 5.99), 5.99),
        ("end_later", 2, (5.0, 6.01), 6.01),
        ("move_earlier", 2, (4.99, 5.99), 4.99),
        ("move_later", 2, (5.01, 6.01), 5.01),
    ],
)
def test_nudges_by_ten_milliseconds(document, do, command, index, after, cursor):
    document.select(index)
    do(command)
    assert stored_rows(document)[index][:2] == pytest.approx(after)
    assert document.view.cursor == pytest.approx(cursor)
    assert document.selected == index


def test_nudges_are_of_ten_milliseconds_or_one_whatever_the_video(document, do, messages):
    document.view.set_frame_times(np.arange(0, 10, 0.04) + 0.001)
    document.select(2)
    do("start_later")
    assert stored_rows(document)[2][0] == 5.01
    do("fine_nudges")
    assert messages[-1] == ("Edges move by 1 ms.", False)
    do("start_later")
    do("start_later")
    assert stored_rows(document)[2][0] == 5.012
    do("fine_nudges")
    do("start_earlier")
    assert stored_rows(document)[2][0] == 5.002


@pytest.mark.parametrize("name", ["start", "end", "move"])
def test_a_run_of_nudges_is_one_undo_and_one_line_of_history(document, do, monkeypatch, name):
    now = [100.0]
    monkeypatch.setattr(document_module, "monotonic", lambda: now[0])
    model = HistoryModel(document)
    document.select(1)
    for _ in range(30):
        do(f"{name}_later")
        now[0] += 0.9
    for _ in range(10):
        do(f"{name}_earlier")
    model.refresh()
    assert len(model.rows) == 2  # what was there, and the run
    assert document.editor.segments[document.selected].action == "hold"
    after = stored_rows(document)
    if name == "start":
        assert after[:2] == [(1.0, 2.2, "grab"), (2.2, 3.0, "hold")]
    document.editor.undo_everywhere()
    assert stored_rows(document) == TIMES
    document.editor.redo_everywhere()
    assert stored_rows(document) == after
    model.refresh()
    assert len(model.rows) == 2


def test_a_run_of_nudges_ends_with_a_pause_another_kind_or_another_edit(document, do, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(document_module, "monotonic", lambda: now[0])
    model = HistoryModel(document)

    def rows():
        model.refresh()
        return len(model.rows) - 1

    document.select(2)
    do("end_later")
    do("end_later")
    assert rows() == 1
    do("start_earlier")
    assert rows() == 2
    now[0] += 1.5
    do("start_earlier")
    assert rows() == 3
    document.project.tracks.edit(
        document.id, document.author, document.editor.segments, TRACK, "elsewhere"
    )
    document.reread()
    document.select(2)
    do("start_earlier")
    assert rows() == 5
    document.editor.undo_everywhere()
    assert stored_rows(document) == TIMES
    do("start_earlier")
    do("start_later")  # back where the run began
    assert stored_rows(document) == TIMES
    document.editor.undo_everywhere()
    assert document.editor.segments != TRACK


def test_a_run_of_nudges_gives_back_what_it_passed_over(document, do):
    document.select(2)
    for _ in range(250):
        do("move_earlier")
    assert stored_rows(document)[-1] == (2.5, 3.5, "release")
    for _ in range(250):
        do("move_later")
    assert stored_rows(document) == TIMES


def test_a_nudge_over_a_neighbour_keeps_the_segment(document, do):
    document.editor.paint(4.99, 5.0, "grab")
    document.select(3)
    do("start_earlier")
    assert document.editor.segments[document.selected].action == "release"


def test_nudges_stop_at_the_ends(document, do):
    document.editor.paint(9.99, 10.0, "grab")
    document.select(3)
    do("end_later")
    do("move_later")
    assert stored_rows(document)[3] == (9.99, 10.0, "grab")


def test_edges_to_the_cursor(document, do, messages):
    document.view.seek(4.0)
    do("end_to_cursor")
    assert stored_rows(document)[1] == (2.0, 4.0, "hold")
    document.view.seek(4.5)
    do("start_to_cursor")
    assert stored_rows(document)[2] == (4.5, 6.0, "release")
    document.view.seek(1.5)
    do("start_to_cursor")
    assert stored_rows(document)[0] == (1.5, 2.0, "grab")
    document.view.seek(0.5)
    do("end_to_cursor")
    assert messages[-1] == ("There is no segment before the cursor.", True)
    document.view.seek(9.0)
    do("start_to_cursor")
    assert messages[-1] == ("There is no segment after the cursor.", True)


def test_zooming_to_the_selection(document, do, messages):
    do("zoom_selection")
    assert messages[-1][1]
    document.select(2)
    do("zoom_selection")
    assert (document.view.start, document.view.end) == pytest.approx((4.75, 6.25))
    document.view.set_range(0.0, 2.0)
    do("zoom_selection")
    assert (document.view.start, document.view.end) == pytest.approx((0.0, 2.5))


def test_copying_from_the_only_other_author(document, do, messages):
    do("copy_from")
    assert messages[-1] == ("Ines has no segment at the cursor; mark a range to copy.", True)
    document.view.seek(7.5)
    do("copy_from")
    assert stored_rows(document) == [*TIMES, (7.0, 8.0, "hold")]
    do("copy_from")
    assert messages[-1] == ("Your labels are the same as Ines's there; nothing copied.", False)


def test_an_empty_track_is_begun_with_all_that_another_author_has(document, do):
    document.editor.erase(*document.view.bounds)
    before = document.view.cursor
    do("copy_from")
    theirs = [(s.start, s.end, s.action) for s in document.other_tracks["Ines"]]
    assert stored_rows(document) == theirs
    assert document.view.cursor == before
    document.editor.undo_everywhere()
    menu = copy_menu(None, document, 0.0)  # where nobody has a segment
    menu.actions()[0].trigger()
    assert stored_rows(document) == theirs


def test_of_several_authors_enter_copies_from_the_same_one_as_last(app):
    ben, ines = Segment(1.0, 2.0, "grab"), Segment(7.0, 8.0, "hold")
    with open_foam_document((), Ben=(ben,), Ines=(ines,)) as document:
        tracks = TrackPanel(document)
        tracks.resize(1096, 100)
        tracks.show()
        copy = commands.handlers(document, tracks, Player(document), tracks)["copy_from"]

        def copied(*keys):
            document.editor.erase(*document.view.bounds)
            copy()
            for key in keys:
                QTest.keyClick(tracks.menu, key)
            return document.editor.segments

        assert copied(Qt.Key.Key_Return) == (ben,)
        assert copied(Qt.Key.Key_Down, Qt.Key.Key_Return) == (ines,)
        assert copied(Qt.Key.Key_Return) == (ines,)
        document.view.seek(4.0)  # where nobody has a segment: a menu would offer nothing
        sentence = "No other track has a segment at the cursor; mark a range to copy."
        assert Obstacles(document)("copy_from") == sentence
        tracks.close()


def test_esc_takes_back_one_thing_after_the_other(document, do):
    document.select(0)
    document.view.set_range(3.0, 4.0)
    document.begin_stroke("grab", 0.0)
    document.set_action("hold")
    do("cancel")
    assert (document.stroke, document.view.range is None, document.selected) == (None, False, 0)
    do("cancel")
    assert (document.view.range, document.selected) == (None, 0)
    do("cancel")
    assert (document.selected, document.action) == (None, "hold")
    do("cancel")
    assert document.action is None


def test_moving_in_time(document, do):
    document.view.seek(5.0)
    do("step_forward")
    assert document.view.cursor == pytest.approx(5.01)
    do("step_back")
    do("leap_forward")
    assert document.view.cursor == pytest.approx(5.2)
    do("leap_back")
    assert document.view.cursor == pytest.approx(5.0)
    do("to_end")
    assert document.view.cursor == 10.0
    do("to_start")
    assert document.view.cursor == 0.0
    document.view.set_span(0.0, 1.0)
    do("pan_right")
    assert document.view.start == pytest.approx(0.2)
    document.view.set_frame_times(np.arange(0, 10, 0.04))
    do("leap_forward")
    assert document.view.cursor == pytest.approx(0.4)
