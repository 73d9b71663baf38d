"""Classifiers of one or several members whose mean probabilities are calibrated.

Neighbouring samples are almost copies of each other: calibration is judged on whole demonstrations
that were left out of an inner fit, never on left-out samples.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.labels import UNLABELLED
from forcelab.recognition.forest import Forest, Linear, require, require_numbers, softmax

Real = NDArray[np.float64]
Member = Forest | Linear

#: How a member is read, by what it is called in a file; "forest" is that of format 1.
_KINDS: dict[str, Callable[[Mapping[str, Any], int, int], Member]] = {
    "trees": Forest.from_plain,
    "forest": Forest.from_format_1,
    "linear": Linear.from_plain,
}

#: Probabilities below this count as this before they are sharpened: a tree may say 0.
FLOOR = 1e-6


def sharpen(probabilities: Real, exponent: float) -> Real:
    """Probabilities (n, K) to a power, rows summing to 1 again: above 1 surer, below less sure."""
    return softmax(exponent * np.log(np.maximum(probabilities, FLOOR)))


@dataclass(frozen=True, eq=False)
class CalibratedEnsemble:
    """Members that look at the same standardised features; f of them, K actions.

    Attributes and methods are named as those of scikit-learn's classifiers.
    """

    classes_: NDArray[np.int64]  # (K,); codes of the actions, rising
    columns: NDArray[np.int64]  # (f,); which columns of the features it looks at
    #: mean, scale: (f,); of the training samples; features are standardised by them
    mean: Real
    scale: Real
    members: Sequence[Member]
    #: By which the mean of their probabilities is sharpened; 1 leaves it as it is
    exponent: float = 1.0

    def predict_proba(self, features: Real) -> Real:
        """Probabilities of the actions, shape (n, K)."""
        ready = features[:, self.columns]  # a copy, which is standardised in place
        ready -= self.mean
        ready /= self.scale
        probabilities = np.mean([member.probabilities(ready) for member in self.members], axis=0)
        return (
            np.asarray(probabilities)
            if self.exponent == 1
            else sharpen(probabilities, self.exponent)
        )

    def predict(self, features: Real) -> NDArray[np.int64]:
        """Codes of the most probable actions, shape (n,)."""
        return np.asarray(self.classes_[np.argmax(self.predict_proba(features), axis=1)])

    def plain(self) -> dict[str, Any]:
        """Arrays, numbers and lists for :meth:`from_plain`."""
        return vars(self) | {"members": [member.plain() for member in self.members]}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, actions: int) -> CalibratedEnsemble:
        """Check what was read from a file: `width` features, codes below `actions`."""
        codes, columns, exponent = plain["classes_"], plain["columns"], float(plain["exponent"])
        require(codes.dtype == columns.dtype == np.int64, "whole numbers for codes and columns")
        require(codes.ndim == columns.ndim == 1 and len(codes) >= 2, "codes")
        require(codes[0] >= 0 and codes[-1] < actions and (np.diff(codes) > 0).all(), "codes")
        require(((columns >= 0) & (columns < width)).all(), "columns of features")
        require(0 < exponent < 1e3, "an exponent above 0")
        mean, scale = plain["mean"], plain["scale"]
        for array in (mean, scale):
            require_numbers(array, columns.shape)
        require((scale > 0).all(), "scales above 0")
        require(plain["members"], "a member")
        members = tuple(
            _KINDS[member["kind"]](member, len(columns), len(codes)) for member in plain["members"]
        )
        return cls(codes, columns, mean, scale, members, exponent)


Codes = NDArray[np.int64]

#: Members of each classifier by its name.
MEMBERS = {
    "logistic": ("logistic",),
    "extra-trees": ("extra-trees",),
    "boosting": ("boosting",),
    "ensemble": ("extra-trees", "logistic"),
}
#: Trees of a forest, and the least samples of a leaf.
TREES, LEAF = 50, 1
#: The same where actions are to count alike: weights say nothing in a leaf of a single sample.
SHARED_LEAF = 3
#: Strength of the logistic regression's data against its penalty.
STRENGTH = 0.01
#: More samples than that are thinned out evenly: half an hour of decisions, which eighty
#: demonstrations make. Trees grow with every one of them; of five times as many a recogniser took
#: 0.8 GB on the disk, 4.8 GB to be trained, and ten times as long.
MOST = 100_000
#: Rounds of boosting, and leaves of each of its trees.
ROUNDS, LEAVES = 60, 8
#: Demonstrations, or groups of them, that are left out of inner fits one after the other.
FOLDS = 5
#: Exponents that are tried to calibrate probabilities.
EXPONENTS = np.geomspace(0.4, 2.5, 43)
#: Least probability in a logarithmic loss.
LEAST = 1e-3


@dataclass(frozen=True, eq=False)
class FitOptions:
    """Options of a fit."""

    #: (n,); the number of each sample's demonstration; all one by default
    groups: Codes | None = None
    balanced: bool = False  # whether every action counts the same, however rare
    calibrated: bool = False  # whether probabilities are calibrated across demonstrations
    trees: int | None = None  # how many there are in a forest; :data:`TREES` by default


def fit_ensemble(
    name: str, X: Real, y: Codes, seed: int, options: FitOptions
) -> Generator[Progress, None, CalibratedEnsemble]:
    """Fit a classifier of :data:`MEMBERS` to X (n, f) and codes y (n,); progress over inner fits.

    Without two demonstrations nothing can be left out: then the probabilities stay as they are.
    """
    groups = np.zeros(len(y), dtype=np.int64) if options.groups is None else options.groups
    folds = _folds(groups)
    if not options.calibrated or len(folds) < 2:
        yield Progress(1, 1, "fit")
        return _fit_members(name, X, y, slice(None), seed, options)
    total = len(folds) + 1
    probabilities, codes_right = [], []
    for held_out in folds:
        P, codes = _held_out_probabilities(name, X, y, held_out, seed, options)
        probabilities.append(P)
        codes_right.append(codes)
        yield Progress(len(probabilities), total, "fit")
    ensemble = _fit_members(name, X, y, slice(None), seed, options)
    exponent = _best_exponent(np.concatenate(probabilities), np.concatenate(codes_right))
    yield Progress(total, total, "fit")
    return replace(ensemble, exponent=exponent)


def thin(y: Codes) -> Codes:
    """Indices of the samples to learn from: of too many every few, and one of each code."""
    first = np.unique(y, return_index=True)[1]
    if len(y) <= MOST + len(first):
        return np.arange(len(y))
    return np.union1d(np.arange(0, len(y), -(-len(y) // MOST)), first)


def training_steps(
    codes: Sequence[Codes], stride: int = 1, *, complete: bool = False
) -> tuple[Codes, Codes, list[Codes]]:
    """Codes and groups (m,) of the labelled time steps, and their indices in each demonstration.

    Of every `stride` steps one is taken, and of more than :data:`MOST` still fewer, unless
    `complete`.
    """
    steps = [stride * np.flatnonzero(item_codes[::stride] != UNLABELLED) for item_codes in codes]
    y = np.concatenate(
        [item_codes[places] for item_codes, places in zip(codes, steps, strict=True)]
    )
    groups = np.repeat(np.arange(len(steps)), [len(places) for places in steps])
    if complete:
        return y, groups, steps
    thinned = thin(y)
    places, y, groups = np.concatenate(steps)[thinned], y[thinned], groups[thinned]
    return y, groups, [places[groups == i] for i in range(len(steps))]


def _folds(groups: Codes) -> list[NDArray[np.bool_]]:
    """Masks of the samples of one or several demonstrations that inner fits leave out."""
    numbers = np.unique(groups)
    count = min(FOLDS, len(numbers))
    return [np.isin(groups, numbers[i::count]) for i in range(count)]


def _held_out_probabilities(
    name: str, X: Real, y: Codes, held_out: NDArray[np.bool_], seed: int, options: FitOptions
) -> tuple[Real, Codes]:
    """Probabilities of the left-out samples, and indices of the right codes among all codes.

    Samples of an action that only the left-out demonstrations have are passed over.
    """
    classes, places = np.unique(y, return_inverse=True)
    training = ~held_out
    if len(np.unique(y[training])) < 2:
        return np.empty((0, len(classes))), np.empty(0, dtype=np.int64)
    ensemble = _fit_members(name, X, y, training, seed, options)
    rows = held_out & np.isin(y, ensemble.classes_)
    P = np.zeros((int(rows.sum()), len(classes)))
    P[:, np.searchsorted(classes, ensemble.classes_)] = ensemble.predict_proba(X[rows])
    return P, places[rows]


def _best_exponent(P: Real, codes: Codes) -> float:
    """The exponent that gives left-out demonstrations the least logarithmic loss."""
    if not len(codes):
        return 1.0
    rows = np.arange(len(codes))
    losses = [
        float(-np.log(np.maximum(sharpen(P, float(e))[rows, codes], LEAST)).mean())
        for e in EXPONENTS
    ]
    return float(EXPONENTS[int(np.argmin(losses))])


def _fit_members(
    name: str, X: Real, y: Codes, rows: NDArray[np.bool_] | slice, seed: int, options: FitOptions
) -> CalibratedEnsemble:
    """Fit all members to some rows, whose features are standardised."""
    from threadpoolctl import threadpool_limits

    y = y[rows]
    # There may be much of it, and extra trees would make a copy in single precision.
    single = MEMBERS[name] == ("extra-trees",)
    width = X.shape[1]
    ready = np.empty((len(y), width), np.float32 if single else np.float64, order="F")
    mean, scale = np.empty(width), np.empty(width)
    for i in range(width):
        values = np.ascontiguousarray(X[rows, i])
        mean[i], spread = values.mean(), values.std()
        # A feature that never changes but for rounding tells nothing, and must not be blown up.
        scale[i] = spread if spread > 1e-9 * max(abs(mean[i]), 1e-300) else 1.0
        ready[:, i] = (values - mean[i]) / scale[i]
    with threadpool_limits(1):
        members = tuple(_fit_member(kind, ready, y, seed, options) for kind in MEMBERS[name])
    return CalibratedEnsemble(np.unique(y), np.arange(width), mean, scale, members)


def _fit_member(kind: str, X: Real, y: Codes, seed: int, options: FitOptions) -> Member:
    """Fit one member."""
    weight = "balanced" if options.balanced else None
    classes = len(np.unique(y))
    if kind == "extra-trees":
        from sklearn.ensemble import ExtraTreesClassifier

        trees = ExtraTreesClassifier(
            TREES if options.trees is None else options.trees,
            min_samples_leaf=SHARED_LEAF if options.balanced else LEAF,
            class_weight=weight,
            random_state=seed,
        )
        return Forest.from_extra_trees(trees.fit(X, y), classes)
    if kind == "boosting":
        from sklearn.ensemble import HistGradientBoostingClassifier

        boosted = HistGradientBoostingClassifier(
            max_iter=ROUNDS,
            max_leaf_nodes=LEAVES,
            early_stopping=False,
            class_weight=weight,
            random_state=seed,
        )
        return Forest.from_boosting(boosted.fit(X, y), classes)
    from sklearn.linear_model import LogisticRegression

    regression = LogisticRegression(C=STRENGTH, max_iter=500, class_weight=weight)
    return Linear.from_sklearn(regression.fit(X, y))
