"""Forests as the first format of recognisers had them."""

from __future__ import annotations

import numpy as np

__all__ = ["forest_in_format_1"]


def forest_in_format_1(forest):
    """What a file of format 1 holds of a forest: every node's children and values."""
    feature = forest.feature.astype(np.int64)
    leaf = feature < 0
    own, right, roots = np.arange(len(feature)), np.zeros(len(feature), np.int64), []
    waiting = []  # nodes whose left side is not done
    for node in own:
        if not waiting:
            roots.append(node)
        if not leaf[node]:
            waiting.append(node)
        else:
            right[node] = node
            while waiting and right[waiting[-1]]:
                waiting.pop()  # its right side is done, too
            if waiting:
                right[waiting[-1]] = node + 1
    threshold, value = np.full(len(feature), -2.0), np.zeros((len(feature), forest.value.shape[1]))
    threshold[~leaf], value[leaf] = forest.threshold, forest.value[forest.leaf]
    left = np.where(leaf, own, own + 1)
    arrays = {"feature": feature, "threshold": threshold, "left": left, "right": right}
    last = {"value": value, "base": forest.base, "boosted": forest.boosted}
    return {"kind": "forest", "roots": np.array(roots)} | arrays | last
