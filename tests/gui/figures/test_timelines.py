import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtGui import QColor
from window_helpers import pixels

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.gui.figures.pairs import Pair, TimelinePairs
from forcelab.labels import Segment
from forcelab.vocabulary import Action, Vocabulary

VOCABULARY = Vocabulary().with_actions("still", "grab", "hold", "pull", "slip", "release")


def figure(human=(), predicted=(), *, start=0.0, end=10.0, name="stylus 1", note="", **more):
    pair = Pair(name, tuple(human), tuple(predicted), start, end, note)
    return TimelinePairs("Stylus", (pair,), more.pop("vocabulary", VOCABULARY), **more)


def rgb(colour):
    return np.array(QColor(colour).getRgb()[:3])


def strip(drawn, row=0, *, predicted=False, scale=4.0, height=0.2, picture=None):
    """The pixels along a track, above its numbers, and the time of each in seconds."""
    boxes = drawn.boxes(row)
    box = boxes.predicted if predicted else boxes.human
    picture = pixels(drawn.image(scale)) if picture is None else picture
    line = picture[int((box.top() + height * box.height()) * scale)]
    x = np.arange(int(box.left() * scale) + 4, int(box.right() * scale) - 3)
    axis = drawn.axis
    share = ((x + 0.5) / scale - axis.begin) / (axis.finish - axis.begin)
    return line[x], axis.start + share * (axis.end - axis.start)


@given(data=st.data())
@settings(max_examples=15, deadline=None)
def test_every_time_has_the_colour_of_its_action_and_white_where_unlabelled(data):
    edges = data.draw(st.lists(st.integers(0, 100), min_size=2, max_size=8, unique=True))
    edges = sorted(edge / 10 for edge in edges)
    actions = [data.draw(st.sampled_from((None, *VOCABULARY.names))) for _ in edges[1:]]
    segments = [
        Segment(a, b, action)
        for a, b, action in zip(edges[:-1], edges[1:], actions, strict=True)
        if action
    ]
    drawn = figure(human=segments, predicted=segments)
    picture = pixels(drawn.image(4.0))
    for predicted in (False, True):
        colours, times = strip(drawn, predicted=predicted, picture=picture)
        clear = np.abs(times[:, None] - np.array(edges)).min(axis=1) > 0.02
        expected = np.full(colours.shape, 255)
        for segment in segments:
            inside = (segment.start <= times) & (times < segment.end)
            expected[inside] = rgb(VOCABULARY[segment.action].colour)
        wrong = clear & (np.abs(colours - expected).max(axis=1) > 2)
        assert not wrong.any(), times[wrong]


def test_human_is_above_predicted_and_pairs_go_down_the_page():
    grab, hold = (Segment(2, 8, "grab"),), (Segment(2, 8, "hold"),)
    pairs = (Pair("1", grab, hold, 0, 10), Pair("2", hold, grab, 0, 10))
    drawn = TimelinePairs("Stylus", pairs, VOCABULARY)
    tops, colours_found = [], []
    for row in (0, 1):
        tops += [drawn.boxes(row).human.top(), drawn.boxes(row).predicted.top()]
        colours = (strip(drawn, row, predicted=predicted)[0] for predicted in (False, True))
        colours_found += [tuple(line[900]) for line in colours]
    grab_rgb, hold_rgb = (
        tuple(rgb(VOCABULARY["grab"].colour)),
        tuple(rgb(VOCABULARY["hold"].colour)),
    )
    assert colours_found == [grab_rgb, hold_rgb, hold_rgb, grab_rgb]
    assert tops == sorted(tops)
    assert 0 < drawn.boxes(0).predicted.top() - drawn.boxes(0).human.bottom() < 4
    assert drawn.boxes(1).human.top() - drawn.boxes(0).predicted.bottom() > 5


def test_all_pairs_share_one_time_axis():
    pairs = (Pair("1", (), (), 0, 4), Pair("2", (), (), 2, 10))
    first, second = (TimelinePairs("S", pairs, VOCABULARY).boxes(row).human for row in (0, 1))
    width_of_second = first.width() / 4
    assert second.left() - first.left() == pytest.approx(2 * width_of_second)
    assert second.width() == pytest.approx(8 * width_of_second)


