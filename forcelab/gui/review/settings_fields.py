"""The settings of a recogniser as a table: what they are called, and when they are used."""

from __future__ import annotations

from forcelab.gui.commands import QT_TRANSLATE_NOOP
from forcelab.gui.review.settings_features import FEATURES
from forcelab.gui.review.settings_field import Field

__all__ = ["FIELDS", "GROUPS"]


#: What learns the actions, and from how much.
_CLASSIFIER = (
    Field(
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
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Rare actions count as much"),
        QT_TRANSLATE_NOOP("forcelab", "Every action has the same weight in training."),
    ),
    Field(
        "calibrated",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Calibrate"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "So that of what is 80 % sure 80 % is right, on demonstrations that were left out.",
        ),
    ),
    Field(
        "trimmed",
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
        "whole",
        QT_TRANSLATE_NOOP("forcelab", "Seed"),
        QT_TRANSLATE_NOOP("forcelab", "The same seed gives the same recogniser again."),
        highest=2**32 - 1,
    ),
)

#: How single decisions become segments.
_DECODER = (
    Field(
        "decoder",
        "choice",
        QT_TRANSLATE_NOOP("forcelab", "Timeline by"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "How single decisions become segments: by filters, or as the most probable course of "
            "the whole demonstration.",
        ),
        options=(
            ("filters", QT_TRANSLATE_NOOP("forcelab", "Filters")),
            ("semi-markov", QT_TRANSLATE_NOOP("forcelab", "Semi-Markov decoder")),
        ),
    ),
    Field(
        "choreography",
        "choice",
        QT_TRANSLATE_NOOP("forcelab", "Choreography"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "What the decoder may know of the task: less carries over to other tasks better.",
        ),
        options=(
            ("none", QT_TRANSLATE_NOOP("forcelab", "Nothing")),
            ("durations", QT_TRANSLATE_NOOP("forcelab", "Durations of actions")),
            ("order", QT_TRANSLATE_NOOP("forcelab", "Durations and order")),
        ),
    ),
    Field(
        "changes",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Learn where actions change"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "A contact, a slip or a snap tells the decoder where one action gives way to another.",
        ),
    ),
    Field(
        "threshold",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Probability threshold"),
        QT_TRANSLATE_NOOP("forcelab", "What is less probable becomes unlabelled."),
        highest=1.0,
        step=0.05,
        decimals=2,
        default=0.8,
    ),
    Field(
        "median",
        "whole",
        QT_TRANSLATE_NOOP("forcelab", "Median filter"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Width of a running median over the labels' numbers. An even width can give an "
            "action that neither neighbour has.",
        ),
        lowest=1,
        highest=1e5,
        unit=QT_TRANSLATE_NOOP("forcelab", "samples"),
        default=10,
    ),
    Field(
        "drop",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Drop segments shorter than"),
        QT_TRANSLATE_NOOP(
            "forcelab", "As a share of the shortest training segment of the same action."
        ),
        highest=100.0,
        step=0.025,
        decimals=3,
        unit=QT_TRANSLATE_NOOP("forcelab", "of the shortest"),
        default=0.125,
    ),
)

_MERGE = Field(
    "merge",
    "merge",
    QT_TRANSLATE_NOOP("forcelab", "Merge map"),
    QT_TRANSLATE_NOOP(
        "forcelab",
        "Spellings to take as one action in training and scoring; your labels stay as they are.",
    ),
)

#: The parts of the form, in order, each with what it is called in English.
GROUPS = {
    QT_TRANSLATE_NOOP("forcelab", "Features"): FEATURES,
    QT_TRANSLATE_NOOP("forcelab", "Classifier"): _CLASSIFIER,
    QT_TRANSLATE_NOOP("forcelab", "Timeline"): _DECODER,
    QT_TRANSLATE_NOOP("forcelab", "Labels"): (_MERGE,),
}

#: Every setting but the preset's name, in the order of the form.
FIELDS = tuple(field for fields in GROUPS.values() for field in fields)
