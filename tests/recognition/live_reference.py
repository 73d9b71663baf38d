"""What labels of a stream must be, stated plainly over a whole demonstration.

Without state: every coefficient is the weighted sum of the samples that its step may know, every
window is summed up by itself, every filter is a loop.
"""

from itertools import pairwise

import numpy as np

from forcelab.demonstration import GAP_PERIODS
from forcelab.labels import UNLABELLED
from forcelab.recognition.features import REACH, REST
from forcelab.recognition.live import (
    TOLERANCE,
    FixedLag,
    LiveLabels,
    OnlineRecogniser,
    budget_of,
    classify,
    limits_of,
    longest_gap,
)
from forcelab.recognition.live_features import (
    COARSE,
    EVERY,
    FIRST,
    FORGETTING,
    LARGEST,
    LATEST,
    OUTLYING,
    OUTLYING_FEW,
    TRUST,
    CausalGrid,
    Floor,
    rows_of,
)
from forcelab.recognition.live_model import live_hop, needs_live_model
from forcelab.signals.channels import channel_map
from forcelab.signals.streaming import Kernel, StreamingCwt


def reference_labels(recogniser, demonstration, latency):
    """The labels of a demonstration `latency` seconds after each step, as `Decided`.

    Where two probabilities, or one and the threshold, are as close as rounding leaves them, those
    of a stream may differ.
    """
    channels = channel_map(demonstration.channels, recogniser.channels)
    grid = CausalGrid(len(channels.recorded), recogniser.rate, longest=longest_gap(recogniser))
    steps = grid.push(demonstration.times, demonstration.signals[:, list(channels.recorded)])
    steps += grid.finish()
    budget = budget_of(recogniser, latency, grid.step, grid.lag)
    signals = channels.apply(steps.signals)
    if needs_live_model(recogniser.settings):
        return labels_of_live_model(recogniser, steps, signals, budget, grid.step)
    features = wavelet_features(recogniser.settings, signals, budget.features)
    probe = getattr(recogniser.classifier, "predict_proba", None)
    codes, probabilities = classify(recogniser, features, steps.valid, probe)
    if recogniser.settings.median is not None:
        codes = median(codes, recogniser.settings.median, budget.median)
        codes[~steps.valid] = UNLABELLED
    limits = limits_of(recogniser)
    if limits:
        codes = dropped(codes, steps.times, limits, grid.step, budget.drop)
    return LiveLabels(steps.times, codes, probabilities)


def streamed(recogniser, demonstration, latency, blocks, rate=None):
    """Times, codes and probabilities of a demonstration that comes in blocks of these lengths."""
    online = OnlineRecogniser(recogniser, latency, demonstration.channels, rate)
    parts, start, turn = [], 0, 0
    while start < len(demonstration.times):
        block = slice(start, start + blocks[turn % len(blocks)])
        parts.append(online.push(demonstration.times[block], demonstration.signals[block]))
        start, turn = block.stop, turn + 1
    parts.append(online.finish())
    return tuple(
        np.concatenate([getattr(part, what) for part in parts])
        for what in ("times", "codes", "probabilities")
    )


def wavelet_features(settings, channels, delay):
    """Features of all steps, each from the samples up to `delay` steps after it."""
    (q, n), k = channels.shape, len(settings.scales)
    coefficients = np.empty((q, k, n), dtype=np.complex128)
    transform = StreamingCwt(settings.scales, 1, settings.mother, TOLERANCE, delay, together=True)
    for j, scale in enumerate(settings.scales.tolist()):
        ahead, past = int(transform.aheads[j]), int(transform.pasts[j])
        weights = Kernel.of(scale, settings.mother).weights(ahead, past)
        for i, channel in enumerate(channels):
            # Before the start the first value holds. Not in Fourier space, where the rounding of
            # one large sample is everywhere.
            held = np.pad(channel - channel[0], (0, ahead), mode="edge")
            coefficients[i, j] = np.convolve(held, weights)[ahead : ahead + n]
    if settings.mother.real:
        coefficients.imag = 0.0
    floor, begin, parts = Floor(q, settings.scales), 0, []
    for look in range(0, n + 1, EVERY):
        # The newest sample that a step knows decides which look at the noise it has.
        first, last = max(0, look - delay), max(0, look + EVERY - delay)
        last = n if look + EVERY > n else last
        known = look or min(FIRST, n)
        floor.see(channels[:, begin:known].T)
        floor.look()
        begin = known
        parts.append(rows_of(coefficients[:, :, first:last], floor.now, settings.phase))
    return np.concatenate(parts)


