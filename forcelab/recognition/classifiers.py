"""Classifiers by name: how each is fitted, step by step, and checked when it is read from a file.

scikit-learn's compiled code follows the numbers in a classifier without looking: a node of a tree
that points outside of it, or a support vector too few, is read past the end of an array. So every
such number is checked before anything is predicted.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Codes, Flags, Real
from forcelab.errors import InputError
from forcelab.recognition.ensemble import (
    MEMBERS,
    READERS,
    FitOptions,
    FitProgress,
    fit_ensemble,
)
from forcelab.recognition.forest import require
from forcelab.recognition.perceptron import raise_interrupts
from forcelab.recognition.plugins import is_import_path, load_plugin, naming_plugin
from forcelab.runtime import one_blas_thread

#: No number that a recogniser holds is larger: what it learnt are forces, seconds and counts.
LARGEST = 1e15


def check_numbers(content: object) -> None:
    """Raise a ValueError unless all numbers in nested values, arrays and objects are in range."""
    waiting, visited = [content], set[int]()
    while waiting:
        value = waiting.pop()
        if isinstance(value, np.ndarray):
            if value.dtype.names:
                waiting += [value[name] for name in value.dtype.names]
            elif value.dtype.kind in "fiu" and value.size:
                require(float(np.abs(value, dtype=np.float64).max()) <= LARGEST, "numbers in range")
        elif isinstance(value, int | float | np.number):
            require(abs(float(value)) <= LARGEST, "numbers in range")
        elif isinstance(value, list | tuple):
            waiting += value
        elif id(value) not in visited:
            visited.add(id(value))
            inner = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
            waiting += inner.values()


def check_classifier(
    classifier: Any, name: str, probabilities: bool, width: int, actions: int
) -> None:
    """Check a fitted scikit-learn classifier from a file and make it ready to predict.

    `name` is its name in :data:`REGISTRY`, `width` its number of features; codes lie below
    `actions`. A decision tree's nodes are still plain arrays. Parts that do not fit together raise
    a ValueError; other errors of NumPy and scikit-learn, over parts that are missing or of a wrong
    type, pass. What plain NumPy would refuse is left to predicting one sample at the end.
    """
    registered = classifier_kind(name)
    kind, check = registered.type_name, registered.check
    if name == "svm" and probabilities:
        kind, check = "CalibratedClassifierCV", _check_calibrated
    require(type(classifier).__name__ == kind, f"the type {kind}")
    codes = classifier.classes_
    require(codes.ndim == 1 and codes.dtype == np.int64 and len(codes) >= 2, "codes")
    require(codes[0] >= 0 and codes[-1] < actions and np.all(np.diff(codes) > 0), "codes")
    check(classifier, width)
    _check_prediction(classifier, width, probabilities)


def _is_array(values: object, shape: tuple[int, ...], kind: str = "f") -> bool:
    """Whether a value is an array of this shape, of floats or of integers."""
    return isinstance(values, np.ndarray) and values.shape == shape and values.dtype.kind == kind


def _check_mlp(mlp: Any, _width: int) -> None:
    """An output for each action, by one numbering."""
    k, outputs = len(mlp.classes_), len(mlp.intercepts_[-1])
    require(outputs == (1 if k == 2 else k), "an output for each action")
    require(np.array_equal(mlp._label_binarizer.classes_, mlp.classes_), "codes")


def _check_nothing(_classifier: Any, _width: int) -> None:
    """Naive Bayes is plain NumPy throughout."""


def _check_tree(classifier: Any, width: int) -> None:
    """Inner nodes must point ahead, none outside; then the arrays become a tree."""
    from sklearn.tree._tree import Tree

    state = classifier.tree_
    _check_tree_state(state, width)
    classifier.tree_ = Tree(width, np.array([len(classifier.classes_)], dtype=np.intp), 1)
    classifier.tree_.__setstate__(state)


def _check_tree_state(state: Mapping[str, Any], width: int) -> None:
    nodes = state["nodes"]
    require(state["node_count"] == len(nodes), "as many nodes as it says")
    _check_nodes(nodes, nodes["left_child"] != -1, "left_child right_child feature", width)


def _check_nodes(nodes: NDArray[Any], inner: Flags, names: str, width: int) -> None:
    """Inner nodes of a tree point ahead, and at features that there are.

    `names` are the fields of a node with its two children and its feature.
    """
    n = len(nodes)
    require(n >= 1 and nodes.ndim == 1, "a list of nodes")
    *children, features = (nodes[name][inner] for name in names.split())
    ahead = np.arange(n)[inner]
    for child in children:
        require(np.all((child > ahead) & (child < n)), "nodes that point at nodes")
    require(np.all((features >= 0) & (features < width)), "nodes that ask for features")


def _check_neighbours(neighbours: Any, width: int) -> None:
    """Every known sample must have a code that there is."""
    n, codes = neighbours.n_samples_fit_, neighbours._y
    require(_is_array(neighbours._fit_X, (n, width)), "samples that fit the features")
    require(_is_array(codes, (n,), "i"), "a code for each sample")
    require(np.all((codes >= 0) & (codes < len(neighbours.classes_))), "codes of actions")
    plain = (neighbours._fit_method, neighbours.metric, neighbours.metric_params, neighbours.p)
    require(plain == ("brute", "minkowski", None, 2), "Euclidean distances")
    require(neighbours.weights == "uniform" and neighbours.outputs_2d_ is False, "equal votes")


def _check_svm(svm: Any, width: int) -> None:
    """Support vectors, their counts and coefficients must agree."""
    k, n = len(svm.classes_), len(svm.support_vectors_)
    counts = svm._n_support
    require(svm.kernel == "rbf" and svm._sparse is False, "a Gaussian kernel")
    require(_is_array(svm.support_vectors_, (n, width)), "support vectors that fit the features")
    require(_is_array(svm.support_, (n,), "i"), "a number for each support vector")
    require(_is_array(counts, (k,), "i") and np.all(counts >= 0) and sum(counts) == n, "counts")
    for coefficients in (svm.dual_coef_, svm._dual_coef_):
        require(_is_array(coefficients, (k - 1, n)), "coefficients for each support vector")
    for intercepts in (svm.intercept_, svm._intercept_):
        require(_is_array(intercepts, (k * (k - 1) // 2,)), "an intercept for each pair of actions")
    require(len(svm._probA) == len(svm._probB) == 0, "no probabilities of its own")


def _check_calibrated(calibrated: Any, width: int) -> None:
    """One SVM, and for each action a curve from its decisions to probabilities."""
    from sklearn.svm import SVC

    (only,) = calibrated.calibrated_classifiers_
    k = len(calibrated.classes_)
    require(type(only.estimator) is SVC, "an SVM inside")
    require(len(only.calibrators) == (1 if k == 2 else k), "a curve for each action")
    _check_svm(only.estimator, width)


def _check_prediction(classifier: Any, width: int, probabilities: bool) -> None:
    """Predict one sample, so that whatever is wrong still shows now and not later."""
    sample = np.zeros((1, width))
    with np.errstate(all="ignore"):
        require(classifier.predict(sample)[0] in classifier.classes_, "codes of actions")
        if probabilities:
            shape = (1, len(classifier.classes_))
            require(
                classifier.predict_proba(sample).shape == shape, "a probability for each action"
            )


#: Folds of the inner cross-validation that turns an SVM's decisions into probabilities.
CALIBRATION_FOLDS = 5
#: Neighbours that vote on a sample.
NEIGHBOURS = 5


def fit_classifier(
    name: str, X: Real, y: Codes, seed: int, probabilities: bool, options: FitOptions | None = None
) -> Iterator[FitProgress]:
    """Fit a classifier to X (n, f) and codes y (n,); that of the last progress is the fitted one.

    The MLP yields every epoch; those that calibrate or average yield their inner fits first,
    without a classifier. All that are kept as plain arrays standardise the features, and obey the
    options; the others do so with ``options.standardised``, and else are what the paper compared.
    Without `probabilities` an SVM then decides by its margins and has no ``predict_proba``. An
    InputError says that there are fewer than two actions, no feature changes, or samples are too
    few to calibrate an SVM or to have neighbours.
    """
    if len(np.unique(y)) < 2:
        raise InputError("Recognition needs labels of at least two actions; label one more.")
    if np.all(X[0] == X):
        raise InputError("The channels never change where they are labelled; choose others.")
    # Two hundred actions of a few samples each are a task; and to put filters back is not safe
    # where there are several threads.
    warnings.filterwarnings("ignore", "The number of unique classes is greater than", UserWarning)
    fit, options = classifier_kind(name).fit, options or FitOptions()
    if fit is None or options.standardised:
        member = name if name in MEMBERS else partial(FittedMember.fit, name)
        yield from fit_ensemble(member, X, y, seed, options)
    else:
        yield from fit(X, y, seed, probabilities)


def fit_in_one_step(make: Callable[[Codes, int, bool], Any]) -> Fit:
    """A fit of one step, of what ``make(y, seed, probabilities)`` gives untrained."""

    def fit(X: Real, y: Codes, seed: int, probabilities: bool) -> Iterator[FitProgress]:
        classifier = make(y, seed, probabilities)
        classifier.fit(X, y)
        yield FitProgress(1, 1, "fit", classifier=classifier)

    return fit


def _naive_bayes(_y: Codes, _seed: int, _probabilities: bool) -> Any:
    from sklearn.naive_bayes import GaussianNB

    return GaussianNB()


def _decision_tree(_y: Codes, seed: int, _probabilities: bool) -> Any:
    from sklearn.tree import DecisionTreeClassifier

    return DecisionTreeClassifier(random_state=seed)


def _nearest_neighbours(y: Codes, _seed: int, _probabilities: bool) -> Any:
    if len(y) < NEIGHBOURS:
        raise InputError(
            f"There are {len(y)} labelled samples, fewer than the {NEIGHBOURS} neighbours that "
            f"vote; label more."
        )
    from sklearn.neighbors import KNeighborsClassifier

    # In this many dimensions a tree search visits every point anyway.
    return KNeighborsClassifier(NEIGHBOURS, algorithm="brute")


def _svm(y: Codes, seed: int, probabilities: bool) -> Any:
    from sklearn.svm import SVC

    if not probabilities:
        return SVC(random_state=seed)
    from sklearn.calibration import CalibratedClassifierCV
    from sklearn.model_selection import StratifiedKFold

    folds = min(CALIBRATION_FOLDS, int(np.unique(y, return_counts=True)[1].min()))
    if folds < 2:
        raise InputError(
            "An action has a single training sample, too few for the probabilities of an SVM; "
            "label more of it or switch the probability threshold off."
        )
    split = StratifiedKFold(folds, shuffle=True, random_state=seed)
    return CalibratedClassifierCV(SVC(random_state=seed), ensemble=False, cv=split)


def _fit_mlp(X: Real, y: Codes, seed: int, _probabilities: bool) -> Iterator[FitProgress]:
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
    best, unimproved = np.inf, 0
    for number in range(1, mlp.max_iter + 1):
        # Two BLAS threads on matrices this small cost seven times the time of one.
        with one_blas_thread(), raise_interrupts():
            mlp.partial_fit(X, y, classes=actions)
        loss = float(mlp.loss_)
        yield FitProgress(number, mlp.max_iter, "fit", loss, mlp)
        unimproved = unimproved + 1 if loss > best - mlp.tol else 0
        best = min(best, loss)
        if unimproved > mlp.n_iter_no_change:
            break


def prediction_state(name: str, classifier: Any) -> Any:
    """A copy of a classifier of scikit-learn, with what prediction needs, for a file."""
    if is_import_path(name):
        return classifier
    bare = copy.copy(classifier)
    # The optimiser's state and the shuffles serve further training only.
    vars(bare).pop("_optimizer", None)
    vars(bare).pop("_random_state", None)
    if hasattr(bare, "tree_"):
        # As plain arrays, which can be checked before compiled code follows them.
        bare.tree_ = bare.tree_.__getstate__()
    return bare


@dataclass(frozen=True, eq=False)
class FittedMember:
    """A classifier of scikit-learn that looks at standardised features."""

    name: str  # in :data:`REGISTRY`
    classifier: Any

    @classmethod
    def fit(cls, name: str, X: Real, y: Codes, seed: int) -> FittedMember:
        """Fit it to features (n, f) and codes (n,)."""
        # An inner fit may have a single sample of an action, and an SVM needs two.
        codes, counts = np.unique(y, return_counts=True)
        lone = np.isin(y, codes[counts == 1])
        X, y = np.concatenate([X, X[lone]]), np.append(y, y[lone])
        fit = classifier_kind(name).fit
        assert fit is not None  # all others are members of their own
        *_, last = fit(X, y, seed, True)
        return cls(name, last.classifier)

    def probabilities(self, features: Real) -> Real:
        """Probabilities of the actions at each time step, shape (n, K)."""
        return np.asarray(self.classifier.predict_proba(features))

    def plain(self) -> dict[str, Any]:
        """Its name and what prediction needs."""
        return {
            "kind": "scikit-learn",
            "name": self.name,
            "classifier": prediction_state(self.name, self.classifier),
        }

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int, classes: int) -> FittedMember:
        """Check what was read from a file; a ValueError where it does not fit."""
        name, classifier = plain["name"], plain["classifier"]
        check_classifier(classifier, name, True, width, classes)
        require(len(classifier.classes_) == classes, "an output for each action")
        return cls(name, classifier)


READERS["scikit-learn"] = FittedMember.from_plain

#: ``fit(X, y, seed, probabilities)``, as of :func:`fit_classifier`.
Fit = Callable[[Real, Codes, int, bool], Iterator[FitProgress]]


@dataclass(frozen=True, slots=True)
class ClassifierKind:
    """One classifier that can be chosen."""

    label: str  # what the window calls it
    #: Fits it step by step; None for what :mod:`forcelab.recognition.ensemble` fits and reads
    fit: Fit | None = None
    type_name: str = ""  # of scikit-learn's class, which a file must hold
    #: ``check(classifier, width)`` raises a ValueError where parts of one from a file do not fit
    #: together
    check: Callable[[Any, int], None] = _check_nothing
    random: bool = True  # whether something is drawn at random, so that the seed counts

    @property
    def plain(self) -> bool:
        """Whether it is kept as plain arrays, by :mod:`forcelab.recognition.ensemble`."""
        return self.fit is None


#: Every classifier by name, in the order of menus: the paper's choice and those it was compared
#: with, then ours.
REGISTRY: Mapping[str, ClassifierKind] = {
    # Of wavelets this is the paper's; of windows that of forcelab.recognition.perceptron.
    "mlp": ClassifierKind("Multilayer perceptron", _fit_mlp, "MLPClassifier", _check_mlp),
    "naive-bayes": ClassifierKind(
        "Naive Bayes", fit_in_one_step(_naive_bayes), "GaussianNB", random=False
    ),
    "decision-tree": ClassifierKind(
        "Decision tree", fit_in_one_step(_decision_tree), "DecisionTreeClassifier", _check_tree
    ),
    "svm": ClassifierKind("Support vector machine", fit_in_one_step(_svm), "SVC", _check_svm),
    "nearest-neighbours": ClassifierKind(
        "Nearest neighbours",
        fit_in_one_step(_nearest_neighbours),
        "KNeighborsClassifier",
        _check_neighbours,
        random=False,
    ),
    "logistic": ClassifierKind("Logistic regression", random=False),
    "extra-trees": ClassifierKind("Extra trees"),
    "trees-mlp": ClassifierKind("Extra trees and multilayer perceptron"),
    "boosting": ClassifierKind("Gradient boosting"),
    "ensemble": ClassifierKind("Extra trees and logistic regression"),
}


def classifier_kind(name: str) -> ClassifierKind:
    """The classifier of a name in :data:`REGISTRY`, or one's own of an import path.

    An InputError says that a path was not named here, or cannot be imported.
    """
    if not is_import_path(name):
        return REGISTRY[name]
    make = load_plugin("classifier", name)
    with _naming_own(name):
        type_name = type(make()).__name__
    return ClassifierKind(name, partial(_fit_own, name, make), type_name, _check_own)


def _naming_own(name: str) -> AbstractContextManager[None]:
    return naming_plugin(name, "failed as a classifier", "correct it, or choose another classifier")


def _fit_own(
    name: str, make: Callable[[], Any], X: Real, y: Codes, seed: int, probabilities: bool
) -> Iterator[FitProgress]:
    """Fit one's own classifier and see that it does what recognition needs."""
    with _naming_own(name):
        classifier = make()
        parameters = classifier.get_params() if hasattr(classifier, "get_params") else {}
        if parameters.get("random_state", seed) is None:
            classifier.set_params(random_state=seed)
        classifier.fit(X, y)
        actions = np.unique(y)
        require(np.array_equal(classifier.classes_, actions), "classes_ of all codes, rising")
        if probabilities and not hasattr(classifier, "predict_proba"):
            raise InputError(
                f"'{name}' gives no probabilities, which a threshold, a decoder and standardised "
                f"features need; give it a predict_proba, as CalibratedClassifierCV does, or "
                f"switch these off."
            )
        _check_prediction(classifier, X.shape[1], probabilities)
    yield FitProgress(1, 1, "fit", classifier=classifier)