@pytest.mark.parametrize("scale", [1.0, 2.0])
@pytest.mark.parametrize("start", [0.0, 3.123, 59.999])
def test_a_segment_of_one_sample_in_a_minute_is_visible(start, scale):
    drawn = figure(human=[Segment(start, start + 0.001, "still")], end=60.0)
    box = drawn.boxes(0).human
    spot = round(drawn.axis.at(start) * scale)
    line = pixels(drawn.image(scale))[int(box.center().y() * scale), spot - 3 : spot + 4]
    towards = (255 - line) @ (255 - rgb(VOCABULARY["still"].colour))
    share = towards.max() / np.sum((255 - rgb(VOCABULARY["still"].colour)) ** 2)
    assert share >= 0.45


def test_a_short_segment_is_not_hidden_by_its_long_neighbours():
    around = [Segment(0, 30, "grab"), Segment(30, 30.001, "still"), Segment(30.001, 60, "grab")]
    colours, _ = strip(figure(human=around, end=60.0))
    assert np.abs(colours - rgb(VOCABULARY["still"].colour)).sum(axis=1).min() < 12


def test_where_short_segments_crowd_the_rare_one_stays_visible():
    crowd = [Segment(i / 100, (i + 1) / 100, "grab") for i in range(6000)]
    crowd[3000] = Segment(30.0, 30.01, "still")
    colours, times = strip(figure(human=crowd, end=60.0))
    near = np.abs(times - 30.005) < 0.03
    assert np.abs(colours[near] - rgb(VOCABULARY["still"].colour)).sum(axis=1).min() < 12


def test_touching_segments_of_one_action_have_a_line_between_them():
    split = figure(human=[Segment(1, 5, "hold"), Segment(5, 9, "hold")])
    whole = figure(human=[Segment(1, 9, "hold")])
    hold = rgb(VOCABULARY["hold"].colour)
    for drawn, lines in ((split, 1), (whole, 0)):
        colours, times = strip(drawn)
        near = np.abs(times - 5) < 0.1
        assert (np.abs(colours[near] - hold).max() > 60) == lines


def test_segments_outside_the_demonstration_are_not_drawn():
    far = [Segment(-50, 3, "grab"), Segment(8, 99, "hold"), Segment(100, 101, "slip")]
    drawn = figure(human=far, predicted=far, start=2.0)
    picture = pixels(drawn.image(1.0))
    box = drawn.boxes(0).human
    middle = int(box.center().y())
    assert (picture[middle, int(box.right()) + 2 :] == 255).all()
    assert (picture[middle, int(box.left()) - 8 : int(box.left()) - 1] == 255).all()


@pytest.mark.parametrize("action", VOCABULARY.names)
def test_the_number_stands_in_wide_segments_only_and_can_be_read(action):
    drawn = figure(human=[Segment(1, 5, action), Segment(6, 6.05, action)])
    colour = rgb(VOCABULARY[action].colour)
    picture, box = pixels(drawn.image(4.0)), drawn.boxes(0).human

    def inside(start, end):
        left, right = (int(drawn.axis.at(t) * 4) for t in (start, end))
        return picture[int(box.top() * 4) + 8 : int(box.bottom() * 4) - 8, left + 4 : right - 3]

    wide, narrow = inside(1, 5), inside(6, 6.05)
    ink = wide[np.abs(wide - colour).max(axis=2) > 90]
    assert len(ink) > 20
    brightness = ink.mean()
    assert brightness < 60 if colour @ [0.21, 0.72, 0.07] > 110 else brightness > 200
    assert np.abs(narrow - colour).max() <= 2


def test_actions_of_one_colour_differ_by_texture():
    actions = tuple(Action(f"a{t}", "#e69f00", "", t) for t in range(6))
    strips = []
    for action in actions:
        drawn = figure(human=[Segment(1, 9, action.name)], vocabulary=Vocabulary(actions))
        box = drawn.boxes(0).human
        block = pixels(drawn.image(2.0))[int(box.top() * 2) + 3 : int(box.bottom() * 2) - 2]
        strips.append(block[:, 400:700])
    plain = rgb("#e69f00")
    assert (strips[0] == plain).all()
    for i, strip in enumerate(strips):
        for other in strips[:i]:
            assert (np.abs(strip - other).max(axis=2) > 40).mean() > 0.05
        assert (np.abs(strip - plain).max(axis=2) < 8).mean() > 0.3  # the colour stays to be seen


