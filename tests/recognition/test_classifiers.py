from __future__ import annotations

import os
import subprocess
import sys
import warnings
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPClassifier
from threadpoolctl import threadpool_limits

from forcelab.errors import InputError
from forcelab.recognition.classifiers import REGISTRY, fit_classifier
from forcelab.recognition.ensemble import FitOptions

pytestmark = pytest.mark.usefixtures("small_fits")


def blobs(counts, features=3, distance=4.0, seed=0):
    """Normal clouds around corners that lie `distance` standard deviations apart."""
    random = np.random.default_rng(seed)
    y = np.repeat(np.arange(len(counts)), counts)
    X = random.normal(size=(len(y), features))
    X[np.arange(len(y)), y % features] += distance * (1 + y // features)
    order = random.permutation(len(y))
    return X[order], y[order]


def fitted(name, X, y, seed=0, probabilities=True):
    *_, last = fit_classifier(name, X, y, seed, probabilities)
    return last.classifier


def fitted_by_sklearn(X, y, seed, **parameters):
    with threadpool_limits(1), warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        return MLPClassifier(random_state=seed, **parameters).fit(X, y)


# --- the MLP, epoch by epoch --------------------------------------------------------------------


def test_the_first_epoch_is_that_of_scikit_learn_to_the_bit():
    X, y = blobs([150, 170, 130])
    epoch = next(fit_classifier("mlp", X, y, 7, True))
    reference = fitted_by_sklearn(X, y, 7, max_iter=1)
    assert epoch.loss == reference.loss_
    for ours, theirs in zip(epoch.classifier.coefs_, reference.coefs_, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    np.testing.assert_array_equal(epoch.classifier.predict_proba(X), reference.predict_proba(X))


def test_a_whole_fit_ends_where_that_of_scikit_learn_ends():
    # Batches differ from the second epoch on: the same algorithm, other shuffles.
    X, y = blobs([300, 300], features=6)
    *_, last = fit_classifier("mlp", X, y, 5, True)
    reference = fitted_by_sklearn(X, y, 5)
    assert 20 < last.done < last.total == reference.max_iter
    assert last.done == pytest.approx(reference.n_iter_, rel=0.1)
    assert last.loss == pytest.approx(reference.loss_, rel=0.1)
    assert np.mean(last.classifier.predict(X) == reference.predict(X)) > 0.995


def test_the_fit_stops_when_the_loss_has_not_fallen_for_more_than_ten_epochs():
    X, y = blobs([200, 200], features=2, distance=0.2)
    losses = [epoch.loss for epoch in fit_classifier("mlp", X, y, 0, True)]
    best, stale, stops = np.inf, 0, []
    for loss in losses:
        stale = 0 if loss <= best - 1e-4 else stale + 1
        best = min(best, loss)
        stops.append(stale == 11)
    assert len(losses) < 200
    assert [i for i, stop in enumerate(stops) if stop] == [len(losses) - 1]


def test_a_fit_that_does_not_converge_ends_after_as_many_epochs_as_announced():
    X, y = blobs([40, 40], distance=1.0)
    epochs = list(fit_classifier("mlp", X, y, 0, True))
    assert [epoch.done for epoch in epochs] == list(range(1, 201))
    assert {epoch.total for epoch in epochs} == {200}


# --- seeds --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", REGISTRY)
def test_one_seed_gives_one_classifier(name):
    X, y = blobs([30, 40, 25], distance=1.0)
    found = []
    for _ in range(2):
        *_, last = islice(fit_classifier(name, X, y, 3, True), 9 if name == "mlp" else None)
        found.append(last.classifier.predict_proba(X))
    np.testing.assert_array_equal(*found)


def test_another_seed_gives_another_mlp():
    X, y = blobs([60, 60])
    first, second = (next(fit_classifier("mlp", X, y, seed, True)) for seed in (1, 2))
    assert not np.array_equal(first.classifier.coefs_[0], second.classifier.coefs_[0])


def test_a_fit_neither_uses_nor_moves_the_random_numbers_of_others():
    X, y = blobs([40, 40])
    np.random.seed(0)  # noqa: NPY002 - the very state that must not matter
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    for name in REGISTRY:
        next(fit_classifier(name, X, y, 0, True))
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


# --- all of them --------------------------------------------------------------------------------


@pytest.mark.parametrize("name", REGISTRY)
@pytest.mark.parametrize("codes", [(0, 1), (0, 2, 5)])
def test_every_classifier_learns_what_can_be_told_apart(name, codes):
    X, y = blobs([90] * len(codes), distance=6.0)
    test_X, test_y = blobs([50] * len(codes), distance=6.0, seed=1)
    classifier = fitted(name, X, np.array(codes)[y])
    assert classifier.classes_.tolist() == list(codes)
    assert np.mean(classifier.predict(test_X) == np.array(codes)[test_y]) > 0.97
    probabilities = classifier.predict_proba(test_X)
    assert probabilities.shape == (len(test_X), len(codes))
    assert probabilities.min() >= 0
    np.testing.assert_allclose(probabilities.sum(axis=1), 1.0, rtol=1e-12)
    most_probable = np.array(codes)[probabilities.argmax(axis=1)]
    np.testing.assert_array_equal(most_probable, classifier.predict(test_X))


@pytest.mark.parametrize("name", REGISTRY)
def test_a_feature_that_never_changes_does_no_harm(name):
    X, y = blobs([60, 60], distance=6.0)
    X[:, 2] = 5.0
    classifier = fitted(name, X, y)
    assert np.mean(classifier.predict(X) == y) > 0.97
    assert np.isfinite(classifier.predict_proba(X)).all()


@pytest.mark.parametrize("name", ["naive-bayes", "trees-mlp"])
def test_features_that_all_never_change_are_refused_in_a_sentence(name):
    with pytest.raises(InputError, match="never change"):
        list(fit_classifier(name, np.full((40, 3), 2.5), np.arange(40) % 2, 0, True))


@pytest.mark.parametrize("name", ["naive-bayes", "trees-mlp"])
@pytest.mark.parametrize("samples", [0, 30])
def test_fewer_than_two_actions_are_refused_in_a_sentence(name, samples):
    X = np.random.default_rng(0).normal(size=(samples, 3))
    with pytest.raises(InputError, match="at least two actions"):
        list(fit_classifier(name, X, np.full(samples, 4), 0, True))


@pytest.mark.parametrize("name", REGISTRY)
def test_units_of_the_features_do_not_matter_where_they_are_standardised(name):
    X, y = blobs([90] * 3, distance=6.0)
    test_X, test_y = blobs([50] * 3, distance=6.0, seed=1)
    units = np.array([1e-4, 1.0, 1e4])  # such as newtons beside newtons per second
    *_, last = fit_classifier(name, X * units, y, 0, True, FitOptions(standardised=True))
    assert np.mean(last.classifier.predict(test_X * units) == test_y) > 0.97


@pytest.mark.parametrize("name", REGISTRY)
def test_every_classifier_can_be_calibrated_where_features_are_standardised(name):
    # Each demonstration has its own offset: sure within one, wrong about the next.
    random = np.random.default_rng(3)
    groups = np.repeat(np.arange(8), 30)
    y = np.tile(np.repeat([0, 1], 15), 8)
    X = (y + 1.2 * random.normal(size=8)[groups])[:, None] + 0.05 * random.normal(size=(240, 2))
    exponents = []
    for calibrated in (False, True):
        options = FitOptions(groups, calibrated=calibrated, standardised=True)
        *_, last = fit_classifier(name, X, y, 0, True, options)
        exponents.append(last.classifier.exponent)
    assert exponents[0] == 1.0
    assert exponents[1] != 1.0


@pytest.mark.parametrize("name", REGISTRY)
def test_rare_actions_count_as_much_in_every_classifier(name):
    random = np.random.default_rng(0)
    y = np.repeat([0, 1], [400, 25])
    X = random.normal(size=(425, 4))
    X[:, 0] += y
    rare = random.normal(size=(400, 4))
    rare[:, 0] += 1.0
    shares = []
    for balanced in (False, True):
        options = FitOptions(balanced=balanced, standardised=True)
        *_, last = fit_classifier(name, X, y, 0, True, options)
        shares.append(np.mean(last.classifier.predict(rare)))
    assert shares[1] > shares[0]


def test_fewer_samples_than_neighbours_are_refused_in_a_sentence():
    X, y = blobs([2, 2])
    with pytest.raises(InputError, match=r"4 labelled samples.* 5 neighbours"):
        list(fit_classifier("nearest-neighbours", X, y, 0, False))
    assert fitted("nearest-neighbours", *blobs([2, 3])).predict(X).shape == (4,)


# --- the SVM's probabilities --------------------------------------------------------------------


def test_an_svm_asked_for_no_probabilities_is_not_calibrated():
    X, y = blobs([30, 1])
    assert not hasattr(fitted("svm", X, y, probabilities=False), "predict_proba")


@pytest.mark.parametrize("rare", [2, 3, 4, 5, 6])
def test_an_action_of_few_samples_still_gets_a_probability(rare):
    X, y = blobs([40, 50, rare], distance=8.0)
    probabilities = fitted("svm", X, y).predict_proba(X)
    assert probabilities.shape == (len(X), 3)
    np.testing.assert_allclose(probabilities.sum(axis=1), 1.0, rtol=1e-12)


def test_an_action_of_a_single_sample_is_too_few_for_probabilities():
    X, y = blobs([40, 50, 1])
    with pytest.raises(InputError, match=r"single training sample.*threshold off"):
        list(fit_classifier("svm", X, y, 0, True))


#: A classifier that another module registers: trained, kept in a file, read again, and offered.
REGISTERED = """
import sys

from forcelab.recognition import classifiers

def make(y, seed, probabilities):
    from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    return LinearDiscriminantAnalysis()

kind = classifiers.ClassifierKind(
    "Discriminant", classifiers.fit_in_one_step(make), "LinearDiscriminantAnalysis", random=False
)
classifiers.REGISTRY = {**classifiers.REGISTRY, "discriminant": kind}

import numpy as np
from factories import labelled_set
from forcelab.cli import main
from forcelab.recognition.settings import FIELDS
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import load_recogniser, save_recogniser
from forcelab.recognition.training import train

three = labelled_set(3, rate=100.0)
made = train(three[:2], preset("paper").replace(classifier="discriminant", max_scale=64.0))
save_recogniser(made, sys.argv[1])
unseen = three[2].demonstration
loaded = load_recogniser(sys.argv[1])
np.testing.assert_array_equal(loaded.predict(unseen).raw, made.predict(unseen).raw)
(options,) = [dict(field.options) for field in FIELDS if field.name == "classifier"]
assert options["discriminant"] == "Discriminant"
main(["train", "--help"])
"""


def test_of_standardised_features_a_single_sample_is_enough():
    X, y = blobs([40, 50, 1], distance=8.0)
    *_, last = fit_classifier("svm", X, y, 0, True, FitOptions(standardised=True))
    assert last.classifier.predict_proba(X).shape == (91, 3)


def test_a_new_classifier_is_one_entry_of_the_registry(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", REGISTERED, tmp_path / "lda.skops"],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "discriminant; or your own as MODULE:FUNCTION (mlp)" in " ".join(done.stdout.split())