def _check_own(classifier: Any, width: int) -> None:
    """Trees within it point at their own nodes; its numbers are else its own affair.

    Of a pipeline each step looks at as many features as it says itself, which scikit-learn checks
    before it predicts.
    """
    from sklearn.tree._tree import Tree

    waiting, visited = [(classifier, width)], set[tuple[int, int]]()
    while waiting:
        value, width = waiting.pop()
        if (id(value), width) in visited:
            continue
        visited.add((id(value), width))
        inner: Iterable[Any] = ()
        if isinstance(value, Tree):
            _check_tree_state(value.__getstate__(), width)
        elif type(value).__name__ == "TreePredictor":  # of histogram gradient boosting
            nodes = value.nodes
            require(not nodes["is_categorical"].any(), "features that are numbers")
            _check_nodes(nodes, nodes["is_leaf"] == 0, "left right feature_idx", width)
        elif isinstance(value, np.ndarray):
            inner = value.ravel().tolist() if value.dtype == object else ()
        elif isinstance(value, list | tuple):
            inner = value
        else:
            parts = value if isinstance(value, Mapping) else getattr(value, "__dict__", {})
            width, inner = parts.get("n_features_in_", width), parts.values()
            if isinstance(members := parts.get("estimators_"), np.ndarray):
                # Gradient boosting gives its samples to its trees without asking them.
                same = all(tree.n_features_in_ == width for tree in members.ravel())
                require(same, "trees of its own features")
        waiting += [(part, width) for part in inner]
