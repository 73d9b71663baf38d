"""Recognition as estimators of scikit-learn, whose samples are whole demonstrations.

So its splitters leave out demonstrations, its searches try settings, and its scores are ours.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator, TransformerMixin
from sklearn.utils.validation import check_is_fitted

from forcelab.arrays import Real
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.labels import Segments, Track, model_author
from forcelab.recognition.cross_validation import held_out_prediction
from forcelab.recognition.examples import (
    LabelledDemonstration,
    actions_of,
    common_channels,
    common_rate,
    prepare_examples,
)
from forcelab.recognition.metrics import pool
from forcelab.recognition.plugins import (
    Named,
    name_as,
    named_here,
    register_classifier,
    register_features,
)
from forcelab.recognition.presets import preset as preset_named
from forcelab.recognition.recogniser import Recogniser
from forcelab.recognition.settings import FIELD_GROUPS, Settings
from forcelab.recognition.training import train
from forcelab.text import unknown_word

#: The value of a parameter that was not given: as in the preset. None switches a filter off.
AS_PRESET = "preset"
#: What a parameter that is a function, as those of one's own, is registered by.
_REGISTERING: dict[str, Callable[[Any], str]] = {
    "classifier": register_classifier,
    "features": register_features,
}
#: What time steps are known by; the other settings are of what learns from them.
FEATURE_SETTINGS = (*(field.name for field in FIELD_GROUPS["Features"]), "windows")


def _takes(*names: str) -> Any:
    """Decorate a class whose constructor takes a preset and these settings.

    The signature is made from the settings, as scikit-learn reads the parameters from it.
    """

    def decorate(cls: type) -> type:
        def __init__(self: Any, preset: str | Settings = "paper", **settings: Any) -> None:  # noqa: N807
            if unknown := sorted(settings.keys() - set(names)):
                raise TypeError(unknown_word("parameter", unknown[0], ("preset", *names)))
            self.preset = preset
            for name in names:
                setattr(self, name, settings.get(name, AS_PRESET))

        either = inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY
        parameters = [
            inspect.Parameter("self", either[0]),
            inspect.Parameter("preset", either[0], default="paper"),
            *(inspect.Parameter(name, either[1], default=AS_PRESET) for name in names),
        ]
        __init__.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        cls.__init__ = __init__  # type: ignore[misc]
        return cls

    return decorate


class _OfDemonstrations(BaseEstimator):
    """An estimator whose parameters are settings and whose samples are demonstrations."""

    preset: str | Settings

    @property
    def settings(self) -> Settings:
        """The settings that the parameters mean; an InputError if one is out of its range."""
        base = self.preset if isinstance(self.preset, Settings) else preset_named(self.preset)
        changed = {
            name: value
            for name, value in self.get_params(deep=False).items()
            if name != "preset" and not (isinstance(value, str) and value == AS_PRESET)
        }
        for name, register in _REGISTERING.items():
            if callable(changed.get(name)):
                changed[name] = register(changed[name])
        return base.replace(**changed)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy for a worker of a search, where all that was named here is named, too."""
        return _unpickle, (type(self), self.__getstate__(), named_here())

    def __sklearn_tags__(self) -> Any:
        """What it takes is no array: scikit-learn's checks that give it one are skipped."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array = False
        tags.no_validation = True
        return tags


def _unpickle(cls: Any, state: dict[str, Any], named: tuple[Named, ...]) -> Any:
    name_as(named)
    estimator = cls.__new__(cls)
    estimator.__setstate__(state)
    return estimator


@_takes(*(field.name for field in fields(Settings) if field.name != "preset"))
class ForceActionClassifier(_OfDemonstrations):
    """Train and recognise as an estimator of scikit-learn.

    ``fit`` is :func:`train`, ``predict`` is :meth:`Recogniser.predict`, to the bit. A sample is a
    demonstration and its target a track, so that scikit-learn's splitters leave out whole
    demonstrations, or tasks with ``groups=[d.task for d in demonstrations]``. Tracks are no
    classes that a splitter could stratify by, so scikit-learn does not count it as a classifier.

    Parameters
    ----------
    preset : str or Settings
        Where every other parameter begins: the name of a preset, as of :func:`preset`, or settings.
    **settings
        Any field of :class:`Settings`, such as ``stride``, ``max_scale`` or ``classifier``. One
        that is not given, which is ``"preset"``, is as in the preset. ``classifier`` and
        ``features`` may be your own, as of :func:`register_classifier`: a function or its path.

    Attributes
    ----------
    recogniser_ : Recogniser
        What was learnt, for :func:`save_recogniser` too.
    classes_ : ndarray of str, shape (K,)
        The actions it tells apart; the columns of :meth:`predict_proba`.

    Raises
    ------
    TypeError
        If a parameter is no setting.

    Examples
    --------
    >>> import forcelab
    >>> from sklearn.model_selection import GridSearchCV, LeaveOneOut
    >>> search = GridSearchCV(
    ...     forcelab.ForceActionClassifier("fast"), {"stride": [5, 10]}, cv=LeaveOneOut()
    ... )
    >>> search.get_params()["estimator__stride"]
    'preset'
    """

    recogniser_: Recogniser

    def fit(
        self, demonstrations: Sequence[Demonstration], tracks: Sequence[Track | Segments]
    ) -> ForceActionClassifier:
        """Train on demonstrations.

        Parameters
        ----------
        demonstrations : sequence of Demonstration
        tracks : sequence of Track or of tuples of Segment
            The labels of each; those without a segment are passed over.

        Returns
        -------
        ForceActionClassifier
            Itself.

        Raises
        ------
        InputError
            If a setting is out of its range, or there is too little to train on.
        """
        labelled = _labelled(demonstrations, tracks)
        self.recogniser_ = train(labelled, self.settings)
        self.classes_ = np.array(self.recogniser_.actions)
        return self

    def predict(self, demonstrations: Sequence[Demonstration]) -> list[Track]:
        """The predicted track of each demonstration, after filters or decoder.

        Raises
        ------
        InputError
            If a demonstration lacks a channel that was trained on.
        """
        check_is_fitted(self, "recogniser_")
        author = model_author(type(self).__name__)
        predictions = map(self.recogniser_.predict, demonstrations)
        return [Track(author, prediction.segments) for prediction in predictions]

    def predict_proba(self, demonstrations: Sequence[Demonstration]) -> list[Real]:
        """Probabilities of the actions, an array (n, K) for each demonstration of n samples.

        They are the classifier's, before filters or decoder; columns are :attr:`classes_`.

        Raises
        ------
        InputError
            If the classifier gives none, or a demonstration lacks a channel.
        """
        check_is_fitted(self, "recogniser_")
        return [self._probabilities(demonstration) for demonstration in demonstrations]

    def _probabilities(self, demonstration: Demonstration) -> Real:
        examples = self.recogniser_.prepare(demonstration)
        _, probabilities = self.recogniser_.classify(examples.features, examples.valid, True)
        if probabilities is None:
            settings = self.recogniser_.settings
            raise InputError(
                f"The classifier {settings.classifier} was trained without probabilities; give a "
                f"threshold, and it learns them."
            )
        return probabilities[examples.nearest(demonstration.times)]

    def score(
        self, demonstrations: Sequence[Demonstration], tracks: Sequence[Track | Segments]
    ) -> float:
        """The share of the labelled samples that are right, 0 to 1, as an evaluation has it.

        What is predicted as unlabelled is wrong; what the human left unlabelled does not count.

        Raises
        ------
        InputError
            If nothing of it is labelled.
        """
        check_is_fitted(self, "recogniser_")
        recogniser = self.recogniser_
        settings = recogniser.settings.replace(channels=recogniser.channels)
        labelled = _labelled(demonstrations, tracks)
        examples = [prepare_examples(item, settings, recogniser.rate) for item in labelled]
        actions = tuple(dict.fromkeys((*recogniser.actions, *actions_of(examples))))
        counts = [
            held_out_prediction(item, known, recogniser.predict_examples(known), actions).counts(
                "filtered"
            )
            for item, known in zip(labelled, examples, strict=True)
        ]
        accuracy = pool("", counts).accuracy
        if accuracy is None:
            raise InputError("Nothing is labelled in what was to be scored; label some of it.")
        return accuracy


@_takes(*FEATURE_SETTINGS)
class ForceFeatures(TransformerMixin, _OfDemonstrations):
    """The features of every time step, as a transformer of scikit-learn.

    A demonstration becomes as many rows as it has time steps, one demonstration after the other:
    the first step of a pipeline whose others look at time steps, such as a PCA or a clustering.

    Parameters
    ----------
    preset : str or Settings
        Where every other parameter begins: the name of a preset, as of :func:`preset`, or settings.
    **settings
        Any of the fields of :class:`Settings` that features are made by, such as ``features``,
        ``max_scale`` or ``step``. One that is not given, which is ``"preset"``, is as in the
        preset.

    Attributes
    ----------
    channels_ : tuple of str
        Recognition channels behind the features.
    rate_ : float
        Samples a second of the grid on which they are made.

    Raises
    ------
    TypeError
        If a parameter is no setting of features.

    Examples
    --------
    >>> import forcelab
    >>> from sklearn.decomposition import PCA
    >>> from sklearn.pipeline import make_pipeline
    >>> pipeline = make_pipeline(forcelab.ForceFeatures("best", amplitude="own"), PCA(2))
    """

    channels_: tuple[str, ...]
    rate_: float

    def fit(self, demonstrations: Sequence[Demonstration], _tracks: object = None) -> ForceFeatures:
        """Learn the common channels and rate of demonstrations.

        Raises
        ------
        InputError
            If there is none, or their channels differ.
        """
        settings = self.settings
        if not len(demonstrations):
            raise InputError("There is no demonstration to learn the channels and the rate of.")
        items = [LabelledDemonstration(demonstration) for demonstration in demonstrations]
        examples = [prepare_examples(item, settings, kept=False) for item in items]
        self.channels_ = common_channels(examples)
        self.rate_ = common_rate(demonstrations, settings)
        return self

    def transform(self, demonstrations: Sequence[Demonstration]) -> Real:
        """The features of all time steps, shape (n, f).

        Those of one demonstration are ``prepare_examples(...).features``, in gaps too.

        Raises
        ------
        InputError
            If a demonstration lacks one of the channels.
        """
        check_is_fitted(self, "channels_")
        settings = self.settings.replace(channels=self.channels_)
        return np.concatenate(
            [
                prepare_examples(LabelledDemonstration(item), settings, self.rate_).features
                for item in demonstrations
            ]
        )

    def get_feature_names_out(self, _input_features: object = None) -> NDArray[np.object_]:
        """What each feature is: channel, kind, and the window in seconds or frequency in Hz."""
        check_is_fitted(self, "channels_")
        return np.array(self.settings.feature_names(self.channels_, self.rate_), dtype=object)


def _labelled(
    demonstrations: Sequence[Demonstration], tracks: Sequence[Track | Segments]
) -> list[LabelledDemonstration]:
    """Demonstrations with the segments of their tracks."""
    if len(demonstrations) != len(tracks):
        raise InputError(
            f"There are {len(demonstrations)} demonstrations and {len(tracks)} tracks; give each "
            f"demonstration its own."
        )
    return [
        LabelledDemonstration(
            demonstration, track.segments if isinstance(track, Track) else tuple(track)
        )
        for demonstration, track in zip(demonstrations, tracks, strict=True)
    ]
