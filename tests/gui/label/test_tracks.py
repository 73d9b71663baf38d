"""Painting with the mouse: real events on the real panel, and what the store holds afterwards."""

import gc
import weakref
from contextlib import contextmanager

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QContextMenuEvent, QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QInputDialog
from window_helpers import PanelMouse, open_foam_document, stored_rows

from forcelab.gui.figures import text
from forcelab.gui.key_events import is_reserved_key
from forcelab.gui.label import track_menus, tracks
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.view_state import Snap
from forcelab.labels import Segment
from forcelab.vocabulary import Vocabulary

ALT = Qt.KeyboardModifier.AltModifier
CTRL = Qt.KeyboardModifier.ControlModifier
TRACK = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"), Segment(5.0, 6.0, "release"))
TIMES = [(s.start, s.end, s.action) for s in TRACK]
#: Ines' rows lie below Ann's, at this height in pixels.
OTHER_ROW = 80


@pytest.fixture
def document(app):
    with open_foam_document(TRACK, Ines=(Segment(7.03, 8.0, "hold"),)) as document:
        yield document


@contextmanager
def open_panel(document):
    panel = TrackPanel(document)
    panel.resize(88 + 1000 + 8, 100)
    panel.show()
    yield panel
    if panel.menu is not None:
        panel.menu.close()
    panel.close()


@pytest.fixture
def panel(document):
    with open_panel(document) as panel:
        yield panel


@pytest.fixture
def hand(panel):
    return PanelMouse(panel)


def entries(menu):
    return {action.text(): action for action in menu.actions()}


@pytest.mark.parametrize(("start", "end"), [(3.5, 4.25), (4.25, 3.5)], ids=["on", "backwards"])
def test_a_drag_with_a_brush_paints(document, hand, start, end):
    document.set_action("hold")
    hand.drag(start, end)
    assert (3.5, 4.25, "hold") in stored_rows(document)
    assert len(document.editor.history()) == 2


@pytest.mark.parametrize("pixels", [1, 3, 8, 12, 15])
def test_a_brush_put_down_beside_a_segment_paints_right_up_to_it(document, hand, panel, pixels):
    document.set_action("grab")
    beside = pixels * panel.seconds_per_pixel
    hand.drag(3.0 + beside, 4.0)
    hand.drag(5.0 - beside, 4.5)
    assert stored_rows(document) == [*TIMES[:2], (3.0, 4.0, "grab"), (4.5, 5.0, "grab"), TIMES[2]]
    hand.move(6.0 + beside, pressed=False)
    assert document.view.hint == Snap(6.0, "edge")
    assert panel.cursor().shape() == Qt.CursorShape.CrossCursor


def test_an_edge_is_dragged_with_a_brush_from_within_its_segment(document, hand, panel):
    document.set_action("grab")
    hand.drag(6.0 - 2 * panel.seconds_per_pixel, 6.5)
    assert (5.0, pytest.approx(6.52), "release") in stored_rows(document)


def test_a_gap_beside_a_segment_can_still_be_left(document, hand, panel):
    document.set_action("grab")
    hand.drag(3.2, 4.0)
    document.view.set_snapping(False)
    hand.drag(6.0 + 4 * panel.seconds_per_pixel, 7.0)
    assert (3.2, 4.0, "grab") in stored_rows(document)
    assert stored_rows(document)[-1][0] > 6.0 + 2 * panel.seconds_per_pixel


def test_a_drag_over_a_segment_paints_over_it(document, hand):
    document.set_action("grab")
    hand.drag(2.5, 5.5)
    assert stored_rows(document) == [
        (1.0, 2.0, "grab"),
        (2.0, 2.5, "hold"),
        (2.5, 5.5, "grab"),
        (5.5, 6.0, "release"),
    ]


def test_while_an_edge_is_dragged_that_time_is_looked_at_and_the_cursor_stays(document, hand):
    document.view.seek(8.0)
    hand.press(5.99)
    hand.move(6.39)
    assert (document.view.displayed_time, document.view.cursor) == (pytest.approx(6.4), 8.0)
    hand.release(6.39)
    assert document.view.displayed_time == 8.0
    hand.press(6.39)
    hand.move(6.8)
    hand.panel.cancel_drag()
    assert document.view.displayed_time == 8.0
    hand.release(6.8)


