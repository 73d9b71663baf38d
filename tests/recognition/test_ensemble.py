from __future__ import annotations

import numpy as np
import pytest
from sklearn.ensemble import ExtraTreesClassifier, HistGradientBoostingClassifier
from sklearn.linear_model import LogisticRegression

from forcelab.jobs import finish
from forcelab.recognition import ensemble
from forcelab.recognition.ensemble import (
    MEMBERS,
    CalibratedEnsemble,
    FitOptions,
    fit_ensemble,
    sharpen,
)
from forcelab.recognition.forest import Forest, Linear, _rounded_down
from tests.recognition.format_1 import forest_in_format_1

pytestmark = pytest.mark.usefixtures("small_fits")

NAMES = tuple(MEMBERS)


def clouds(counts, seed=0, features=4, distance=1.5):
    random = np.random.default_rng(seed)
    y = np.repeat(np.arange(len(counts)), counts)
    X = random.normal(size=(len(y), features))
    X[np.arange(len(y)), y % features] += distance
    return X, y


def fitted(name, X, y, care=None, seed=0):
    return finish(fit_ensemble(name, X, y, seed, care or FitOptions()))


@pytest.mark.parametrize("counts", [(40, 50), (40, 50, 30)])
def test_arrays_answer_as_scikit_learn_does(counts):
    X, y = clouds(counts)
    rows, _ = clouds((300,) * len(counts), seed=1)
    trees = ExtraTreesClassifier(7, min_samples_leaf=3, random_state=0).fit(X, y)
    boosted = HistGradientBoostingClassifier(max_iter=6, early_stopping=False).fit(X, y)
    regression = LogisticRegression().fit(X, y)
    pairs = [
        (Forest.from_extra_trees(trees, len(counts)), trees),
        (Forest.from_boosting(boosted, len(counts)), boosted),
        (Linear.from_sklearn(regression), regression),
    ]
    for ours, theirs in pairs:
        np.testing.assert_allclose(ours.probabilities(rows), theirs.predict_proba(rows), atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_what_is_stored_as_arrays_answers_the_same(name):
    X, y = clouds((40, 50, 30))
    ensemble = fitted(name, X, y)
    again = CalibratedEnsemble.from_plain(ensemble.plain(), X.shape[1], 3)
    np.testing.assert_array_equal(again.predict_proba(X), ensemble.predict_proba(X))
    np.testing.assert_array_equal(again.predict(X), ensemble.predict(X))


def broken(plain, member, part, change):
    found = dict(plain) | {"members": [dict(member) for member in plain["members"]]}
    place = found if member is None else found["members"][member]
    value = np.array(place[part], copy=True) if isinstance(place[part], np.ndarray) else place[part]
    place[part] = change(value)
    return found


def put(index, value):
    def change(array):
        array[index] = value
        return array

    return change


DAMAGE = [
    (0, "feature", put(0, 99)),
    (0, "feature", put(0, -3)),
    (0, "feature", put(0, -1)),  # a leaf more: the last tree but one ends too soon
    (0, "feature", put(-1, 0)),  # a leaf less: the last tree does not end
    (0, "feature", lambda a: a[::-1]),  # as many leaves, but no trees
    (0, "feature", lambda a: a[:-1]),
    (0, "feature", lambda a: a[:0]),
    (0, "feature", lambda a: a.astype(np.float64)),
    (0, "feature", lambda a: a[:, np.newaxis]),
    (0, "threshold", put(0, np.nan)),
    (0, "threshold", lambda a: a[:-1]),
    (0, "threshold", lambda a: a.astype(str)),
    (0, "leaf", put(0, 200)),
    (0, "leaf", lambda a: a[1:]),
    (0, "leaf", lambda a: a.astype(np.int64)),
    (0, "value", lambda a: a[:, :1]),
    (0, "value", lambda a: -a),
    (0, "value", lambda a: a[:0]),
    (0, "base", put(0, 1.0)),
    (0, "boosted", lambda _: 0),
    (1, "weights", lambda a: a[:-1]),
    (1, "bias", put(0, np.inf)),
    (None, "classes_", put(0, 2)),
    (None, "classes_", put(-1, 7)),
    (None, "columns", put(0, 50)),
    (None, "scale", put(0, 0.0)),
    (None, "mean", put(0, np.nan)),
    (None, "exponent", lambda _: -1.0),
    (None, "members", lambda _: []),
]


@pytest.mark.parametrize(("member", "part", "change"), DAMAGE)
def test_arrays_that_do_not_fit_are_refused_before_anything_follows_them(member, part, change):
    X, y = clouds((40, 50, 30))
    plain = fitted("ensemble", X, y).plain()
    CalibratedEnsemble.from_plain(plain, 4, 3)
    with pytest.raises(ValueError, match="must"):
        CalibratedEnsemble.from_plain(broken(plain, member, part, change), 4, 3)


@pytest.mark.parametrize("name", ["extra-trees", "boosting"])
def test_a_forest_of_format_1_answers_the_same_and_is_kept_small(name):
    X, y = clouds((400, 500, 300), distance=0.5)
    ensemble = fitted(name, X, y)
    older = ensemble.plain() | {"members": [forest_in_format_1(ensemble.members[0])]}
    again = CalibratedEnsemble.from_plain(older, 4, 3)
    np.testing.assert_array_equal(again.predict_proba(X), ensemble.predict_proba(X))
    twice = CalibratedEnsemble.from_plain(again.plain(), 4, 3)
    np.testing.assert_array_equal(twice.predict_proba(X), ensemble.predict_proba(X))
    sizes = [
        sum(part.nbytes for part in plain["members"][0].values() if isinstance(part, np.ndarray))
        for plain in (older, again.plain(), ensemble.plain())
    ]
    assert sizes[2] <= sizes[1] < sizes[0] / 3


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("left", put(0, 0)),  # a node that is its own child would be followed for ever
        ("right", put(0, 10**9)),
        ("left", put(0, -5)),
        ("left", lambda a: a.astype(np.float64)),
        ("feature", put(0, 99)),
        ("feature", put(0, -3)),
        ("roots", put(0, 10**9)),
        ("roots", lambda a: a[:-1]),
        ("threshold", put(0, np.nan)),
        ("value", lambda a: a[:, :1]),
        ("value", lambda a: -a),
        ("boosted", lambda _: 1),
    ],
)
def test_a_forest_of_format_1_that_does_not_fit_is_refused(part, change):
    X, y = clouds((40, 50, 30))
    plain = fitted("extra-trees", X, y).plain()
    older = plain | {"members": [forest_in_format_1(Forest.from_plain(plain["members"][0], 4, 3))]}
    CalibratedEnsemble.from_plain(older, 4, 3)
    with pytest.raises(ValueError, match="must"):
        CalibratedEnsemble.from_plain(broken(older, 0, part, change), 4, 3)