def median(codes, width, ahead):
    """The running median with at most `ahead` steps to look ahead."""
    before, after = width // 2, (width - 1) // 2
    out = codes.copy()
    for i in range(len(codes)):
        newest = min(len(codes) - 1, i + ahead)
        window = np.sort(codes[np.clip(np.arange(i - before, i + after + 1), 0, newest)])
        out[i] = (window[(width - 1) // 2] + window[width // 2] + 1) // 2
    return out


def dropped(codes, times, limits, period, ahead):
    """The drop heuristic with at most `ahead` steps to look ahead."""
    n, longest = len(codes), GAP_PERIODS * period
    parted = (np.diff(codes) != 0) | (np.diff(times) > longest)
    edges = [0, *(np.flatnonzero(parted) + 1).tolist(), n]
    out = codes.copy()
    for start, end in pairwise(edges):
        follows = end < n and times[end] - times[end - 1] <= longest
        whole = (times[end] if follows else times[end - 1] + period) - times[start]
        for i in range(start, end):
            newest = i + ahead
            seconds = whole if end <= min(newest, n) else times[newest] - times[start]
            if seconds < limits.get(int(codes[i]), 0.0) - 1e-9:
                out[i] = UNLABELLED
    return out


def labels_of_live_model(recogniser, steps, channels, budget, period):
    """The labels of a part for streams: of features as it has learnt from, decoded at once."""
    hop, n = live_hop(recogniser.settings, 1.0 / period), len(steps)
    looks = [round(part.windows.look / period) for part in recogniser.live_models]
    part = recogniser.live_models[looks.index(budget.features)]
    features = part.windows.of(channels, 1.0 / period, hop)
    valid = steps.valid[np.minimum(np.arange(len(features)) * hop + hop // 2, n - 1)]
    known = np.zeros((len(features), len(recogniser.actions)))
    found = part.classifier.predict_proba(features[valid])
    known[np.ix_(valid, part.classifier.classes_)] = found
    use = recogniser.settings.choreography
    decoder = FixedLag(hop * period, budget.decoder // hop, recogniser.grammar, use)
    with np.errstate(divide="ignore"):
        codes = np.concatenate([decoder.push(np.log(known), valid), decoder.finish()])
    around = np.minimum(np.arange(n) // hop, len(features) - 1)
    return LiveLabels(
        steps.times,
        np.where(steps.valid, codes[around], UNLABELLED),
        np.where(steps.valid[:, None], known[around], 0.0),
    )


def window_features(what, channels, rate, hop):
    """Features of all time steps, one after the other and window by window; shape (m, f)."""
    q, n = channels.shape
    ready = np.clip(channels / what.usual[:, None], -LARGEST, LARGEST)
    ahead = round(what.look * rate)
    count = max(1, int(np.ceil((n - hop // 2) / hop)))
    out = np.empty((count, 3, q, len(what.windows)))
    for step in range(count):
        middle = step * hop + hop // 2
        for number, spread in enumerate(what.windows):
            if spread >= COARSE * hop / rate:
                cells = int(np.ceil((REACH * spread * rate + ahead) / hop)) + 2
                ends = middle + ahead - hop * np.arange(cells)[::-1]
                samples = ready[:, np.clip(ends[:, None] - np.arange(hop), 0, n - 1)]
                times, width = (ends - (hop - 1) / 2 - middle) / rate, spread
            else:
                reach = int(np.ceil(REACH * spread * rate))
                offsets = np.arange(-reach - 1, min(ahead, reach) + 1)
                samples = ready[:, np.clip(middle + offsets, 0, n - 1), None]
                times, width = offsets / rate, max(spread, 0.5 / rate)
            # What lies within its reach, and the one value before.
            first = max(0, int(np.searchsorted(times, -REACH * width, side="right")) - 1)
            samples, times = samples[:, first:], times[first:]
            weights = np.exp(-0.5 * (times / width) ** 2)
            weights /= weights.sum()
            values = samples.mean(axis=2)
            start, off = values[:, :1], times - times @ weights
            level = start[:, 0] + (values - start) @ weights
            out[step, 0, :, number] = level
            out[step, 1, :, number] = (values - start) @ (weights * off) / (weights @ off**2)
            variance = ((values - level[:, None]) ** 2 + samples.var(axis=2)) @ weights
            out[step, 2, :, number] = np.sqrt(variance)
    if what.own:
        rest, size = running(ready, rate, hop, ahead, count)
        out[:, 0] -= rest[:, :, None]
        out /= size[:, None, :, None]
    return out.reshape(count, -1)


def running(ready, rate, hop, ahead, count):
    """Level at rest and size of the movements so far, each of shape (count, q)."""
    n, limit = ready.shape[1], max(1, round(REST * rate))
    rests, sizes = np.empty((2, count, len(ready)))
    squares, total = np.zeros((2, len(ready)))
    newest, keep = hop // 2 + ahead, np.exp(-hop / rate / FORGETTING)
    for step in range(-(newest // hop), count):
        last = newest + step * hop
        rest = np.median(ready[:, np.clip(np.arange(min(last + 1, limit)), 0, n - 1)], axis=1)
        cell = ready[:, np.clip(np.arange(last - hop + 1, last + 1), 0, n - 1)]
        away = np.abs(cell - rest[:, None])
        latest = np.clip(np.arange(last - max(hop, LATEST) + 1, last + 1), 0, n - 1)
        near = np.sort(np.abs(ready[:, latest] - rest[:, None]), axis=1)
        most = OUTLYING_FEW if hop < LATEST else OUTLYING
        away = np.minimum(away, most * near[:, len(latest) // 2, None])
        squares = keep * squares + np.square(away).sum(axis=1) / rate
        total = keep * total + away.sum(axis=1) / rate
        if step >= 0:
            rests[step], sizes[step] = rest, (squares + TRUST) / (total + TRUST)
    return rests, sizes
