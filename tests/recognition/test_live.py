"""Live recognition gives what is stated for its latency, whatever the blocks."""

from dataclasses import replace

import numpy as np
import pytest
from factories import labelled_set
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train
from forcelab.signals import cwt_engine
from tests.recognition.live_reference import pushed, reference_labels, streamed


@pytest.fixture(scope="module")
def three():
    return labelled_set(3, rate=250.0)


@pytest.fixture(scope="module")
def trained(three):
    """Of wavelets, with filters."""
    return train(three[:2], Settings(max_scale=32.0, stride=5))


@pytest.fixture(scope="module", params=["wavelets and filters", "windows and decoder"])
def either(request, three, trained):
    """A recogniser of both kinds that follow a stream, each in a way of its own."""
    if request.param.startswith("wavelets"):
        return trained
    request.getfixturevalue("small_fits")
    return train(three[:2], preset("fast"))


def first_steps(demonstration, count):
    """The beginning of a recording; what a reference takes grows with the square of its length."""
    return replace(
        demonstration,
        times=demonstration.times[:count],
        signals=demonstration.signals[:count],
    )


@pytest.mark.parametrize("latency", [0.0, 0.1, 1.0])
def test_labels_are_those_stated_for_the_latency(either, three, latency):
    demonstration = first_steps(three[2].demonstration, 600)
    expected = reference_labels(either, demonstration, latency)
    # Wavelets are transformed to a tolerance, which depends on what comes together.
    tolerance = 1e-6 if either.live_models else 1e-3
    for blocks in ([5], [1, 40, 3, 700]):
        times, codes, probabilities = streamed(either, demonstration, latency, blocks)
        assert np.array_equal(times, expected.times)
        assert np.array_equal(codes, expected.codes)
        assert np.abs(probabilities - expected.probabilities).max() < tolerance


def test_labels_do_not_depend_on_the_blocks(either, three):
    @settings(max_examples=15, deadline=None)
    @given(
        sizes=st.lists(st.integers(1, 90), min_size=1, max_size=6),
        latency=st.sampled_from([0.0, 0.04, 0.1, 0.4]),
        length=st.integers(1, 250),
    )
    def check(sizes, latency, length):
        demonstration = three[2].demonstration
        piece = slice(500, 500 + length)  # of a grip that ends
        found, expected = (
            pushed(
                OnlineRecogniser(either, latency, demonstration.channels, 250.0),
                demonstration.times[piece],
                demonstration.signals[piece],
                blocks,
            )
            for blocks in (sizes, [length])
        )
        assert len(found[1]) == length
        assert np.array_equal(found[1], expected[1])
        assert np.abs(found[2] - expected[2]).max() < (1e-12 if either.live_models else 1e-3)

    check()


def test_with_time_enough_labels_are_those_of_offline_recognition(trained, three):
    for item in three:
        offline = trained.predict(item.demonstration)
        times, codes, _ = streamed(trained, item.demonstration, 3.0, [13])
        assert np.array_equal(times, offline.times)
        assert np.mean(codes == offline.filtered) > 0.995
        assert (codes != UNLABELLED).any()


def test_a_label_comes_no_later_than_the_latency_and_needs_no_later_sample(either, three):
    demonstration, latency = three[2].demonstration, 0.2
    online = OnlineRecogniser(either, latency, demonstration.channels, 250.0)
    known = []
    for i in range(len(demonstration.times)):
        block = slice(i, i + 1)
        decided = online.push(demonstration.times[block], demonstration.signals[block])
        known += decided.codes.tolist()
        assert i + 1 - len(known) <= round(latency * 250)
    # What follows differently changes nothing of what has been said.
    half = len(demonstration.times) // 2
    other = demonstration.signals.copy()
    other[half:] = 9.0
    _, codes, _ = streamed(either, replace(demonstration, signals=other), latency, [5], 250.0)
    assert codes[: half - 50].tolist() == known[: half - 50]


