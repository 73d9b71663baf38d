"""What a recogniser can promise for a latency, before any device is there."""

from __future__ import annotations

from dataclasses import dataclass

from forcelab.demonstration import Channel
from forcelab.recognition.online import OnlineRecogniser
from forcelab.recognition.online_budget import Early
from forcelab.recognition.recogniser import Recogniser

__all__ = ["Promise", "promised"]


@dataclass(frozen=True)
class Promise:
    """What a latency is spent on, and what it leaves to be estimated.

    Parameters
    ----------
    latency : float
        Seconds from a sample to its label.
    wavelets, filters : float
        Seconds of it that wavelets and filters look ahead.
    scales : int
        That the recogniser uses.
    early : tuple of Early
        Those that are estimated before their wavelet has passed.
    """

    latency: float
    wavelets: float
    filters: float
    scales: int
    early: tuple[Early, ...]


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
    filters = (budget.median + budget.drop) * step
    scales = len(recogniser.settings.scales)
    return Promise(latency, budget.features * step, filters, scales, online.early)
