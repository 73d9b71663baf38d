"""The settings of the classifier: what learns the actions, and from how much."""

from __future__ import annotations

from forcelab.gui.commands import QT_TRANSLATE_NOOP
from forcelab.gui.review.settings_field import Field, Values

__all__ = ["CLASSIFIER"]


def _is_plain(values: Values) -> bool:
    """Whether the classifier can weigh actions and be calibrated."""
    return values["classifier"] in ("logistic", "extra-trees", "boosting", "ensemble")


def _is_random(values: Values) -> bool:
    """Whether anything of the classifier is drawn at random."""
    drawn = ("mlp", "decision-tree", "svm", "extra-trees", "boosting", "ensemble")
    return values["classifier"] in drawn


#: In the order of the form.
CLASSIFIER = (
    Field(
        "classifier",
        "classifier",
        "choice",
        QT_TRANSLATE_NOOP("forcelab", "Classifier"),
        QT_TRANSLATE_NOOP("forcelab", "What learns the actions from the features."),
        options=(
            ("mlp", QT_TRANSLATE_NOOP("forcelab", "Multilayer perceptron")),
            ("naive-bayes", QT_TRANSLATE_NOOP("forcelab", "Naive Bayes")),
            ("decision-tree", QT_TRANSLATE_NOOP("forcelab", "Decision tree")),
            ("svm", QT_TRANSLATE_NOOP("forcelab", "Support vector machine")),
            ("nearest-neighbours", QT_TRANSLATE_NOOP("forcelab", "Nearest neighbours")),
            ("logistic", QT_TRANSLATE_NOOP("forcelab", "Logistic regression")),
            ("extra-trees", QT_TRANSLATE_NOOP("forcelab", "Extra trees")),
            ("boosting", QT_TRANSLATE_NOOP("forcelab", "Gradient boosting")),
            ("ensemble", QT_TRANSLATE_NOOP("forcelab", "Extra trees and logistic regression")),
        ),
    ),
    Field(
        "balanced",
        "classifier",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Rare actions count as much"),
        QT_TRANSLATE_NOOP("forcelab", "Every action has the same weight in training."),
        applies=_is_plain,
    ),
    Field(
        "calibrated",
        "classifier",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Calibrate"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "So that of what is 80 % sure 80 % is right, on demonstrations that were left out.",
        ),
        applies=_is_plain,
    ),
    Field(
        "trimmed",
        "classifier",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Leave out what is contradicted"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Train without the segments that the other demonstrations contradict, which are likely "
            "coding errors; at most a third of an action's.",
        ),
    ),
    Field(
        "stride",
        "classifier",
        "whole",
        QT_TRANSLATE_NOOP("forcelab", "Stride"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Train on every so many-th time step. Neighbouring ones are almost copies: of samples "
            "every 10th trains in a sixth of the time. Recognition always covers all of them.",
        ),
        lowest=1,
        highest=1e6,
        unit=QT_TRANSLATE_NOOP("forcelab", "time steps"),
    ),
    Field(
        "seed",
        "classifier",
        "whole",
        QT_TRANSLATE_NOOP("forcelab", "Seed"),
        QT_TRANSLATE_NOOP("forcelab", "The same seed gives the same recogniser again."),
        highest=2**32 - 1,
        applies=_is_random,
    ),
)