def test_a_gap_is_bridged_and_never_labelled(either, three):
    demonstration = three[2].demonstration
    keep = np.ones(len(demonstration.times), dtype=bool)
    keep[400:460] = False
    keep[700:702] = False  # lost samples are no gap
    signals = demonstration.signals.copy()
    signals[500:560, 0] = np.nan
    holed = replace(demonstration, times=demonstration.times[keep], signals=signals[keep])
    for latency in (0.0, 0.1):
        times, codes, known = streamed(either, holed, latency, [7])
        assert np.array_equal(times, holed.times)
        bare = (times > 1.999) & (times < 2.239)
        assert np.all(codes[bare] == UNLABELLED)
        assert np.all(known[bare] == 0)
        assert np.all(known[(times > 1.84) & (times < 1.98)].any(axis=1))
        assert np.all(known[times > 2.26].any(axis=1))
        assert np.array_equal(codes, streamed(either, holed, latency, [5000])[1])
    if not either.live_models:  # with time enough it is what the whole recording gives
        offline = either.predict(holed)
        places = np.searchsorted(offline.times, holed.times - 0.002)
        _, codes, _ = streamed(either, holed, 3.0, [50])
        assert np.mean(codes == offline.filtered[places]) > 0.99


def test_after_days_unplugged_it_goes_on(either, three):
    demonstration = three[2].demonstration
    online = OnlineRecogniser(either, 0.1, demonstration.channels, 250.0)
    first = online.push(demonstration.times, demonstration.signals)
    again = online.push(demonstration.times[:25] + 3e5, demonstration.signals[:25])
    # What waited is decided at once, and nothing of the days between.
    count = len(demonstration.times)
    assert np.array_equal(np.concatenate([first.times, again.times])[:count], demonstration.times)
    decided = online.push(demonstration.times[25:] + 3e5, demonstration.signals[25:])
    assert len(first) + len(again) + len(decided) > 1.9 * count
    assert decided.times.min() > 3e5
    assert (decided.codes != UNLABELLED).any()


def test_a_channel_that_falls_silent_stops_labels_but_not_the_stream(trained, three):
    demonstration = three[2].demonstration
    signals = np.tile(demonstration.signals, (2, 1))
    silent = slice(300, 300 + len(demonstration.times))
    signals[silent, 2] = np.nan
    long = replace(demonstration, times=np.arange(len(signals)) / 250.0, signals=signals)
    for blocks in ([41], [3000]):
        times, codes, _ = streamed(trained, long, 0.1, blocks)
        assert np.allclose(times, long.times)
        assert np.all(codes[silent] == UNLABELLED)
        assert (codes[silent.stop :] != UNLABELLED).any()
        assert np.array_equal(codes, streamed(trained, long, 0.1, [250])[1])


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


@pytest.mark.parametrize("rate", [500.0, 333.0, 125.0])
def test_what_comes_at_another_rate_is_brought_to_the_recognisers_grid(trained, three, rate):
    demonstration = three[2].demonstration
    times = np.arange(0.0, demonstration.times[-1], 1 / rate)
    signals = [np.interp(times, demonstration.times, column) for column in demonstration.signals.T]
    other = replace(demonstration, times=times, signals=np.stack(signals, axis=1))
    stamps, codes, _ = streamed(trained, other, 3.0, [17])
    assert np.array_equal(stamps, times)
    offline = trained.predict(other)
    nearest = np.abs(offline.times[:, None] - times).argmin(axis=0)
    assert np.mean(codes == offline.filtered[nearest]) > 0.95


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


def test_a_jittering_stream_is_planned_once(trained, three, monkeypatch):
    demonstration = three[2].demonstration
    jitter = np.random.default_rng(0).uniform(-3e-4, 3e-4, len(demonstration.times))
    made = []

    class Counted(cwt_engine.FewSamples):
        def __init__(self, *arguments):
            made.append(arguments)
            super().__init__(*arguments)

    monkeypatch.setattr(cwt_engine, "FewSamples", Counted)
    for latency in (0.0, 0.04, 0.2):
        made.clear()
        uneven = replace(demonstration, times=demonstration.times + jitter)
        times, _, _ = streamed(trained, uneven, latency, [5], rate=250.0)
        assert np.array_equal(times, uneven.times)
        assert len(made) <= 1
