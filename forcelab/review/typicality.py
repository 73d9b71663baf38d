"""How typical each of some demonstrations is of all of them.

Who labels next what a recogniser is least certain of is led to the odd demonstrations first: what
is unlike all others is uncertain, too, and teaches little about them. Information density [1]_
therefore weighs the uncertainty of each by how many are like it. Demonstrations are alike by mean
and spread of their features, whatever was labelled.

References
----------
.. [1] Settles, B. and Craven, M., "An analysis of active learning strategies for sequence labeling
   tasks", EMNLP 2008, section 3.3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.examples import Examples

__all__ = ["STEPS", "sampled", "typicality"]

#: Time steps of each demonstration that are looked at: their mean and spread are known to a
#: thirtieth of the spread, and a hundred demonstrations of a hundred features take 40 MB.
STEPS = 1000

Steps = NDArray[np.float32]


def sampled(examples: Examples) -> Steps:
    """Some time steps of a demonstration, spread evenly over all that are not in gaps.

    Returns
    -------
    ndarray of float32, shape (m, f)
        At most :data:`STEPS` rows; none where all is a gap.
    """
    valid = np.flatnonzero(examples.valid)
    every = -(-len(valid) // STEPS) or 1
    # What is larger than the type holds is as odd as what it can hold.
    most = np.finfo(np.float32).max
    return np.clip(examples.features[valid[::every]], -most, most).astype(np.float32)


def typicality(demonstrations: Sequence[Steps]) -> NDArray[np.float64]:
    """How many are like each, as a share of all.

    Features are standardised over all demonstrations, and large ones made logarithmic: a single
    peak says little of what a demonstration is like. Two are alike by ``exp(-(d / h)^2)``, d being
    the distance of their means and spreads and h the median distance of two that differ.

    Parameters
    ----------
    demonstrations : sequence of ndarray, each of shape (m, f)
        As :func:`sampled` leaves them; m may differ.

    Returns
    -------
    ndarray of float64, shape (len(demonstrations),)
        Above 0, at most 1: of 1 where all are alike, as one by itself is. 0 for one without rows.
    """
    found = np.zeros(len(demonstrations))
    seen = [i for i, steps in enumerate(demonstrations) if len(steps)]
    if not seen:
        return found
    every = np.concatenate([demonstrations[i] for i in seen])
    mean, scale = every.mean(axis=0, dtype=np.float64), every.std(axis=0, dtype=np.float64)
    scale[scale == 0] = 1.0
    looks = np.stack([_look((demonstrations[i] - mean) / scale) for i in seen])
    # One after the other: of all pairs at once the differences of 1,000 take gigabytes.
    apart = np.stack([np.linalg.norm(looks - look, axis=1) for look in looks])
    differing = apart[apart > 0]
    usual = float(np.median(differing)) if len(differing) else 1.0
    found[seen] = np.exp(-np.square(apart / usual)).mean(axis=1)
    return found


def _look(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean and spread of standardised features, shape (2 f,)."""
    ready = np.arcsinh(steps)
    return np.concatenate([ready.mean(axis=0), ready.std(axis=0)])
