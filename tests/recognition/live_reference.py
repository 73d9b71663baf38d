"""What labels of a stream must be, by what recognises recordings, cut off after each hop."""

from dataclasses import replace

import numpy as np

from forcelab.recognition.features import RunningSize, wavelet_features
from forcelab.recognition.hsmm import decode
from forcelab.recognition.live_model import needs_live_model
from forcelab.recognition.online import (
    NOISE_SECONDS,
    TOLERANCE,
    LiveLabels,
    OnlineRecogniser,
    budget_of,
    wavelet_samples,
)
from forcelab.signals.channels import channel_map
from forcelab.signals.conditioning import noise_level
from forcelab.signals.grid import on_grid


def reference_labels(recogniser, demonstration, latency):
    """The labels of an even recording that misses nothing, `latency` seconds after each sample."""
    n, period = len(demonstration.times), demonstration.period
    budget = budget_of(recogniser, latency, period)
    hop, complete = round(budget.hop / period), round(budget.complete / period)
    firsts = range(0, n, hop)
    recordings = [
        replace(
            demonstration,
            times=demonstration.times[: first + complete + 1],
            signals=demonstration.signals[: first + complete + 1],
        )
        for first in firsts
    ]
    if needs_live_model(recogniser.settings):
        known = [
            _known_of_model(recogniser, recording, budget, number)
            for number, recording in enumerate(recordings)
        ]
        with np.errstate(divide="ignore"):
            logs = np.log(known)
        codes = []
        for number in range(len(known)):
            past = logs[: number + budget.lag + 1]
            valid = np.ones(len(past), dtype=bool)
            decoded = decode(past, valid, budget.hop, recogniser.grammar)
            codes.append(decoded[number])
        around = np.arange(n) // hop
        return LiveLabels(demonstration.times, np.array(codes)[around], np.array(known)[around])
    settings, classified, noise = recogniser.settings, [], None
    before, most, after = wavelet_samples(settings, budget, 1 / period)
    for number, (first, recording) in enumerate(zip(firsts, recordings, strict=True)):
        channels = channel_map(recording.channels, recogniser.channels)
        values = channels.apply(on_grid(recording, None, channels.recorded).signals)
        if number % round(NOISE_SECONDS / budget.hop) == 0:
            noise = noise_level(values[:, max(0, first - before) :])
        # Before its beginning a stream has its first value, after its end its last one.
        places = np.clip(np.arange(first - before, first + after), 0, values.shape[1] - 1)
        features = wavelet_features(
            values[:, places],
            settings.scales,
            settings.mother,
            settings.phase,
            noise,
            places=slice(before, before + most),
            tolerance=TOLERANCE,
        )[: min(hop, n - first)]
        valid = np.ones(len(features), dtype=bool)
        classified.append(recogniser.classify(features, valid, True))
    raw, known = zip(*classified, strict=True)
    raw = np.concatenate(raw)
    known = None if known[0] is None else np.concatenate(known)
    codes = []
    for first in firsts:
        past = slice(0, first + hop * (budget.lag + 1))
        times = demonstration.times[past]
        probabilities = None if known is None else known[past]
        valid = np.ones(len(times), dtype=bool)
        stages = recogniser.filter(raw[past], probabilities, times, valid)
        codes.append(stages["filtered"][first : first + hop])
    return LiveLabels(demonstration.times, np.concatenate(codes), known)


def _known_of_model(recogniser, recording, budget, number):
    """The probabilities of a time step, of which a recording knows all that it may."""
    model = next(m for m in recogniser.live_models if m.windows.look == budget.ahead)
    channels = channel_map(recording.channels, recogniser.channels)
    grid = on_grid(recording, recogniser.rate, channels.recorded)
    values = channels.apply(grid.signals)
    hop = round(budget.hop * grid.rate)
    steps = np.minimum(np.arange(number + 1) * hop + hop // 2, len(grid.times) - 1)
    size = RunningSize(len(values), grid.rate)
    features = model.windows.features(values, grid.rate, steps, size)
    known = np.zeros(len(recogniser.actions))
    known[model.classifier.classes_] = model.classifier.predict_proba(features[-1:])[0]
    return known


def streamed(recogniser, demonstration, latency, blocks, rate=None):
    """Times, codes and probabilities of a demonstration that comes in blocks of these lengths."""
    online = OnlineRecogniser(recogniser, latency, demonstration.channels, rate)
    return pushed(online, demonstration.times, demonstration.signals, blocks)


def pushed(online, times, signals, blocks):
    """The same of any stamps and signals, also such as no demonstration holds."""
    parts, start = [], 0
    while start < len(times):
        block = slice(start, start + blocks[len(parts) % len(blocks)])
        parts.append(online.push(times[block], signals[block]))
        start = block.stop
    parts.append(online.finish())
    return tuple(
        np.concatenate([getattr(part, what) for part in parts])
        for what in ("times", "codes", "probabilities")
    )
