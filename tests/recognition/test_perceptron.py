from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from sklearn.neural_network import MLPClassifier
from threadpoolctl import threadpool_limits

from forcelab.jobs import finish
from forcelab.recognition import perceptron
from forcelab.recognition.ensemble import FitOptions, fit_ensemble
from forcelab.recognition.perceptron import Perceptron, fit_perceptron, held_out_epochs


def demonstrations(count=6, each=60, offset=0.8, seed=0):
    """Two actions in features that each demonstration has an offset of its own in."""
    random = np.random.default_rng(seed)
    groups = np.repeat(np.arange(count), each)
    y = np.tile(np.repeat([0, 1], each // 2), count)
    X = 0.3 * random.normal(size=(len(y), 8)) + offset * random.normal(size=(count, 8))[groups]
    X[:, 0] += 2.0 * y
    return X.astype(np.float32), y, groups


def parts_of(groups):
    return [(np.flatnonzero(groups % 3 != i), np.flatnonzero(groups % 3 == i)) for i in range(3)]


@pytest.mark.parametrize("actions", [2, 3])
def test_arrays_answer_as_scikit_learn_does_for_clipped_features(actions):
    random = np.random.default_rng(0)
    X, y = 3.0 * random.normal(size=(90, 4)), np.arange(90) % actions
    clipped = np.clip(X, -2.0, 2.0)
    with threadpool_limits(1):
        mlp = MLPClassifier((7,), random_state=0).partial_fit(clipped, y, classes=np.unique(y))
        expected = mlp.predict_proba(clipped)
    found = Perceptron.from_sklearn(mlp, 2.0)
    np.testing.assert_allclose(found.probabilities(X), expected, atol=1e-9)
    again = Perceptron.from_plain(found.plain(), 4, actions)
    np.testing.assert_array_equal(again.probabilities(X), found.probabilities(X))


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("inner", lambda a: a[:-1]),
        ("inner", lambda a: a * np.nan),
        ("inner", lambda a: a.astype(np.float32)),
        ("bias", lambda a: a[:0]),
        ("bias", lambda a: a[1:]),
        ("outer", lambda a: a[:, :1]),
        ("outer_bias", lambda a: a + np.inf),
        ("limit", lambda _: 0.0),
        ("limit", lambda _: float("nan")),
        ("limit", lambda _: 3),
    ],
)
def test_arrays_that_do_not_fit_are_refused(name, change):
    X, y, _ = demonstrations()
    plain = finish(fit_perceptron(X, y, np.arange(len(y)), 0, 1)).plain()
    Perceptron.from_plain(plain, 8, 2)
    with pytest.raises(ValueError, match="must"):
        Perceptron.from_plain(plain | {name: change(plain[name])}, 8, 2)


def test_it_stops_where_left_out_demonstrations_are_recognised_best():
    X, y, groups = demonstrations(offset=2.0)
    epochs = []
    best, probabilities = finish(held_out_epochs(X, y, parts_of(groups), 0), epochs.append)
    losses = [epoch.loss for epoch in epochs if epoch.loss is not None]
    numbers = [epoch.number for epoch in epochs if epoch.loss is not None]
    assert numbers == list(range(1, len(losses) + 1))
    assert best == 1 + int(np.argmin(losses))
    assert len(losses) == best + perceptron.PATIENCE < perceptron.EPOCHS
    # They are those of the best epoch, and of networks that have not seen the demonstrations.
    right = np.concatenate(
        [P[np.arange(len(P)), y[out]] for P, (_, out) in zip(probabilities, parts_of(groups))]  # noqa: B905
    )
    assert -np.log(np.maximum(right, perceptron.LEAST)).mean() == pytest.approx(min(losses))
    nonsense = X.copy()
    nonsense[groups % 3 == 0] = 0.0
    _, other = finish(held_out_epochs(nonsense, y, parts_of(groups)[:1], 0))
    _, own = finish(held_out_epochs(X, y, parts_of(groups)[:1], 0))
    assert not np.array_equal(other[0], own[0])


def test_an_action_that_a_part_has_not_got_has_no_column_there():
    X, y, groups = demonstrations()
    y = np.where(groups % 3 == 0, 2, y)
    parts = [(rows, out[np.isin(y[out], y[rows])]) for rows, out in parts_of(groups)]
    parts = [part for part in parts if len(part[1])]
    _, probabilities = finish(held_out_epochs(X, y, parts, 0))
    assert [P.shape[1] for P in probabilities] == [len(np.unique(y[rows])) for rows, _ in parts]


def test_one_seed_gives_one_network_and_another_another(monkeypatch):
    monkeypatch.setattr(perceptron, "EPOCHS", 12)
    X, y, groups = demonstrations(count=3, each=20)
    care = FitOptions(groups, calibrated=True)
    first, same, other = (
        finish(fit_ensemble("mlp", X, y, seed, care)).predict_proba(X) for seed in (3, 3, 4)
    )
    np.testing.assert_array_equal(first, same)
    assert not np.array_equal(first, other)


def test_a_long_epoch_pauses_so_that_it_can_be_cancelled(monkeypatch):
    monkeypatch.setattr(perceptron, "PART", 50)
    X, y, _ = demonstrations()
    steps = fit_perceptron(X, y, np.arange(len(y)), 0, 1)
    assert [epoch.loss is None for epoch in steps] == [True] * 8 + [False]  # 360 samples


@pytest.mark.parametrize("name", ["mlp", "trees-mlp"])
def test_the_losses_of_left_out_demonstrations_are_told_epoch_by_epoch(name, monkeypatch):
    monkeypatch.setattr(perceptron, "PATIENCE", 4)
    monkeypatch.setattr(perceptron, "EPOCHS", 20)
    X, y, groups = demonstrations(count=3, each=20)
    steps = []
    fitted = finish(fit_ensemble(name, X, y, 0, FitOptions(groups, calibrated=True)), steps.append)
    known = [(step.done, step.loss) for step in steps if step.loss is not None]
    assert [number for number, _ in known] == list(range(1, len(known) + 1))
    assert len(known) > perceptron.PATIENCE
    done = [step.done for step in steps]
    assert done == sorted(done)
    assert done[-1] == steps[-1].total
    assert isinstance(fitted.members[-1], Perceptron)


def test_without_a_second_demonstration_the_loss_of_training_is_told():
    X, y, _ = demonstrations(1)
    steps = []
    finish(fit_ensemble("mlp", X, y, 0, FitOptions(calibrated=True)), steps.append)
    losses = [step.loss for step in steps if step.loss is not None]
    assert len(losses) == perceptron.EPOCHS_ALONE
    assert losses[-1] < losses[0]


def test_a_force_never_met_before_does_not_decide_alone():
    X, y, groups = demonstrations()
    fitted = finish(fit_ensemble("mlp", X.astype(float), y, 0, FitOptions(groups)))
    far, farther = X[:1].astype(float), X[:1].astype(float)
    far[0, 3], farther[0, 3] = 1e3, 1e9
    np.testing.assert_array_equal(fitted.predict_proba(far), fitted.predict_proba(farther))


def test_a_mean_of_trees_and_network_is_their_mean():
    X, y, groups = demonstrations()
    both = finish(fit_ensemble("trees-mlp", X.astype(float), y, 0, FitOptions(groups)))
    each = [
        dataclasses.replace(both, members=[member]).predict_proba(X.astype(float))
        for member in both.members
    ]
    np.testing.assert_allclose(both.predict_proba(X.astype(float)), np.mean(each, axis=0))
