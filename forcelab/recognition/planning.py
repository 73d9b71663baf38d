"""What is computed to recognise a demonstration, what is left out, and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.recognition.settings import Settings
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import frequencies, usual_scales

__all__ = ["Part", "planned"]


@dataclass(frozen=True, slots=True)
class Part:
    """Something that costs time or memory where it is computed.

    Parameters
    ----------
    name : str
        Such as ``"video decoder"``.
    computed : bool
        Whether it is, or is left out.
    why : str
        What it is computed from, or why it is not.
    """

    name: str
    computed: bool
    why: str


def planned(demonstration: Demonstration, settings: Settings) -> tuple[Part, ...]:
    """Tell what is computed to recognise a demonstration; nothing of it is computed here.

    Parameters
    ----------
    demonstration : Demonstration
    settings : Settings
        Of the recogniser; where they name no rate the demonstration's own is meant.

    Returns
    -------
    tuple of Part
        In the order of the computation.

    Raises
    ------
    InputError
        If a wanted channel is missing.
    """
    return (
        *_features(demonstration, settings),
        *_after(settings),
    )


def _features(demonstration: Demonstration, settings: Settings) -> Iterator[Part]:
    """From recorded columns to feature vectors."""
    recorded = demonstration.channels
    try:
        channels = channel_map(recorded, settings.channels)
    except InputError as error:
        raise InputError(f"Demonstration '{demonstration.name}': {error}") from error
    rate = settings.rate or demonstration.rate
    windowed = settings.features == "windows"
    yield _windows(settings) if windowed else _scales(settings, rate)
    for name, places in zip(channels.names, channels.columns, strict=True):
        columns = ", ".join(recorded[channels.recorded[place]].name for place in places)
        yield Part(f"channel {name}", True, f"from {columns}")
    every = channel_map(recorded)
    for name in every.names:
        if name not in channels.names:
            yield Part(f"channel {name}", False, "the settings do not name it")
    for column, channel in enumerate(recorded):
        if column not in channels.recorded:
            yield Part(f"column {channel.name}", False, "no channel that is computed needs it")
    if settings.step is not None:
        hertz = rate / settings.hop(rate)
        yield Part("every time step", False, f"decided at {hertz:.6g} Hz, not {rate:.6g} Hz")
    if windowed:
        yield Part("wavelets", False, "windows are looked at in their place")
        yield Part(
            "level, slope and rms",
            True,
            f"{settings.replace(peaks=False).width(len(channels.names))} a time step",
        )
        yield Part("peaks", settings.peaks, _peaks(settings, len(channels.names)))
    else:
        yield from _wavelets(demonstration, settings, len(channels.names), rate)


def _peaks(settings: Settings, channels: int) -> str:
    """How many features they are, or why there are none."""
    if not settings.peaks:
        return "the settings leave them out"
    plain = settings.replace(peaks=False).width(channels)
    return f"{settings.width(channels) - plain} a time step"


def _windows(settings: Settings) -> Part:
    """The windows that channels are looked at in."""
    sizes = ", ".join(f"{1000 * window:g}" for window in settings.windows)
    return Part(f"{len(settings.windows)} windows", True, f"of {sizes} ms")


def _scales(settings: Settings, rate: float) -> Part:
    """The scales of the wavelets."""
    scales = settings.scales
    hertz = frequencies(scales, rate, settings.mother)
    return Part(
        f"{len(scales)} scales",
        True,
        f"{scales[0]:g} to {scales[-1]:g} samples at {rate:.6g} Hz, {settings.wavelet} of "
        f"{hertz[0]:.3g} to {hertz[-1]:.3g} Hz",
    )


def _wavelets(
    demonstration: Demonstration, settings: Settings, channels: int, rate: float
) -> Iterator[Part]:
    """What is computed of the wavelet transforms."""
    scales = settings.scales
    samples = max(1, round(demonstration.duration * rate))
    usual = usual_scales(samples, settings.min_scale, settings.spacing)
    wider = usual[len(scales) :]
    if len(wider):
        sizes = ", ".join(f"{scale:g}" for scale in wider)
        yield Part(f"scales of {sizes} samples", False, "wider than the settings' largest scale")
    width = channels * len(scales)
    yield Part("log magnitudes", True, f"{width} a time step")
    yield Part(
        "phases",
        settings.phase,
        f"{(1 + settings.circular) * width} a time step"
        if settings.phase
        else "the settings switch them off",
    )


def _after(settings: Settings) -> Iterator[Part]:
    """From feature vectors to a filtered timeline."""
    yield Part(f"classifier {settings.classifier}", True, "one decision a time step")
    yield Part(
        "probabilities",
        settings.needs_probabilities,
        "the decoder needs them"
        if settings.decodes
        else "the threshold filter needs them"
        if settings.needs_probabilities
        else "no filter that is on needs them",
    )
    knowing = {
        "none": "knows nothing of the task",
        "durations": "knows durations",
        "order": "knows durations and order",
    }
    yield Part(
        "semi-Markov decoder",
        settings.decodes,
        knowing[settings.choreography] if settings.decodes else "filters stand in its place",
    )
    if settings.decodes:
        why = "where actions change is learnt by itself" if settings.changes else "switched off"
        yield Part("trees for changes", settings.changes, why)
        yield Part("filters", False, "the decoder stands in their place")
        return
    filters = (
        ("threshold filter", settings.threshold, "below {:g}: unlabelled"),
        ("median filter", settings.median, "over {:g} samples"),
        ("drop filter", settings.drop, "shorter than {:g} of the shortest trained one: unlabelled"),
    )
    for name, value, what in filters:
        why = "the settings switch it off" if value is None else what.format(value)
        yield Part(name, value is not None, why)
