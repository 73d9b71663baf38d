"""Peers that decide time step by time step: MiniRocket with ridge regression, and LightGBM.

Sources
-------
Dempster, Schmidt and Webb, "MiniRocket: a very fast (almost) deterministic transform for time
series classification", KDD 2021. Ke et al., "LightGBM: a highly efficient gradient boosting
decision tree", NeurIPS 2017. Both with the settings that their packages come with.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import NDArray

from forcelab.measure.peers.peer import Fitted, Peer, Task, around
from forcelab.recognition.forest import softmax
from forcelab.recognition.presets import preset
from forcelab.recognition.windows import window_features

__all__ = ["LIGHTGBM", "MINIROCKET", "windows"]

Real = NDArray[np.float64]
Whole = NDArray[np.int64]

#: MiniRocket sees so many means over so many seconds around a time step: 1.28 s.
COUNT, PERIOD = 128, 0.01
#: It learns from every so-manieth labelled step: its features of all of them take gigabytes.
STRIDE = 2


def _cells(channels: Real, rate: float, places: Whole) -> Real:
    return around(channels, rate, places, COUNT, PERIOD)


def _minirocket(task: Task, seed: int) -> Fitted:
    """Ridge regression chooses its own penalty; its decisions are made positive by a softmax."""
    from aeon.classification.convolution_based import MiniRocketClassifier

    def shaped(rows: Real) -> NDArray[np.float32]:
        return rows.reshape(len(rows), task.channels, COUNT).astype(np.float32)

    X, y = task.labelled()
    made = MiniRocketClassifier(n_jobs=1, random_state=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what its compiler says of our NumPy is nobody's concern
        made.fit(shaped(X[::STRIDE]), y[::STRIDE])

    def recognised(rows: Real) -> Real:
        found = made.pipeline_.decision_function(shaped(rows))
        if found.ndim == 1:  # of two actions there is one decision
            found = np.stack([-found, found], axis=1)
        return _spread(softmax(found), made.classes_, task.actions)

    return recognised


def windows(channels: Real, rate: float, places: Whole) -> Real:
    """What presets `fast` and `best` look at around each time step, shape (m, f)."""
    return window_features(channels, rate, preset("fast").windows, places, "both")


def _lightgbm(task: Task, seed: int) -> Fitted:
    from lightgbm import LGBMClassifier

    X, y = task.labelled()
    made = LGBMClassifier(n_jobs=1, random_state=seed, verbose=-1).fit(X, y)

    def recognised(rows: Real) -> Real:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that rows have no names
            return _spread(np.asarray(made.predict_proba(rows)), made.classes_, task.actions)

    return recognised


def _spread(probabilities: Real, codes: Whole, actions: int) -> Real:
    """Probabilities of all actions; those that were not learnt have none."""
    out = np.zeros((len(probabilities), actions))
    out[:, codes] = probabilities
    return out


MINIROCKET = Peer("MiniRocket + ridge", "aeon", _cells, _minirocket)
LIGHTGBM = Peer("LightGBM on our windows", "lightgbm", windows, _lightgbm)
