"""Classifiers by name, fitted step by step so that a fit can be watched and stopped."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.recognition.learning import AVERAGED, Care, fitting_averaged
from forcelab.signals.cwt_blocks import one_blas_thread

__all__ = ["Step", "fitting"]

#: Folds of the inner cross-validation that turns an SVM's decisions into probabilities.
CALIBRATION_FOLDS = 5
#: Neighbours that vote on a sample.
NEIGHBOURS = 5


@dataclass(frozen=True, slots=True)
class Step:
    """One step of a fit.

    Parameters
    ----------
    number, total : int
        This step, from 1, and the most there can be; a fit may converge earlier.
    loss : float or None
        Training loss; None for classifiers that have none.
    classifier : object
        The classifier as it stands, ready to predict; None where there is none yet.
    """

    number: int
    total: int
    loss: float | None
    classifier: Any


def fitting(
    name: str,
    X: NDArray[np.float64],
    y: NDArray[np.int64],
    seed: int,
    probabilities: bool,
    care: Care | None = None,
) -> Iterator[Step]:
    """Fit a classifier step by step; the last step's classifier is the fitted one.

    Parameters
    ----------
    name : str
        One of :data:`forcelab.recognition.settings.CLASSIFIERS`.
    X : ndarray, shape (n, f)
        Features.
    y : ndarray of int, shape (n,)
        Codes of the actions.
    seed : int
        Of weights, shuffles and ties.
    probabilities : bool
        Whether ``predict_proba`` will be asked for. The SVM gets none otherwise, and decides by
        its margins; with them, by what its margins were calibrated to.
    care : Care, optional
        What the fit must take care of, of those that take any.

    Yields
    ------
    Step
        One an epoch for the MLP; one for each inner fit, without a classifier, and a last one for
        those that choose or calibrate; a single one for the others.

    Raises
    ------
    InputError
        If there are fewer than two actions, all samples are the same, or there are too few to
        calibrate an SVM or to have neighbours.
    """
    counts = np.unique(y, return_counts=True)[1]
    if len(counts) < 2:
        raise InputError("Recognition needs labels of at least two actions; label one more.")
    if np.all(X[0] == X):
        raise InputError("The channels never change where they are labelled; choose others.")
    # Two hundred actions of a few samples each are a task; and to put filters back is not safe
    # where there are several threads.
    warnings.filterwarnings("ignore", "The number of unique classes is greater than", UserWarning)
    if name == "mlp":
        yield from _fitting_mlp(X, y, seed)
        return
    if name in AVERAGED:
        yield from _fitting_averaged(name, X, y, seed, care or Care())
        return
    if name == "nearest-neighbours" and len(y) < NEIGHBOURS:
        raise InputError(
            f"There are {len(y)} labelled samples, fewer than the {NEIGHBOURS} neighbours that "
            f"vote; label more."
        )
    classifier = _untrained(name, seed, probabilities, int(counts.min()))
    classifier.fit(X, y)
    yield Step(1, 1, None, classifier)


def _fitting_averaged(
    name: str, X: NDArray[np.float64], y: NDArray[np.int64], seed: int, care: Care
) -> Iterator[Step]:
    """Fit what :mod:`forcelab.recognition.learning` fits; inner fits are steps on the way."""
    job = fitting_averaged(name, X, y, seed, care)
    while (fitted := next(job)).done < fitted.total:
        yield Step(fitted.done, fitted.total, None, None)
    yield Step(fitted.total, fitted.total, None, finish(job))


def _untrained(name: str, seed: int, probabilities: bool, rarest: int) -> Any:
    """Build a classifier with scikit-learn's defaults."""
    if name == "naive-bayes":
        from sklearn.naive_bayes import GaussianNB

        return GaussianNB()
    if name == "decision-tree":
        from sklearn.tree import DecisionTreeClassifier

        return DecisionTreeClassifier(random_state=seed)
    if name == "nearest-neighbours":
        from sklearn.neighbors import KNeighborsClassifier

        # In this many dimensions a tree search visits every point anyway.
        return KNeighborsClassifier(NEIGHBOURS, algorithm="brute")
    from sklearn.svm import SVC

    if not probabilities:
        return SVC(random_state=seed)
    from sklearn.calibration import CalibratedClassifierCV
    from sklearn.model_selection import StratifiedKFold

    folds = min(CALIBRATION_FOLDS, rarest)
    if folds < 2:
        raise InputError(
            "An action has a single training sample, too few for the probabilities of an SVM; "
            "label more of it or switch the probability threshold off."
        )
    split = StratifiedKFold(folds, shuffle=True, random_state=seed)
    return CalibratedClassifierCV(SVC(random_state=seed), ensemble=False, cv=split)


def _fitting_mlp(X: NDArray[np.float64], y: NDArray[np.int64], seed: int) -> Iterator[Step]:
    """Fit scikit-learn's MLP with its defaults, an epoch at a time.

    ``partial_fit`` keeps the state of Adam, which ``warm_start`` with ``max_iter=1`` would lose.
    It is ``fit`` but for the order of the samples: ``fit`` shuffles what it shuffled in the epoch
    before, ``partial_fit`` starts from the order given. The loop stops as ``fit`` does: when the
    loss has not fallen by `tol` for more than `n_iter_no_change` epochs, or after `max_iter`.
    """
    from sklearn.neural_network import MLPClassifier

    # An int would start every epoch's shuffle anew and show all epochs the same batches.
    state = np.random.RandomState(seed)
    mlp = MLPClassifier(random_state=state)
    actions = np.unique(y)
    best, stale = np.inf, 0
    for number in range(1, mlp.max_iter + 1):
        # Two BLAS threads on matrices this small cost seven times the time of one.
        with one_blas_thread(), _hearing_interrupts():
            mlp.partial_fit(X, y, classes=actions)
        loss = float(mlp.loss_)
        yield Step(number, mlp.max_iter, loss, mlp)
        stale = stale + 1 if loss > best - mlp.tol else 0
        best = min(best, loss)
        if stale > mlp.n_iter_no_change:
            break


@contextmanager
def _hearing_interrupts() -> Iterator[None]:
    """Let Ctrl+C through, which scikit-learn swallows in the middle of an epoch and warns of."""
    if threading.current_thread() is not threading.main_thread():
        yield  # no other thread is ever interrupted, and filters of warnings belong to all threads
        return
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "Training interrupted by user")
        try:
            yield
        except UserWarning as interrupted:
            raise KeyboardInterrupt from interrupted