@pytest.mark.parametrize(("start", "end"), [(3.5, 4.9), (4.8, 3.5), (0.2, 0.9), (9.8, 9.2)])
def test_the_words_of_a_drag_cover_neither_pointer_nor_segment(
    document, hand, panel, monkeypatch, start, end
):
    plates = []
    monkeypatch.setattr(
        tracks, "draw_plate", lambda _, at, words, *__, **___: plates.append((at, words))
    )
    document.set_action("hold")
    hand.press(start)
    hand.move(end)
    panel.grab()
    at, words = plates[-1]
    half = (text.width(words, text.font(10)) + 12) / 2
    low, high = sorted((panel.x_at(start), panel.x_at(end)))
    assert f"{abs(end - start):.3f} s" in words
    assert at.x() + half < low or at.x() - half > high
    assert not -2 <= panel.x_at(end) - (at.x() - half) <= 2 * half
    assert panel.plot.left() <= at.x() - half
    assert at.x() + half <= panel.plot.right()
    hand.release(end)


def test_esc_ends_a_drag_as_if_nothing_had_happened(document, hand, panel):
    document.set_action("hold")
    hand.press(3.5)
    hand.move(4.2)
    panel.grab()
    assert stored_rows(document) == TIMES, "while it is dragged nothing is stored"
    QTest.keyClick(panel, Qt.Key.Key_Escape)
    hand.move(4.4)
    hand.release(4.4)
    assert stored_rows(document) == TIMES
    assert not panel.dragging


def test_esc_is_kept_for_the_drag_whatever_else_it_is_bound_to(hand, panel):
    def is_escape_reserved():
        none = Qt.KeyboardModifier.NoModifier
        event = QKeyEvent(QEvent.Type.ShortcutOverride, Qt.Key.Key_Escape, none)
        return is_reserved_key(panel, event)

    assert not is_escape_reserved()
    hand.press(3.5)
    assert is_escape_reserved()


def test_a_drag_jumps_to_an_edge_nearby_and_says_so(document, hand):
    document.set_action("hold")
    hand.press(3.5)
    hand.move(4.94)
    assert document.view.hint == Snap(5.0, "edge")
    hand.release(4.94)
    assert (3.5, 5.0, "hold") in stored_rows(document)


def test_a_drag_jumps_to_a_contact_event_before_a_frame(document, hand):
    document.view.contacts = np.array([4.213])
    document.view.set_frame_times(np.arange(0, 10, 1 / 30))
    document.set_action("hold")
    hand.drag(3.5, 4.25)
    assert (3.5, 4.213, "hold") in stored_rows(document)


@pytest.mark.parametrize(("start", "end"), [(3.12, 4.0), (4.0, 3.07), (4.0, 4.88)])
def test_no_gap_too_narrow_to_be_seen_is_left_to_a_contact_event(document, hand, start, end):
    document.view.contacts = np.array([3.06, 4.94])
    document.set_action("release")
    hand.drag(start, end)
    low, high = (3.0, 4.0) if end != 4.88 else (4.0, 6.0)  # it joins the release that follows
    assert (low, high, "release") in stored_rows(document)


def test_a_segment_narrower_than_the_reach_ends_at_its_contact_event(document, hand):
    document.view.contacts = np.array([3.06])
    document.set_action("release")
    hand.drag(3.01, 3.07)
    assert (3.0, 3.06, "release") in stored_rows(document)


def test_alt_bypasses_snapping(document, hand):
    document.set_action("hold")
    hand.press(3.5, ALT)
    hand.move(4.94, ALT)
    assert document.view.hint is None
    hand.release(4.94, ALT)
    assert (3.5, 4.94, "hold") in stored_rows(document)


def test_snapping_can_be_switched_off(document, hand):
    document.view.set_snapping(False)
    document.set_action("hold")
    hand.drag(3.5, 4.94)
    assert (3.5, 4.94, "hold") in stored_rows(document)


def test_times_that_snap_to_nothing_are_those_of_samples(document, hand):
    document.view.set_span(3.2, 4.2)  # a pixel is 1 ms, a sample 10 pixels
    document.set_action("hold")
    hand.drag(3.5041, 3.8072)
    assert (3.5, 3.81, "hold") in stored_rows(document)


def test_painting_stops_at_the_ends_of_the_demonstration(document, hand):
    document.set_action("hold")
    hand.press(9.0)
    hand.move(10.07)
    hand.release(10.07)
    assert (9.0, 10.0, "hold") in stored_rows(document)


