"""Which demonstrations hold the same recording, bit by bit or nearly.

One that was rounded, cropped, scaled or resampled is still the same recording, and a recogniser
that has learnt from one of the two has seen the other. Two are compared channel by channel by how
their smoothed signals change, shifted to where they are most alike and with one scale for all
channels; the least alike channel counts, so that a counter or a trigger that recordings share
does not make them one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence

import numpy as np

from forcelab.arrays import Floats
from forcelab.demonstration import Demonstration
from forcelab.signals.conditioning import bridge
from forcelab.signals.grid import readings

#: Signals are compared at so many steps a second, after a median filter of so many steps, which
#: takes out glitches, and a Gaussian of so many seconds.
STEP_RATE, MEDIAN_STEPS, SMOOTHING = 50.0, 5, 0.05
#: Changes count up to so many times what nine tenths of a channel's stay below: no jolt outweighs
#: the rest.
MOST_CHANGE = 3.0
#: A channel with fewer values than this is not compared, as one that was rounded so much says
#: little; nor is one that changes ever by the same but for this share, such as a counter.
FEWEST_VALUES, STEADY_SHARE = 16, 0.05
#: Copies share so many seconds at least, and this share of the shorter one.
SHORTEST_OVERLAP, OVERLAP_SHARE = 2.0, 0.5
#: A first look at all pairs is at every so many-th step, smoothed by so many seconds more. Those of
#: which it explains less than this share, or that are less alike there, are not looked at again.
COARSE_STEP, COARSE_SMOOTHING, LEAST_EXPLAINED, LEAST_COARSE_LIKENESS = 5, 0.1, 0.6, 0.8
#: Likeness from which two recordings are one. No two of the paper's reach 0.70, of sixty simulated
#: ones of a task 0.90, and of forty that shake at a steady 2 Hz 0.971. Of the paper's, copies that
#: were rounded to 0.1 N, cropped by 0.1 to 0.5 s, scaled or resampled reach 0.985.
LEAST_LIKENESS = 0.975
#: The same where fewer than so many channels are compared: one simulated force alone is alike by
#: up to 0.991.
FEW_CHANNELS, LEAST_LIKENESS_OF_FEW = 3, 0.995
#: So many answers are remembered, as an evaluation asks several times.
CACHE_SIZE = 16

_cache: dict[tuple[str, ...], list[list[int]]] = {}  # by the ids of the demonstrations


def find_copies(demonstrations: Sequence[Demonstration]) -> list[list[int]]:
    """Indices of the demonstrations of each recording, usually one, in order."""
    ids = tuple(demonstration.id for demonstration in demonstrations)
    if ids not in _cache:
        while len(_cache) >= CACHE_SIZE:
            del _cache[next(iter(_cache))]
        groups = find_equal(demonstrations)
        firsts = [demonstrations[group[0]] for group in groups]
        for i, j in _near_copies(firsts):
            if groups[i] is not groups[j]:
                joined, other = groups[i] + groups[j], (groups[i], groups[j])
                groups = [joined if any(group is o for o in other) else group for group in groups]
        _cache[ids] = sorted(map(sorted, {id(group): group for group in groups}.values()))
    return _cache[ids]


def find_equal(demonstrations: Sequence[Demonstration]) -> list[list[int]]:
    """Indices of the demonstrations of each recording that have the same signals bit by bit.

    Ids differ as soon as a stamp does; equal signals are still the same recording.
    """
    places: dict[bytes, list[int]] = {}
    for i, demonstration in enumerate(demonstrations):
        signals = np.ascontiguousarray(demonstration.signals, dtype=np.float64)
        places.setdefault(hashlib.sha256(signals.tobytes()).digest(), []).append(i)
    return list(places.values())


def _near_copies(demonstrations: Sequence[Demonstration]) -> Iterator[tuple[int, int]]:
    """Indices of each two demonstrations that are nearly the same recording."""
    long = [i for i, d in enumerate(demonstrations) if d.duration >= SHORTEST_OVERLAP]
    channels = {i: [channel.name for channel in demonstrations[i].channels] for i in long}
    shared = set.intersection(*map(set, channels.values())) if len(long) > 1 else set()
    if not shared:
        return
    movements = measure_movements(
        [
            demonstrations[i].signals[:, [channels[i].index(c) for c in sorted(shared)]]
            for i in long
        ],
        [demonstrations[i].times for i in long],
    )
    for i, j in promising_pairs(movements):
        compared = movements[i].any(axis=1) & movements[j].any(axis=1)
        least = LEAST_LIKENESS if compared.sum() >= FEW_CHANNELS else LEAST_LIKENESS_OF_FEW
        if likeness(movements[i], movements[j]) >= least:
            yield long[i], long[j]


def measure_movements(signals: Sequence[Floats], times: Sequence[Floats]) -> list[Floats]:
    """How the smoothed channels of each recording change from step to step, (c, m) each.

    `signals` (n, c), `times` (n,). In units of what is usual for the channel; 0 throughout where a
    recording's is not to be compared.
    """
    movements = [_measure_movement(*recording) for recording in zip(signals, times, strict=True)]
    usual = np.array([_usual_change(movement) for movement in movements])
    units = [np.median(each[each > 0]) if each.any() else 1.0 for each in usual.T]
    return [
        np.clip(m / np.array(units)[:, np.newaxis], -MOST_CHANGE, MOST_CHANGE) for m in movements
    ]


def _measure_movement(signals: Floats, times: Floats) -> Floats:
    """The changes of one recording's channels, in their units."""
    from scipy.ndimage import gaussian_filter1d, median_filter  # takes long to load

    # A long gap is no movement.
    steps = np.rint(np.cumsum(np.minimum(np.diff(times, prepend=times[:1]), 1.0)) * STEP_RATE)
    steps = steps.astype(np.int64)
    counts = np.bincount(steps)
    seen, every = np.flatnonzero(counts), np.arange(len(counts))
    rows = np.zeros((signals.shape[1], len(counts)))
    for row, signal in zip(rows, signals.T, strict=True):
        recorded = bridge(readings(signal))
        if len(np.unique(recorded[:: max(1, len(recorded) // 500)])) >= FEWEST_VALUES:
            row[:] = np.interp(every, seen, np.bincount(steps, recorded)[seen] / counts[seen])
    rows = gaussian_filter1d(
        median_filter(rows, size=(1, MEDIAN_STEPS)), SMOOTHING * STEP_RATE, axis=1
    )
    changes = np.diff(rows, axis=1)
    trend = changes.mean(axis=1, keepdims=True)
    changes[_usual_change(changes - trend) <= STEADY_SHARE * np.abs(trend[:, 0])] = 0
    return changes


def _usual_change(changes: Floats) -> Floats:
    """What nine tenths of each channel's changes stay below, (c,)."""
    place = int(0.9 * (changes.shape[1] - 1))
    return np.partition(np.abs(changes), place, axis=1)[:, place]


def promising_pairs(movements: Sequence[Floats]) -> Iterator[tuple[int, int]]:
    """Indices of each two recordings that may be one, by a first look at all of them."""
    from scipy.fft import irfft, next_fast_len, rfft  # takes long to load
    from scipy.ndimage import gaussian_filter1d

    coarse = [
        gaussian_filter1d(m, COARSE_SMOOTHING * STEP_RATE, axis=1)[:, ::COARSE_STEP]
        for m in movements
    ]
    n = max(row.shape[1] for row in coarse)
    rows = np.zeros((len(coarse), len(coarse[0]), n), dtype=np.float32)
    for padded, row in zip(rows, coarse, strict=True):
        padded[:, : row.shape[1]] = row
    size = next_fast_len(2 * n, real=True)
    spectra, energies = rfft(rows, size), np.square(rows).sum(axis=(1, 2))
    for i in range(len(rows) - 1):
        products = irfft(np.einsum("jcf,cf->jf", spectra[i + 1 :], spectra[i].conj()), size)
        best = products.argmax(axis=1)
        explained = products[np.arange(len(best)), best]
        may = explained > LEAST_EXPLAINED * np.minimum(energies[i], energies[i + 1 :])
        others, shifts = np.flatnonzero(may) + i + 1, best[may] - np.where(best[may] >= n, size, 0)
        places = np.arange(n) - shifts[:, np.newaxis]  # of the first recording, in the others'
        lengths = np.array([coarse[j].shape[1] for j in others.tolist()])
        inside = (places >= 0) & (places < coarse[i].shape[1])
        inside &= np.arange(n) < lengths[:, np.newaxis]
        first = rows[i][:, np.clip(places, 0, n - 1)].swapaxes(0, 1) * inside[:, np.newaxis]
        alike = _least_alike(first, rows[others] * inside[:, np.newaxis])
        for j in others[alike >= LEAST_COARSE_LIKENESS].tolist():
            yield i, j


def _least_alike(a: Floats, b: Floats) -> Floats:
    """The likeness of movements (..., c, n) in the channel where it is least, of those that move.

    That is 1 for equal ones up to a scale that all channels share, 0 where nothing moves.
    """
    of_a, of_b, of_both = ((x * y).sum(axis=-1) for x, y in ((a, a), (b, b), (a, b)))
    moving = (of_a > 0) & (of_b > 0)
    of_a, of_b = np.where(moving, of_a, 1.0), np.where(moving, of_b, 1.0)
    logs = np.where(moving, 0.5 * np.log(of_b / of_a), np.inf)
    middle = np.maximum(moving.sum(axis=-1, keepdims=True) - 1, 0) // 2
    log_scale = np.take_along_axis(np.sort(logs, axis=-1), middle, axis=-1)
    scale = np.exp(np.where(np.isfinite(log_scale), log_scale, 0.0))
    alike = np.where(moving, 2 * scale * of_both / (of_b + scale**2 * of_a), 1.0)
    return np.where(moving.any(axis=-1), alike.min(axis=-1), 0.0)


def likeness(first: Floats, second: Floats) -> float:
    """How alike two movements are, shifted to where they are most so: 1 of one recording."""
    from scipy.fft import irfft, next_fast_len, rfft  # takes long to load

    short, long = sorted((first, second), key=lambda movement: movement.shape[1])
    n, m = short.shape[1], long.shape[1]
    size = next_fast_len(n + m, real=True)
    products = irfft((rfft(long, size) * rfft(short, size).conj()).sum(axis=0), size)
    best = int(np.argmax(products))
    # The shift between two steps, by a parabola.
    before, at, after = products[best - 1], products[best], products[(best + 1) % size]
    bend = before - 2 * at + after
    shift = best - (size if best >= m else 0) + (0.5 * (before - after) / bend if bend < 0 else 0)
    common = np.arange(max(int(np.ceil(shift)), 0), min(m, int(n + shift)))
    if len(common) < max(OVERLAP_SHARE * n, SHORTEST_OVERLAP * STEP_RATE):
        return 0.0
    shifted = np.stack([np.interp(common - shift, np.arange(n), row) for row in short])
    return float(_least_alike(shifted, long[:, common]))
