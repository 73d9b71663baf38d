"""Examples: the features, units and human codes of every time step of a demonstration."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import groupby
from statistics import median_low
from typing import Any

import numpy as np

from forcelab.arrays import Codes, Flags, Real, Whole
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.label_map import MergeMap
from forcelab.labels import UNLABELLED, Segment, Segments, to_codes
from forcelab.recognition.features import (
    peak_features,
    plugin_features,
    wavelet_features,
    window_features,
)
from forcelab.recognition.settings import Settings
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid

#: Names that a remark lists before it only counts the rest.
NAMED = 3
#: What can be done where units differ.
CURE = "readings without a unit may be raw counts, which become newtons by a calibration"


def units_of(channels: Sequence[Channel], names: Sequence[str] | None = None) -> tuple[str, ...]:
    """The unit of each recognition channel; empty where it has none."""
    mapping = channel_map(channels, names)
    return tuple(channels[mapping.recorded[columns[0]]].unit for columns in mapping.columns)


def mixed_unit_remarks(
    demonstrations: Sequence[Demonstration], settings: Settings
) -> tuple[str, ...]:
    """A remark where demonstrations of one evaluation have channels in different units."""
    names = settings.channels
    for name in channel_map(demonstrations[0].channels, names).names if demonstrations else ():
        units = [(units_of(d.channels, [name])[0], d.name) for d in demonstrations]
        units.sort(key=lambda pair: pair[0])
        parts = [
            f"{_unit_text(unit)} in {_name_list([name for _, name in pairs])}"
            for unit, pairs in groupby(units, key=lambda pair: pair[0])
        ]
        if len(parts) > 1:
            return (
                f"The channel '{name}' is {', and '.join(parts)}, which does not compare: {CURE}; "
                f"give all the same unit, or leave some out.",
            )
    return ()


def unit_remarks(
    learnt: Sequence[str], names: Sequence[str], channels: Sequence[Channel]
) -> tuple[str, ...]:
    """A remark where channels have other units than those (`learnt`) of a recogniser's `names`."""
    for name, learnt_unit, unit in zip(names, learnt, units_of(channels, names), strict=False):
        if learnt_unit != unit:
            return (
                f"The channel '{name}' is {_unit_text(unit)}, but the recogniser learnt it "
                f"{_unit_text(learnt_unit)}, which does not compare: {CURE}.",
            )
    return ()


def _unit_text(unit: str) -> str:
    return f"in {unit}" if unit else "without a unit"