def test_without_a_brush_a_drag_marks_a_range_and_asks_what_with(document, hand, panel):
    hand.drag(3.5, 4.25)
    assert document.view.range == pytest.approx((3.5, 4.25))
    assert stored_rows(document) == TIMES
    entries(panel.menu)["&3  release"].trigger()
    assert (3.5, 4.25, "release") in stored_rows(document)
    assert document.view.range is None


@pytest.mark.parametrize("pixels", [0, 3, 6, 9, 12, 15])
def test_a_range_marked_beside_a_segment_begins_at_its_edge(document, hand, panel, pixels):
    beside = pixels * panel.seconds_per_pixel
    hand.move(3.0 + beside, pressed=False)
    assert document.view.hint == Snap(3.0, "edge")
    assert panel.cursor().shape() == Qt.CursorShape.CrossCursor
    hand.drag(3.0 + beside, 4.0)
    entries(panel.menu)["&3  release"].trigger()
    hand.drag(5.0 - max(beside, panel.seconds_per_pixel), 4.5)
    entries(panel.menu)["&1  grab"].trigger()
    assert stored_rows(document) == [
        *TIMES[:2],
        (3.0, 4.0, "release"),
        (4.5, 5.0, "grab"),
        TIMES[2],
    ]


def test_what_to_do_with_a_marked_range_is_said_and_an_action_can_be_new(
    document, hand, panel, messages
):
    hand.drag(3.5, 4.25)
    sentence = "Choose an action for the marked range, or press its key; Esc shuts the list."
    assert messages == [(sentence, False)]
    assert "Erase the range" not in entries(panel.menu), "there is nothing in it"
    entries(panel.menu)["Another action…"].trigger()
    dialog = panel.findChild(QInputDialog)
    dialog.setTextValue(" lift  up ")
    dialog.accept()
    assert (3.5, 4.25, "lift up") in stored_rows(document)
    assert "lift up" in document.vocabulary.names


def test_the_first_drag_of_all_paints_though_there_is_no_action_yet(app):
    with open_foam_document(()) as document:
        path, name = document.project.path, document.id
        document.project.actions.set_vocabulary(document.demonstration.task, Vocabulary())
        document.open_project(path)
        assert document.open_demonstration(name)
        assert not document.vocabulary.names
        with open_panel(document) as panel:
            PanelMouse(panel).drag(3.5, 4.25)
            entries(panel.menu)["grab"].trigger()
            assert stored_rows(document) == [(3.5, 4.25, "grab")]
            PanelMouse(panel).drag(5.0, 5.5)
            more = entries(entries(panel.menu)["More actions"].menu())
            assert "grab" not in more
            more["hold"].trigger()
            assert stored_rows(document) == [(3.5, 4.25, "grab"), (5.0, 5.5, "hold")]


def test_esc_while_marking_brings_the_former_range_back(document, hand, panel):
    document.view.set_range(8.0, 9.0)
    hand.press(3.5)
    hand.move(4.2)
    assert document.view.range == pytest.approx((3.5, 4.2))
    QTest.keyClick(panel, Qt.Key.Key_Escape)
    assert document.view.range == (8.0, 9.0)


def test_a_shared_edge_moves_for_both(document, hand):
    hand.drag(2.02, 2.42)
    assert stored_rows(document)[:2] == [(1.0, 2.4, "grab"), (2.4, 3.0, "hold")]


@pytest.mark.parametrize(
    ("start", "end", "times"),
    [(5.04, 4.64, (4.6, 6.0)), (5.97, 4.2, (5.0, 5.01))],
    ids=["it does not jump under the pointer", "it cannot pass the other one"],
)
def test_an_edge_is_grabbed_beside_it(document, hand, start, end, times):
    hand.drag(start, end)
    assert stored_rows(document)[2] == (*times, "release")


def test_an_edge_jumps_to_another_edge_but_not_back_to_its_own(document, hand):
    hand.drag(5.0, 3.05)
    assert stored_rows(document)[2] == (3.0, 6.0, "release")
    hand.drag(5.99, 6.05)
    assert stored_rows(document)[2] == (3.0, 6.06, "release")


def test_an_edge_stays_selected_with_its_segment(document, hand):
    document.select(2)
    hand.drag(5.0, 0.5)  # over both others
    assert stored_rows(document) == [(0.5, 6.0, "release")]
    assert document.selected == 0