def test_a_forest_takes_little_and_little_more_before_it_is_asked():
    X, y = clouds((4000, 5000, 3000), distance=0.5)
    (forest,) = fitted("extra-trees", X, y).members
    arrays = [part for part in vars(forest).values() if isinstance(part, np.ndarray)]
    assert sum(part.nbytes for part in arrays) < 6 * len(forest.feature)
    assert "_paths" not in vars(forest)
    forest.probabilities(X[:3])
    assert "_paths" not in forest.plain()


def test_one_row_is_answered_as_it_is_among_many_and_what_is_no_number_goes_to_the_right():
    X, y = clouds((60, 50, 40))
    (forest,) = fitted("extra-trees", X, y).members
    X[3, 1], X[4] = np.nan, 1e300
    together = forest.probabilities(X)
    each = np.concatenate([forest.probabilities(row[np.newaxis]) for row in X])
    np.testing.assert_array_equal(each, together)
    assert forest.probabilities(X[:0]).shape == (0, 3)


def test_thresholds_part_float32_as_the_longer_ones_do():
    random = np.random.default_rng(0)
    exact = np.concatenate([random.normal(size=999), [0.0, -0.0, 1e-45, 1e38]]).astype(np.float32)
    near = exact.astype(np.float64)[:, np.newaxis] * (1 + np.array([-1e-9, 0.0, 1e-9]))
    short = _rounded_down(near)
    assert short.dtype == np.float32
    for x in (exact, np.nextafter(exact, np.float32(9)), np.nextafter(exact, np.float32(-9))):
        np.testing.assert_array_equal(x[:, None] <= short, x[:, None].astype(float) <= near)


def test_with_a_single_demonstration_nothing_is_calibrated():
    X, y = clouds((20, 20), distance=0.5)
    care = FitOptions(groups=np.zeros(40, dtype=np.int64), calibrated=True)
    assert fitted("extra-trees", X, y, care).exponent == 1.0


def test_calibration_makes_an_overconfident_classifier_less_sure():
    # Each demonstration has its own offset: sure within one, wrong about the next.
    random = np.random.default_rng(3)
    groups = np.repeat(np.arange(8), 60)
    y = np.tile(np.repeat([0, 1], 30), 8)
    X = (y + 1.2 * random.normal(size=8)[groups])[:, None] + 0.05 * random.normal(size=(480, 1))
    plain = fitted("boosting", X, y, FitOptions(groups=groups))
    calibrated = fitted("boosting", X, y, FitOptions(groups=groups, calibrated=True))
    assert calibrated.exponent < 0.8
    np.testing.assert_array_equal(calibrated.predict(X), plain.predict(X))


def test_sharpening_keeps_the_order_and_certainty_itself():
    P = np.array([[0.0, 1.0], [0.3, 0.7], [0.5, 0.5]])
    for exponent in (0.5, 2.0):
        found = sharpen(P, exponent)
        np.testing.assert_allclose(found.sum(axis=1), 1.0)
        assert np.isfinite(found).all()
        assert found[0, 1] > 0.99
        assert found[2, 0] == pytest.approx(0.5)
    assert sharpen(P, 2.0)[1, 1] == pytest.approx(0.49 / 0.58)


def test_of_too_many_samples_evenly_many_are_learnt_and_every_action(monkeypatch):
    monkeypatch.setattr(ensemble, "MOST", 50)
    y = np.repeat([0, 1, 2], [121, 80, 1])  # the last one falls between two that are taken
    assert np.bincount(y[ensemble.thin(y)]).tolist() == [25, 17, 1]
    assert len(ensemble.thin(y[95:145])) == 50  # as many as there may be: none is left out