def _name_list(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    text = ", ".join(f"'{name}'" for name in names[:NAMED])
    more = len(names) - NAMED
    return f"{text} and {more} more" if more > 0 else text


@dataclass(frozen=True)
class LabelledDemonstration:
    """A demonstration with the segments one coder gave it.

    Parameters
    ----------
    demonstration : Demonstration
    segments : tuple of Segment
        Empty where nothing is labelled.
    apart : bool
        Whether the actions have their task as a suffix. They were merged before they got it, and
        no merge map must take it away again.
    added : bool
        Whether the segments are another coder's, of whom is only learnt: it is never tested on.

    Examples
    --------
    >>> item = forcelab.LabelledDemonstration(
    ...     project.demonstrations.load("foam 01"), (forcelab.Segment(0.0, 1.0, "still"),)
    ... )
    >>> len(item.segments)
    1
    """

    demonstration: Demonstration
    segments: Segments = ()
    apart: bool = False
    added: bool = False

    def merged(self, merge: MergeMap | None) -> LabelledDemonstration:
        """The demonstration with its actions merged, unless they are kept apart."""
        if merge is None or self.apart:
            return self
        return replace(self, segments=merge.apply_segments(self.segments))


def suffix_actions(
    labelled: Sequence[LabelledDemonstration], suffixes: Sequence[str]
) -> list[LabelledDemonstration]:
    """Give each demonstration's actions a suffix, such as its task: ``grab`` becomes ``grab_foam``.

    No merge map changes them any more: what it is to merge is merged before.
    """
    return [
        replace(
            item,
            segments=tuple(Segment(s.start, s.end, f"{s.action}_{suffix}") for s in item.segments),
            apart=True,
        )
        for item, suffix in zip(labelled, suffixes, strict=True)
    ]


@dataclass(frozen=True)
class Examples:
    """The time steps of one demonstration as a recogniser sees them.

    Parameters
    ----------
    name : str
        The demonstration's.
    times : ndarray of float64, shape (n,)
        Seconds.
    features : ndarray of float64, shape (n, f)
    valid : ndarray of bool, shape (n,)
        False in gaps, where nothing is trained, scored or predicted.
    segments : tuple of Segment
        The human's, spelled as in training.
    channels : tuple of str
        Recognition channels behind the features.
    rate : float
        Samples a second of the grid that the features were computed on; time steps may lie
        farther apart.
    units : tuple of str
        Of the channels; empty where they are not known.
    added : bool
        Whether the segments are another coder's.

    Examples
    --------
    >>> examples = forcelab.prepare_examples(labelled[0], settings)
    >>> examples.features.shape, examples.times.shape
    ((469, 48), (469,))
    """

    name: str
    times: Real
    features: Real
    valid: Flags
    segments: Segments
    channels: tuple[str, ...]
    rate: float
    units: tuple[str, ...] = ()
    added: bool = False

    def nearest(self, times: Real) -> Whole:
        """The time step nearest to each of `times` (s), shape (m,)."""
        if times is self.times:
            return np.arange(len(times))
        middles = 0.5 * (self.times[:-1] + self.times[1:])
        return np.searchsorted(middles, times)

    def codes(self, actions: Sequence[str]) -> Codes:
        """Human codes, shape (n,); unlabelled in gaps and for actions not among `actions`."""
        segments = [segment for segment in self.segments if segment.action in actions]
        codes = to_codes(segments, self.times, actions)
        codes[~self.valid] = UNLABELLED
        return codes

    def all_features(self) -> Real:
        """The features of every time step, shape (n, f)."""
        return self.features


@dataclass(frozen=True)
class LazyExamples(Examples):
    """Examples whose features are computed whenever they are asked for, and not kept.

    Of hundreds of demonstrations they are gigabytes, of which a training looks at some rows.
    """

    features: Real = field(init=False, repr=False, compare=False)
    #: Makes examples that have them; here there is no attribute `features`
    making: Callable[[], Examples] = field(kw_only=True)

    def all_features(self) -> Real:
        """The features of every time step, shape (n, f), computed anew."""
        return self.making().features


def prepare_examples(
    labelled: LabelledDemonstration,
    settings: Settings,
    rate: float | None = None,
    *,
    kept: bool = True,
) -> Examples:
    """Compute the examples of one demonstration.

    Parameters
    ----------
    labelled : LabelledDemonstration
    settings : Settings
    rate : float, optional
        Samples a second of the grid; the settings' rate, or the demonstration's own, by default.
    kept : bool
        Whether features are made now, and kept.

    Returns
    -------
    examples : Examples
        Every time step; the settings' stride is for training to take. :class:`LazyExamples` where
        features are not kept.

    Raises
    ------
    InputError
        If a wanted channel is missing.

    Notes
    -----
    Glitches count as missing samples and are bridged; see
    :func:`~forcelab.signals.conditioning.glitches`.

    Examples
    --------
    >>> examples = forcelab.prepare_examples(labelled[0], settings)
    >>> examples.features.shape, len(examples.codes(run.actions))
    ((469, 48), 469)
    """
    demonstration = labelled.demonstration
    try:
        channels = channel_map(demonstration.channels, settings.channels)
    except InputError as error:
        raise InputError(f"Demonstration '{demonstration.name}': {error}") from error
    grid = on_grid(demonstration, rate or settings.rate, channels.recorded)
    steps = settings.steps(len(grid.times), grid.rate)
    example: dict[str, Any] = {
        "name": demonstration.name,
        # Not a view of every sample, which would stay as long.
        "times": np.ascontiguousarray(grid.times[steps]),
        "valid": np.ascontiguousarray(grid.valid[steps]),
        "segments": labelled.merged(settings.merge).segments,
        "channels": channels.names,
        "rate": grid.rate,
        "units": units_of(demonstration.channels, channels.names),
        "added": labelled.added,
    }
    if not kept:
        return LazyExamples(**example, making=partial(prepare_examples, labelled, settings, rate))
    features = _features(channels.apply(grid.signals), settings, grid.rate, steps)
    return Examples(**example, features=features)


def gather_features(
    examples: Sequence[Examples], *step_lists: Sequence[Whole]
) -> Generator[Progress, None, list[Real]]:
    """Stacked features of some time steps of each demonstration, for each of `step_lists`.

    Lazy examples are computed one at a time, which is progress.
    """
    gathered: list[Real] = []
    filled = [0] * len(step_lists)
    for i, example in enumerate(examples):
        features = example.all_features()
        if not gathered:
            gathered = [np.empty((sum(map(len, steps)), features.shape[1])) for steps in step_lists]
        for number, (rows, steps) in enumerate(zip(gathered, step_lists, strict=True)):
            first, filled[number] = filled[number], filled[number] + len(steps[i])
            rows[first : filled[number]] = features[steps[i]]
        if isinstance(example, LazyExamples):  # those that are there take no time
            yield Progress(i + 1, len(examples), "features")
    return gathered


def _features(signals: Real, settings: Settings, rate: float, steps: slice) -> Real:
    """Features of some time steps, shape (m, f), of channels (q, n)."""
    parts = []
    if "windows" in settings.known_features:
        places = np.arange(signals.shape[1])[steps]
        parts.append(window_features(signals, rate, settings.windows, places, settings.amplitude))
        if settings.peaks:
            own_units = settings.amplitude != "absolute"
            parts.append(peak_features(signals, rate, settings.windows[0], places, own_units))
    if "wavelets" in settings.known_features:
        parts.append(
            wavelet_features(
                signals,
                settings.scales,
                settings.mother,
                settings.phase,
                circular=settings.circular,
                places=steps,
            )
        )
    parts += [plugin_features(path, signals, rate, steps) for path in settings.own_features]
    return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)


def common_rate(demonstrations: Sequence[Demonstration], settings: Settings) -> float:
    """The common rate in Hz: the settings', or the median of the demonstrations' own.

    Of an even number the lower median, which one of them really has.
    """
    if settings.rate is not None:
        return settings.rate
    return median_low(demonstration.rate for demonstration in demonstrations)


def actions_of(examples: Sequence[Examples]) -> tuple[str, ...]:
    """All actions of the human segments, in the order of their first occurrence."""
    return tuple(dict.fromkeys(s.action for example in examples for s in example.segments))


def common_channels(examples: Sequence[Examples]) -> tuple[str, ...]:
    """The channels that all demonstrations share; an InputError where they differ."""
    first = examples[0]
    for other in examples[1:]:
        if other.channels != first.channels:
            raise InputError(
                f"'{first.name}' has the channels {', '.join(first.channels)} but '{other.name}' "
                f"has {', '.join(other.channels)}; choose channels that both have."
            )
    return first.channels
