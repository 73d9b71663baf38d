"""Trees and weighted sums as plain arrays: fitted by scikit-learn, asked and stored without it.

What is stored as arrays can be checked before anything follows it, and is asked for one step as
fast as for many: scikit-learn looks at its input for longer than a live step may take.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Forest", "Linear"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

#: Rows of features that go down all trees together, so that where they stand fits the cache.
BLOCK = 512


def _softmax(logits: Real) -> Real:
    """Probabilities from logits along the last axis."""
    odds = np.exp(logits - logits.max(axis=-1, keepdims=True))
    return np.asarray(odds / odds.sum(axis=-1, keepdims=True))


@dataclass(frozen=True, eq=False)
class Forest:
    """Decision trees, one after another in the same arrays; t trees, n nodes, K actions.

    Parameters
    ----------
    roots : ndarray of int64, shape (t,)
        First node of each tree.
    feature : ndarray of int64, shape (n,)
        Which feature a node asks for; -1 at a leaf.
    threshold : ndarray of float64, shape (n,)
        At most this: to the left.
    left, right : ndarray of int64, shape (n,)
        Where to go on; at a leaf the leaf itself.
    value : ndarray of float64, shape (n, K)
        What a leaf says; of inner nodes it means nothing.
    base : ndarray of float64, shape (K,)
        What is added to the sum over the trees.
    boosted : bool
        Whether the sum is of logits; otherwise of probabilities.
    """

    roots: Whole
    feature: Whole
    threshold: Real
    left: Whole
    right: Whole
    value: Real
    base: Real
    boosted: bool

    def probabilities(self, features: Real) -> Real:
        """Of each action at each time step, shape (m, K)."""
        total = np.empty((len(features), self.value.shape[1]))
        for first in range(0, len(features), BLOCK):
            rows = features[first : first + BLOCK]
            total[first : first + BLOCK] = self.value[self._leaves(rows)].sum(axis=1) + self.base
        return _softmax(total) if self.boosted else total / total.sum(axis=1, keepdims=True)

    def _leaves(self, rows: Real) -> Whole:
        """The leaf of each row in each tree, shape (m, t)."""
        nodes = np.broadcast_to(self.roots, (len(rows), len(self.roots))).copy()
        number = np.arange(len(rows))[:, None]
        while True:
            asked = self.feature[nodes]
            inner = asked >= 0
            if not inner.any():
                return nodes
            low = rows[number, np.maximum(asked, 0)] <= self.threshold[nodes]
            # A leaf is its own child on both sides.
            nodes = np.where(low, self.left[nodes], self.right[nodes])

    @classmethod
    def averaging(cls, trees: Any, classes: int) -> Forest:
        """From scikit-learn's extra trees or random forest."""
        parts = []
        for tree in (estimator.tree_ for estimator in trees.estimators_):
            leaf = tree.children_left < 0
            # Of a leaf the shares of the actions; older versions give weighted counts.
            value = tree.value[:, 0, :] / tree.value[:, 0, :].sum(axis=1, keepdims=True)
            parts.append(
                (
                    np.where(leaf, -1, tree.feature),
                    tree.threshold,
                    tree.children_left,
                    tree.children_right,
                    value,
                )
            )
        return cls._joined(parts, np.zeros(classes), boosted=False)

    @classmethod
    def boosting(cls, boosted: Any, classes: int) -> Forest:
        """From scikit-learn's histogram gradient boosting of numbers."""
        parts = []
        for trees in boosted._predictors:
            for code, tree in enumerate(trees):
                nodes = tree.nodes
                leaf = nodes["is_leaf"].astype(bool)
                value = np.zeros((len(nodes), classes))
                # Of two actions there is one logit, the second one's.
                value[:, code if classes > 2 else 1] = nodes["value"]
                parts.append(
                    (
                        np.where(leaf, -1, nodes["feature_idx"]),
                        nodes["num_threshold"],
                        nodes["left"],
                        nodes["right"],
                        value,
                    )
                )
        base = np.zeros(classes)
        baseline = np.ravel(boosted._baseline_prediction)
        base[classes - len(baseline) :] = baseline
        return cls._joined(parts, base, boosted=True)

    @classmethod
    def _joined(cls, parts: list[tuple[Any, ...]], base: Real, boosted: bool) -> Forest:
        """One tree after another, their nodes renumbered."""
        counts = np.array([len(part[0]) for part in parts], dtype=np.int64)
        roots = np.cumsum(counts) - counts
        feature = np.concatenate([part[0] for part in parts]).astype(np.int64)
        own = np.arange(len(feature))
        shift = np.repeat(roots, counts)
        left, right = (
            np.where(
                feature < 0,
                own,
                np.concatenate([part[i] for part in parts]).astype(np.int64) + shift,
            )
            for i in (2, 3)
        )
        return cls(
            roots,
            feature,
            np.concatenate([part[1] for part in parts]).astype(np.float64),
            left,
            right,
            np.concatenate([part[4] for part in parts]).astype(np.float64),
            base,
            boosted,
        )

    def plain(self) -> dict[str, Any]:
        """Its arrays by name."""
        return {"kind": "forest"} | vars(self)

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, classes: int) -> Forest:
        """Check arrays that were read from a file, and make a forest of them.

        Raises
        ------
        ValueError
            If a node points at itself without being a leaf, backwards or outside, or asks for a
            feature that there is not: following it would not end, or would read elsewhere.
        """
        names = ("roots", "feature", "threshold", "left", "right", "value", "base", "boosted")
        made = cls(**{name: plain[name] for name in names})
        n = len(made.feature)
        whole = (made.roots, made.feature, made.left, made.right)
        shapes = ((len(made.roots),), (n,), (n,), (n,))
        for array, shape in zip(whole, shapes, strict=True):
            _must(array.dtype == np.int64 and array.shape == shape, "whole numbers for each node")
        _must_be_numbers(made.threshold, (n,))
        _must_be_numbers(made.value, (n, classes))
        _must_be_numbers(made.base, (classes,))
        _must(type(made.boosted) is bool and len(made.roots) >= 1, "at least one tree")
        _must(((made.roots >= 0) & (made.roots < n)).all(), "trees that begin at a node")
        leaf, own = made.feature == -1, np.arange(n)
        _must(((made.feature >= -1) & (made.feature < width)).all(), "nodes that ask for features")
        for child in (made.left, made.right):
            ahead = (child > own) & (child < n)
            _must(np.where(leaf, child == own, ahead).all(), "nodes that point ahead")
        if not made.boosted:
            sums = made.value[leaf].sum(axis=1)
            _must((made.value[leaf] >= 0).all() and (sums > 0).all(), "shares at its leaves")
            _must((made.base == 0).all(), "shares at its leaves alone")
        return made


