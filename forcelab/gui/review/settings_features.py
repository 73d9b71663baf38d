"""The settings of the features: by what a recogniser knows time steps."""

from __future__ import annotations

from forcelab.gui.review.settings_field import Field

__all__ = ["FEATURES"]


#: In the order of the form.
FEATURES = (
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
