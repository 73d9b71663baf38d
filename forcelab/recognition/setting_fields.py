"""The settings as a table: label, help, range, unit, and when each applies.

Command line and dialog are made from it; what a value may be at all is in
:class:`~forcelab.recognition.settings.Settings`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.settings import applies

FieldKind = Literal["number", "whole", "choice", "flag", "channels", "windows", "merge"]
#: What a form holds, by the names of :class:`~forcelab.recognition.settings.Settings`.
FormValues = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class SettingField:
    """One setting in the form."""

    name: str  # as of :class:`~forcelab.recognition.settings.Settings`
    kind: FieldKind  # which editor it has
    #: label, tip: what it is called, and what it does
    label: str
    tip: str
    #: lowest, highest, step: of a number: its range in the form, and what one click adds
    lowest: float = 0.0
    highest: float = 1e6
    step: float = 1.0
    decimals: int = 0  # of a number
    unit: str = ""  # of a number
    options: tuple[tuple[str, str], ...] = ()  # of a choice: values, and what they are called
    #: What a switch that is turned on begins with; a field that has it can be off, which is None
    default: float | None = None

    def applies(self, values: FormValues) -> bool:
        """Whether it changes anything, given all values of the form."""
        return applies(self.name, values)


#: In the order of the form.
FEATURE_FIELDS = (
    SettingField(
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
    SettingField(
        "channels",
        "channels",
        "Channels",
        "What the recogniser looks at; leaving some out saves time.",
    ),
    SettingField(
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
    SettingField(
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
    SettingField(
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
    SettingField(
        "min_scale",
        "number",
        "Smallest scale",
        "The finest detail that is looked at.",
        lowest=0.1,
        highest=1e5,
        decimals=1,
        unit="samples",
    ),
    SettingField(
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
    SettingField(
        "spacing",
        "number",
        "Octaves apart",
        "Octaves from one scale to the next.",
        lowest=0.01,
        highest=10.0,
        step=0.25,
        decimals=2,
    ),
    SettingField(
        "phase",
        "flag",
        "Phases",
        "Phases beside the magnitudes: twice the features.",
    ),
    SettingField(
        "circular",
        "flag",
        "Cosine and sine",
        "Of each phase, in place of the angle, which jumps at half a turn.",
    ),
    SettingField(
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
    SettingField(
        "peaks",
        "flag",
        "Peaks",
        (
            "How far each channel is from its highest and its lowest level, before and after: "
            "whether it has peaked or is about to."
        ),
    ),
    SettingField(
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
    SettingField(
        "classifier",
        "choice",
        "Classifier",
        "What learns the actions from the features.",
        options=tuple((name, kind.label) for name, kind in REGISTRY.items()),
    ),
    SettingField(
        "balanced",
        "flag",
        "Balance rare actions",
        "Every action has the same weight in training.",
    ),
    SettingField(
        "calibrated",
        "flag",
        "Calibrate",
        "So that of what is 80 % sure 80 % is right, on demonstrations that were left out.",
    ),
    SettingField(
        "trimmed",
        "flag",
        "Skip contradicted segments",
        (
            "Train without the segments that the other demonstrations contradict, which are likely "
            "coding errors; at most a third of an action's."
        ),
    ),
    SettingField(
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
    SettingField(
        "seed",
        "whole",
        "Seed",
        "The same seed gives the same recogniser again.",
        highest=2**32 - 1,
    ),
)

#: How single decisions become segments.
_DECODER_FIELDS = (
    SettingField(
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
    SettingField(
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
    SettingField(
        "changes",
        "flag",
        "Learn where actions change",
        "A contact, a slip or a snap tells the decoder where one action gives way to another.",
    ),
    SettingField(
        "threshold",
        "number",
        "Probability threshold",
        "What is less probable becomes unlabelled.",
        highest=1.0,
        step=0.05,
        decimals=2,
        default=0.8,
    ),
    SettingField(
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
    SettingField(
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

_MERGE_FIELD = SettingField(
    "merge",
    "merge",
    "Merge map",
    "Spellings to take as one action in training and scoring; your labels stay as they are.",
)

#: The parts of the form, in order, each with its title.
FIELD_GROUPS = {
    "Features": FEATURE_FIELDS,
    "Classifier": _CLASSIFIER_FIELDS,
    "Timeline": _DECODER_FIELDS,
    "Labels": (_MERGE_FIELD,),
}

#: Every setting of the form, in its order.
FIELDS = tuple(field for fields in FIELD_GROUPS.values() for field in fields)

#: The settings of the command line that the form has no room for.
WINDOWS_FIELD = SettingField(
    "windows",
    "windows",
    "Windows",
    "Standard deviations of the windows, rising.",
    unit="s",
)
