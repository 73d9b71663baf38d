"""The settings of the timeline: how single decisions become segments."""

from __future__ import annotations

from forcelab.gui.commands import QT_TRANSLATE_NOOP
from forcelab.gui.review.settings_field import Field, Values

__all__ = ["DECODER"]


def _decodes(values: Values) -> bool:
    """Whether a decoder makes the timeline."""
    return values["decoder"] != "filters"


def _filters(values: Values) -> bool:
    """Whether filters make the timeline."""
    return not _decodes(values)


#: In the order of the form.
DECODER = (
    Field(
        "decoder",
        "filters",
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
        "filters",
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
        applies=_decodes,
    ),
    Field(
        "threshold",
        "filters",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Probability threshold"),
        QT_TRANSLATE_NOOP("forcelab", "What is less probable becomes unlabelled."),
        highest=1.0,
        step=0.05,
        decimals=2,
        default=0.8,
        applies=_filters,
    ),
    Field(
        "median",
        "filters",
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
        applies=_filters,
    ),
    Field(
        "drop",
        "filters",
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
        applies=_filters,
    ),
)
