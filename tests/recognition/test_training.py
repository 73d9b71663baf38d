from __future__ import annotations

import multiprocessing
import threading
from dataclasses import replace

import numpy as np
import pytest
from factories import SYNTHETIC_ACTIONS, labelled_set, synthetic_demonstration

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.recognition import ensemble, label_noise, live_model
from forcelab.recognition import training as training_module
from forcelab.recognition.ensemble import FitProgress
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import fit_examples, prepare_all, train, training_job

pytestmark = pytest.mark.usefixtures("small_fits")

SMALL = Settings(max_scale=64.0, classifier="naive-bayes", threshold=None, median=None, drop=None)
SMALL_MLP = SMALL.replace(classifier="mlp", stride=10)


@pytest.fixture
def fitted_to(monkeypatch):
    """Collects what the classifier is fitted to, and fits nothing."""
    arguments = {}

    def fitting(name, X, y, seed, probabilities, care):
        arguments.update(name=name, X=X, y=y, seed=seed, probabilities=probabilities, care=care)
        yield FitProgress(1, 1, "fit")

    monkeypatch.setattr(training_module, "fit_classifier", fitting)
    return arguments


# --- progress -----------------------------------------------------------------------------------


@pytest.mark.parametrize("anew", [0, 3])
def test_progress_tells_features_first_and_then_every_epoch_with_a_falling_loss(
    three, monkeypatch, anew
):
    if anew:  # looked at, and then again for what is learnt from
        monkeypatch.setattr(training_module, "ROOM", 0)
    progress = []
    finish(training_job(three, SMALL_MLP), progress.append)
    stages = [step.text for step in progress]
    first = 3 + anew
    assert stages == ["features"] * first + ["fit"] * (len(stages) - first)
    counted = [(step.done, step.total) for step in progress[:first]]
    assert counted == (1 + anew // 3) * [(1, 3), (2, 3), (3, 3)]
    fit = progress[first:]
    assert [step.done for step in fit] == list(range(1, len(fit) + 1))
    assert fit[-1].loss < 0.3 * fit[0].loss


def test_a_training_that_is_stopped_leaves_nothing_running(three):
    threads, children = set(threading.enumerate()), set(multiprocessing.active_children())
    job = training_job(three, SMALL_MLP)
    while next(job).text != "fit":
        pass
    next(job)
    job.close()
    assert set(threading.enumerate()) == threads
    assert set(multiprocessing.active_children()) <= children
    with pytest.raises(StopIteration):
        next(job)


# --- what the fit depends on, and what not ------------------------------------------------------


@pytest.mark.parametrize("settings", [SMALL, SMALL_MLP], ids=["naive-bayes", "mlp"])
def test_unlabelled_samples_are_never_trained_on(three, settings):
    clean = finish(prepare_all(three, settings))
    poisoned = []
    for examples in clean:
        features = examples.features.copy()
        features[examples.codes(SYNTHETIC_ACTIONS) < 0] = 1e100
        poisoned.append(replace(examples, features=features))
    assert any(not np.array_equal(a.features, b.features) for a, b in zip(clean, poisoned))  # noqa: B905
    first, second = (finish(fit_examples(some, settings)) for some in (clean, poisoned))
    for examples in clean:
        np.testing.assert_array_equal(
            first.predict_examples(examples).raw, second.predict_examples(examples).raw
        )


def test_every_stride_th_sample_counted_from_each_start_is_trained_on(three, fitted_to):
    train(three, SMALL.replace(stride=7, seed=5))
    X, y = [], []
    for item in three:
        examples = prepare_examples(item, SMALL)
        codes = examples.codes(SYNTHETIC_ACTIONS)
        for i in range(0, len(codes), 7):
            if codes[i] >= 0:
                X.append(examples.features[i])
                y.append(codes[i])
    np.testing.assert_array_equal(fitted_to["X"], X)
    np.testing.assert_array_equal(fitted_to["y"], y)
    assert (fitted_to["name"], fitted_to["seed"]) == ("naive-bayes", 5)


def test_of_too_many_samples_only_those_that_are_learnt_from_are_gathered(
    three, fitted_to, monkeypatch
):
    settings = SMALL.replace(classifier="extra-trees")
    examples = finish(prepare_all(three, settings))
    finish(fit_examples(examples, settings))
    X, y = fitted_to["X"], fitted_to["y"]
    groups = fitted_to["care"].groups
    assert len(X) == len(y) == len(groups)
    monkeypatch.setattr(ensemble, "MOST", 100)
    finish(fit_examples(examples, settings))
    some = ensemble.thin(y)
    assert len(some) < len(y) / 2
    np.testing.assert_array_equal(fitted_to["X"], X[some])
    np.testing.assert_array_equal(fitted_to["y"], y[some])
    np.testing.assert_array_equal(fitted_to["care"].groups, groups[some])


def test_training_without_room_holds_the_features_of_one_demonstration_at_a_time(
    monkeypatch, peak_memory
):
    monkeypatch.setattr(training_module, "ROOM", 0)
    monkeypatch.setattr(label_noise, "TREES", 2)
    monkeypatch.setattr(live_model, "LOOKS", live_model.LOOKS[:1])
    for module in (ensemble, label_noise):
        monkeypatch.setattr(module, "MOST", 200)
    items = labelled_set(14, rate=100.0)
    settings = preset("best").replace(step=None)
    train(items[:2], settings)  # what is loaded on the way
    sizes = [prepare_examples(item, settings).features.nbytes for item in items]
    _, peak = peak_memory(lambda: train(items, settings))
    assert peak < 0.4 * sum(sizes)


def test_training_learns_what_a_fit_to_kept_features_learns(three, monkeypatch):
    examples = finish(prepare_all(three, preset("best")))
    fitted = finish(fit_examples(examples, preset("best"))).predict_examples(examples[0])
    for room in (0, 1):  # for none, and for those of the first
        monkeypatch.setattr(training_module, "ROOM", room)
        unkept = finish(prepare_all(three, preset("best"), room))
        assert [hasattr(example, "features") for example in unkept] == [room == 1, False, False]
        trained = train(three, preset("best"))
        found = trained.predict_examples(examples[0])
        np.testing.assert_array_equal(fitted.probabilities, found.probabilities)
        np.testing.assert_array_equal(fitted.filtered, found.filtered)
        assert len(trained.live_models) == 3


@pytest.mark.parametrize("threshold", [None, 0.8])
def test_probabilities_are_prepared_only_if_a_filter_needs_them(three, fitted_to, threshold):
    train(three[:1], SMALL.replace(threshold=threshold))
    assert fitted_to["probabilities"] is (threshold is not None)


def test_the_shortest_segment_of_each_action_is_remembered(three):
    recogniser = train(three, SMALL)
    for action in SYNTHETIC_ACTIONS:
        lengths = [s.duration for item in three for s in item.segments if s.action == action]
        # To the sample: segments are measured on the grid, as they are scored.
        assert recogniser.shortest[action] == pytest.approx(min(lengths), abs=1 / recogniser.rate)


def test_lost_samples_cut_no_shortest_segment(three):
    whole = train(three, SMALL).shortest
    lossy = []
    for item in three:
        times = item.demonstration.times
        lost = np.zeros(len(times), dtype=bool)
        for segment in item.segments:  # 0.2 s, soon after each begins
            first = np.searchsorted(times, segment.start) + 3
            lost[first : first + 20] = True
        some = replace(
            item.demonstration, times=times[~lost], signals=item.demonstration.signals[~lost]
        )
        lossy.append(replace(item, demonstration=some))
    assert train(lossy, SMALL).shortest == pytest.approx(whole, abs=0.011)


def test_demonstrations_without_labels_take_no_part(three):
    bare = LabelledDemonstration(synthetic_demonstration(8, rate=100.0)[0])
    with_bare, without = train([bare, *three], SMALL), train(three, SMALL)
    assert with_bare.trained_on == without.trained_on == tuple(i.demonstration.id for i in three)
    np.testing.assert_array_equal(with_bare.classifier.theta_, without.classifier.theta_)


def test_recordings_of_two_rates_are_trained_on_one_grid(fitted_to):
    items = [
        LabelledDemonstration(*synthetic_demonstration(1, rate=100.0)),
        LabelledDemonstration(*synthetic_demonstration(2, rate=100.0)),
        LabelledDemonstration(*synthetic_demonstration(3, rate=400.0)),
    ]
    recogniser = train(items, SMALL)
    assert recogniser.rate == pytest.approx(100.0)
    seconds = sum(segment.duration for item in items for segment in item.segments)
    assert len(fitted_to["y"]) == pytest.approx(100.0 * seconds, rel=0.02)


# --- refusals -----------------------------------------------------------------------------------


def test_training_without_a_label_is_refused_in_a_sentence(three):
    bare = [LabelledDemonstration(item.demonstration) for item in three]
    with pytest.raises(InputError, match="Nothing is labelled yet"):
        train(bare, SMALL)
    with pytest.raises(InputError, match="Nothing is labelled yet"):
        train([], SMALL)


def test_segments_that_hold_no_sample_are_no_labels(three):
    beyond = (Segment(1000.0, 1001.0, "grab"), Segment(1001.0, 1002.0, "hold"))
    with pytest.raises(InputError, match="samples of two actions"):
        train([LabelledDemonstration(three[0].demonstration, beyond)], SMALL)
