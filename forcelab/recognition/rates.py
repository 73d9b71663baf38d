"""What a recogniser cannot see in a recording at a lower rate than it learnt from."""

from __future__ import annotations

from forcelab.demonstration import Demonstration
from forcelab.recognition.recogniser import Recogniser

#: A rate that is lower by less than this share is the same one: clocks differ by far less.
TOLERANCE = 0.01


def rate_remarks(recogniser: Recogniser, demonstration: Demonstration) -> tuple[str, ...]:
    """A remark on a recogniser's scales for which a recording has too low a rate.

    A recording is put onto the recogniser's grid, but no interpolation brings back what lies above
    half the rate of its samples.
    """
    return rate_remarks_at(
        recogniser, 1.0 / demonstration.period, "It was sampled", "this recording has"
    )


def rate_remarks_at(
    recogniser: Recogniser, sampled: float, come: str, have: str
) -> tuple[str, ...]:
    """The same for `sampled` samples a second; `come` and `have` are parts of the sentence."""
    bands = recogniser.settings.bands(recogniser.rate)
    lost = bands[bands > sampled / 2]
    if sampled >= (1 - TOLERANCE) * recogniser.rate or not len(lost):
        return ()
    kind = "scales" if recogniser.settings.features == "wavelets" else "windows"
    return (
        f"{come} at {sampled:.4g} Hz, and the recogniser learnt at {recogniser.rate:.4g} Hz: "
        f"{len(lost)} of its {len(bands)} {kind} look above {sampled / 2:.4g} Hz, where {have} "
        f"nothing, so expect poor labels; train one with --rate {sampled:.4g}.",
    )