@dataclass(frozen=True, eq=False)
class Linear:
    """Multinomial logistic regression; f features, K actions.

    Parameters
    ----------
    weights : ndarray of float64, shape (f, K)
    bias : ndarray of float64, shape (K,)
    """

    weights: Real
    bias: Real

    def probabilities(self, features: Real) -> Real:
        """Of each action at each time step, shape (m, K)."""
        # Each row by itself: a product of many rounds otherwise than one of a few, and a stream's
        # labels must not depend on its blocks.
        rows = np.ascontiguousarray(features)[:, None]
        return _softmax(np.matmul(rows, self.weights)[:, 0] + self.bias)

    @classmethod
    def of(cls, fitted: Any) -> Linear:
        """From scikit-learn's logistic regression."""
        weights, bias = fitted.coef_.T, fitted.intercept_
        if weights.shape[1] == 1:  # of two actions there is one logit, the second one's
            weights, bias = np.hstack([0 * weights, weights]), np.append(0.0, bias)
        return cls(np.ascontiguousarray(weights, dtype=np.float64), bias.astype(np.float64))

    def plain(self) -> dict[str, Any]:
        """Its arrays by name."""
        return {"kind": "linear"} | vars(self)

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, classes: int) -> Linear:
        """Check arrays that were read from a file.

        Raises
        ------
        ValueError
            If they do not fit.
        """
        made = cls(plain["weights"], plain["bias"])
        _must_be_numbers(made.weights, (width, classes))
        _must_be_numbers(made.bias, (classes,))
        return made


def _must_be_numbers(array: Real, shape: tuple[int, ...]) -> None:
    """Raise unless an array holds finite numbers in this shape."""
    _must(array.dtype == np.float64 and array.shape == shape, f"numbers of shape {shape}")
    _must(np.isfinite(array).all(), "finite numbers")


def _must(true: object, what: str) -> None:
    """Raise unless a part is as it must be."""
    if not true:
        raise ValueError(f"the classifier must have {what}")
