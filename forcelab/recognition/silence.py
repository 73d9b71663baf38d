"""What is said where filters left next to nothing of a prediction."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forcelab.recognition.recogniser import Prediction
from forcelab.recognition.results import Tested
from forcelab.recognition.settings import Settings

__all__ = ["silence_remark"]

#: Share of the time steps that had an action before the filters; less is no timeline.
LEAST = 0.2
#: Hz, for which the scales of the presets are made.
USUAL = 1000


def silence_remark(
    predicted: Sequence[Tested | Prediction], settings: Settings, rate: float
) -> tuple[str, ...]:
    """A remark where the filters left no timeline, with what took it and a likely cause.

    Parameters
    ----------
    predicted : sequence of Tested or Prediction
        All by recognisers of the same settings.
    settings : Settings
    rate : float
        Samples a second of the grid.

    Returns
    -------
    tuple of str
        One sentence; none where something is left, or nothing was there before the filters.
    """

    def left(stage: str) -> int:
        codes = (one.stages.get(stage, one.filtered) for one in predicted)
        return sum(int(np.count_nonzero(each >= 0)) for each in codes)

    before = sum(int(np.count_nonzero(one.raw >= 0)) for one in predicted)
    if not before or left("all") >= LEAST * before:
        return ()
    filters = {
        "threshold": f"what is less probable than {settings.threshold} (threshold)",
        "median": f"what a median over {settings.median} samples turns (median)",
        "drop": f"what lasts less than {settings.drop} of the shortest segment trained on (drop)",
    }
    on = [name for name in filters if getattr(settings, name) is not None]
    if not on or settings.decodes:
        return ()
    counts = [before, *map(left, on)]
    culprit = max(range(len(on)), key=lambda i: counts[i] - counts[i + 1])
    cause = ""
    if settings.features == "wavelets":
        # To three digits, but as 1,020 and not as 1.02e+03.
        low, high = (float(f"{1000 * one / rate:.3g}") for one in settings.scales[[0, -1]])
        such = "" if rate == USUAL else f", such as {USUAL} Hz"
        cause = (
            f"; at {rate:.6g} Hz the scales are {low:,g} to {high:,g} ms, so try others or another "
            f"rate{such}"
        )
    share = 100 * left("all") / before
    return (
        f"The filters left {share:.1f} % of the predicted time, most of it taken by one that "
        f"unlabels {filters[on[culprit]]}{cause}; or train on more, or switch that filter off.",
    )
