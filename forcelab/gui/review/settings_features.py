"""The settings of the features: by what a recogniser knows time steps."""

from __future__ import annotations

from forcelab.gui.commands import QT_TRANSLATE_NOOP
from forcelab.gui.review.settings_field import Field

__all__ = ["FEATURES"]


#: In the order of the form.
FEATURES = (
    Field(
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
        "channels",
        QT_TRANSLATE_NOOP("forcelab", "Channels"),
        QT_TRANSLATE_NOOP("forcelab", "What the recogniser looks at; leaving some out saves time."),
    ),
    Field(
        "rate",
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
    ),
    Field(
        "parameter",
        "number",
        QT_TRANSLATE_NOOP("forcelab", "Parameter p"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Of a Morlet how many oscillations it has: larger tells frequencies better apart, "
            "smaller times. Of a Gaussian which derivative.",
        ),
        highest=1000.0,
        decimals=2,
    ),
    Field(
        "min_scale",
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
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Phases"),
        QT_TRANSLATE_NOOP("forcelab", "Phases beside the magnitudes: twice the features."),
    ),
    Field(
        "circular",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Cosine and sine"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "Of each phase, in place of the angle, which jumps at half a turn.",
        ),
    ),
    Field(
        "amplitude",
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
        ),
    ),
    Field(
        "peaks",
        "flag",
        QT_TRANSLATE_NOOP("forcelab", "Peaks"),
        QT_TRANSLATE_NOOP(
            "forcelab",
            "How far each channel is from its highest and its lowest level, before and after: "
            "whether it has peaked or is about to.",
        ),
    ),
    Field(
        "step",
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
)
