"""Binary trees told by nothing but which of their nodes are leaves.

Nodes stand in the order in which one comes to them: first a node, then all of its left side, then
all of its right side; one tree after another. Where a node's children are follows from that, so
that it need not be stored, and whatever is stored makes trees that end.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["are_trees", "right_children", "roots"]

Whole = NDArray[np.int32]


def _open(leaf: NDArray[np.bool_]) -> Whole:
    """How many right sides are still to come before each node, and after all; shape (n + 1,).

    Counted from 0 before the first tree; each tree that is complete takes one away.
    """
    steps: NDArray[Any] = np.zeros(len(leaf) + 1, dtype=np.int32)
    np.cumsum(np.where(leaf, np.int32(-1), np.int32(1)), out=steps[1:])
    return steps


def are_trees(leaf: NDArray[np.bool_]) -> bool:
    """Whether nodes, told which are leaves, make complete trees, at least one."""
    steps = _open(leaf)
    return len(leaf) > 0 and bool(steps[-1] < steps[:-1].min())


def roots(leaf: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The first node of each tree, shape (t,)."""
    steps = _open(leaf)[:-1]
    lowest = np.minimum.accumulate(steps)
    return np.flatnonzero(np.diff(lowest, prepend=np.int32(1)))


def right_children(leaf: NDArray[np.bool_]) -> Whole:
    """Where the right side of each node begins, shape (n,); of a leaf, the leaf itself."""
    # A left side takes away what its node has opened: the next node before which as much is open
    # as before the node itself is the first one of the right side.
    steps = _open(leaf)[:-1]
    order = np.argsort(steps, kind="stable").astype(np.int32)
    following = np.empty(len(leaf), dtype=np.int32)
    following[order[:-1]] = order[1:]
    following[order[-1]] = order[-1]
    return np.where(leaf, np.arange(len(leaf), dtype=np.int32), following)
