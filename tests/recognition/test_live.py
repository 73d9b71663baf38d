"""Live recognition gives what is stated for its latency, whatever the blocks."""

from dataclasses import replace

import numpy as np
import pytest
from factories import labelled_set
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition import filters
from forcelab.recognition.live import (
    CausalDrop,
    CausalMedian,
    OnlineRecogniser,
    probability_function,
)
from forcelab.recognition.live_features import PATIENCE, CausalGrid, Steps
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train
from forcelab.signals.grid import on_grid
from tests.recognition.live_reference import reference_labels, streamed


@pytest.fixture(scope="module")
def three():
    return labelled_set(3, rate=250.0)


@pytest.fixture(scope="module")
def trained(three):
    return train(three[:2], Settings(max_scale=32.0, stride=5))


@pytest.mark.parametrize("latency", [0.0, 0.05, 0.3, 2.0])
@pytest.mark.parametrize("blocks", [[5], [1000], [1, 40, 3, 700]])
def test_labels_are_those_stated_for_the_latency(trained, three, latency, blocks):
    expected = reference_labels(trained, three[2].demonstration, latency)
    times, codes, probabilities = streamed(trained, three[2].demonstration, latency, blocks)
    assert np.array_equal(times, expected.times)
    assert np.array_equal(codes, expected.codes)
    assert np.abs(probabilities - expected.probabilities).max() < 1e-3


def test_with_time_enough_labels_are_those_of_offline_recognition(trained, three):
    for item in three:
        offline = trained.predict(item.demonstration)
        times, codes, _ = streamed(trained, item.demonstration, 3.0, [13])
        assert np.array_equal(times, offline.times)
        assert np.mean(codes == offline.filtered) > 0.995
        assert (codes != UNLABELLED).any()


def test_a_label_comes_no_later_than_the_latency_and_needs_no_later_sample(trained, three):
    demonstration, latency = three[2].demonstration, 0.2
    online = OnlineRecogniser(trained, latency, demonstration.channels, 250.0)
    known, begun = [], False
    for i in range(0, len(demonstration.times), 5):
        decided = online.push(demonstration.times[i : i + 5], demonstration.signals[i : i + 5])
        known += decided.codes.tolist()
        begun = begun or len(decided) > 0
        newest = min(i + 5, len(demonstration.times)) - 1
        if begun:  # the noise is known
            assert newest + 1 - len(known) == pytest.approx(latency * 250, abs=0.5)
    # What follows differently changes nothing of what has been said.
    half = len(demonstration.times) // 2
    other = demonstration.signals.copy()
    other[half:] = 9.0
    _, codes, _ = streamed(trained, replace(demonstration, signals=other), latency, [5])
    assert codes[: half - 50].tolist() == known[: half - 50]


def test_a_gap_is_bridged_and_never_labelled(trained, three):
    demonstration = three[2].demonstration
    keep = np.ones(len(demonstration.times), dtype=bool)
    keep[400:460] = False
    keep[700:702] = False  # lost samples are no gap
    holed = replace(
        demonstration, times=demonstration.times[keep], signals=demonstration.signals[keep]
    )
    offline = trained.predict(holed)
    for blocks in ([7], [5000]):
        times, codes, _ = streamed(trained, holed, 3.0, blocks)
        assert np.allclose(times, offline.times, atol=1e-6)
        assert np.all(codes[400:460] == UNLABELLED)
        assert np.mean(codes == offline.filtered) > 0.99
        for latency in (0.1, 3.0):
            expected = reference_labels(trained, holed, latency)
            assert np.array_equal(streamed(trained, holed, latency, blocks)[1], expected.codes)


def test_after_days_unplugged_it_goes_on(trained, three):
    demonstration = three[2].demonstration
    online = OnlineRecogniser(trained, 0.1, demonstration.channels, 250.0)
    online.push(demonstration.times, demonstration.signals)
    decided = online.push(demonstration.times + 3e5, demonstration.signals)
    late = decided.times > 3e5
    assert late.sum() > 0.9 * len(demonstration.times)
    assert np.all(decided.codes[decided.times < 3e5 - 1][-50:] == UNLABELLED)
    assert (decided.codes[late] != UNLABELLED).any()


