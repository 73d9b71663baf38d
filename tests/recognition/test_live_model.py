"""Recognisers with windows and a decoder on a stream: what is stated, whatever the blocks."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from factories import labelled_set, synthetic_set

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import UNLABELLED
from forcelab.live.recognition import latency_budget
from forcelab.recognition import cross_validation
from forcelab.recognition.cross_validation import leave_one_out_live_job
from forcelab.recognition.ensemble import sharpen
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.features import REACH, RunningSize, cut_window_features
from forcelab.recognition.hsmm import decode
from forcelab.recognition.live_model import LOOKS, CausalWindows, LiveModel
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import load_recogniser, save_recogniser
from forcelab.recognition.training import train, training_job
from tests.recognition.live_reference import reference_labels, streamed

pytestmark = pytest.mark.usefixtures("small_fits")

RATE = 250.0
WINDOWS = preset("fast").windows


@pytest.fixture(scope="module")
def three():
    return labelled_set(3, rate=RATE)


@pytest.fixture(scope="module")
def trained(three):
    return train(three[:2], preset("fast"))


# Features


def featured(what, channels, rate, hop):
    """Features of all time steps."""
    steps = np.arange(hop // 2, channels.shape[1], hop)
    return what.features(channels, rate, steps, RunningSize(len(channels), rate))


@pytest.mark.parametrize("ahead", [0, 12, 175])
def test_a_cut_window_is_the_line_of_best_fit_through_what_it_sees(ahead):
    n, windows = 300, (0.0005, *WINDOWS)
    signals = np.cumsum(np.random.default_rng(ahead).standard_normal((2, n)), axis=1)
    places = np.arange(3, n, 20)
    found = cut_window_features(signals, RATE, windows, places, ahead)
    for row, place in zip(found, places.tolist(), strict=True):
        for number, spread in enumerate(windows):
            width = max(spread, 0.5 / RATE)
            reach = int(np.ceil(REACH * width * RATE))
            offsets = np.arange(-reach, min(ahead, reach) + 1)
            times = offsets / RATE
            root = np.exp(-0.25 * (times / width) ** 2)
            weights = root**2 / (root**2).sum()
            for values, channel in zip(row[:, :, number].T, signals, strict=True):
                seen = channel[np.clip(place + offsets, 0, n - 1)]
                level = weights @ seen
                line = np.linalg.lstsq(
                    root[:, None] * np.stack([np.ones_like(times), times], axis=1), root * seen
                )[0]
                rms = np.sqrt(weights @ (seen - level) ** 2)
                assert np.allclose(values, [level, line[1], rms], rtol=1e-7, atol=1e-9)


def test_a_window_seen_whole_is_the_gaussian_one():
    rate, slope = 1000.0, 3.0
    times = np.arange(4000) / rate
    found = cut_window_features((slope * times)[None], rate, (0.04,), np.array([2010]), 200)
    level, sloping, rms = found[0, :, 0, 0]
    assert level == pytest.approx(slope * times[2010], rel=1e-6)
    assert sloping == pytest.approx(slope, rel=1e-6)
    assert rms == pytest.approx(slope * 0.04, rel=2e-3)  # of four standard deviations


def test_own_units_forget_a_person_s_strength_and_keep_the_level_at_rest():
    rate = 250.0
    times = np.arange(60 * int(rate)) / rate
    press = 5.0 + np.where(times > 1, 1 + np.sin(2 * np.pi * times), 0.0)
    what = CausalWindows((0.04,), 0.05, np.ones(1), True)
    weak = featured(what, press[None], rate, 5)
    strong = featured(what, (5.0 + 4 * (press - 5.0))[None], rate, 5)
    assert np.abs(weak[:40, 0]).max() < 1e-9
    late = slice(2000, None)
    assert np.allclose(weak[late], strong[late], rtol=0.1, atol=0.1)
    first = slice(52, 60)  # nothing is known of this person yet
    assert strong[first, 0].max() > 1.3 * weak[first, 0].max()


@pytest.mark.parametrize("size", [1e4, 1e16])
@pytest.mark.parametrize(("rate", "hop"), [(1000.0, 20), (100.0, 2), (50.0, 1)])
@pytest.mark.parametrize("lasting", [1, 3])
def test_own_units_hear_nothing_of_a_glitch_once_it_has_passed(size, rate, hop, lasting):
    times = np.arange(round(8 * rate)) / rate
    press = np.where(times > 1, 2 + np.sin(2 * np.pi * times), 0.0)[None]
    what = CausalWindows((0.04,), 0.05, np.ones(1), True)
    clean = featured(what, press, rate, hop)
    place = round(3 * rate)
    press[0, place : place + lasting] = size
    found = featured(what, press, rate, hop)
    after = slice(round(3.5 * rate) // hop, None)
    assert np.allclose(found[after], clean[after], rtol=0.5, atol=1e-3)


# Labels


def test_a_label_is_what_the_decoder_says_of_all_that_the_latency_lets_it_see(trained, three):
    demonstration, latency = three[2].demonstration, 0.1
    online = OnlineRecogniser(trained, latency, demonstration.channels, RATE)
    hop, lag = 5, online.budget.lag
    assert lag > 0
    _, codes, known = streamed(trained, demonstration, latency, [50], RATE)
    steps = known[hop // 2 :: hop]
    with np.errstate(divide="ignore"):
        logs = np.log(steps)
    for step in range(0, len(steps) - lag, 7):
        past = logs[: step + lag + 1]
        expected = decode(past, np.ones(len(past), dtype=bool), 0.02, trained.grammar)
        assert codes[step * hop + hop // 2] == expected[step]


def test_with_time_enough_labels_are_nearly_those_of_offline_recognition(trained, three):
    item = three[2]
    offline = trained.predict(item.demonstration).filtered
    _, codes, _ = streamed(trained, item.demonstration, 0.1, [20])
    assert np.mean(codes == offline) > 0.9


def test_devices_whose_clocks_differ_a_little_are_learnt_from_together():
    # Of 2.498 and of 2.502 samples a time step: two of one device, three of the other.
    slow, quick = (
        LabelledDemonstration(
            replace(demonstration, times=demonstration.times * 125 / rate), segments
        )
        for (demonstration, segments), rate in zip(
            synthetic_set(2, rate=125.0), (124.9, 125.1), strict=True
        )
    )
    one, other = (
        train(order, preset("fast")).live_models for order in ([slow, quick], [quick, slow])
    )
    for part, same in zip(one, other, strict=True):
        assert np.allclose(part.classifier.mean, same.classifier.mean, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", ["zeros", "huge", "tiny", "offset", "constant", "jump"])
def test_forces_that_break_careless_code_are_labelled_as_stated(trained, three, kind):
    like = three[2].demonstration
    noise = np.random.default_rng(0).standard_normal((300, len(like.channels)))
    signals = {
        "zeros": np.zeros_like(noise),
        "huge": 1e29 * noise,
        "tiny": 1e-300 * noise,
        "offset": 1e9 + 1e-6 * noise,
        "constant": np.full_like(noise, 1e30),
        "jump": np.where(np.arange(300)[:, None] > 150, 1e30, -1e-200) * np.ones(noise.shape[1]),
    }[kind]
    odd = replace(like, times=np.arange(300) / RATE, signals=signals)
    _, codes, known = streamed(trained, odd, 0.1, [33])
    assert np.all(codes != UNLABELLED)
    assert np.allclose(known.sum(axis=1), 1.0)
    expected = reference_labels(trained, odd, 0.1)
    assert np.array_equal(codes, expected.codes)


@pytest.mark.parametrize("value", [3.4e38, 1e300, np.nan])
def test_what_no_sensor_reads_counts_as_missing(trained, three, value):
    """Live and from the file, one such sample changes little and a second of them is unlabelled."""
    like = three[2].demonstration
    signals = like.signals.copy()
    signals[300] = value
    signals[500 : 500 + round(RATE)] = value
    odd = replace(like, signals=signals)
    times, codes, _ = streamed(trained, odd, 0.1, [33])
    lost = (times > like.times[500]) & (times < like.times[500] + 0.99)
    assert np.all(codes[lost] == UNLABELLED)
    assert np.all(codes[times < like.times[480]] != UNLABELLED)
    assert np.all(codes[times > like.times[500] + 1.2] != UNLABELLED)


def test_memory_stays_the_same(trained, three):
    demonstration = three[2].demonstration
    online = OnlineRecogniser(trained, 0.1, demonstration.channels, RATE)
    n, held = len(demonstration.times), []
    for turn in range(4):
        online.push(demonstration.times + turn * n / RATE, demonstration.signals)
        held.append(len(pickle.dumps(online)))
    assert held[-1] <= 1.01 * held[1]


# The recogniser


def test_a_file_keeps_what_follows_streams(trained, three, tmp_path):
    save_recogniser(trained, tmp_path / "r.skops")
    again = load_recogniser(tmp_path / "r.skops")
    assert [part.windows.look for part in again.live_models] == list(LOOKS)
    demonstration = three[2].demonstration
    for one, other in zip(
        streamed(trained, demonstration, 0.1, [50]),
        streamed(again, demonstration, 0.1, [50]),
        strict=True,
    ):
        assert np.array_equal(one, other)


def test_what_does_not_fit_is_refused(trained):
    with pytest.raises(InputError, match="latency"):
        finish(leave_one_out_live_job([], trained.settings, -1.0))
    with pytest.raises(InputError, match="needs two labelled ones"):
        finish(leave_one_out_live_job([], trained.settings, 0.1))
    part = trained.live_models[1]
    plain = part.plain() | {"usual": np.array([1.0, -1.0, 1.0, 1.0])}
    for wrong in (
        plain,
        part.plain() | {"windows": [2.0, 1.0]},
        part.plain() | {"look": np.nan},
        part.plain() | {"own": 1},
    ):
        with pytest.raises(ValueError, match="must|windows"):
            LiveModel.from_plain(wrong, 4, len(trained.actions))


def test_an_evaluation_as_a_stream_leaves_each_out_and_says_how_far_to_rely_on_it(three):
    evaluation = finish(leave_one_out_live_job(three, preset("fast"), 0.1, "foam"))
    pooled, each = evaluation.scores("filtered")
    assert len(each) == 3
    assert pooled.accuracy > 0.8
    assert pooled.coverage == 1.0
    assert "100 ms" in evaluation.remarks[0]
    assert 0 < evaluation.reliability.brier < 0.5
    assert evaluation.to_json()["reliability"]["ece"] < 0.5


def test_a_recording_that_is_there_twice_is_left_out_as_a_whole_as_a_stream(three, monkeypatch):
    old = three[0].demonstration
    twin = replace(old, name="twin", times=old.times + 5.0)
    moved = tuple(replace(s, start=s.start + 5, end=s.end + 5) for s in three[0].segments)
    trained_on = []

    def watched(labelled, settings):
        trained_on.append([item.demonstration.name for item in labelled])
        return training_job(labelled, settings)

    monkeypatch.setattr(cross_validation, "training_job", watched)
    items = [*three, LabelledDemonstration(twin, moved)]
    found = finish(leave_one_out_live_job(items, preset("fast"), 0.1))
    _, second, third = (item.demonstration.name for item in three)
    first = old.name
    without = [second, third]
    assert trained_on == [without, [first, third, "twin"], [first, second, "twin"]]
    assert [item.name for item in found.tested] == [first, second, third, "twin"]
    assert any("left out together" in remark for remark in found.remarks)
    with pytest.raises(InputError, match="is there twice"):
        finish(leave_one_out_live_job([*three, three[0]], preset("fast"), 0.1))


def test_probabilities_of_a_stream_are_calibrated_where_those_offline_are(three):
    plain = preset("fast").replace(stride=1)
    bare, calibrated = (train(three, plain.replace(calibrated=on)) for on in (False, True))
    assert {part.classifier.exponent for part in bare.live_models} == {1.0}
    (exponent,) = {part.classifier.exponent for part in calibrated.live_models}
    assert exponent != 1.0
    assert [part.windows.look for part in calibrated.live_models] == list(LOOKS)
    # Only how sure it is changes: what learns is the same.
    X = np.random.default_rng(0).standard_normal((50, bare.live_models[0].windows.width))
    for one, other in zip(bare.live_models, calibrated.live_models, strict=True):
        known = one.classifier.predict_proba(X)
        assert np.allclose(other.classifier.predict_proba(X), sharpen(known, exponent))


def test_a_recogniser_from_before_says_what_to_do(trained, three):
    old = replace(trained, live_models=())
    with pytest.raises(InputError, match="train it again"):
        OnlineRecogniser(old, 0.1, three[2].demonstration.channels)
    plain = replace(old, settings=trained.settings.replace(decoder="filters"))
    with pytest.raises(InputError, match="fast, best or paper"):
        OnlineRecogniser(plain, 0.1, three[2].demonstration.channels)


def test_more_latency_looks_farther_ahead_and_what_is_promised_is_what_is_done(trained):
    looks_ahead = []
    for latency in (0.0, 0.05, 0.1, 0.3, 3.0):
        promise = latency_budget(trained, latency)
        looks_ahead.append(promise.ahead)
        assert promise.ahead + promise.filters <= latency
        assert promise.early == ()
    assert looks_ahead == sorted(looks_ahead)
    assert looks_ahead[0] == 0.0
    assert looks_ahead[-1] == pytest.approx(LOOKS[-1], abs=0.5 / RATE)
