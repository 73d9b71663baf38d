"""Offsets, scales and swapped sensors of test demonstrations, matched to training without labels.

Another person presses harder, another device counts otherwise, and after a repair the two sensors
of a pair of tongs may have changed places. Estimated over all test demonstrations together, so that
they keep what tells one from the other, are

* the *offset* of each recorded channel, the median of its first 0.2 s, when nothing is held;
* the *scale* of each recognition channel, the 95th percentile of its distances from rest; both axes
  of a tangential force are scaled alike;
* the *assignment of sensors*: of each permutation the likelihood of the channels' relative sizes
  and correlations, under independent Student distributions around the medians of the training
  demonstrations, as wide as their spread and what calibration may be off. Sensors count as swapped
  only where that is :data:`LEAST_LOG_RATIO` more likely, in logarithm per demonstration.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from forcelab.arrays import Real, Whole
from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.features import REST, SIZE
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid

#: Logarithm of how much likelier an assignment must be than that of the names, per demonstration:
#: some seven times, as swapping what is right costs far more than leaving what is wrong.
LEAST_LOG_RATIO = 2.0
#: Degrees of freedom of the Student distributions: one odd demonstration must not decide. Few are
#: too few to fit them; 4 as in Lange, Little and Taylor, "Robust statistical modeling using the t
#: distribution", JASA 84, 1989.
DEGREES_OF_FREEDOM = 4.0
#: Standard deviation of a size's logarithm by calibration (a quarter of a force), and of Fisher's z
#: of a correlation by circumstances: assumed, so that few and alike demonstrations of training do
#: not make everything else look impossible.
CALIBRATION_SPREAD, CORRELATION_SPREAD = 0.25, 0.4
#: A channel that would need more than this factor is dead, and stays as it is: neither persons nor
#: calibrations differ by as much, and its noise would be made a force.
LARGEST_GAIN = 20.0
#: With more sensors than this the names are believed: 5 have 120 assignments, of which one or the
#: other looks likelier by chance.
MOST_SENSORS = 4


@dataclass(frozen=True)
class Adaptation:
    """The change of offsets, scales and sensors that matches test demonstrations to training."""

    #: For each recorded channel the one whose samples it takes; another one's where sensors are
    #: swapped
    sources: Mapping[str, str]
    test_rest: Mapping[str, float]  # level at rest of each source
    train_rest: Mapping[str, float]  # level at rest of each channel in training
    gain: Mapping[str, float]  # factor of each channel
    #: Sensors that changed places: the one in training, and the recorded one that stands for it
    swapped: tuple[tuple[str, str], ...] = ()
    #: Of the likelihoods of the best other assignment of sensors and that of the names, per
    #: demonstration; minus infinity where there is no other
    log_ratio: float = -np.inf

    def apply(self, item: LabelledDemonstration) -> LabelledDemonstration:
        """The test demonstration as the training set's sensors would have recorded it."""
        demonstration = item.demonstration
        names = [channel.name for channel in demonstration.channels]
        columns = {name: demonstration.signals[:, i] for i, name in enumerate(names)}
        signals = np.array(demonstration.signals)
        for i, name in enumerate(names):
            source = self.sources.get(name)
            if source is not None:
                moved = columns[source] - self.test_rest[source]
                signals[:, i] = self.train_rest[name] + self.gain[name] * moved
        adapted = Demonstration(
            demonstration.name,
            demonstration.task,
            demonstration.times,
            signals,
            demonstration.channels,
            grid_rate=demonstration.grid_rate,
        )
        return replace(item, demonstration=adapted)

    @property
    def summary(self) -> str:
        """The change in one sentence, as a remark of an evaluation."""
        sensors = "no sensor is swapped"
        if self.swapped:
            pairs = " and ".join(
                f"{replacement} for {sensor}" for sensor, replacement in self.swapped
            )
            sensors = f"sensors are swapped ({pairs}; log likelihood ratio {self.log_ratio:.1f})"
        gains = sorted(self.gain.values())
        return (
            f"Adapted to the training demonstrations without labels: {sensors}, "
            f"forces are scaled by {gains[0]:.2f} to {gains[-1]:.2f}."
        )


@dataclass(frozen=True)
class _Summary:
    """Rest, sizes and correlations of one demonstration's channels."""

    recorded: tuple[str, ...]
    channels: tuple[str, ...]
    #: Recorded channels of each recognition channel.
    parts: Mapping[str, tuple[str, ...]]
    rest: Real  # (u,)
    size: Real  # (q,), above 0
    correlations: Real  # (q, q), Fisher's z of the correlations