def test_alt_moves_a_segment_and_its_end_snaps_too(document, hand):
    hand.drag(5.5, 3.52, ALT)
    # Its start would come to lie at 3.02 s: the edge at 3 s is near.
    assert stored_rows(document)[2] == (3.0, 4.0, "release")
    hand.drag(3.5, 6.55, ALT)
    # Its end would come to lie at 7.05 s, near Ines' edge at 7.03 s.
    assert stored_rows(document)[2] == (6.03, 7.03, "release")


def test_shift_moves_a_segment_and_ctrl_paints_freely(document, hand):
    shift = Qt.KeyboardModifier.ShiftModifier
    hand.drag(5.5, 3.52, shift)
    assert stored_rows(document)[2] == (3.0, 4.0, "release")
    hand.drag(3.5, 5.52, shift | CTRL)
    assert stored_rows(document)[2] == (5.02, 6.02, "release")
    document.set_action("hold")
    hand.drag(4.0, 4.96, CTRL)
    assert (4.0, 4.96, "hold") in stored_rows(document)


def test_ctrl_lets_nothing_attract_while_a_segment_is_moved(document, hand):
    hand.drag(5.5, 3.52, ALT | CTRL)
    assert stored_rows(document)[2] == (3.02, 4.02, "release")


def test_a_click_selects_and_seeks(document, hand):
    hand.click(2.5)
    assert document.selected == 1
    assert document.view.cursor == pytest.approx(2.5)
    hand.click(4.0)
    assert document.selected is None
    assert document.view.cursor == pytest.approx(4.0)
    assert stored_rows(document) == TIMES


def test_less_than_five_pixels_on_an_edge_are_a_click(document, hand):
    hand.press(2.02)
    hand.move(2.05)
    hand.release(2.05)
    assert stored_rows(document) == TIMES
    assert document.selected == 1


