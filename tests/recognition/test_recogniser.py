"""The recogniser: predictions, what each filter leads to, and what it remarks."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from factories import BAYES_SETTINGS, blas_threads, synthetic_demonstration
from threadpoolctl import threadpool_limits

from forcelab.errors import InputError
from forcelab.labels import UNLABELLED, to_codes
from forcelab.recognition import filters
from forcelab.recognition import recogniser as recogniser_module
from forcelab.recognition.examples import prepare_examples
from forcelab.recognition.recogniser import Prediction, Recogniser
from forcelab.recognition.results import empty_prediction_remarks
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train
from forcelab.runtime import one_blas_thread

pytestmark = pytest.mark.usefixtures("small_fits")

OFF = Settings(max_scale=64.0, classifier="naive-bayes", threshold=None, median=None, drop=None)
#: Strong enough to change something on these short, well separated recordings.
ON = {"threshold": 0.999, "median": 12, "drop": 0.7}


class Oracle:
    """A classifier that says what it was told to, sample after sample."""

    def __init__(self, codes, confidence=None, actions=3):
        self.classes_ = np.arange(actions)
        self.codes = np.asarray(codes)
        self.sure = np.ones(len(codes)) if confidence is None else np.asarray(confidence)
        self.calls = []
        self.next_row = 0

    def _next(self, X):
        first, self.next_row = self.next_row, self.next_row + len(X)
        return slice(first, self.next_row)

    def predict(self, X):
        self.calls.append(("predict", len(X)))
        return self.codes[self._next(X)]

    def predict_proba(self, X):
        self.calls.append(("predict_proba", len(X)))
        block = self._next(X)
        rest = (1 - self.sure[block]) / (len(self.classes_) - 1)
        probabilities = np.repeat(rest[:, np.newaxis], len(self.classes_), axis=1)
        probabilities[np.arange(len(X)), self.codes[block]] = self.sure[block]
        return probabilities


def oracle(codes, confidence=None, shortest=None, **settings):
    """A recogniser that says what it was told to, and a demonstration of as many samples."""
    n = len(codes)
    demonstration = synthetic_demonstration(1, rate=100.0)[0]
    demonstration = dataclasses.replace(
        demonstration, times=demonstration.times[:n], signals=demonstration.signals[:n]
    )
    recogniser = Recogniser(
        settings=OFF.replace(**settings),
        rate=100.0,
        channels=("tangential 1", "tangential 2", "normal 1", "normal 2"),
        actions=("grab", "hold", "still"),
        shortest=shortest or {},
        classifier=Oracle(codes, confidence),
    )
    return recogniser, demonstration


@pytest.fixture(scope="module")
def bayes(three):
    return train(three[:2], OFF)


# --- raw codes and probabilities ----------------------------------------------------------------


def test_a_recogniser_finds_the_actions_of_a_demonstration_it_has_not_seen(bayes, three):
    unseen, segments = three[2].demonstration, three[2].segments
    prediction = bayes.predict(unseen)
    human = to_codes(segments, unseen.times, prediction.actions)
    assert prediction.raw.shape == (len(unseen.times),)
    assert (prediction.raw >= 0).all()
    assert np.mean(prediction.raw[human >= 0] == human[human >= 0]) > 0.6
    assert set(prediction.seconds) == {"predict", "filter"}


def test_without_a_threshold_probabilities_are_never_computed():
    recogniser, demonstration = oracle([0, 1, 2, 1] * 25, median=3, drop=0.1)
    prediction = recogniser.predict(demonstration)
    assert {call for call, _ in recogniser.classifier.calls} == {"predict"}
    assert prediction.probabilities is None
    assert prediction.raw.tolist() == [0, 1, 2, 1] * 25


def test_with_a_threshold_every_sample_is_classified_once():
    recogniser, demonstration = oracle([0, 1, 2, 1] * 25, threshold=0.5)
    prediction = recogniser.predict(demonstration)
    assert recogniser.classifier.calls == [("predict_proba", 100)]
    assert prediction.raw.tolist() == [0, 1, 2, 1] * 25
    np.testing.assert_array_equal(prediction.probabilities, np.eye(3)[prediction.raw])


def test_an_action_without_a_training_sample_has_the_probability_zero():
    recogniser, demonstration = oracle([0, 1] * 30, confidence=[0.75] * 60, threshold=0.5)
    recogniser.classifier.classes_ = np.array([0, 2])
    prediction = recogniser.predict(demonstration)
    assert prediction.raw.tolist() == [0, 2] * 30
    assert prediction.probabilities[:, 1].tolist() == [0.0] * 60
    np.testing.assert_array_equal(prediction.probabilities.sum(axis=1), 1.0)


@pytest.mark.parametrize("threshold", [None, 0.9])
@pytest.mark.parametrize("block", [1, 7, 64, 99])
def test_recognition_in_blocks_gives_what_recognition_at_once_gives(
    bayes, three, monkeypatch, threshold, block
):
    recogniser = dataclasses.replace(bayes, settings=OFF.replace(threshold=threshold))
    full = recogniser.predict(three[2].demonstration)
    monkeypatch.setattr(recogniser_module, "BLOCK", block)
    parts = recogniser.predict(three[2].demonstration)
    np.testing.assert_array_equal(parts.raw, full.raw)
    np.testing.assert_array_equal(parts.filtered, full.filtered)
    if threshold is not None:
        np.testing.assert_allclose(parts.probabilities, full.probabilities, atol=1e-12)


def test_blas_has_its_threads_back_where_a_transform_outlasts_a_recognition():
    class Meanwhile(Oracle):
        """As it is asked, a transform begins in another thread."""

        def predict(self, X):
            transform.__enter__()
            return super().predict(X)

    transform = one_blas_thread()
    recogniser, demonstration = oracle([0, 1, 2])
    recogniser = dataclasses.replace(recogniser, classifier=Meanwhile([0, 1, 2]))
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        recogniser.predict(demonstration)
        assert set(blas_threads()) == {1}
        transform.__exit__(None, None, None)
        assert blas_threads() == before


# --- filters ------------------------------------------------------------------------------------


def test_without_filters_the_filtered_codes_are_the_raw_ones(bayes, three):
    prediction = bayes.predict(three[2].demonstration)
    np.testing.assert_array_equal(prediction.filtered, prediction.raw)
    assert prediction.filtered is not prediction.raw


@pytest.mark.parametrize("switched_on", [(), *[(n,) for n in ON], ("threshold", "drop"), tuple(ON)])
def test_filters_do_what_they_say_in_the_papers_order_alone_or_together(bayes, three, switched_on):
    settings = OFF.replace(**{name: ON[name] for name in switched_on})
    prediction = dataclasses.replace(bayes, settings=settings).predict(three[2].demonstration)
    codes = prediction.raw
    for name in switched_on:
        before = codes
        if name == "threshold":
            codes = filters.threshold(codes, prediction.probabilities, ON[name])
        elif name == "median":
            codes = filters.median(codes, ON[name])
        else:
            shortest = {i: bayes.shortest[a] for i, a in enumerate(prediction.actions)}
            codes = filters.drop_short(codes, prediction.times, shortest, ON[name])
        assert not np.array_equal(before, codes)
        np.testing.assert_array_equal(prediction.stages.get(name, codes), codes)
    stages = [name for name in switched_on if name != "drop"]
    assert list(prediction.stages) == ["raw", *stages, "filtered"]
    np.testing.assert_array_equal(prediction.filtered, codes)
    np.testing.assert_array_equal(prediction.raw, bayes.predict(three[2].demonstration).raw)


def test_the_threshold_leaves_unlabelled_what_is_less_probable():
    confidence = np.where(np.arange(60) % 3 == 0, 0.79, 0.8)
    recogniser, demonstration = oracle([1] * 60, confidence=confidence, threshold=0.8)
    expected = [UNLABELLED, 1, 1] * 20
    assert recogniser.predict(demonstration).filtered.tolist() == expected


def test_dropping_measures_against_the_shortest_training_segment_of_the_same_action():
    codes = np.repeat([0, 1, 2, 1], [10, 10, 20, 9])
    recogniser, demonstration = oracle(codes, shortest={"grab": 0.1, "hold": 0.2}, drop=0.475)
    expected = np.repeat([0, 1, 2, UNLABELLED], [10, 10, 20, 9])
    assert recogniser.predict(demonstration).filtered.tolist() == expected.tolist()


def test_asking_how_certain_it_is_changes_no_prediction(monkeypatch):
    monkeypatch.setattr(Oracle, "_next", lambda _, X: slice(len(X)))
    # As rounding and ties may do: what it says is not what it holds for the most probable.
    recogniser, demonstration = oracle(np.repeat([0, 1, 2], 20), np.full(60, 0.2), median=8)
    plain = recogniser.predict(demonstration)
    traced = recogniser.predict(demonstration, probability_trace=True)
    assert plain.probability_trace is None
    assert traced.probability_trace.actions
    np.testing.assert_array_equal(traced.raw, plain.raw)
    np.testing.assert_array_equal(traced.filtered, plain.filtered)


def test_the_segments_are_those_of_the_filtered_codes():
    recogniser, demonstration = oracle(np.repeat([0, 1, 0], [30, 3, 30]), median=8)
    segments = recogniser.predict(demonstration).segments
    assert [(s.start, round(s.end, 9), s.action) for s in segments] == [(0.0, 0.63, "grab")]


# --- gaps and channels --------------------------------------------------------------------------


@pytest.mark.parametrize("switched_on", [{}, ON, {"median": 200}])
def test_nothing_is_recognised_in_a_gap(bayes, three, switched_on):
    old = three[2].demonstration
    times = old.times + np.where(np.arange(len(old.times)) >= 150, 1.0, 0.0)
    gapped = dataclasses.replace(old, times=times)
    recogniser = dataclasses.replace(bayes, settings=OFF.replace(**switched_on))
    prediction = recogniser.predict(gapped)
    inside = (prediction.times > 1.495) & (prediction.times < 2.495)
    assert inside.sum() == 100
    assert (prediction.raw[inside] == UNLABELLED).all()
    assert (prediction.filtered[inside] == UNLABELLED).all()
    assert (prediction.raw[~inside] >= 0).all()
    ends = [s.end for s in prediction.segments if s.start < 1.5]
    assert max(ends) <= 1.51


def test_a_recording_of_another_rate_is_recognised_on_the_recognisers_grid(bayes, three):
    fast, segments = synthetic_demonstration(3, rate=300.0)
    prediction = bayes.predict(fast)
    np.testing.assert_allclose(np.diff(prediction.times), 0.01)
    human = to_codes(segments, prediction.times, prediction.actions)
    assert np.mean(prediction.raw[human >= 0] == human[human >= 0]) > 0.6


def test_channels_may_come_in_another_order(bayes, three):
    old = three[2].demonstration
    turned = dataclasses.replace(old, signals=old.signals[:, ::-1], channels=old.channels[::-1])
    np.testing.assert_array_equal(bayes.predict(turned).raw, bayes.predict(old).raw)


def test_a_missing_channel_is_named(bayes, three):
    old = three[2].demonstration
    lame = dataclasses.replace(old, signals=old.signals[:, :5], channels=old.channels[:5])
    with pytest.raises(InputError, match=r"no recognition channel '(tangential|normal) 2'"):
        bayes.predict(lame)


def test_examples_of_other_channels_are_refused_by_name(bayes, three):
    other = prepare_examples(three[2], OFF.replace(channels=("normal 1",)))
    with pytest.raises(InputError, match="'foam 03' has the channels normal 1; the recogniser"):
        bayes.predict_examples(other)


def test_gaps_have_no_certainty(three):
    from dataclasses import replace

    demonstration = three[2].demonstration
    keep = np.abs(demonstration.times - 2.0) > 0.3
    gappy = replace(
        demonstration, times=demonstration.times[keep], signals=demonstration.signals[keep]
    )
    prediction = train(three[:2], BAYES_SETTINGS).predict(gappy, probability_trace=True)
    inside = np.abs(prediction.probability_trace.times - 2.0) < 0.25
    assert inside.any()
    assert (prediction.probability_trace.values[inside] == 0).all()
    outside = np.abs(prediction.probability_trace.times - 2.0) > 0.32
    # Probabilities add up to one, in 255ths that are rounded each.
    assert (
        np.abs(prediction.probability_trace.values[outside].sum(axis=1, dtype=int) - 255).max() <= 2
    )


N = 100
NOTHING = Settings(threshold=None, median=None, drop=None)


def reviewed(left, **stages):
    """A demonstration of which so many steps are left after the filters, and after each stage."""

    def codes(number):
        found = np.full(N, UNLABELLED)
        found[:number] = 0
        return found

    stages = {name: codes(n) for name, n in {"raw": N, **stages, "filtered": left}.items()}
    return Prediction(np.arange(N) / 100, ("grab",), stages, None, {})


@pytest.mark.parametrize(
    ("stages", "taken"),
    [
        ({"threshold": 2, "median": 2}, "less probable than 0.8 (threshold)"),
        ({"threshold": 90, "median": 80}, "lasts less than 0.125 of the shortest segment"),
    ],
)
def test_the_filter_that_left_nothing_is_named_with_the_scales_in_seconds(stages, taken):
    (remark,) = empty_prediction_remarks([reviewed(1, **stages)], Settings(), 20_000.0)
    assert remark.startswith("The filters left 1.0 % of the predicted time")
    assert taken in remark
    assert "at 20000 Hz the scales are 0.1 to 51.2 ms" in remark
    assert "or another rate, such as 1000 Hz; or train" in remark


def test_the_usual_rate_is_not_advised_where_it_is_that():
    (remark,) = empty_prediction_remarks([reviewed(0, threshold=0)], Settings(), 1000.0)
    assert "the scales are 2 to 1,020 ms, so try others or another rate; or train" in remark


def test_windows_have_no_scales_to_blame():
    (remark,) = empty_prediction_remarks(
        [reviewed(0, threshold=0)], Settings(features="windows"), 50.0
    )
    assert "scales" not in remark


@pytest.mark.parametrize(
    ("left", "settings"), [(50, Settings()), (0, NOTHING), (0, Settings(decoder="semi-markov"))]
)
def test_no_remark_where_much_is_left_or_no_filter_took_it(left, settings):
    assert empty_prediction_remarks([reviewed(left, threshold=left)], settings, 1000.0) == ()
