"""What stands beside the two bars of a pair: veils, marks, lanes and their captions."""

import xml.etree.ElementTree as ET
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QRectF
from PySide6.QtGui import QColor
from window_helpers import pixels

from forcelab.gui.figures.axes import Axis
from forcelab.gui.figures.pairs import Pair, PairRow, TimelinePairs
from forcelab.gui.figures.tracks import (
    LEVELS,
    STRONGEST,
    agreed_share,
    fade_at,
    fade_overlays,
)
from forcelab.labels import Segment, ordered, to_codes
from forcelab.recognition.probabilities import ProbabilityTrace
from forcelab.review.differences import find_differences
from forcelab.vocabulary import Vocabulary

ACTIONS = ("grab", "hold", "release")
VOCABULARY = Vocabulary().with_actions(*ACTIONS)
AXIS, BOX = Axis(0.0, 10.0, 100.0, 900.0), QRectF(100.0, 0.0, 800.0, 13.0)


def sure_of(*probabilities):
    """A certainty of ten seconds with the probability of grab in equal parts of it."""
    grab = np.repeat(probabilities, 500 // len(probabilities))
    values = np.stack([grab, 1 - grab, np.zeros_like(grab)], axis=1)
    return ProbabilityTrace(0.0, 50.0, ACTIONS, np.rint(255 * values).astype(np.uint8))


def tracks():
    """Tracks with edges on tenths of a second, over ten seconds."""
    edges = st.lists(st.integers(0, 100), min_size=2, max_size=12, unique=True)
    actions = st.lists(st.sampled_from((*ACTIONS, None)), min_size=11, max_size=11)
    return st.builds(_track, edges, actions)


def _track(edges, actions):
    edges = sorted(edges)
    pieces = zip(edges[:-1], edges[1:], actions, strict=False)
    return ordered(Segment(a / 10, b / 10, action) for a, b, action in pieces if action)


@given(tracks(), tracks())
@settings(max_examples=60, deadline=None)
def test_the_agreed_share_is_the_accuracy_of_fine_samples(human, predicted):
    times = np.arange(0.005, 10, 0.01)
    human_codes, predicted_codes = (to_codes(track, times, ACTIONS) for track in (human, predicted))
    labelled = human_codes >= 0
    marks = [m for m in find_differences("x", human, predicted) if m.human is not None]
    share = agreed_share(human, marks)
    if labelled.any():
        assert share == pytest.approx((human_codes == predicted_codes)[labelled].mean())
    else:
        assert share is None


def opacity(probability):
    """How much of an action's colour is faded where it is so probable."""
    fades = fade_overlays(sure_of(probability), (Segment(0, 10, "grab"),), AXIS, BOX)
    return fade_at(fades, AXIS.at(5.0))


def test_the_thickness_of_a_veil_falls_with_the_probability():
    thickness = [opacity(p) for p in np.linspace(0, 1, 101)]
    assert thickness == sorted(thickness, reverse=True)
    assert thickness[-1] == opacity(0.96) == 0
    assert thickness[0] == pytest.approx(STRONGEST)
    assert len(set(thickness)) == LEVELS + 1


@given(st.lists(st.sampled_from((0.2, 0.5, 0.7, 1.0)), min_size=5, max_size=5), tracks())
@settings(max_examples=40, deadline=None)
def test_a_veil_lies_where_its_action_is_improbable_and_on_no_unlabelled_time(shares, track):
    fades = fade_overlays(sure_of(*shares), track, AXIS, BOX)
    assert all(a.right <= b.left for a, b in pairwise(fades))
    edges = {t for s in track for t in (s.start, s.end)} | {0, 2, 4, 6, 8, 10}
    for time in np.arange(0.05, 10, 0.1):
        if min(abs(time - edge) for edge in edges) < 0.09:
            continue  # columns are some pixels wide
        action = next((s.action for s in track if s.start <= time < s.end), None)
        share = shares[int(time // 2)]
        probability = {"grab": share, "hold": 1 - share, "release": 0.0, None: 1.0}[action]
        assert abs(fade_at(fades, AXIS.at(time)) - opacity(probability)) <= 0.1, time


def test_what_the_recogniser_does_not_know_is_not_veiled():
    assert fade_overlays(sure_of(0.1), (Segment(1, 9, "sneeze"),), AXIS, BOX) == ()


def rich(**changes):
    human, predicted = (Segment(1, 9, "grab"),), (Segment(1, 5, "grab"), Segment(5, 9, "hold"))
    details = {
        "lanes": (PairRow("raw", (Segment(2, 4, "release"),), True), PairRow("Bob & co", human)),
        "probability_trace": sure_of(0.5),
        "marks": find_differences("x", human, predicted),
        **changes,
    }
    pair = Pair("d 1", human, predicted, 0.0, 10.0, "50 %", **details)
    return TimelinePairs("Stylus", (pair, pair), VOCABULARY)


def pixel_at(drawn, box, time, height=0.2):
    image = pixels(drawn.image(2.0))
    return image[int((box.top() + height * box.height()) * 2), int(drawn.axis_of(0).at(time) * 2)]


def rgb(action):
    return np.array(QColor(VOCABULARY[action].colour).getRgb()[:3])


def test_lanes_lie_below_the_pair_and_have_captions(tmp_path):
    drawn = rich()
    boxes = drawn.boxes(0)
    tops = [box.top() for box in (boxes.human, boxes.predicted, *boxes.lanes)]
    assert tops == sorted(tops)
    assert boxes.lanes[-1].bottom() < drawn.boxes(1).human.top()
    assert np.abs(pixel_at(drawn, boxes.lanes[1], 3.0) - rgb("grab")).max() <= 2
    drawn.save(tmp_path / "f.svg")
    texts = ET.parse(tmp_path / "f.svg").getroot().iter("{http://www.w3.org/2000/svg}text")
    words = ["".join(text.itertext()).strip() for text in texts]
    for caption in ("human", "predicted", "raw", "Bob & co"):
        assert words.count(caption) == 2
    assert any("Lighter: less probable." in line for line in words)


def test_predictions_are_veiled_and_coders_are_not():
    drawn, sure = rich(), rich(probability_trace=None)
    boxes = drawn.boxes(0)
    veiled = rgb("grab") + (255 - rgb("grab")) * opacity(0.5)
    assert np.abs(pixel_at(drawn, boxes.predicted, 2.0) - veiled).max() <= 3
    for human in (boxes.human, boxes.lanes[1]):
        assert np.abs(pixel_at(drawn, human, 2.0) - rgb("grab")).max() <= 2
    assert np.abs(pixel_at(sure, boxes.predicted, 2.0) - rgb("grab")).max() <= 2


def test_marks_lie_between_the_bars_where_they_differ():
    drawn = rich()
    band = drawn.boxes(0).band
    red = np.array([0xB3, 0x26, 0x1E])
    assert np.abs(pixel_at(drawn, band, 7.0, 0.5) - red).max() <= 4
    for time in (0.5, 2.0, 9.5):
        assert np.abs(pixel_at(drawn, band, time, 0.5) - red).max() > 60
    assert rich(marks=None).boxes(0).band.height() < band.height()


def test_a_stretched_pair_takes_the_whole_width():
    pairs = (Pair("a", (), (), 0, 4), Pair("b", (), (), 2, 10))
    drawn = TimelinePairs("S", pairs, VOCABULARY, stretched=True)
    assert drawn.boxes(0).human.width() == pytest.approx(drawn.boxes(1).human.width())
    assert drawn.boxes(0).human.left() == pytest.approx(drawn.boxes(1).human.left())


def test_a_proposal_has_no_bar_for_the_human():
    pair = Pair("d", None, (Segment(1, 9, "grab"),), 0.0, 10.0)
    drawn = TimelinePairs("S", (pair,), VOCABULARY)
    boxes = drawn.boxes(0)
    assert boxes.human.height() == 0
    assert np.abs(pixel_at(drawn, boxes.predicted, 2.0) - rgb("grab")).max() <= 2