def test_a_channel_that_falls_silent_stops_labels_but_not_the_stream(trained, three):
    demonstration = three[2].demonstration
    signals = np.tile(demonstration.signals, (4, 1))
    silent = slice(300, 300 + 2 * len(demonstration.times))
    signals[silent, 2] = np.nan
    long = replace(demonstration, times=np.arange(len(signals)) / 250.0, signals=signals)
    for blocks in ([11], [3000]):
        times, codes, _ = streamed(trained, long, 0.1, blocks)
        assert np.allclose(times, long.times)
        assert np.all(codes[silent] == UNLABELLED)
        assert (codes[silent.stop :] != UNLABELLED).any()
        assert np.array_equal(codes, reference_labels(trained, long, 0.1).codes)


@pytest.mark.parametrize("nonsense", [3.4028235e38, -1.7e308, 1e16])
def test_what_a_board_prints_where_it_knows_nothing_is_bridged(trained, three, nonsense):
    demonstration = three[2].demonstration
    signals = demonstration.signals.copy()
    signals[400] = np.nan
    expected = streamed(trained, replace(demonstration, signals=signals), 0.1, [5])
    signals[400] = nonsense
    # Not replace(), as no demonstration holds such numbers.
    online = OnlineRecogniser(trained, 0.1, demonstration.channels, 250.0)
    parts = [online.push(demonstration.times, signals), online.finish()]
    assert np.array_equal(np.concatenate([part.codes for part in parts]), expected[1])


def test_stamps_that_stand_still_or_go_back_are_left_out(trained, three):
    demonstration = three[2].demonstration
    expected = streamed(trained, demonstration, 0.1, [50])
    online = OnlineRecogniser(trained, 0.1, demonstration.channels)
    codes = []
    for i in range(0, len(demonstration.times), 50):
        for _ in range(2):  # everything twice
            block = slice(i, i + 50)
            codes += online.push(
                demonstration.times[block], demonstration.signals[block]
            ).codes.tolist()
    codes += online.finish().codes.tolist()
    assert codes == expected[1].tolist()


@pytest.mark.parametrize("rate", [250.0, 500.0, 333.0, 100.0])
def test_another_device_rate_is_brought_to_the_recognisers_grid_as_offline(rate):
    n = 2000
    times = np.arange(n) / rate
    signals = np.column_stack([np.sin(2 * np.pi * 8 * times), np.cumsum(np.ones(n)) / n])
    demonstration = Demonstration("d", "t", times, signals, (Channel("a"), Channel("b")))
    expected = on_grid(demonstration, 250.0)
    for size in (1, 17, n):
        grid = CausalGrid(2, 250.0)
        parts = [grid.push(times[i : i + size], signals[i : i + size]) for i in range(0, n, size)]
        parts.append(grid.finish())
        found = sum(parts[1:], parts[0])
        assert abs(len(found) - len(expected.times)) <= 1
        count = min(len(found), len(expected.times))
        assert np.allclose(found.signals[:count], expected.signals[:count], atol=1e-9)
        inside = slice(0, count - 1)  # stamps behind the last sample are its own
        assert np.allclose(found.times[inside], expected.times[inside], atol=1e-9)
        assert found.valid.all()


