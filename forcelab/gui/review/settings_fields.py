"""The settings of a recogniser as a table: what they are called, and when they are used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from forcelab.gui.commands import QT_TRANSLATE_NOOP, translated

__all__ = ["FIELDS", "GROUPS", "Field"]

Kind = Literal["number", "whole", "choice", "flag", "channels", "merge"]
#: What a form holds, by the names of :class:`~forcelab.recognition.settings.Settings`.
Values = Mapping[str, Any]

#: The parts of the form, in order.
GROUPS = {
    "features": QT_TRANSLATE_NOOP("forcelab", "Features"),
    "classifier": QT_TRANSLATE_NOOP("forcelab", "Classifier"),
    "filters": QT_TRANSLATE_NOOP("forcelab", "Filters"),
    "labels": QT_TRANSLATE_NOOP("forcelab", "Labels"),
}


def _always(_values: Values) -> bool:
    """For a field that every recogniser uses."""
    return True


@dataclass(frozen=True, slots=True)
class Field:
    """One setting in the form.

    Parameters
    ----------
    name : str
        As of :class:`~forcelab.recognition.settings.Settings`.
    group : str
        One of :data:`GROUPS`.
    kind : str
        Which editor it has.
    label, tip : str
        In English; what it is called, and what it does.
    lowest, highest, step : float
        Of a number: its range in the form, and what one click adds.
    decimals : int
        Of a number.
    unit : str
        Of a number, in English.
    options : tuple of (str, str)
        Of a choice: values, and what they are called in English.
    default : float, optional
        What a switch that is turned on begins with; a field that has it can be off, which is None.
    applies : callable
        Whether it is used, told from all values of the form.
    """

    name: str
    group: str
    kind: Kind
    label: str
    tip: str
    lowest: float = 0.0
    highest: float = 1e6
    step: float = 1.0
    decimals: int = 0
    unit: str = ""
    options: tuple[tuple[str, str], ...] = ()
    default: float | None = None
    applies: Callable[[Values], bool] = _always

    @property
    def shown(self) -> str:
        """What it is called in the coder's language."""
        return translated(self.label)

    @property
    def shown_tip(self) -> str:
        """What it does, in the coder's language."""
        return translated(self.tip)


def _has_parameter(values: Values) -> bool:
    """Whether the wavelet has a parameter."""
    return values["wavelet"] != "haar"


def _is_random(values: Values) -> bool:
    """Whether anything of the classifier is drawn at random."""
    return values["classifier"] in ("mlp", "decision-tree", "svm")


#: Every setting but the preset's name, in the order of the form.
FIELDS = (
    Field(
        "channels",
        "features",
        "channels",
        QT_TRANSLATE_NOOP("forcelab", "Channels"),
        QT_TRANSLATE_NOOP("forcelab", "What the recogniser looks at; leaving some out saves time."),
    ),
    Field(
        "rate",
        "features",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Rate"),
        QT_TRANSLATE_NOOP(
            "forcelab", "Samples a second of the grid; off: that of the demonstrations."
        ),
        lowest=0.1,
        highest=1e5,
        step=100.0,
        decimals=1,
        unit=QT_TRANSLATE_NOOP("forcelab", "Hz"),
        default=1000.0,
    ),
    Field(
        "wavelet",
        "features",
        "choice",
        QT_TRANSLATE_NOOP("forcelab", "Wavelet"),
        QT_TRANSLATE_NOOP("forcelab", "What the forces are compared with at every scale."),
        options=(
            ("morlet", QT_TRANSLATE_NOOP("forcelab", "Morlet (complex)")),
            ("real-morlet", QT_TRANSLATE_NOOP("forcelab", "Morlet (real part)")),
            ("dog", QT_TRANSLATE_NOOP("forcelab", "Derivative of a Gaussian")),
            ("haar", QT_TRANSLATE_NOOP("forcelab", "Haar")),
        ),
    ),
    Field(
        "parameter",
        "features",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Parameter p"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Of a Morlet how many oscillations it has: larger tells frequencies better apart, "
            "smaller times. Of a Gaussian which derivative.",
        ),
        lowest=0.0,
        highest=1000.0,
        step=1.0,
        decimals=2,
        applies=_has_parameter,
    ),
    Field(
        "min_scale",
        "features",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Smallest scale"),
        QT_TRANSLATE_NOOP("forcelab", "The finest detail that is looked at."),
        lowest=0.1,
        highest=1e5,
        decimals=1,
        unit=QT_TRANSLATE_NOOP("forcelab", "samples"),
    ),
    Field(
        "max_scale",
        "features",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Largest scale"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "The slowest movement that is looked at. Very large scales tell where in the "
            "choreography one is, which need not carry over to another task.",
        ),
        lowest=0.1,
        highest=1e5,
        step=64.0,
        decimals=1,
        unit=QT_TRANSLATE_NOOP("forcelab", "samples"),
    ),
    Field(
        "spacing",
        "features",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Octaves apart"),
        QT_TRANSLATE_NOOP("forcelab", "Octaves from one scale to the next."),
        lowest=0.01,
        highest=10.0,
        step=0.25,
        decimals=2,
    ),
    Field(
        "phase",
        "features",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Phases"),
        QT_TRANSLATE_NOOP("forcelab", "Phases beside the magnitudes: twice the features."),
    ),
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
        ),
    ),
    Field(
        "stride",
        "classifier",
        "whole",
        QT_TRANSLATE_NOOP("forcelab", "Stride"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Train on every so many-th sample. Neighbouring samples are almost copies: every 10th "
            "trains in a sixth of the time. Recognition always covers every sample.",
        ),
        lowest=1,
        highest=1e6,
        unit=QT_TRANSLATE_NOOP("forcelab", "samples"),
    ),
    Field(
        "seed",
        "classifier",
        "whole",
        QT_TRANSLATE_NOOP("forcelab", "Seed"),
        QT_TRANSLATE_NOOP("forcelab", "The same seed gives the same recogniser again."),
        highest=2**31 - 1,
        applies=_is_random,
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
    ),
    Field(
        "merge",
        "labels",
        "merge",
        QT_TRANSLATE_NOOP("forcelab", "Merge map"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Spellings to take as one action in training and scoring; your labels stay as they "
            "are.",
        ),
    ),
)
