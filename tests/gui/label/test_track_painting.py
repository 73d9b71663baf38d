"""What is seen on the tracks: pixels and names."""

from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor, QImage, QPainter
from window_helpers import PanelMouse, open_foam_document

from forcelab.gui.figures.axes import Axis
from forcelab.gui.label.swatches import style_of
from forcelab.gui.label.track_painting import abbreviations, narrow_columns, paint_row, short_name
from forcelab.gui.label.tracks import TrackPanel
from forcelab.gui.theme import colours
from forcelab.labels import Segment

TRACK = (Segment(1.0, 2.0, "grab"), Segment(2.0, 3.0, "hold"), Segment(5.0, 6.0, "release"))


@pytest.fixture
def document(app):
    with open_foam_document(TRACK, Ines=(Segment(7.0, 8.0, "lift"),)) as document:
        yield document


@pytest.fixture
def panel(document):
    panel = TrackPanel(document)
    panel.resize(1096, 100)
    panel.show()
    yield panel
    panel.close()


def colour_at(panel, time, y=14):
    """The colour on screen at a time; near the top of the row, where no name is."""
    return panel.grab().toImage().pixelColor(PanelMouse(panel, y).at(time))


def test_segments_have_their_actions_colours_and_the_rest_is_unlabelled(document, panel):
    for time, action in ((1.5, "grab"), (2.5, "hold"), (5.5, "release")):
        assert colour_at(panel, time) == QColor(document.vocabulary[action].colour)
    assert colour_at(panel, 4.0) == QColor(colours().unlabelled)


def test_an_action_that_is_not_in_the_vocabulary_is_grey(document):
    grab = QColor(document.vocabulary["grab"].colour)
    assert style_of(document.vocabulary, "grab").colour == grab
    assert style_of(document.vocabulary, "unheard of").colour == QColor(colours().frame)


def test_the_others_tracks_are_seen_too(document, panel):
    (other,) = panel.rows()[1:]
    lifted = QColor(document.vocabulary["lift"].colour)
    assert colour_at(panel, 7.2, round(other.box.top()) + 3) == lifted


def test_a_row_that_did_not_fit_is_whole_when_there_is_room(document, panel):
    panel.resize(1096, panel.minimumSizeHint().height() - 12)
    (other,) = panel.rows()[1:]
    panel.grab()
    panel.resize(1096, panel.minimumSizeHint().height())
    lifted = QColor(document.vocabulary["lift"].colour)
    assert panel.rows()[1].box == other.box
    assert colour_at(panel, 7.2, round(other.box.bottom()) - 3) == lifted


def test_what_is_dragged_is_seen_at_its_new_place(document, panel):
    document.set_action("hold")
    hand = PanelMouse(panel)
    hand.press(3.5)
    hand.move(4.5)
    assert colour_at(panel, 4.3) == QColor(document.vocabulary["hold"].colour)
    panel.cancel_drag()
    assert colour_at(panel, 4.3) == QColor(colours().unlabelled)
    hand.press(2.0)
    hand.move(2.6)
    assert colour_at(panel, 2.4) == QColor(document.vocabulary["grab"].colour)


def test_a_stroke_grows_with_the_cursor(document, panel):
    document.begin_stroke("release", 7.0)
    document.view.seek(8.0)
    assert colour_at(panel, 7.5) == QColor(document.vocabulary["release"].colour)
    assert colour_at(panel, 8.5) == QColor(colours().unlabelled)


def test_the_selected_segment_is_framed(document, panel):
    before = colour_at(panel, 5.5, 5)
    document.select(2)
    assert colour_at(panel, 5.5, 5) == QColor(colours().accent)
    document.select(None)
    assert colour_at(panel, 5.5, 5) == before


def test_every_author_has_a_row_and_the_coder_the_highest(document, panel):
    rows = panel.rows()
    assert [row.author for row in rows] == ["Ann", "Ines"]
    assert rows[0].box.height() > rows[1].box.height()
    document.set_hidden_authors(frozenset({"Ines"}))
    assert [row.author for row in panel.rows()] == ["Ann"]


def test_room_grows_with_the_authors(document, panel):
    low = panel.minimumSizeHint().height()
    document.set_hidden_authors(frozenset({"Ines"}))
    assert panel.minimumSizeHint().height() < low