@pytest.mark.parametrize("name", ["x" * 400, "two\nlines " * 60, "stylus 7"])
def test_names_and_notes_keep_clear_of_the_bars(name):
    drawn = figure(human=[Segment(0, 10, "grab")], name=name, note=name)
    picture, box = pixels(drawn.image(1.0)), drawn.boxes(0).human
    left, right = int(box.left()), math.ceil(box.right())
    rows = slice(int(box.top()) - 8, int(box.bottom()) + 20)
    before, after = picture[rows, left - 8 : left - 1], picture[rows, right + 2 : right + 8]
    assert (before == 255).all()
    assert (after == 255).all()
    assert (picture[rows, : left - 8] < 128).any()
    assert (picture[rows, right + 8 :] < 160).any()
    assert box.width() > drawn.width / 2


def test_an_elided_name_keeps_its_end():
    first, second = (
        pixels(figure(name="a demonstration with a long name, number " + number).image(1.0))
        for number in ("17", "42")
    )
    assert (first != second).any()


def test_the_legend_is_in_the_order_of_occurrence():
    pairs = (
        Pair("1", (Segment(0, 1, "slip"), Segment(1, 2, "grab")), (Segment(0, 1, "pull"),), 0, 9),
        Pair("2", (Segment(0, 1, "hold"),), (Segment(0, 1, "release"),), 0, 9),
    )
    drawn = TimelinePairs("Stylus", pairs, VOCABULARY)
    assert drawn.actions == ("slip", "grab", "hold", "pull", "release")
    pairs_of_stylus = TimelinePairs("Stylus", pairs, VOCABULARY, actions=("still", "grab"))
    assert pairs_of_stylus.actions == ("still", "grab", "slip", "hold", "pull", "release")


def test_the_legend_of_thirty_actions_wraps_over_lines():
    names = tuple(f"an action, {i}" for i in range(30))
    many = figure(actions=names, vocabulary=Vocabulary().with_actions(*names))
    few = figure(actions=("still", "grab"))
    assert 40 <= many.size.height() - few.size.height() <= 150
    assert many.boxes(0).human.top() - few.boxes(0).human.top() == pytest.approx(
        many.size.height() - few.size.height()
    )


def test_the_height_grows_with_the_pairs():
    heights = []
    for n in (1, 10, 20, 200):
        pairs = tuple(Pair(f"{i}", (), (), 0, 9) for i in range(n))
        drawn = TimelinePairs("Stylus", pairs, VOCABULARY)
        heights.append(drawn.size.height())
        assert drawn.boxes(n - 1).predicted.bottom() < drawn.size.height() - 40
    assert heights[2] - heights[1] == pytest.approx((heights[1] - heights[0]) / 9 * 10)
    assert heights[3] > 8 * heights[2]


def test_a_demonstration_without_any_segment_is_drawn_as_an_empty_frame():
    colours, _ = strip(figure(), height=0.5)
    assert (colours == 255).all()
    drawn = figure()
    box = drawn.boxes(0).human
    column = pixels(drawn.image(1.0))[:, int(box.center().x())]
    assert (column[round(box.top()) - 1 : round(box.top()) + 2] < 245).any()


def test_no_demonstration_is_refused():
    with pytest.raises(InputError, match="no demonstration"):
        TimelinePairs("Stylus", (), VOCABULARY)


def test_an_action_that_the_vocabulary_lacks_is_named():
    with pytest.raises(InputError, match="'sneeze'"):
        figure(predicted=[Segment(0, 1, "sneeze")])


@pytest.mark.parametrize(("start", "end"), [(1.0, 1.0), (2.0, 1.0), (0.0, math.inf)])
def test_a_pair_that_does_not_last_is_named(start, end):
    with pytest.raises(InputError, match="stylus 1"):
        figure(start=start, end=end)


@pytest.mark.parametrize("note", ["", "72.0 %"])
def test_what_the_notes_say_is_told_only_where_there_are_notes(note, tmp_path):
    figure(note=note).save(tmp_path / "f.svg")
    told = "White: unlabelled. At the right: accuracy after the filters." in svg_text(tmp_path)
    assert told == bool(note)


def svg_text(folder):
    """All texts of a saved figure."""
    texts = ET.parse(folder / "f.svg").getroot().iter("{http://www.w3.org/2000/svg}text")
    return "".join(f"{(''.join(text.itertext())).strip()}|" for text in texts)


def test_names_that_differ_in_their_middle_only_are_cut_where_they_do(app):
    axes = [
        f"{side} {kind} {axis}, filtered and zeroed"
        for side in ("left", "right")
        for kind in ("force", "torque")
        for axis in "xyz"
    ]
    for room in (60.0, 80.0, 110.0):
        shown = [text.elided_name(name, text.font(10), room, tuple(axes)) for name in axes]
        assert len(set(shown)) == len(axes), shown
        assert all(text.width(name, text.font(10)) <= room for name in shown)
