"""The settings of a recogniser as a table: label, help, range, and when each applies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.settings import counts

FieldKind = Literal["number", "whole", "choice", "flag", "channels", "merge"]
#: What a form holds, by the names of :class:`~forcelab.recognition.settings.Settings`.
FormValues = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Field:
    """One setting in the form.

    Parameters
    ----------
    name : str
        As of :class:`~forcelab.recognition.settings.Settings`.
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
    """

    name: str
    kind: FieldKind
    label: str
    tip: str
    lowest: float = 0.0
    highest: float = 1e6
    step: float = 1.0
    decimals: int = 0
    unit: str = ""
    options: tuple[tuple[str, str], ...] = ()
    default: float | None = None

    def applies(self, values: FormValues) -> bool:
        """Whether it is used, told from all values of the form."""
        return counts(self.name, values)

    @property
    def shown(self) -> str:
        """What it is called in the coder's language."""
        return self.label

    @property
    def shown_tip(self) -> str:
        """What it does, in the coder's language."""
        return self.tip


#: In the order of the form.
FEATURE_FIELDS = (
    Field(
        "features",
        "choice",
        "Features",
        (
            "Wavelets tell frequencies apart; windows also see how hard one grips, and take less "
            "time."
        ),
        options=(
            ("wavelets", "Wavelets"),
            ("windows", "Level, slope and strength in windows"),
        ),
    ),
    Field(
        "channels",
        "channels",
        "Channels",
        "What the recogniser looks at; leaving some out saves time.",
    ),
    Field(
        "rate",
        "number",
        "Rate",
        "Samples a second of the grid; off: that of the demonstrations.",
        lowest=0.1,
        highest=1e5,
        step=100.0,
        decimals=1,
        unit="Hz",
        default=1000.0,
    ),
    Field(
        "wavelet",
        "choice",
        "Wavelet",
        "What the forces are compared with at every scale.",
        options=(
            ("morlet", "Morlet (complex)"),
            ("real-morlet", "Morlet (real part)"),
            ("uncorrected-morlet", "Morlet (uncorrected)"),
            ("torrence-compo", "Morlet (Torrence and Compo)"),
            ("dog", "Derivative of a Gaussian"),
            ("haar", "Haar"),
        ),
    ),
    Field(
        "parameter",
        "number",
        "Parameter p",
        (
            "Of a Morlet how many oscillations it has: larger tells frequencies better apart, "
            "smaller times. Of a Gaussian which derivative."
        ),
        highest=1000.0,
        decimals=2,
    ),
    Field(
        "min_scale",
        "number",
        "Smallest scale",
        "The finest detail that is looked at.",
        lowest=0.1,
        highest=1e5,
        decimals=1,
        unit="samples",
    ),
    Field(
        "max_scale",
        "number",
        "Largest scale",
        (
            "The slowest movement that is looked at. Very large scales tell where in the "
            "choreography one is, which need not carry over to another task."
        ),
        lowest=0.1,
        highest=1e5,
        step=64.0,
        decimals=1,
        unit="samples",
    ),
    Field(
        "spacing",
        "number",
        "Octaves apart",
        "Octaves from one scale to the next.",
        lowest=0.01,
        highest=10.0,
        step=0.25,
        decimals=2,
    ),
    Field(
        "phase",
        "flag",
        "Phases",
        "Phases beside the magnitudes: twice the features.",
    ),
    Field(
        "circular",
        "flag",
        "Cosine and sine",
        "Of each phase, in place of the angle, which jumps at half a turn.",
    ),
    Field(
        "amplitude",
        "choice",
        "Unit of forces",
        (
            "People grip differently hard, which each demonstration's own amplitude takes out; but "
            "hard and soft objects differ by nothing else."
        ),
        options=(
            ("absolute", "As recorded"),
            ("own", "Each demonstration's own amplitude"),
            ("both", "Both side by side"),
        ),
    ),
    Field(
        "peaks",
        "flag",
        "Peaks",
        (
            "How far each channel is from its highest and its lowest level, before and after: "
            "whether it has peaked or is about to."
        ),
    ),
    Field(
        "step",
        "number",
        "Time step",
        "Between two decisions; off: every sample. 0.02 s costs no accuracy.",
        lowest=0.001,
        highest=10.0,
        step=0.01,
        decimals=3,
        unit="s",
        default=0.02,
    ),
)


#: What learns the actions, and from how much.
_CLASSIFIER_FIELDS = (
    Field(
        "classifier",
        "choice",
        "Classifier",
        "What learns the actions from the features.",
        options=tuple((name, kind.label) for name, kind in REGISTRY.items()),
    ),
    Field(
        "balanced",
        "flag",
        "Balance rare actions",
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
        "Skip contradicted segments",
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
_DECODER_FIELDS = (
    Field(
        "decoder",
        "choice",
        "Decoder",
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

_MERGE_FIELD = Field(
    "merge",
    "merge",
    "Merge map",
    "Spellings to take as one action in training and scoring; your labels stay as they are.",
)

#: The parts of the form, in order, each with what it is called in English.
FIELD_GROUPS = {
    "Features": FEATURE_FIELDS,
    "Classifier": _CLASSIFIER_FIELDS,
    "Timeline": _DECODER_FIELDS,
    "Labels": (_MERGE_FIELD,),
}

#: Every setting but the preset's name, in the order of the form.
FIELDS = tuple(field for fields in FIELD_GROUPS.values() for field in fields)