def test_a_double_click_zooms_to_the_segment(document, hand, panel):
    QTest.mouseDClick(
        panel.viewport(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, hand.at(5.5)
    )
    assert (document.view.start, document.view.end) == pytest.approx((4.75, 6.25))
    assert stored_rows(document) == TIMES


def test_on_anothers_track_one_only_seeks(document, panel):
    document.set_action("hold")
    hand = PanelMouse(panel, OTHER_ROW)
    assert not panel.rows()[1].own
    assert panel.rows()[1].box.contains(hand.at(7.5))
    hand.click(7.5)
    assert document.view.cursor == pytest.approx(7.5)
    assert document.selected is None
    assert stored_rows(document) == TIMES


def test_a_change_from_elsewhere_ends_a_drag(document, hand, panel):
    hand.press(2.0)
    hand.move(2.4)
    document.editor.delete(0)
    hand.release(2.4)
    assert not panel.dragging
    assert stored_rows(document) == TIMES[1:]


def test_the_pointer_tells_what_a_press_would_do(document, hand, panel):
    hand.move(5.02, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.SplitHCursor
    hand.move(5.5, ALT, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.SizeAllCursor
    hand.move(5.5, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.ArrowCursor
    document.set_action("grab")
    hand.move(4.0, pressed=False)
    assert panel.cursor().shape() == Qt.CursorShape.CrossCursor


def test_the_snap_target_is_offered_before_it_is_taken(document, hand):
    hand.move(7.08, pressed=False)
    assert document.view.hint == Snap(7.03, "edge")
    hand.move(7.08, ALT, pressed=False)
    assert document.view.hint is None


def menu_of(panel, time, y=20):
    """The entries of the menu that a right click opens, those of its menus included."""
    place = PanelMouse(panel, y).at(time)
    reason = QContextMenuEvent.Reason.Mouse
    event = QContextMenuEvent(reason, place, panel.mapToGlobal(place))
    QApplication.sendEvent(panel.viewport(), event)
    found = entries(panel.menu)
    for title, action in entries(panel.menu).items():
        if action.menu() is not None:
            found |= {f"{title}/{below}": sub for below, sub in entries(action.menu()).items()}
    return found


@pytest.mark.parametrize(
    ("time", "entry", "after"),
    [
        (1.5, "Relabel with/&3  release", [(1.0, 2.0, "release"), *TIMES[1:]]),
        (1.5, "Split here", [(1.0, 1.5, "grab"), (1.5, 2.0, "grab"), *TIMES[1:]]),
        (1.5, "Merge with the next", [(1.0, 3.0, "grab"), TIMES[2]]),
        (5.5, "Merge with the previous", [TIMES[0], (2.0, 6.0, "hold")]),
        (1.5, "Delete", TIMES[1:]),
        (4.0, "Fill this gap with/&1  grab", [*TIMES[:2], (3.0, 5.0, "grab"), TIMES[2]]),
        (7.5, "Copy from Ines", [*TIMES, (7.03, 8.0, "hold")]),
        (1.5, "Copy from Ines", TIMES[1:]),
    ],
)
def test_the_menu_of_the_own_track(document, panel, time, entry, after):
    menu_of(panel, time)[entry].trigger()
    assert stored_rows(document) == after


def test_the_menu_fills_and_erases_the_range(document, panel):
    document.view.set_range(1.5, 5.5)
    menu_of(panel, 4.0)["Fill the range with/&2  hold"].trigger()
    assert stored_rows(document) == [(1.0, 1.5, "grab"), (1.5, 5.5, "hold"), (5.5, 6.0, "release")]
    document.view.set_range(2.0, 3.0)
    menu_of(panel, 4.0)["Erase the range"].trigger()
    assert (2.0, 3.0) not in [(s.start, s.end) for s in document.editor.segments]
    assert document.view.range is None


def test_a_menu_of_actions_without_any_says_so(document, panel, hovered):
    document.set_vocabulary(Vocabulary())
    document.vocabulary = Vocabulary()
    document.view.set_range(3.5, 4.5)
    offered = menu_of(panel, 4.0)
    for entry in ("Fill this gap with", "Fill the range with"):
        assert not offered[entry].isEnabled()
        spot = panel.menu.actionGeometry(offered[entry]).center()
        assert hovered(panel.menu, spot) == "The task has no actions."


def test_the_menu_of_anothers_track_copies(document, panel):
    menu_of(panel, 7.5, OTHER_ROW)["Copy this segment to mine"].trigger()
    assert stored_rows(document) == [*TIMES, (7.03, 8.0, "hold")]


def test_the_menu_asks_for_a_segment_to_be_played(panel):
    requests = []
    panel.play_requested.connect(lambda start, end: requests.append((start, end)))
    menu_of(panel, 1.5)["Play it"].trigger()
    assert requests == [(1.0, 2.0)]


def test_the_longest_gap_is_asked_for_and_filled(document, panel):
    menu_of(panel, 4.0)["Fill short gaps…"].trigger()
    dialog = panel.findChild(QInputDialog)
    dialog.setDoubleValue(2.5)
    dialog.accept()
    assert stored_rows(document) == [TIMES[0], (2.0, 4.0, "hold"), (4.0, 6.0, "release")]


def test_the_menu_key_opens_the_menu_of_the_cursor(document, panel):
    document.view.seek(1.5)
    where = QPoint(0, 0)
    event = QContextMenuEvent(QContextMenuEvent.Reason.Keyboard, where, where)
    QApplication.sendEvent(panel.viewport(), event)
    entries(panel.menu)["Split here"].trigger()
    assert (1.0, 1.5, "grab") in stored_rows(document)


def test_an_action_picked_by_its_key_in_the_menu(document, hand, panel):
    hand.drag(3.5, 4.25)
    QTest.keyClick(panel.menu, Qt.Key.Key_2)
    assert (3.5, 4.25, "hold") in stored_rows(document)


def test_a_menu_does_not_keep_its_panel(document):
    document.view.set_range(3.2, 3.7)
    for menu_of in (
        lambda panel: panel.menu_at(panel.rows()[0], 1.5),
        lambda panel: track_menus.range_menu(panel, document),
    ):
        panel = TrackPanel(document)
        panel.menu, gone = menu_of(panel), weakref.ref(panel)
        del panel
        gc.collect()
        assert gone() is None


def test_what_is_dragged_out_of_view_is_still_told_in_its_row(document, hand, panel, monkeypatch):
    plates = []
    monkeypatch.setattr(tracks, "draw_plate", lambda _, at, *__, **___: plates.append(at.y()))
    document.view.set_span(4.0, 8.0)
    hand.press(5.5, ALT)
    hand.move(2.0, ALT)
    panel.grab()
    assert plates[-1] == panel.rows()[0].box.center().y()


def test_an_action_of_a_very_long_name_fits_into_the_menu(document, hand, panel):
    document.add_actions("very long " * 30 + "name")
    hand.drag(3.5, 4.25)
    menu = panel.menu
    widest = max(menu.actionGeometry(entry).width() for entry in menu.actions())
    assert widest <= menu.screen().size().width()


def test_another_coder_is_not_painted_for_by_a_drag(document, hand, panel):
    document.editor.erase(0.0, 10.0)
    document.set_action("hold")
    hand.press(3.5)
    hand.move(4.0)
    document.set_author("Eva")  # whose track is as empty
    hand.release(4.2)
    assert document.editor.segments == ()
    assert not panel.dragging


def test_a_key_relabels_a_tiny_segment_that_was_clicked(document, hand):
    document.editor.paint(8.0012, 8.0041, "grab")
    hand.click(8.0)
    assert (
        document.editor.segments[3].start <= document.view.cursor <= document.editor.segments[3].end
    )
    assert document.selected == 3


def test_a_change_of_another_author_does_not_end_a_drag(document, hand):
    document.set_action("hold")
    hand.press(3.5)
    hand.move(4.0)
    document.set_hidden_authors(frozenset({"Ines"}))
    hand.move(4.2)
    hand.release(4.2)
    assert (3.5, 4.2, "hold") in stored_rows(document)


def test_words_under_the_pointer_and_for_screen_readers(document, panel):
    def words(time, y):
        return panel.tooltip_at(QPointF(PanelMouse(panel, y).at(time)))

    assert words(1.5, 20) == "Ann: grab 1.000–2.000 s (1.000 s)"
    assert words(7.5, OTHER_ROW) == "Ines: hold 7.030–8.000 s (0.970 s)"
    assert words(4.0, 20) == ""
    assert panel.tooltip_at(QPointF(20, OTHER_ROW)) == "Ines"
    document.select(1)
    assert panel.accessibleDescription() == "hold 2.000–3.000 s (1.000 s)"
    document.select(None)
    assert panel.accessibleDescription() == ""


def test_the_pointer_tells_who_proposed_a_segment(document, panel):
    document.editor.accept((Segment(4.0, 5.0, "hold"),), "model paper 12")
    at = QPointF(PanelMouse(panel, 20).at(4.5))
    assert panel.tooltip_at(at) == ("Ann: hold 4.000–5.000 s (1.000 s)\nproposed by model paper 12")
    document.editor.move_edge(document.editor.index_of(Segment(4.0, 5.0, "hold")), "start", 4.2)
    assert panel.tooltip_at(at).endswith("proposed by model paper 12, changed since")
    document.editor.relabel(document.editor.index_of(Segment(4.2, 5.0, "hold")), "release")
    assert "proposed" not in panel.tooltip_at(at)


def test_an_empty_track_says_how_to_begin_until_the_first_stroke(app):
    with open_foam_document() as document:
        panel = TrackPanel(document)
        panel.resize(88 + 1000 + 8, 100)
        panel.show()
        row = panel.rows()[0].box.adjusted(250, 4, -250, -4).toRect()

        def inks():
            app.processEvents()
            picture = panel.grab(row).toImage()
            across, down = range(picture.width()), range(picture.height())
            return len({picture.pixel(x, y) for x in across for y in down})

        empty = inks()
        document.begin_stroke("hold", document.view.bounds[0])
        painted = inks()
        document.cancel_stroke()
        again = inks()
        hand = PanelMouse(panel)
        document.set_action("hold")
        hand.press(0.1)
        hand.move(0.5)
        dragged = inks()
        hand.release(0.5)
        assert empty == again > 3
        assert painted < empty
        assert dragged < empty
        panel.close()


def test_what_was_begun_by_a_key_is_said_in_the_row_until_it_is_ended(app, monkeypatch):
    long = "search for the stud with the left corner"
    with open_foam_document() as document:
        panel = TrackPanel(document)
        panel.resize(88 + 300 + 8, 100)
        panel.show()
        document.add_actions(long)
        written = []
        paint = tracks.draw_plate
        monkeypatch.setattr(
            tracks,
            "draw_plate",
            lambda *rest, **how: (written.append(rest[2]), paint(*rest, **how)),
        )

        def said():
            written.clear()
            panel.grab()
            return written

        assert said() == []
        document.begin_stroke("hold", 0.834)
        assert said() == ["hold from 0.83 s: press 2 again to end"]
        document.begin_stroke(long, 0.834)
        [sentence] = said()
        assert sentence.startswith("search")
        assert sentence.endswith(" from 0.83 s: press 4 again to end")
        assert text.width(sentence, text.font(10)) < 300
        document.cancel_stroke()
        document.view.seek(0.5)
        document.view.mark_in()
        assert said() == ["range from 0.50 s: press ] to end"]
        document.view.seek(0.7)
        document.view.mark_out()
        assert said() == []
        panel.close()
