"""Whether a classifier read from a file holds together.

scikit-learn's compiled code follows the numbers in a classifier without looking: a node of a tree
that points outside of it, or a support vector too few, is read past the end of an array. So every
such number is looked at before anything is predicted.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.settings import Settings

__all__ = ["check_classifier"]


def check_classifier(classifier: Any, settings: Settings, width: int, actions: int) -> None:
    """Check a fitted classifier and make it ready to predict.

    Parameters
    ----------
    classifier : object
        As read from a file; a decision tree's nodes are still plain arrays.
    settings : Settings
        They say which classifier it must be.
    width : int
        How many features it must take.
    actions : int
        How many actions there are; its codes must lie below.

    Raises
    ------
    ValueError
        If it is another classifier, or its parts do not fit together.

    Notes
    -----
    Other errors of NumPy and scikit-learn, over parts that are missing or of a wrong type, pass.
    """
    checks: dict[str, tuple[str, Callable[[Any, int], None]]] = {
        "mlp": ("MLPClassifier", _check_mlp),
        "naive-bayes": ("GaussianNB", _check_naive_bayes),
        "decision-tree": ("DecisionTreeClassifier", _check_tree),
        "nearest-neighbours": ("KNeighborsClassifier", _check_neighbours),
        "svm": ("SVC", _check_svm),
    }
    kind, check = checks[settings.classifier]
    if settings.classifier == "svm" and settings.needs_probabilities:
        kind, check = "CalibratedClassifierCV", _check_calibrated
    _must(type(classifier).__name__ == kind, f"the type {kind}")
    codes = classifier.classes_
    _must(codes.ndim == 1 and codes.dtype == np.int64 and len(codes) >= 2, "codes")
    _must(codes[0] >= 0 and codes[-1] < actions and np.all(np.diff(codes) > 0), "codes")
    _must(int(classifier.n_features_in_) == width, f"{width} features")
    check(classifier, width)
    _check_prediction(classifier, width, settings.needs_probabilities)


def _must(true: object, what: str) -> None:
    """Raise unless a part is as it must be."""
    if not true:
        raise ValueError(f"the classifier must have {what}")


def _is_array(values: object, shape: tuple[int, ...], kind: str = "f") -> bool:
    """Whether something is an array of this shape, of floats or of integers."""
    return isinstance(values, np.ndarray) and values.shape == shape and values.dtype.kind == kind


def _check_mlp(mlp: Any, width: int) -> None:
    """Layers must fit each other; plain NumPy multiplies them."""
    sizes = [width, *(len(biases) for biases in mlp.intercepts_)]
    _must(mlp.n_layers_ == len(sizes) == len(mlp.coefs_) + 1, "as many layers as it says")
    for weights, shape in zip(mlp.coefs_, pairwise(sizes), strict=True):
        _must(_is_array(weights, shape), "fitting layers")
    _must(len(mlp.classes_) == (2 if sizes[-1] == 1 else sizes[-1]), "an output for each action")


def _check_naive_bayes(bayes: Any, width: int) -> None:
    """One normal distribution for each action and feature."""
    shape = (len(bayes.classes_), width)
    _must(_is_array(bayes.theta_, shape) and _is_array(bayes.var_, shape), "fitting distributions")
    _must(_is_array(bayes.class_prior_, shape[:1]), "fitting priors")


def _check_tree(classifier: Any, width: int) -> None:
    """Inner nodes must point ahead, none outside; then the arrays become a tree."""
    from sklearn.tree._tree import Tree

    state = classifier.tree_
    nodes: NDArray[Any] = state["nodes"]
    n, k = len(nodes), len(classifier.classes_)
    _must(n >= 1 and nodes.ndim == 1 and state["node_count"] == n, "as many nodes as it says")
    _must(_is_array(state["values"], (n, 1, k)), "values for each node")
    inner = nodes["left_child"] != -1
    ahead = np.arange(n)[inner]
    for child in (nodes["left_child"][inner], nodes["right_child"][inner]):
        _must(np.all((child > ahead) & (child < n)), "nodes that point at nodes")
    asked = nodes["feature"][inner]
    _must(np.all((asked >= 0) & (asked < width)), "nodes that ask for features")
    tree = Tree(width, np.array([k], dtype=np.intp), 1)
    tree.__setstate__(state)
    _must(classifier.n_outputs_ == 1 and classifier.n_classes_ == k, "one output")
    classifier.tree_ = tree


def _check_neighbours(neighbours: Any, width: int) -> None:
    """Every known sample must have a code that there is."""
    n, codes = neighbours.n_samples_fit_, neighbours._y
    _must(_is_array(neighbours._fit_X, (n, width)), "samples that fit the features")
    _must(_is_array(codes, (n,), "i"), "a code for each sample")
    _must(np.all((codes >= 0) & (codes < len(neighbours.classes_))), "codes of actions")
    _must(1 <= neighbours.n_neighbors <= n, "enough samples")
    plain = (neighbours._fit_method, neighbours.metric, neighbours.metric_params, neighbours.p)
    _must(plain == ("brute", "minkowski", None, 2), "Euclidean distances")
    _must(neighbours.weights == "uniform" and neighbours.outputs_2d_ is False, "equal votes")


def _check_svm(svm: Any, width: int) -> None:
    """Support vectors, their counts and coefficients must agree."""
    k, n = len(svm.classes_), len(svm.support_vectors_)
    counts = svm._n_support
    _must(svm.kernel == "rbf" and svm._sparse is False, "a Gaussian kernel")
    _must(_is_array(svm.support_vectors_, (n, width)), "support vectors that fit the features")
    _must(_is_array(svm.support_, (n,), "i"), "a number for each support vector")
    _must(_is_array(counts, (k,), "i") and np.all(counts >= 0) and sum(counts) == n, "counts")
    for coefficients in (svm.dual_coef_, svm._dual_coef_):
        _must(_is_array(coefficients, (k - 1, n)), "coefficients for each support vector")
    for intercepts in (svm.intercept_, svm._intercept_):
        _must(_is_array(intercepts, (k * (k - 1) // 2,)), "an intercept for each pair of actions")
    _must(len(svm._probA) == len(svm._probB) == 0, "no probabilities of its own")


def _check_calibrated(calibrated: Any, width: int) -> None:
    """One SVM, and for each action a curve from its decisions to probabilities."""
    from sklearn.calibration import _SigmoidCalibration
    from sklearn.svm import SVC

    (only,) = calibrated.calibrated_classifiers_
    k = len(calibrated.classes_)
    _must(type(only.estimator) is SVC, "an SVM inside")
    _must(np.array_equal(only.classes, calibrated.classes_), "the same codes inside")
    _must(np.array_equal(only.estimator.classes_, calibrated.classes_), "the same codes inside")
    _must(int(only.estimator.n_features_in_) == width, f"{width} features")
    _must(len(only.calibrators) == (1 if k == 2 else k), "a curve for each action")
    _must(all(type(curve) is _SigmoidCalibration for curve in only.calibrators), "sigmoid curves")
    _check_svm(only.estimator, width)


def _check_prediction(classifier: Any, width: int, probabilities: bool) -> None:
    """Predict one sample, so that whatever is wrong still shows now and not later."""
    sample = np.zeros((1, width))
    with np.errstate(all="ignore"):
        _must(classifier.predict(sample)[0] in classifier.classes_, "codes of actions")
        if probabilities:
            shape = (1, len(classifier.classes_))
            _must(classifier.predict_proba(sample).shape == shape, "a probability for each action")
