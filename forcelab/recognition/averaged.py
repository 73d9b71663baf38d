"""A classifier of several members whose probabilities are averaged, then calibrated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.forest import Forest, Linear, must, must_be_numbers, softmax

__all__ = ["Averaged", "sharpened"]

Real = NDArray[np.float64]
Member = Forest | Linear

#: How a member is read, by what it is called in a file; "forest" is that of format 1.
_KINDS: dict[str, Callable[[Mapping[str, Any], int, int], Member]] = {
    "trees": Forest.from_plain,
    "forest": Forest.from_older,
    "linear": Linear.from_plain,
}

#: Probabilities below this count as this before they are sharpened: a tree may say 0.
FLOOR = 1e-6


def sharpened(probabilities: Real, exponent: float) -> Real:
    """Probabilities (n, K) to a power, rows summing to 1 again: above 1 surer, below less sure."""
    return softmax(exponent * np.log(np.maximum(probabilities, FLOOR)))


@dataclass(frozen=True, eq=False)
class Averaged:
    """Members that each look at the same standardised features; f of them, K actions.

    Its attribute and methods are named as those of scikit-learn's classifiers.

    Parameters
    ----------
    classes_ : ndarray of int64, shape (K,)
        Codes of the actions, rising.
    columns : ndarray of int64, shape (f,)
        Which columns of the features it looks at.
    mean, scale : ndarray of float64, shape (f,)
        Of the training samples; features are standardised by them.
    members : sequence of Forest or Linear, at least one
    exponent : float
        By which the mean of their probabilities is sharpened; 1 leaves it as it is.
    """

    classes_: NDArray[np.int64]
    columns: NDArray[np.int64]
    mean: Real
    scale: Real
    members: Sequence[Member]
    exponent: float = 1.0

    def predict_proba(self, features: Real) -> Real:
        """Probabilities of the actions, shape (n, K)."""
        ready = features[:, self.columns]  # a copy, which is standardised in place
        ready -= self.mean
        ready /= self.scale
        found = np.mean([member.probabilities(ready) for member in self.members], axis=0)
        return np.asarray(found) if self.exponent == 1 else sharpened(found, self.exponent)

    def predict(self, features: Real) -> NDArray[np.int64]:
        """Codes of the most probable actions, shape (n,)."""
        return np.asarray(self.classes_[np.argmax(self.predict_proba(features), axis=1)])

    def plain(self) -> dict[str, Any]:
        """Arrays, numbers and lists, from which :meth:`from_plain` makes an equal one."""
        return vars(self) | {"members": [member.plain() for member in self.members]}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, actions: int) -> Averaged:
        """Check what was read from a file.

        Parameters
        ----------
        plain : mapping
        width : int
            How many features there are.
        actions : int
            How many actions there are; codes lie below.

        Raises
        ------
        ValueError
            If anything does not fit together.
        """
        codes, columns, exponent = plain["classes_"], plain["columns"], float(plain["exponent"])
        must(codes.dtype == columns.dtype == np.int64, "whole numbers for codes and columns")
        must(codes.ndim == columns.ndim == 1 and len(codes) >= 2, "codes")
        must(codes[0] >= 0 and codes[-1] < actions and (np.diff(codes) > 0).all(), "codes")
        must(((columns >= 0) & (columns < width)).all(), "columns of features")
        must(0 < exponent < 1e3, "an exponent above 0")
        mean, scale = plain["mean"], plain["scale"]
        for array in (mean, scale):
            must_be_numbers(array, columns.shape)
        must((scale > 0).all(), "scales above 0")
        must(plain["members"], "a member")
        members = tuple(
            _KINDS[member["kind"]](member, len(columns), len(codes)) for member in plain["members"]
        )
        return cls(codes, columns, mean, scale, members, exponent)
