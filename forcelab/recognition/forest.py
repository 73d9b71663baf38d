"""Trees and weighted sums as plain arrays: fitted by scikit-learn, evaluated and stored without.

Binary trees are described by which of their nodes are leaves, in preorder: first a node, then all
of its left side, then all of its right side; one tree after another. Where a node's children are
follows from that and need not be stored, and whatever is stored makes trees that end.

What is stored as arrays can be checked before anything follows it, and is evaluated for one step as
fast as for many: scikit-learn checks its input for longer than a live step may take.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Flags, Real, Whole


def _pending_right_sides(leaf: Flags) -> NDArray[np.int32]:
    """Number of right sides still to come before each node, and after all; shape (n + 1,).

    Counted from 0 before the first tree; each tree that is complete takes one away.
    """
    steps: NDArray[Any] = np.zeros(len(leaf) + 1, dtype=np.int32)
    np.cumsum(np.where(leaf, np.int32(-1), np.int32(1)), out=steps[1:])
    return steps


def are_complete_trees(leaf: Flags) -> bool:
    """Whether nodes, given which are leaves, make complete trees, at least one."""
    steps = _pending_right_sides(leaf)
    return len(leaf) > 0 and bool(steps[-1] < steps[:-1].min())


def roots(leaf: Flags) -> Whole:
    """The first node of each tree, shape (t,)."""
    steps = _pending_right_sides(leaf)[:-1]
    lowest = np.minimum.accumulate(steps)
    return np.flatnonzero(np.diff(lowest, prepend=np.int32(1)))


def right_children(leaf: Flags) -> NDArray[np.int32]:
    """Where the right side of each node begins, shape (n,); of a leaf, the leaf itself."""
    # A left side takes away what its node has opened: the next node before which as much is open
    # as before the node itself is the first one of the right side.
    steps = _pending_right_sides(leaf)[:-1]
    order = np.argsort(steps, kind="stable").astype(np.int32)
    following = np.empty(len(leaf), dtype=np.int32)
    following[order[:-1]] = order[1:]
    following[order[-1]] = order[-1]
    return np.where(leaf, np.arange(len(leaf), dtype=np.int32), following)


Integers = NDArray[np.signedinteger[Any]]

#: Rows of features that go down all trees together, so that where they stand fits the cache.
BLOCK = 512


def softmax(logits: Real) -> Real:
    """Probabilities from logits along the last axis."""
    odds = np.exp(logits - logits.max(axis=-1, keepdims=True))
    return np.asarray(odds / odds.sum(axis=-1, keepdims=True))


@dataclass(frozen=True, eq=False)
class Forest:
    """Decision trees, one after another; t trees, n nodes of which l are leaves, K actions.

    Kept as it is stored, which is small; what evaluating it takes beside is made at first use.
    """

    #: (n,); which feature a node asks for; -1 at a leaf. Nodes stand in the order of the module's
    #: docstring.
    feature: NDArray[np.signedinteger[Any]]
    #: (n - l,); of each inner node; at most this: to the left. Features are rounded to the same
    #: kind of number first: scikit-learn's averaged trees are grown on float32 and look at nothing
    #: finer.
    threshold: NDArray[np.floating[Any]]
    #: (l,); which row of `value` each leaf says. Most leaves say what others say, too.
    leaf: NDArray[np.unsignedinteger[Any]]
    value: Real  # (v, K)
    base: Real  # (K,); what is added to the sum over the trees
    boosted: bool  # whether the sum is of logits; otherwise of probabilities

    def probabilities(self, features: Real) -> Real:
        """Probabilities of the actions at each time step, shape (m, K)."""
        total = np.empty((len(features), self.value.shape[1]))
        with np.errstate(over="ignore"):  # what is too large for float32 is as good as infinite
            samples = features.astype(self.threshold.dtype, copy=False)
        for first in range(0, len(features), BLOCK):
            rows = samples[first : first + BLOCK]
            total[first : first + BLOCK] = self.value[self._leaf_rows(rows)].sum(axis=1) + self.base
        return softmax(total) if self.boosted else total / total.sum(axis=1, keepdims=True)

    def _leaf_rows(self, rows: NDArray[np.floating[Any]]) -> Integers:
        """Row of values of the leaf that each tree leads each row of features to, shape (m, t)."""
        roots, threshold, right, row = self._paths
        nodes = np.broadcast_to(roots, (len(rows), len(roots)))
        begin = np.arange(0, rows.size, rows.shape[1])[:, None]  # of each row
        while True:
            feature = self.feature.take(nodes)
            if feature.max() < 0:
                return row.take(nodes)
            # A leaf asks for what stands before the row, but nothing is at most its threshold,
            # which is no number: it goes to the right, where it is itself.
            low = rows.take(begin + feature) <= threshold.take(nodes)
            nodes = np.where(low, nodes + 1, right.take(nodes))

    @cached_property
    def _paths(self) -> tuple[NDArray[Any], ...]:
        """First nodes (t,); of each node threshold, right child and row of values, each (n,)."""
        leaf = self.feature < 0
        threshold = np.full(len(leaf), np.nan, dtype=self.threshold.dtype)
        threshold[~leaf] = self.threshold
        row = np.zeros(len(leaf), dtype=np.int32)
        row[leaf] = self.leaf
        return roots(leaf), threshold, right_children(leaf).astype(np.int64), row

    @classmethod
    def from_extra_trees(cls, trees: Any, classes: int) -> Forest:
        """From scikit-learn's extra trees or random forest."""
        parts = []
        for tree in (estimator.tree_ for estimator in trees.estimators_):
            leaf = tree.children_left < 0
            # Of a leaf the shares of the actions; older versions give weighted counts.
            value = tree.value[leaf, 0, :] / tree.value[leaf, 0, :].sum(axis=1, keepdims=True)
            feature = np.where(leaf, -1, tree.feature)
            parts.append((feature, _rounded_down(tree.threshold[~leaf]), value))
        return cls._joined(parts, np.zeros(classes), boosted=False)

    @classmethod
    def from_boosting(cls, boosted: Any, classes: int) -> Forest:
        """From scikit-learn's histogram gradient boosting of numbers."""
        parts = []
        for trees in boosted._predictors:
            for code, tree in enumerate(trees):
                nodes = tree.nodes
                leaf = nodes["is_leaf"].astype(bool)
                value = np.zeros((int(leaf.sum()), classes))
                # Of two actions there is one logit, the second one's.
                value[:, code if classes > 2 else 1] = nodes["value"][leaf]
                feature = np.where(leaf, -1, nodes["feature_idx"].astype(np.int64))
                parts.append((feature, nodes["num_threshold"][~leaf], value))
        base = np.zeros(classes)
        baseline = np.ravel(boosted._baseline_prediction)
        base[classes - len(baseline) :] = baseline
        return cls._joined(parts, base, boosted=True)

    @classmethod
    def _joined(cls, parts: list[tuple[Any, ...]], base: Real, boosted: bool) -> Forest:
        """One tree after another: of all nodes the features, then thresholds, values of leaves."""
        feature, threshold, value = (np.concatenate([part[i] for part in parts]) for i in range(3))
        return cls._small(feature, threshold, value, base, boosted)

    @classmethod
    def _small(
        cls, feature: Integers, threshold: Any, value: Real, base: Real, boosted: bool
    ) -> Forest:
        """In the smallest integer types that do, each row of values once."""
        each, leaf = np.unique(value.astype(np.float64), axis=0, return_inverse=True)
        kind = np.min_scalar_type(-int(feature.max()) - 2)
        small = leaf.reshape(-1).astype(np.min_scalar_type(len(each)))
        return cls(feature.astype(kind), threshold, small, each, base, boosted)

    def plain(self) -> dict[str, Any]:
        """Its arrays by name."""
        return {"kind": "trees"} | {part.name: getattr(self, part.name) for part in fields(self)}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, classes: int) -> Forest:
        """Check arrays that were read from a file, and make a forest of them; else a ValueError.

        Nodes that are no complete trees, or that point at a feature or value that does not exist,
        would never end or read elsewhere.
        """
        forest = cls(**{part.name: plain[part.name] for part in fields(cls)})
        leaf = forest.feature == -1
        require(
            forest.feature.dtype.kind == "i" and forest.feature.ndim == 1, "whole numbers for nodes"
        )
        require(
            ((forest.feature >= -1) & (forest.feature < width)).all(), "nodes that ask for features"
        )
        require(are_complete_trees(leaf), "complete trees")
        inner = (int((~leaf).sum()),)
        require_numbers(forest.threshold, inner, (np.float32, np.float64))
        require(
            forest.leaf.dtype.kind == "u" and forest.leaf.shape == (int(leaf.sum()),),
            "a row a leaf",
        )
        require((forest.leaf < len(forest.value)).all(), "leaves that say values")
        require(forest.value.ndim == 2, "values of each action")
        require_numbers(forest.value, (len(forest.value), classes))
        require_numbers(forest.base, (classes,))
        require(type(forest.boosted) is bool, "sums of one kind")
        if not forest.boosted:
            shares = forest.value
            require((shares >= 0).all() and (shares.sum(axis=1) > 0).all(), "shares at leaves")
            require((forest.base == 0).all(), "shares at its leaves alone")
        return forest

    @classmethod
    def from_format_1(cls, plain: Mapping[str, Any], width: int, classes: int) -> Forest:
        """The same of a file of format 1, in which every node had its children and its values."""
        n = len(plain["feature"])
        for name in ("feature", "left", "right"):
            is_integer = plain[name].dtype == np.int64 and plain[name].shape == (n,)
            require(is_integer, "whole numbers for each node")
        require_numbers(plain["threshold"], (n,))
        require_numbers(plain["value"], (n, classes))
        leaf = plain["feature"] == -1
        require(are_complete_trees(leaf), "complete trees")
        indices = np.arange(n)
        for name, child in (
            ("left", np.where(leaf, indices, indices + 1)),
            ("right", right_children(leaf)),
        ):
            require(np.array_equal(plain[name], child), "nodes in their order")
        require(np.array_equal(plain["roots"], roots(leaf)), "trees that begin at a node")
        feature, threshold, value = plain["feature"], plain["threshold"], plain["value"]
        require(((feature >= -1) & (feature < width)).all(), "nodes that ask for features")
        forest = cls._small(feature, threshold[~leaf], value[leaf], plain["base"], plain["boosted"])
        return cls.from_plain(forest.plain(), width, classes)


