"""What a recogniser can promise for a latency, before any device is there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcelab.demonstration import Channel
from forcelab.recognition.live_part import needs_whole
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.online_budget import Early
from forcelab.recognition.recogniser import Recogniser

__all__ = ["LOSSES", "Promise", "promised"]

#: Seconds of latency, and points of accuracy lost against a second: preset ``fast``, leaving one
#: demonstration out, mean of the stylus and the foam (``forcelab evaluate --latency``).
LOSSES = ((0.0, 4.0), (0.05, 2.0), (0.1, 0.5), (0.3, 0.1), (1.0, 0.0))


@dataclass(frozen=True)
class Promise:
    """What a latency is spent on, and what it leaves to be estimated.

    Parameters
    ----------
    latency : float
        Seconds from a sample to its label.
    ahead, filters : float
        Seconds of it that wavelets or windows look ahead, and filters or the decoder.
    scales : int
        Of wavelets that are used on a stream; 0 where windows take their place.
    early : tuple of Early
        Those that are estimated before their wavelet has passed.
    loss : float
        Points of accuracy that the latency takes against one of a second, as far as it was
        measured: see :data:`LOSSES`.
    """

    latency: float
    ahead: float
    filters: float
    scales: int
    early: tuple[Early, ...]
    loss: float = 0.0


def promised(recogniser: Recogniser, latency: float) -> Promise:
    """What a latency means, at the rate that the recogniser was trained at.

    Parameters
    ----------
    recogniser : Recogniser
    latency : float
        Seconds.

    Raises
    ------
    InputError
        If the latency is negative.
    """
    channels = [Channel(name, "N") for name in recogniser.channels]
    online = OnlineRecogniser(recogniser, latency, channels, recogniser.rate)
    budget, step = online.budget, online.step
    assert budget is not None
    assert step is not None
    filters = (budget.median + budget.drop + budget.decoder) * step
    scales = 0 if needs_whole(recogniser.settings) else len(recogniser.settings.scales)
    # Of wavelets the errors of the early ones say it.
    loss = 0.0 if scales else float(np.interp(latency, *np.transpose(LOSSES)))
    return Promise(latency, budget.features * step, filters, scales, online.early, loss)
