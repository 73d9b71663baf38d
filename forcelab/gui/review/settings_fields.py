"""The settings of a recogniser as a table: what they are called, and when they are used."""

from __future__ import annotations

from forcelab.gui.commands import QT_TRANSLATE_NOOP
from forcelab.gui.review.settings_classifier import CLASSIFIER
from forcelab.gui.review.settings_decoder import DECODER
from forcelab.gui.review.settings_features import FEATURES
from forcelab.gui.review.settings_field import Field

__all__ = ["FIELDS", "GROUPS", "Field"]

#: The parts of the form, in order.
GROUPS = {
    "features": QT_TRANSLATE_NOOP("forcelab", "Features"),
    "classifier": QT_TRANSLATE_NOOP("forcelab", "Classifier"),
    "filters": QT_TRANSLATE_NOOP("forcelab", "Timeline"),
    "labels": QT_TRANSLATE_NOOP("forcelab", "Labels"),
}

_MERGE = Field(
    "merge",
    "labels",
    "merge",
    QT_TRANSLATE_NOOP("forcelab", "Merge map"),
    QT_TRANSLATE_NOOP(
        "forcelab",
        "Spellings to take as one action in training and scoring; your labels stay as they are.",
    ),
)

#: Every setting but the preset's name, in the order of the form.
FIELDS = (*FEATURES, *CLASSIFIER, *DECODER, _MERGE)
