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
    """Whether there are wavelets, and they have a parameter."""
    return _has_wavelets(values) and values["wavelet"] != "haar"


def _has_wavelets(values: Values) -> bool:
    """Whether time steps are known by wavelets."""
    return values["features"] == "wavelets"


def _has_phases(values: Values) -> bool:
    """Whether there are wavelets, and their phases are used."""
    return _has_wavelets(values) and bool(values["phase"])


def _has_windows(values: Values) -> bool:
    """Whether time steps are known by windows."""
    return values["features"] == "windows"


def _is_plain(values: Values) -> bool:
    """Whether the classifier can weigh actions and be calibrated."""
    return values["classifier"] in ("logistic", "extra-trees", "boosting", "ensemble")


def _decodes(values: Values) -> bool:
    """Whether a decoder makes the timeline."""
    return values["decoder"] != "filters"


def _filters(values: Values) -> bool:
    """Whether filters make the timeline."""
    return not _decodes(values)


def _is_random(values: Values) -> bool:
    """Whether anything of the classifier is drawn at random."""
    drawn = ("mlp", "decision-tree", "svm", "extra-trees", "boosting", "ensemble")
    return values["classifier"] in drawn


#: Every setting but the preset's name, in the order of the form.
FIELDS = (
    Field(
        "features",
        "features",
        "choice",
        QT_TRANSLATE_NOOP("forcelab", "Features"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Wavelets tell frequencies apart; windows also see how hard one grips, and take less "
            "time.",
        ),
        options=(
            ("wavelets", QT_TRANSLATE_NOOP("forcelab", "Wavelets")),
            ("windows", QT_TRANSLATE_NOOP("forcelab", "Level, slope and strength in windows")),
        ),
    ),
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
            ("uncorrected-morlet", QT_TRANSLATE_NOOP("forcelab", "Morlet (uncorrected)")),
            ("torrence-compo", QT_TRANSLATE_NOOP("forcelab", "Morlet (Torrence and Compo)")),
            ("dog", QT_TRANSLATE_NOOP("forcelab", "Derivative of a Gaussian")),
            ("haar", QT_TRANSLATE_NOOP("forcelab", "Haar")),
        ),
        applies=_has_wavelets,
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
        applies=_has_wavelets,
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
        applies=_has_wavelets,
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
        applies=_has_wavelets,
    ),
    Field(
        "phase",
        "features",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Phases"),
        QT_TRANSLATE_NOOP("forcelab", "Phases beside the magnitudes: twice the features."),
        applies=_has_wavelets,
    ),
    Field(
        "circular",
        "features",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Cosine and sine"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Of each phase, in place of the angle, which jumps at half a turn.",
        ),
        applies=_has_phases,
    ),
    Field(
        "amplitude",
        "features",
        "choice",
        QT_TRANSLATE_NOOP("forcelab", "Unit of forces"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "People grip differently hard, which each demonstration's own amplitude takes out; but "
            "hard and soft objects differ by nothing else.",
        ),
        options=(
            ("absolute", QT_TRANSLATE_NOOP("forcelab", "As recorded")),
            ("own", QT_TRANSLATE_NOOP("forcelab", "Each demonstration's own amplitude")),
            ("both", QT_TRANSLATE_NOOP("forcelab", "Both side by side")),
            ("chosen", QT_TRANSLATE_NOOP("forcelab", "Whichever does better")),
        ),
        applies=_has_windows,
    ),
    Field(
        "step",
        "features",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Time step"),
        QT_TRANSLATE_NOOP(
            "forcelab", "Between two decisions; off: every sample. 0.02 s costs no accuracy."
        ),
        lowest=0.001,
        highest=10.0,
        step=0.01,
        decimals=3,
        unit=QT_TRANSLATE_NOOP("forcelab", "s"),
        default=0.02,
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
