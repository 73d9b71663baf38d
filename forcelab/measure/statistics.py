"""What a set of labelled recordings of one task is like, in figures.

Figures are medians over demonstrations unless they say otherwise, so that one that went wrong does
not move them. Spectra are Welch's, with Hann windows of one second at most, straight lines taken
off, as amplitude densities.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt, welch

from forcelab.errors import InputError
from forcelab.measure.felt import REST, SHORTEST, Felt, felt, within
from forcelab.recognition.examples import Labelled

__all__ = ["Figures", "figures"]

Array = NDArray[np.float64]

#: Values by what they are and their unit; NaN where the recordings do not tell.
Figures = dict[tuple[str, str], float]

#: Frequency bands, Hz: slow forces, hand, tremor (8-12 Hz), ringing of tongs and things, noise.
BANDS = ((0.5, 2.0), (2.0, 8.0), (8.0, 15.0), (15.0, 40.0), (40.0, 100.0), (100.0, 400.0))
#: Noise is what is faster than this, Hz.
NOISE = 15.0
#: Something is gripped where a sensor is pressed by more than this, N.
GRIPPED = 0.5
#: The rise of a grip is looked at below this frequency, Hz: an impact is no grip.
IMPACTS = 30.0


def figures(labelled: Sequence[Labelled], actions: Sequence[str]) -> Figures:
    """Compute all figures of a set of recordings.

    The sensors are numbered by the tangential force that they feel, the largest first, because
    which of them is left and right differs from set to set.

    Parameters
    ----------
    labelled : sequence of Labelled
        Of one task and one kind of device, each with at least one segment.
    actions : sequence of str
        Those to give figures of, in this order.

    Raises
    ------
    InputError
        If there is no demonstration, one has no segment or no 3-axis force sensor, or they have
        different numbers of sensors.
    """
    if not labelled:
        raise InputError("There is no demonstration to compute figures of; name at least one.")
    all_felt = [felt(item) for item in labelled]
    if len({one.axes.shape[1] for one in all_felt}) > 1:
        raise InputError("The demonstrations have different numbers of sensors; keep them apart.")
    shears = np.median([one.tangential.mean(axis=0) for one in all_felt], axis=0)
    ranks = np.argsort(-shears, kind="stable")
    return (
        _labels(labelled, actions)
        | _forces(all_felt, ranks, [action for action in actions if action != REST])
        | _signals(all_felt)
    )


def _typical(values: Iterable[float]) -> float:
    """The median of those values that there are; NaN if there is none."""
    there = [value for value in values if np.isfinite(value)]
    return float(np.median(there)) if there else np.nan


def _labels(labelled: Sequence[Labelled], actions: Sequence[str]) -> Figures:
    """How long demonstrations and segments are, and how many there are of each action."""
    whole = [item.demonstration.duration for item in labelled]
    covered = [sum(s.duration for s in item.segments) for item in labelled]
    shares = [100 * (1 - c / w) for c, w in zip(covered, whole, strict=True)]
    result: Figures = {
        ("duration", "s"): _typical(whole),
        ("unlabelled share", "%"): _typical(shares),
    }
    for action in actions:
        durations = [s.duration for item in labelled for s in item.segments if s.action == action]
        result[f"{action}: segments", "per demonstration"] = len(durations) / len(labelled)
        for name, quantile in (("lower quartile", 0.25), ("median", 0.5), ("upper quartile", 0.75)):
            value = float(np.quantile(durations, quantile)) if durations else np.nan
            result[f"{action}: duration, {name}", "s"] = value
    return result


def _forces(all_felt: Sequence[Felt], ranks: NDArray[np.intp], actions: Sequence[str]) -> Figures:
    """How large forces are, overall and within actions, and how a grip begins."""
    result: Figures = {}
    for action in (None, *actions):
        masks = [one.during(action) for one in all_felt]
        for number, sensor in enumerate(ranks, start=1):
            for kind in ("normal", "tangential"):
                parts = [
                    getattr(one, kind)[mask, sensor]
                    for one, mask in zip(all_felt, masks, strict=True)
                    if mask.any()
                ]
                what = f"{kind} force of sensor {number}"
                where = f"{action or 'all actions'}: {what}"
                result[f"{where}, peak", "N"] = _typical(part.max() for part in parts)
                result[f"{where}, median", "N"] = _typical(float(np.median(part)) for part in parts)
    result["grab: rise from 10 to 90 %", "s"] = _typical(_rise(one) for one in all_felt)
    result["gripped: tangential over normal force", ""] = _typical(_ratio(o) for o in all_felt)
    return result


def _rise(one: Felt) -> float:
    """Seconds that the mean normal force takes from 10 to 90 % of its peak in the first grab.

    The peak is looked for until the action after the grab ends: coders end a grab early.
    """
    grabs = [number for number, s in enumerate(one.segments) if s.action == "grab"]
    if not grabs or one.times[-1] - one.times[0] < SHORTEST:
        return np.nan
    first, after = one.segments[grabs[0]], one.segments[grabs[0] : grabs[0] + 2][-1]
    pressed = -one.axes[:, :, 2].mean(axis=1)
    if one.rate > 2 * IMPACTS:
        pressed = sosfiltfilt(butter(2, IMPACTS, fs=one.rate, output="sos"), pressed)
    pressed = pressed[within(one.times, [(first.start - 0.1, after.end)])]
    peak = pressed.max(initial=0.0)
    high = int(np.argmax(pressed >= 0.9 * peak))
    low = np.flatnonzero(pressed[:high] < 0.1 * peak)
    return (high - int(low[-1])) / one.rate if low.size and peak > GRIPPED else np.nan


def _ratio(one: Felt) -> float:
    """Median of the tangential over the normal force of all sensors where they are pressed."""
    gripped = one.normal > GRIPPED
    return _typical(one.tangential[gripped] / one.normal[gripped])


def _signals(all_felt: Sequence[Felt]) -> Figures:
    """Steps, noise and spectra of the tangential axes (fx, fy) and of the normal one (fz)."""
    result: Figures = {}
    for kind, axes in (("tangential", [0, 1]), ("normal", [2])):
        steps = [
            _step(channel)
            for one in all_felt
            for channel in one.recorded[:, :, axes].reshape(len(one.recorded), -1).T
        ]
        noises = [_noise(_of(part, axes), one.rate) for one in all_felt for part in one.at_rest]
        result[f"{kind} axes: quantisation step", "mN"] = 1e3 * _typical(steps)
        result[f"{kind} axes: noise at rest above {NOISE:g} Hz", "mN rms"] = 1e3 * _typical(noises)
        for when in ("at rest", "in action"):
            spectra = [
                _densities([_of(part, axes) for part in parts], one.rate)
                for one in all_felt
                if (parts := one.at_rest if when == "at rest" else one.in_action)
            ]
            for number, (low, high) in enumerate(BANDS):
                value = _typical(spectrum[number] for spectrum in spectra)
                result[f"{kind} axes {when}: {low:g} to {high:g} Hz", "mN/√Hz"] = 1e3 * value
    return result


def _of(part: Array, axes: Sequence[int]) -> Array:
    """The columns of some axes of all sensors, from those of all axes."""
    return part.reshape(len(part), -1, 3)[:, :, axes].reshape(len(part), -1)


def _step(channel: Array) -> float:
    """The distance of neighbouring counts, N; NaN where no two counts are known.

    Recordings may have been read off straight lines between counts; where two neighbouring samples
    are equal they are counts all the same.
    """
    counts = np.unique(channel[1:][np.diff(channel) == 0])
    distances = np.diff(counts)
    distances = distances[distances > 1e-9]
    return float(distances.min()) if distances.size else np.nan


def _spectrum(part: Array, rate: float) -> tuple[Array, Array]:
    """Frequencies in Hz and the mean power density of the columns in N^2/Hz."""
    window = min(len(part), round(rate))
    frequency, power = welch(part, rate, nperseg=window, axis=0, detrend="linear")
    return frequency, power.mean(axis=1)


def _noise(part: Array, rate: float) -> float:
    """Effective value of what is faster than any hand, N.

    Of the spectrum and not of differences of neighbouring samples, which straight lines between
    counts make small.
    """
    frequency, power = _spectrum(part, rate)
    fast = frequency >= NOISE
    return float(np.sqrt(power[fast].sum() * frequency[1])) if fast.any() else np.nan


def _densities(parts: Sequence[Array], rate: float) -> list[float]:
    """Amplitude density in each band, N/√Hz: of the mean power, median over the parts."""
    rows = []
    for part in parts:
        frequency, power = _spectrum(part, rate)
        inside = [(frequency >= low) & (frequency < high) for low, high in BANDS]
        rows.append(
            [
                np.sqrt(power[band].mean()) if band.any() and high <= rate / 2 else np.nan
                for band, (_, high) in zip(inside, BANDS, strict=True)
            ]
        )
    return [_typical(column) for column in zip(*rows, strict=True)]
