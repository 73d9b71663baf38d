"""Classifiers of one or several members whose mean probabilities are calibrated.

Neighbouring samples are almost copies of each other: calibration is judged on whole demonstrations
that were left out of an inner fit, never on left-out samples.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Flags, Real, Whole
from forcelab.jobs import Progress, map_progress
from forcelab.labels import UNLABELLED
from forcelab.recognition.forest import Forest, Linear, require, require_numbers, softmax
from forcelab.recognition.perceptron import (
    EPOCHS,
    EPOCHS_ALONE,
    LEAST,
    LIMIT,
    Epoch,
    Perceptron,
    fit_perceptron,
    held_out_epochs,
)

ResultT = TypeVar("ResultT")


class Member(Protocol):
    """One of the classifiers that are averaged."""

    def probabilities(self, features: Real) -> Real:
        """Probabilities (n, K) of the actions, of standardised features (n, f)."""

    def plain(self) -> dict[str, Any]:
        """What a file holds of it: under "kind" the name of its reader in :data:`READERS`."""


#: ``reader(plain, f, K)`` checks a member that was read from a file; "forest" is of format 1.
READERS: dict[str, Callable[[Mapping[str, Any], int, int], Member]] = {
    "trees": Forest.from_plain,
    "forest": Forest.from_format_1,
    "linear": Linear.from_plain,
    "perceptron": Perceptron.from_plain,
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

    classes_: Codes  # (K,); codes of the actions, rising
    columns: Whole  # (f,); which columns of the features it looks at
    #: mean, scale: (f,); of the training samples; features are standardised by them
    mean: Real
    scale: Real
    members: Sequence[Member]
    #: By which the mean of their probabilities is sharpened; 1 leaves it as it is
    exponent: float = 1.0

    def predict_proba(self, features: Real) -> Real:
        """Probabilities of the actions, shape (n, K)."""
        ready = self.standardised(features)
        probabilities = np.mean([member.probabilities(ready) for member in self.members], axis=0)
        return (
            np.asarray(probabilities)
            if self.exponent == 1
            else sharpen(probabilities, self.exponent)
        )

    def standardised(self, features: Real) -> Real:
        """The features that its members look at, as they do; shape (n, f)."""
        ready = features[:, self.columns]  # a copy, which is standardised in place
        ready -= self.mean
        ready /= self.scale
        return ready

    def predict(self, features: Real) -> Codes:
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
            READERS[member["kind"]](member, len(columns), len(codes)) for member in plain["members"]
        )
        return cls(codes, columns, mean, scale, members, exponent)


#: Members of each classifier by its name; of any other it is itself the only one.
MEMBERS = {
    "logistic": ("logistic",),
    "extra-trees": ("extra-trees",),
    "boosting": ("boosting",),
    "mlp": ("mlp",),
    "ensemble": ("extra-trees", "logistic"),
    "trees-mlp": ("extra-trees", "mlp"),
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


#: ``fit(X, y, seed)`` makes a member of standardised features (n, f) and codes (n,).
MemberFit = Callable[[Real, Codes, int], Member]


@dataclass(frozen=True, eq=False)
class FitOptions:
    """Options of a fit."""

    #: (n,); the number of each sample's demonstration; all one by default
    groups: Codes | None = None
    balanced: bool = False  # whether every action counts the same, however rare
    calibrated: bool = False  # whether probabilities are calibrated across demonstrations
    trees: int | None = None  # how many there are in a forest; :data:`TREES` by default
    #: Whether those that are kept as scikit-learn's own get standardised features, too
    standardised: bool = False
    #: Raises an InputError where a fitted classifier cannot be kept; asked after the first fit
    check: Callable[[Any], object] | None = None


@dataclass(frozen=True, slots=True)
class FitProgress(Progress):
    """Progress of a fit, with the loss of classifiers that have one."""

    #: After an epoch: of demonstrations that were left out, or of training where none is
    loss: float | None = None
    #: As it stands, ready to predict; None where there is none yet
    classifier: Any = None


def fit_ensemble(
    name: str | MemberFit, X: Real, y: Codes, seed: int, options: FitOptions
) -> Generator[FitProgress, None, CalibratedEnsemble]:
    """Fit a classifier to X (n, f) and codes y (n,); progress over epochs and inner fits.

    It is one of :data:`MEMBERS` by name, or has a single member, given what fits that. Without two
    demonstrations nothing can be left out: then the probabilities stay as they are.
    """
    kinds = MEMBERS[name] if isinstance(name, str) else (name,)
    others = tuple(kind for kind in kinds if kind != "mlp")
    parts = _parts(y, options.groups) if options.calibrated else []
    total = EPOCHS * (len(kinds) - len(others)) + len(parts) * bool(others) + 1
    classes = np.unique(y)
    # What each of the members gives to the left-out samples
    shares = [np.zeros((len(left_out), len(classes))) for _, left_out in parts]
    networks: tuple[Perceptron, ...] = ()
    if len(others) < len(kinds):
        networks = ((yield from _fit_network(X, y, parts, shares, seed, options, total)),)
    for i, (rows, left_out) in enumerate(parts if others else ()):
        ensemble = _fit_members(others, X, y, rows, seed, options)
        if i == 0 and options.check is not None:
            options.check(ensemble)
        P = len(others) * ensemble.predict_proba(X[left_out])
        shares[i][:, np.searchsorted(classes, ensemble.classes_)] += P
        yield FitProgress(total - len(parts) + i, total, "fit")
    ensemble = _fit_members(others, X, y, np.arange(len(y)), seed, options)
    exponent = 1.0
    if parts:
        left_out = np.concatenate([left_out for _, left_out in parts])
        P = np.concatenate(shares) / len(kinds)
        exponent = _best_exponent(P, np.searchsorted(classes, y[left_out]))
    ensemble = replace(ensemble, members=(*ensemble.members, *networks), exponent=exponent)
    yield FitProgress(total, total, "fit", classifier=ensemble)
    return ensemble


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


def _folds(groups: Codes) -> list[Flags]:
    """Masks of the samples of one or several demonstrations that inner fits leave out."""
    numbers = np.unique(groups)
    count = min(FOLDS, len(numbers))
    return [np.isin(groups, numbers[i::count]) for i in range(count)]


def _parts(y: Codes, groups: Codes | None) -> list[tuple[Codes, Codes]]:
    """Rows to train on and rows that are left out, for one demonstration or some after the other.

    Samples of an action that only the left-out demonstrations have are passed over; there are no
    parts with a single demonstration.
    """
    masks = [] if groups is None else _folds(groups)
    parts = [(~held_out, held_out & np.isin(y, y[~held_out])) for held_out in masks]
    return [
        (np.flatnonzero(rows), np.flatnonzero(left_out))
        for rows, left_out in parts
        if left_out.any() and len(np.unique(y[rows])) > 1
    ]


def _evened(y: Codes, rows: Codes) -> Codes:
    """About as many rows, equally many of each code: some several times, or every few."""
    codes = np.unique(y[rows])
    places = [rows[y[rows] == code] for code in codes]
    each = -(-len(rows) // len(codes))
    return np.concatenate([own[np.arange(each) * len(own) // each] for own in places])


def _fit_network(
    X: Real,
    y: Codes,
    parts: Sequence[tuple[Codes, Codes]],
    shares: Sequence[Real],
    seed: int,
    options: FitOptions,
    total: int,
) -> Generator[FitProgress, None, Perceptron]:
    """Fit a network to all samples, and add what its like give to the left-out ones to `shares`."""
    ready = _standardised(X, np.arange(len(y)), np.float32, "C")[0]
    np.clip(ready, -LIMIT, LIMIT, out=ready)

    def learnt(rows: Codes) -> Codes:
        return _evened(y, rows) if options.balanced else rows

    epochs = EPOCHS_ALONE
    if parts:
        balanced = [(learnt(rows), left_out) for rows, left_out in parts]
        job = held_out_epochs(ready, y, balanced, seed)
        epochs, found = yield from _in_steps(job, total)
        for (rows, _), share, P in zip(parts, shares, found, strict=True):
            share[:, np.searchsorted(np.unique(y), np.unique(y[rows]))] += P
    fit = fit_perceptron(ready, y, learnt(np.arange(len(y))), seed, epochs)
    # The curve of left-out demonstrations is drawn, and not that of training after it.
    return (yield from _in_steps(fit, total, EPOCHS if parts else None))


def _in_steps(
    job: Generator[Epoch, None, ResultT], total: int, done: int | None = None
) -> Generator[FitProgress, None, ResultT]:
    """The epochs of a job as progress; without their loss, all at one step, given `done`."""

    def progress(epoch: Epoch) -> FitProgress:
        if done is None:
            return FitProgress(epoch.number, total, "fit", epoch.loss)
        return FitProgress(done, total, "fit")

    return map_progress(job, progress)


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


def _standardised(
    X: Real, rows: Codes, dtype: type[np.floating[Any]], order: Literal["C", "F"]
) -> tuple[NDArray[np.floating[Any]], Real, Real]:
    """Some rows of X (n, f), standardised; and the mean and scale (f,) of each feature."""
    width = X.shape[1]
    ready = np.empty((len(rows), width), dtype, order=order)
    mean, scale = np.empty(width), np.empty(width)
    for i in range(width):
        values = np.ascontiguousarray(X[rows, i])
        mean[i], spread = values.mean(), values.std()
        # A feature that never changes but for rounding tells nothing, and must not be blown up.
        scale[i] = spread if spread > 1e-9 * max(abs(mean[i]), 1e-300) else 1.0
        ready[:, i] = (values - mean[i]) / scale[i]
    return ready, mean, scale


def _fit_members(
    kinds: tuple[str | MemberFit, ...],
    X: Real,
    y: Codes,
    rows: Codes,
    seed: int,
    options: FitOptions,
) -> CalibratedEnsemble:
    """Fit all members but networks to some rows, whose features are standardised."""
    from threadpoolctl import threadpool_limits

    # There may be much of it, and extra trees would make a copy in single precision.
    dtype = np.float32 if kinds == ("extra-trees",) else np.float64
    ready, mean, scale = _standardised(X, rows, dtype, "F")
    y = y[rows]
    with threadpool_limits(1):
        members = tuple(_fit_member(kind, ready, y, seed, options) for kind in kinds)
    return CalibratedEnsemble(np.unique(y), np.arange(X.shape[1]), mean, scale, members)


def _fit_member(
    kind: str | MemberFit, X: NDArray[Any], y: Codes, seed: int, options: FitOptions
) -> Member:
    if not isinstance(kind, str):
        learnt = _evened(y, np.arange(len(y))) if options.balanced else slice(None)
        return kind(X[learnt], y[learnt], seed)
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