def estimate_adaptation(
    train: Sequence[LabelledDemonstration], test: Sequence[LabelledDemonstration]
) -> Adaptation:
    """Match test demonstrations to training ones, at least one of each; labels play no part."""
    train_summaries = [_summarise_channels(item.demonstration) for item in train]
    test_summaries = [_summarise_channels(item.demonstration) for item in test]
    first = train_summaries[0]
    for summary, item in zip([*train_summaries, *test_summaries], [*train, *test], strict=True):
        if summary.channels != first.channels or summary.recorded != first.recorded:
            raise InputError(
                f"'{item.demonstration.name}' has the channels {', '.join(summary.recorded)} but "
                f"'{train[0].demonstration.name}' has {', '.join(first.recorded)}; adapt "
                f"demonstrations with the same channels."
            )
    order, swapped, log_ratio = _assign_sensors(train_summaries, test_summaries)
    rest = _column_medians([summary.rest for summary in train_summaries])
    rests = _column_medians([summary.rest for summary in test_summaries])
    sizes = np.exp(_column_medians([np.log(summary.size) for summary in train_summaries]))
    others = np.exp(_column_medians([np.log(summary.size) for summary in test_summaries]))[order]
    sources, gain = {}, {}
    for i, channel in enumerate(first.channels):
        factor = float(sizes[i] / others[i])
        plausible = 1 / LARGEST_GAIN <= factor <= LARGEST_GAIN
        sources_used = first.parts[first.channels[order[i]]]
        for name, source in zip(first.parts[channel], sources_used, strict=True):
            sources[name], gain[name] = source, factor if plausible else 1.0
    return Adaptation(
        sources,
        dict(zip(first.recorded, rests.tolist(), strict=True)),
        dict(zip(first.recorded, rest.tolist(), strict=True)),
        gain,
        swapped,
        log_ratio,
    )


def _column_medians(rows: Sequence[Real]) -> Real:
    """The median of each column."""
    return np.asarray(np.median(np.stack(rows), axis=0))


def _summarise_channels(demonstration: Demonstration) -> _Summary:
    names = [channel.name for channel in demonstration.channels]
    channels = channel_map(demonstration.channels)
    grid = on_grid(demonstration, None, channels.recorded)
    rest = np.median(grid.signals[: max(1, round(REST * grid.rate))], axis=0)
    away = np.abs(channels.apply(grid.signals - rest))
    size = np.quantile(away, SIZE, axis=1)
    size = np.where(size > 0, size, 1.0)
    recorded = tuple(names[column] for column in channels.recorded)
    # Logarithmic in large forces: a single peak says little of how channels move together.
    ready = np.arcsinh(2 * away / size[:, None])
    ready -= ready.mean(axis=1, keepdims=True)
    lengths = np.sqrt((ready**2).sum(axis=1))
    together = ready @ ready.T / np.maximum(np.outer(lengths, lengths), 1e-300)
    return _Summary(
        recorded,
        channels.names,
        {
            name: tuple(recorded[place] for place in columns)
            for name, columns in zip(channels.names, channels.columns, strict=True)
        },
        rest,
        size,
        np.arctanh(np.clip(together, -0.999, 0.999)),
    )


def _assign_sensors(
    train: Sequence[_Summary], test: Sequence[_Summary]
) -> tuple[Whole, tuple[tuple[str, str], ...], float]:
    """The best assignment of sensors: channel order, swapped pairs, log likelihood ratio."""
    channels = train[0].channels
    same = np.arange(len(channels))
    sensors = _sensors(channels)
    weakest = [
        np.exp(_column_medians([np.log(summary.size) for summary in group])).min()
        for group in (train, test)
    ]
    # A dead channel makes its sensor look like the weaker one.
    if not 2 <= len(sensors) <= MOST_SENSORS or LARGEST_GAIN * weakest[1] < weakest[0]:
        return same, (), -np.inf
    baseline = _likelihood(train, test, same)
    best, swaps, gain = same, tuple(sensors), -np.inf
    for turn in itertools.permutations(sensors):
        if turn == tuple(sensors):
            continue
        order = same.copy()
        for sensor, replacement in zip(sensors, turn, strict=True):
            order[list(sensors[sensor])] = sensors[replacement]
        likelihood_gain = _likelihood(train, test, order) - baseline
        if likelihood_gain > gain:
            best, swaps, gain = order, turn, likelihood_gain
    if gain < LEAST_LOG_RATIO:
        return same, (), gain
    pairs = zip(sensors, swaps, strict=True)
    return (
        best,
        tuple((sensor, replacement) for sensor, replacement in pairs if sensor != replacement),
        gain,
    )


def _sensors(channels: Sequence[str]) -> dict[str, tuple[int, int]]:
    """Places of the tangential and the normal force of each 3-axis sensor."""
    places = {name: i for i, name in enumerate(channels)}
    sensors = {}
    for name, i in places.items():
        kind, _, sensor = name.partition(" ")
        if kind == "tangential" and f"normal {sensor}" in places:
            sensors[sensor] = (i, places[f"normal {sensor}"])
    return sensors


def _likelihood(train: Sequence[_Summary], test: Sequence[_Summary], order: Whole) -> float:
    """Log likelihood of an assignment, per demonstration and up to a constant."""
    same = np.arange(len(order))
    train_signatures = np.stack([_sensor_signature(summary, same) for summary in train])
    test_signatures = np.stack([_sensor_signature(summary, order) for summary in test])
    q = len(order)
    slack = np.repeat([CALIBRATION_SPREAD, CORRELATION_SPREAD], [q, q * (q - 1) // 2])
    width = np.sqrt(train_signatures.var(axis=0) + slack**2)
    off = (test_signatures - np.median(train_signatures, axis=0)) / width
    logs = -0.5 * (DEGREES_OF_FREEDOM + 1) * np.log1p(off**2 / DEGREES_OF_FREEDOM)
    return float(logs.sum(axis=1).mean())


def _sensor_signature(summary: _Summary, order: Whole) -> Real:
    """What distinguishes sensors: relative sizes of the channels, and their correlations."""
    sizes = np.log(summary.size[order])
    correlations = summary.correlations[np.ix_(order, order)]
    return np.concatenate([sizes - sizes.mean(), correlations[np.triu_indices(len(order), 1)]])
