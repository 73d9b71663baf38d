"""A multilayer perceptron as plain arrays, and its fit to features that are standardised already.

Neighbouring samples are almost copies of each other: on samples left out at random a network would
go on getting better while it learns demonstrations by heart. So where it stops is found on whole
demonstrations that were left out, by as many networks side by side as there are groups of them. The
one that is kept then learns from all of them for as many epochs.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Real
from forcelab.recognition.forest import require, require_numbers, softmax
from forcelab.runtime import one_blas_thread

Single = NDArray[np.float32]

#: Units of the hidden layer, and the weight of the penalty on the squares of its weights.
HIDDEN, PENALTY = 32, 0.1
#: Standardised features count as at most this, so that a force never met before does not decide
#: alone.
LIMIT = 2.0
#: Samples that a step of the optimiser looks at, at most, and least steps of an epoch: of a few
#: demonstrations it has few samples to learn from, and needs as many steps.
BATCH, STEPS = 200, 10
#: Most epochs, and epochs without a smaller loss after which no more follow.
EPOCHS, PATIENCE = 60, 10
#: Epochs where nothing can be left out to find where to stop.
EPOCHS_ALONE = 20
#: Samples between two moments at which a fit can be cancelled, some 10 ms.
PART = 2000
#: Least probability in a logarithmic loss.
LEAST = 1e-3


@dataclass(frozen=True, eq=False)
class Perceptron:
    """One hidden layer of h rectified units; f features, K actions."""

    inner: Real  # (f, h); weights of the hidden layer
    bias: Real  # (h,)
    outer: Real  # (h, K); from hidden units to the logits of the actions
    outer_bias: Real  # (K,)
    limit: float = np.inf  # features beyond it, to either side, count as this

    def probabilities(self, features: Real) -> Real:
        """Probabilities of the actions at each time step, shape (n, K)."""
        return softmax(self.logits(features))

    def logits(self, features: Real) -> Real:
        """Logits of the actions at each time step, shape (n, K)."""
        return np.asarray(np.maximum(self.arriving(features), 0.0) @ self.outer + self.outer_bias)

    def arriving(self, features: Real) -> Real:
        """Inputs of the hidden units, shape (n, h)."""
        return np.asarray(self.clipped(features) @ self.inner + self.bias)

    def clipped(self, features: Real) -> Real:
        """The features as far as they count."""
        return np.clip(features, -self.limit, self.limit)

    @classmethod
    def from_sklearn(cls, mlp: Any, limit: float = np.inf) -> Perceptron:
        """From scikit-learn's MLP with one hidden layer of rectified units."""
        inner, outer = (np.asarray(weights, dtype=np.float64) for weights in mlp.coefs_)
        bias, outer_bias = (np.asarray(b, dtype=np.float64) for b in mlp.intercepts_)
        if outer.shape[1] == 1:  # of two actions there is one logit, the second one's
            outer, outer_bias = np.hstack([0 * outer, outer]), np.append(0.0, outer_bias)
        return cls(inner, bias, outer, outer_bias, limit)

    def plain(self) -> dict[str, Any]:
        """Its arrays by name."""
        return {"kind": "perceptron"} | vars(self)

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, classes: int) -> Perceptron:
        """Check arrays that were read from a file; a ValueError where they do not fit."""
        network = cls(**{name: plain[name] for name in cls.__dataclass_fields__})
        (hidden,) = network.bias.shape
        require(hidden > 0, "hidden units")
        require_numbers(network.inner, (width, hidden))
        require_numbers(network.bias, (hidden,))
        require_numbers(network.outer, (hidden, classes))
        require_numbers(network.outer_bias, (classes,))
        require(type(network.limit) is float and network.limit > 0, "a limit above 0")
        return network


@contextmanager
def raise_interrupts() -> Iterator[None]:
    """Raise the KeyboardInterrupt that scikit-learn turns into a warning in an epoch."""
    if threading.current_thread() is not threading.main_thread():
        yield  # no other thread is ever interrupted, and filters of warnings belong to all threads
        return
    with warnings.catch_warnings():
        warnings.filterwarnings("error", "Training interrupted by user")
        try:
            yield
        except UserWarning as interrupted:
            raise KeyboardInterrupt from interrupted


@dataclass(frozen=True, slots=True)
class Epoch:
    """How far a fit is."""

    number: int  # of the epoch, from 1
    loss: float | None = None  # after it; None within it


class _Network:
    """A network in training, on some rows (m,) of clipped X (n, f) and codes y (n,)."""

    def __init__(self, X: Single, y: Codes, rows: Codes, seed: int) -> None:
        from sklearn.neural_network import MLPClassifier

        self._X, self._y, self._rows = X, y, rows
        self._random = np.random.default_rng(seed)
        # An int would start every epoch's shuffle anew and show all epochs the same batches.
        state = np.random.RandomState(seed)
        batch = min(BATCH, -(-len(rows) // STEPS))
        self.mlp = MLPClassifier((HIDDEN,), alpha=PENALTY, batch_size=batch, random_state=state)
        self.codes = np.unique(y[rows])

    def train(self, number: int) -> Generator[Epoch, None, float]:
        """Train on each row once more, a part at a time; gives the mean training loss."""
        order = self._random.permutation(self._rows)
        losses = []
        for part in np.array_split(order, -(-len(order) // PART)):
            with one_blas_thread(), raise_interrupts():
                self.mlp.partial_fit(self._X[part], self._y[part], classes=self.codes)
            losses.append(float(self.mlp.loss_))
            yield Epoch(number)
        return float(np.mean(losses))


def fit_perceptron(
    X: Single, y: Codes, rows: Codes, seed: int, epochs: int
) -> Generator[Epoch, None, Perceptron]:
    """Fit a network to some rows (m,) of clipped X (n, f) and codes y (n,).

    The loss of an epoch is that of its training rows.
    """
    network = _Network(X, y, rows, seed)
    for number in range(1, epochs + 1):
        yield Epoch(number, (yield from network.train(number)))
    return Perceptron.from_sklearn(network.mlp, LIMIT)


def held_out_epochs(
    X: Single, y: Codes, parts: Sequence[tuple[Codes, Codes]], seed: int
) -> Generator[Epoch, None, tuple[int, list[Real]]]:
    """The number of epochs that suits left-out rows best, and their probabilities after it.

    Each of `parts` are rows to train on and rows that are left out; there is a network for each,
    and the loss of an epoch is the mean over all left-out rows. Probabilities are of the codes of
    the rows trained on. It ends once the loss has not fallen for :data:`PATIENCE` epochs.
    """
    networks = [_Network(X, y, rows, seed) for rows, _ in parts]
    best, least, probabilities = 0, np.inf, list[Real]()
    for number in range(1, EPOCHS + 1):
        now, losses = [], []
        for network, (_, left_out) in zip(networks, parts, strict=True):
            yield from network.train(number)
            with one_blas_thread():
                P = network.mlp.predict_proba(X[left_out]).astype(np.float64)
            right = P[np.arange(len(P)), np.searchsorted(network.codes, y[left_out])]
            now.append(P)
            losses.append(-np.log(np.maximum(right, LEAST)))
        loss = float(np.concatenate(losses).mean())
        if loss < least:
            best, least, probabilities = number, loss, now
        yield Epoch(number, loss)
        if number >= best + PATIENCE:
            break
    return best, probabilities