def test_slim_rows_all_lie_in_the_panel_and_are_full_again_where_there_is_room(document, panel):
    document.other_tracks = {f"coder {i}": TRACK for i in range(5)}
    full = panel.least_height(compact=False)
    panel.set_compact(True)
    compact = panel.least_height(compact=True)
    assert panel.minimumSizeHint().height() == compact < 0.6 * full
    for height in (compact, full - 10, full + 40):
        panel.resize(600, height)
        rows = panel.rows()
        assert rows[-1].box.bottom() <= height
        assert all(a.box.bottom() < b.box.top() for a, b in pairwise(rows))
        assert all(row.box.height() >= 5 for row in rows)
        panel.grab()
    high = rows[-1].box.height()
    panel.set_compact(False)
    assert panel.rows()[-1].box.height() == high


@pytest.mark.parametrize(("height", "written"), [(7.0, False), (12.0, True)])
def test_a_name_is_written_only_where_its_letters_are_not_cut(document, height, written):
    image = QImage(200, 20, QImage.Format.Format_RGB32)
    painter, box = QPainter(image), QRectF(0, 0, 200, height)
    style = {"vocabulary": document.vocabulary, "theme": colours(), "size": 10.0}
    paint_row(painter, box, Axis(1.0, 2.0, 0.0, 200.0), TRACK, **style)
    painter.end()
    inks = {image.pixel(x, y) for x in range(4, 196) for y in range(2, int(height) - 2)}
    assert (len(inks) > 1) == written


def test_the_rarest_of_a_crowd_is_seen():
    track = [Segment(i / 1000, (i + 1) / 1000, "a") for i in range(1000)]
    track[555] = replace(track[555], action="b")
    wide, columns, names = narrow_columns(tuple(track), 0.0, 0.01, 100, 0.03)
    assert wide == ()
    assert [names[code] for code in columns] == ["a"] * 55 + ["b"] + ["a"] * 44


def test_one_short_segment_is_seen_on_screen(document, panel):
    document.editor.paint(4.0001, 4.0002, "hold")
    assert colour_at(panel, 4.0) == QColor(document.vocabulary["hold"].colour)


@given(
    st.lists(st.floats(1e-4, 1.0), max_size=80).map(np.cumsum),
    st.floats(1e-3, 1.0),
)
def test_every_narrow_segment_has_a_column_that_it_or_a_neighbour_shows(cuts, pixel):
    pairs = cuts[: len(cuts) // 2 * 2].reshape(-1, 2).tolist()
    track = tuple(Segment(a, b, f"action {i % 3}") for i, (a, b) in enumerate(pairs) if b > a)
    count = int(max(cuts, default=0.0) / pixel) + 2
    wide, columns, names = narrow_columns(track, 0.0, pixel, count, 3 * pixel)
    assert wide == tuple(s for s in track if s.duration >= 3 * pixel)
    near = set()
    for segment in set(track) - set(wide):
        first, last = int(segment.start / pixel), int(segment.end / pixel) + 1
        here = {code for code in columns[first:last].tolist() if code >= 0}
        assert here
        near |= set(range(first, last))
        if segment.duration >= 2 * pixel:
            middle = columns[int((segment.start + segment.end) / 2 / pixel)]
            assert names[middle] == segment.action
    assert set(np.flatnonzero(columns >= 0).tolist()) <= near


STYLUS = ("still", "grab", "pull", "slip", "slip transition", "slipped", "release")


def test_a_name_is_cut_to_what_fits_but_not_to_nothing(app):
    names = ("slip transition",)
    whole, wide = short_name("slip transition", names, 12.0, 500)
    assert whole == "slip transition"
    for room in range(500):
        name, width = short_name("slip transition", names, 12.0, room)
        assert width <= max(room, 0)
        if room >= 12:
            assert name.startswith("s")
        if room >= wide:
            assert name == whole
    assert short_name("slip transition", names, 12.0, 3) == ("", 0.0)
    assert short_name("x", ("x",), 12.0, 100)[0] == "x"


@pytest.mark.parametrize("room", range(4, 120, 3))
def test_no_two_actions_are_shortened_to_the_same(app, room):
    short = [short_name(name, STYLUS, 12.0, room)[0] for name in STYLUS]
    for (name, other), (a, b) in zip(combinations(STYLUS, 2), combinations(short, 2), strict=True):
        assert not a or a != b, (name, other, a)


def test_a_beginning_that_another_name_has_does_not_stand_for_a_longer_one(app):
    shortened = {short_name("slip transition", STYLUS, 12.0, room)[0] for room in range(8, 110)}
    assert not {"sl", "s", "sli…", "slip…"} & shortened
    assert any(short.startswith("s…t") for short in shortened)


def test_an_action_that_is_added_leaves_the_signs_of_the_others():
    before = abbreviations(STYLUS[:4])
    after = abbreviations(STYLUS)
    assert {name: pair[0] for name, pair in before.items()} == {
        name: after[name][0] for name in before
    }
    assert after["slip"][0] == "sl"
    assert after["slipped"][0] == "sp"