@dataclass(frozen=True, eq=False)
class Linear:
    """Multinomial logistic regression; f features, K actions."""

    weights: Real  # (f, K)
    bias: Real  # (K,)

    def probabilities(self, features: Real) -> Real:
        """Probabilities of the actions at each time step, shape (m, K)."""
        # Each row by itself: a product of many rounds otherwise than one of a few, and a stream's
        # labels must not depend on its blocks.
        rows = np.ascontiguousarray(features)[:, None]
        return softmax(np.matmul(rows, self.weights)[:, 0] + self.bias)

    @classmethod
    def from_sklearn(cls, fitted: Any) -> Linear:
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
        """Check arrays that were read from a file; a ValueError where they do not fit."""
        linear = cls(plain["weights"], plain["bias"])
        require_numbers(linear.weights, (width, classes))
        require_numbers(linear.bias, (classes,))
        return linear


def _rounded_down(threshold: Real) -> NDArray[np.float32]:
    """The largest float32 up to each number: a float32 is at most the one as it is the other."""
    near = threshold.astype(np.float32)
    return np.where(near > threshold, np.nextafter(near, np.float32(-np.inf)), near)


def require_numbers(
    array: NDArray[Any], shape: tuple[int, ...], kinds: tuple[type, ...] = (np.float64,)
) -> None:
    """Raise a ValueError unless an array holds finite numbers of these types in this shape."""
    require(array.dtype in kinds and array.shape == shape, f"numbers of shape {shape}")
    require(np.isfinite(array).all(), "finite numbers")


def require(true: object, requirement: str) -> None:
    """Raise a ValueError unless a part is as it must be."""
    if not true:
        raise ValueError(f"the classifier must have {requirement}")
