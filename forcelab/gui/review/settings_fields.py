"""The settings of a recogniser as a table: what they are called, and when they are used."""

from __future__ import annotations

from forcelab.gui.review.settings_features import FEATURES
from forcelab.gui.review.settings_field import Field

__all__ = ["FIELDS", "GROUPS"]


#: What learns the actions, and from how much.
_CLASSIFIER = (
    Field(
        "classifier",
        "choice",
        "Classifier",
        "What learns the actions from the features.",
        options=(
            ("mlp", "Multilayer perceptron"),
            ("naive-bayes", "Naive Bayes"),
            ("decision-tree", "Decision tree"),
            ("svm", "Support vector machine"),
            ("nearest-neighbours", "Nearest neighbours"),
            ("logistic", "Logistic regression"),
            ("extra-trees", "Extra trees"),
            ("boosting", "Gradient boosting"),
            ("ensemble", "Extra trees and logistic regression"),
        ),
    ),
    Field(
        "balanced",
        "flag",
        "Rare actions count as much",
        "Every action has the same weight in training.",
    ),
    Field(
        "calibrated",
        "flag",
        "Calibrate",
        "So that of what is 80 % sure 80 % is right, on demonstrations that were left out.",
    ),
    Field(
        "trimmed",
        "flag",
        "Leave out what is contradicted",
        (
            "Train without the segments that the other demonstrations contradict, which are likely "
            "coding errors; at most a third of an action's."
        ),
    ),
    Field(
        "stride",
        "whole",
        "Stride",
        (
            "Train on every so many-th time step. Neighbouring ones are almost copies: of samples "
            "every 10th trains in a sixth of the time. Recognition always covers all of them."
        ),
        lowest=1,
        highest=1e6,
        unit="time steps",
    ),
    Field(
        "seed",
        "whole",
        "Seed",
        "The same seed gives the same recogniser again.",
        highest=2**32 - 1,
    ),
)

#: How single decisions become segments.
_DECODER = (
    Field(
        "decoder",
        "choice",
        "Timeline by",
        (
            "How single decisions become segments: by filters, or as the most probable course of "
            "the whole demonstration."
        ),
        options=(
            ("filters", "Filters"),
            ("semi-markov", "Semi-Markov decoder"),
        ),
    ),
    Field(
        "choreography",
        "choice",
        "Choreography",
        "What the decoder may know of the task: less carries over to other tasks better.",
        options=(
            ("none", "Nothing"),
            ("durations", "Durations of actions"),
            ("order", "Durations and order"),
        ),
    ),
    Field(
        "changes",
        "flag",
        "Learn where actions change",
        "A contact, a slip or a snap tells the decoder where one action gives way to another.",
    ),
    Field(
        "threshold",
        "number",
        "Probability threshold",
        "What is less probable becomes unlabelled.",
        highest=1.0,
        step=0.05,
        decimals=2,
        default=0.8,
    ),
    Field(
        "median",
        "whole",
        "Median filter",
        (
            "Width of a running median over the labels' numbers. An even width can give an "
            "action that neither neighbour has."
        ),
        lowest=1,
        highest=1e5,
        unit="samples",
        default=10,
    ),
    Field(
        "drop",
        "number",
        "Drop segments shorter than",
        "As a share of the shortest training segment of the same action.",
        highest=100.0,
        step=0.025,
        decimals=3,
        unit="of the shortest",
        default=0.125,
    ),
)

_MERGE = Field(
    "merge",
    "merge",
    "Merge map",
    "Spellings to take as one action in training and scoring; your labels stay as they are.",
)

#: The parts of the form, in order, each with what it is called in English.
GROUPS = {
    "Features": FEATURES,
    "Classifier": _CLASSIFIER,
    "Timeline": _DECODER,
    "Labels": (_MERGE,),
}

#: Every setting but the preset's name, in the order of the form.
FIELDS = tuple(field for fields in GROUPS.values() for field in fields)
