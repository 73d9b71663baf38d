"""What a recogniser cannot see in a recording at a lower rate than it learnt from."""

from __future__ import annotations

from forcelab.demonstration import Demonstration
from forcelab.recognition.recogniser import Recogniser

__all__ = ["unseen"]

#: A rate that is lower by less than this share is the same one: clocks differ by far less.
TOLERANCE = 0.01


def unseen(recogniser: Recogniser, demonstration: Demonstration) -> tuple[str, ...]:
    """Say which of a recogniser's scales a recording has nothing for.

    A recording is put onto the grid that the recogniser learnt on, but no interpolation brings
    back what lies above half the rate of its samples.

    Parameters
    ----------
    recogniser : Recogniser
    demonstration : Demonstration

    Returns
    -------
    tuple of str
        One sentence, or nothing where every scale finds its frequency in the recording.
    """
    sampled = 1.0 / demonstration.period
    bands = recogniser.settings.bands(recogniser.rate)
    lost = bands[bands > sampled / 2]
    if sampled >= (1 - TOLERANCE) * recogniser.rate or not len(lost):
        return ()
    kind = "scales" if recogniser.settings.features == "wavelets" else "windows"
    return (
        f"It was sampled at {sampled:.4g} Hz, and the recogniser learnt at {recogniser.rate:.4g} "
        f"Hz: {len(lost)} of its {len(bands)} {kind} look above {sampled / 2:.4g} Hz, where this "
        f"recording has nothing, so expect poor labels; train one with --rate {sampled:.4g}.",
    )