def test_how_a_gap_is_bridged_does_not_depend_on_the_blocks():
    """Of one channel for longer than is waited, while others miss a few samples now and then."""
    n = 3 * PATIENCE
    signals = np.cumsum(np.random.default_rng(0).standard_normal((n, 3)), axis=0)
    signals[300 : 300 + PATIENCE + 200, 0] = np.nan
    signals[[100, 101, 102, 2300, n - 1], 1] = 1e16
    signals[2200:2204, 2] = 5e9  # it lasts
    for first in range(0, n, 90):
        signals[first : first + 30, 1 + first // 90 % 2] = np.nan
    times = np.arange(n) / 250.0
    times[2000:] += 3.0 * PATIENCE / 250  # then nothing at all for a while
    times[2500] = times[2499]
    found = []
    for size in (n, 1, 7, 61, 500):
        grid, steps = CausalGrid(3, 250.0), Steps.none(3)
        for first in range(0, n, size):
            steps += grid.push(times[first : first + size], signals[first : first + size])
            steps += grid.push(times[:0], signals[:0])  # nothing new
        found.append(steps + grid.finish())
    for other in found[1:]:
        assert np.array_equal(other.times, found[0].times)
        assert np.array_equal(other.signals, found[0].signals)
        assert np.array_equal(other.valid, found[0].valid)
    assert np.abs(found[0].signals[:, :2]).max() < 1e3
    assert np.count_nonzero(found[0].signals[:, 2] == 5e9) == 4


codes_lists = st.lists(st.tuples(st.integers(-1, 3), st.integers(1, 9)), min_size=4, max_size=12)


def cut(array, sizes):
    start, turn = 0, 0
    while start < len(array):
        yield array[start : start + sizes[turn % len(sizes)]]
        start, turn = start + sizes[turn % len(sizes)], turn + 1


@settings(max_examples=40, deadline=None)
@given(runs=codes_lists, width=st.integers(1, 15), sizes=st.lists(st.integers(1, 20), min_size=1))
def test_the_median_that_may_look_ahead_is_the_offline_one(runs, width, sizes):
    codes = np.repeat(*np.array(runs).T).astype(np.int64)
    median = CausalMedian(width, 100)
    parts = [median.push(part) for part in cut(codes, sizes)]
    found = np.concatenate([*parts, median.finish()])
    assert found.tolist() == filters.median(codes, width).tolist()


@settings(max_examples=40, deadline=None)
@given(runs=codes_lists, sizes=st.lists(st.integers(1, 20), min_size=1), gap=st.integers(0, 60))
def test_the_drop_heuristic_that_may_look_ahead_is_the_offline_one(runs, sizes, gap):
    codes = np.repeat(*np.array(runs).T).astype(np.int64)
    times = np.arange(len(codes)) * 0.01
    times[gap:] += 0.2 if len(codes) > 3 else 0.0
    shortest = {0: 0.3, 1: 0.6, 3: 0.02}
    drop = CausalDrop({code: s / 8 for code, s in shortest.items()}, 0.01, 1000)
    places = list(cut(np.arange(len(codes)), sizes))
    parts = [drop.push(times[place], codes[place]) for place in places]
    found = np.concatenate([*parts, drop.finish()])
    expected = filters.drop_short(codes, times, shortest, 1 / 8)
    assert found.tolist() == expected.tolist()


def test_the_fast_way_through_the_mlp_is_scikit_learns(trained, three):
    random = np.random.default_rng(0)
    features = random.normal(0, 30, (200, trained.classifier.n_features_in_))
    fast = probability_function(trained.classifier)(features)
    assert np.allclose(fast, trained.classifier.predict_proba(features), atol=1e-12)


@pytest.mark.parametrize("classifier", ["naive-bayes", "svm"])
def test_other_classifiers_and_settings_stream_too(three, classifier):
    plain = Settings(
        max_scale=16.0, stride=20, classifier=classifier, threshold=None, median=None, drop=None,
        phase=False,
    )  # fmt: skip
    recogniser = train(three[:2], plain)
    demonstration = three[2].demonstration
    online = OnlineRecogniser(recogniser, 0.1, demonstration.channels)
    parts = [online.push(demonstration.times, demonstration.signals), online.finish()]
    codes = np.concatenate([part.codes for part in parts])
    assert np.array_equal(codes, reference_labels(recogniser, demonstration, 0.1).codes)
    assert (parts[0].probabilities is None) == (classifier == "svm")


def test_early_scales_are_listed_with_their_errors(trained, three):
    channels = three[2].demonstration.channels
    soon = OnlineRecogniser(trained, 0.05, channels).early
    assert [early.scale for early in soon][-1] == 32.0
    assert soon[-1].error > soon[0].error > 0
    assert OnlineRecogniser(trained, 5.0, channels).early == ()


def test_what_does_not_fit_is_refused(trained, three):
    channels = three[2].demonstration.channels
    with pytest.raises(InputError, match="no recognition channel"):
        OnlineRecogniser(trained, 0.1, channels[:3])
    for latency in (-1.0, 1e9, np.nan):
        with pytest.raises(InputError, match="latency is a number of seconds from 0 to 600, not"):
            OnlineRecogniser(trained, latency, channels)
    online = OnlineRecogniser(trained, 0.1, channels)
    with pytest.raises(InputError, match="shape"):
        online.push(np.arange(3.0), np.zeros((3, 5)))


def test_a_stream_that_ends_before_anything_is_known_gives_its_labels_all_the_same(trained, three):
    demonstration = three[2].demonstration
    for n in (0, 1, 2, 70, 300):
        online = OnlineRecogniser(trained, 0.1, demonstration.channels)
        first = online.push(demonstration.times[:n], demonstration.signals[:n])
        last = online.finish()
        assert len(first) + len(last) == n
