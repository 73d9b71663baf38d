"""The nearest training segments: against a plain loop and against scikit-learn."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.neighbors import NearestNeighbors
from synthetic import synthetic_demonstration

from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.settings import Settings
from forcelab.review.differences import Interval
from forcelab.review.explanation import (
    SegmentFeatures,
    nearest_segments,
    summarise,
    summarise_segments,
)

SETTINGS = Settings(max_scale=32.0)
SCALES = len(SETTINGS.scales)


def drawn(seed, count=30, width=7):
    """Summaries of three demonstrations and two actions, with one number that never changes."""
    random = np.random.default_rng(seed)
    values = random.normal(size=(count, width)) * random.uniform(0.1, 50.0, size=width)
    values[:, 3] = 4.0
    places = tuple(
        Interval(str(random.integers(3)), float(i), i + 1.0, ("grab", "hold")[random.integers(2)])
        for i in range(count)
    )
    return SegmentFeatures(places, values), values[0] + random.normal(size=width)


@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
@settings(max_examples=40)
def test_they_are_those_of_a_plain_loop(seed, count):
    training, wanted = drawn(seed)
    spread = [s if s > 0 else 1.0 for s in training.values.std(axis=0)]
    found = []
    for i, place in enumerate(training.places):
        if place.human == "hold" and place.demonstration != "1":
            away = training.values[i] - wanted
            far = sum((a / s) ** 2 for a, s in zip(away, spread, strict=True)) ** 0.5
            found.append((far, i, place))
    found.sort()
    near = nearest_segments(wanted, training, "hold", count, without={"1"})
    assert [n.place for n in near] == [place for *_, place in found[:count]]
    assert [n.distance for n in near] == pytest.approx([far for far, *_ in found[:count]])


def test_they_are_those_of_scikit_learn():
    training, wanted = drawn(5, count=200)
    spread = training.values.std(axis=0)
    spread[3] = 1.0
    chosen = [i for i, place in enumerate(training.places) if place.human == "grab"]
    theirs = NearestNeighbors(n_neighbors=3, algorithm="brute").fit(
        training.values[chosen] / spread
    )
    distances, order = theirs.kneighbors([wanted / spread])
    near = nearest_segments(wanted, training, "grab")
    assert [n.place for n in near] == [training.places[chosen[i]] for i in order[0]]
    assert [n.distance for n in near] == pytest.approx(distances[0].tolist())


def test_the_unit_of_a_number_makes_no_difference():
    training, wanted = drawn(9)
    factors = np.array([1e3, 1.0, 1e-6, 1.0, 1.0, 5.0, 1.0])
    scaled = SegmentFeatures(training.places, training.values * factors)
    ours = [n.place for n in nearest_segments(wanted, training, "hold")]
    assert [n.place for n in nearest_segments(wanted * factors, scaled, "hold")] == ours


def test_an_action_that_nobody_else_has_has_no_neighbours():
    training, wanted = drawn(1)
    assert nearest_segments(wanted, training, "juggle") == ()
    assert nearest_segments(wanted, training, "hold", without={"0", "1", "2"}) == ()


def test_a_segment_is_known_by_magnitudes_levels_and_length():
    demonstration, segments = synthetic_demonstration(3, rate=200.0)
    examples = prepare_examples(LabelledDemonstration(demonstration, segments), SETTINGS)
    found = summarise_segments(examples, demonstration, SCALES)
    assert [(p.start, p.end, p.human) for p in found.places] == [
        (s.start, s.end, s.action) for s in segments
    ]
    hold = segments[2]
    inside = (demonstration.times >= hold.start) & (demonstration.times < hold.end)
    rows = examples.features[inside, : 4 * SCALES]
    fx, fy, fz = demonstration.signals[inside, :3].T
    row = found.values[2]
    assert row[: 4 * SCALES] == pytest.approx(rows.mean(axis=0))
    assert row[4 * SCALES : 8 * SCALES] == pytest.approx(rows.std(axis=0))
    assert row[8 * SCALES] == pytest.approx(np.mean(np.hypot(fx, fy)))
    assert row[8 * SCALES + 2] == pytest.approx(fz.mean())
    assert row[-1] == pytest.approx(np.log(hold.duration))


def test_a_stretch_without_samples_has_no_summary():
    demonstration, segments = synthetic_demonstration(3, rate=200.0)
    examples = prepare_examples(LabelledDemonstration(demonstration, segments), SETTINGS)
    assert summarise(examples, demonstration, SCALES, 1.001, 1.004) is None


def test_a_demonstration_without_labels_adds_nothing():
    demonstration, segments = synthetic_demonstration(3, rate=200.0)
    bare = summarise_segments(
        prepare_examples(LabelledDemonstration(demonstration), SETTINGS), demonstration, SCALES
    )
    full = summarise_segments(
        prepare_examples(LabelledDemonstration(demonstration, segments), SETTINGS),
        demonstration,
        SCALES,
    )
    joined = SegmentFeatures.joined([bare, full])
    assert joined.places == full.places
    assert np.array_equal(joined.values, full.values)
