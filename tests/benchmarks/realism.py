"""Simulated tasks beside real recordings of them: how far their statistics are apart.

The reading at rest is the median over the samples labelled ``still`` or, where there is none, over
the first tenth of a second.

Figures are medians over demonstrations unless they say otherwise, so that one that went wrong does
not move them. Spectra are Welch's, with Hann windows of one second at most, straight lines taken
off, as amplitude densities.
"""

from __future__ import annotations

import tempfile
from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt, welch

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.label_map import MergeMap
from forcelab.labels import Segments
from forcelab.project import Project
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.dataset import load_dataset
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid
from forcelab.simulation.coder_model import CODERS
from forcelab.simulation.generate import Order, produce_demonstrations
from forcelab.simulation.origin import Origin, origins
from forcelab.simulation.scene import TASKS, Task

Array = NDArray[np.float64]

#: The action during which nothing is touched.
REST = "still"
#: Edges of actions are coded to within some hundredths of a second; rest begins and ends by this
#: much later and earlier, s.
MARGIN = 0.05
#: Stretches shorter than this say nothing about a spectrum, s.
SHORTEST = 0.25


@dataclass(frozen=True)
class BaselineRemoved:
    """One demonstration's forces on a uniform grid, with the readings at rest taken off."""

    times: Array  # (n,), seconds
    rate: float  # Hz
    axes: Array  # (n, s, 3), fx, fy and fz of each sensor, N
    recorded: Array  # (m, s, 3), the same as they are stored
    segments: Segments

    @cached_property
    def normal(self) -> Array:
        """Magnitudes of the normal forces, shape (n, s), N."""
        return np.abs(self.axes[:, :, 2])

    @cached_property
    def tangential(self) -> Array:
        """Magnitudes of the tangential forces, shape (n, s), N."""
        return np.hypot(self.axes[:, :, 0], self.axes[:, :, 1])

    def during(self, action: str | None) -> NDArray[np.bool_]:
        """Which samples are labelled with an action, or with any but rest if None; shape (n,)."""
        return within(
            self.times,
            [
                (segment.start, segment.end)
                for segment in self.segments
                if (segment.action != REST if action is None else segment.action == action)
            ],
        )

    @cached_property
    def at_rest(self) -> list[Array]:
        """Forces of each stretch at rest, margins left out; shape (k, 3 s) each."""
        return self._stretches(
            [(s.start + MARGIN, s.end - MARGIN) for s in self.segments if s.action == REST]
        )

    @cached_property
    def in_action(self) -> list[Array]:
        """Forces of each stretch from leaving rest to coming back to it; shape (k, 3 s) each."""
        spans: list[tuple[float, float]] = []
        fresh = True
        for segment in self.segments:
            if segment.action != REST and fresh:
                spans.append((segment.start, segment.end))
            elif segment.action != REST:
                spans[-1] = (spans[-1][0], segment.end)
            fresh = segment.action == REST
        return self._stretches(spans)

    def _stretches(self, spans: Iterable[tuple[float, float]]) -> list[Array]:
        """The forces of those spans that are long enough for a spectrum."""
        flat = self.axes.reshape(len(self.times), -1)
        parts = [flat[within(self.times, [span])] for span in spans]
        return [part for part in parts if len(part) >= SHORTEST * self.rate]


def remove_baseline(item: LabelledDemonstration) -> BaselineRemoved:
    """Find the sensors, bring them onto a grid and take off what they read at rest.

    `item`: with at least one segment.
    """
    title = item.demonstration.name
    channels = channel_map(item.demonstration.channels)
    sensors = [
        (*columns, *channels.columns[channels.names.index(name.replace("tangential", "normal", 1))])
        for name, columns in zip(channels.names, channels.columns, strict=True)
        if len(columns) == 2
    ]
    if not sensors:
        raise InputError(
            f"'{title}' has no 3-axis force sensor, such as channels fx1, fy1 and fz1."
        )
    columns = [channels.recorded[column] for sensor in sensors for column in sensor]
    grid = on_grid(item.demonstration, columns=columns)
    resting = within(grid.times, [(s.start, s.end) for s in item.segments if s.action == REST])
    if not resting.any():
        resting = grid.times < grid.times[0] + 0.1
    signals = grid.signals - np.median(grid.signals[resting], axis=0)
    shape = (-1, len(sensors), 3)
    recorded = item.demonstration.signals[:, columns].reshape(shape)
    return BaselineRemoved(grid.times, grid.rate, signals.reshape(shape), recorded, item.segments)


def within(times: Array, spans: Iterable[tuple[float, float]]) -> NDArray[np.bool_]:
    """Tell which times lie in any of the spans, their ends not included; shape (n,)."""
    inside = np.zeros(len(times), dtype=np.bool_)
    for start, end in spans:
        inside |= (times >= start) & (times < end)
    return inside


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


def figures(labelled: Sequence[LabelledDemonstration], actions: Sequence[str]) -> Figures:
    """Compute all figures of a set of recordings.

    The sensors are numbered by the tangential force that they feel, the largest first, because
    which of them is left and right differs from set to set.

    `labelled`: of one task and one kind of device, each with at least one segment; `actions`: those
    to give figures of, in this order.
    """
    recordings = [remove_baseline(item) for item in labelled]
    shears = np.median([recording.tangential.mean(axis=0) for recording in recordings], axis=0)
    ranks = np.argsort(-shears, kind="stable")
    return (
        _labels(labelled, actions)
        | _forces(recordings, ranks, [action for action in actions if action != REST])
        | _signals(recordings)
    )


def _typical(values: Iterable[float]) -> float:
    """The median of those values that there are; NaN if there is none."""
    finite = [value for value in values if np.isfinite(value)]
    return float(np.median(finite)) if finite else np.nan


def _labels(labelled: Sequence[LabelledDemonstration], actions: Sequence[str]) -> Figures:
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


def _forces(
    recordings: Sequence[BaselineRemoved], ranks: NDArray[np.intp], actions: Sequence[str]
) -> Figures:
    """How large forces are, overall and within actions, and how a grip begins."""
    result: Figures = {}
    for action in (None, *actions):
        masks = [recording.during(action) for recording in recordings]
        for number, sensor in enumerate(ranks, start=1):
            for kind in ("normal", "tangential"):
                parts = [
                    getattr(recording, kind)[mask, sensor]
                    for recording, mask in zip(recordings, masks, strict=True)
                    if mask.any()
                ]
                what = f"{kind} force of sensor {number}"
                where = f"{action or 'all actions'}: {what}"
                result[f"{where}, peak", "N"] = _typical(part.max() for part in parts)
                result[f"{where}, median", "N"] = _typical(float(np.median(part)) for part in parts)
    result["grab: rise from 10 to 90 %", "s"] = _typical(
        _rise(recording) for recording in recordings
    )
    result["gripped: tangential over normal force", ""] = _typical(_ratio(o) for o in recordings)
    return result


def _rise(recording: BaselineRemoved) -> float:
    """Seconds that the mean normal force takes from 10 to 90 % of its peak in the first grab.

    The peak is looked for until the action after the grab ends: coders end a grab early.
    """
    grabs = [number for number, s in enumerate(recording.segments) if s.action == "grab"]
    if not grabs or recording.times[-1] - recording.times[0] < SHORTEST:
        return np.nan
    first, after = recording.segments[grabs[0]], recording.segments[grabs[0] : grabs[0] + 2][-1]
    pressed = -recording.axes[:, :, 2].mean(axis=1)
    if recording.rate > 2 * IMPACTS:
        pressed = sosfiltfilt(butter(2, IMPACTS, fs=recording.rate, output="sos"), pressed)
    pressed = pressed[within(recording.times, [(first.start - 0.1, after.end)])]
    peak = pressed.max(initial=0.0)
    high = int(np.argmax(pressed >= 0.9 * peak))
    low = np.flatnonzero(pressed[:high] < 0.1 * peak)
    return (high - int(low[-1])) / recording.rate if low.size and peak > GRIPPED else np.nan


def _ratio(recording: BaselineRemoved) -> float:
    """Median of the tangential over the normal force of all sensors where they are pressed."""
    gripped = recording.normal > GRIPPED
    return _typical(recording.tangential[gripped] / recording.normal[gripped])


def _signals(recordings: Sequence[BaselineRemoved]) -> Figures:
    """Steps, noise and spectra of the tangential axes (fx, fy) and of the normal one (fz)."""
    result: Figures = {}
    for kind, axes in (("tangential", [0, 1]), ("normal", [2])):
        steps = [
            _step(channel)
            for recording in recordings
            for channel in recording.recorded[:, :, axes].reshape(len(recording.recorded), -1).T
        ]
        noises = [
            _noise(_of(part, axes), recording.rate)
            for recording in recordings
            for part in recording.at_rest
        ]
        result[f"{kind} axes: quantisation step", "mN"] = 1e3 * _typical(steps)
        result[f"{kind} axes: noise at rest above {NOISE:g} Hz", "mN rms"] = 1e3 * _typical(noises)
        for when in ("at rest", "in action"):
            spectra = [
                _densities([_of(part, axes) for part in parts], recording.rate)
                for recording in recordings
                if (parts := recording.at_rest if when == "at rest" else recording.in_action)
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


#: Figures further apart than this factor are marked.
FACTOR = 2.0
MARK = "!"


@dataclass(frozen=True, slots=True)
class Comparison:
    """One figure of simulated and of real recordings."""

    name: str  # what it is, such as ``"grab: duration, median"``
    unit: str  # empty where it has none
    #: simulated and real: Finite and not negative.
    simulated: float
    real: float

    @property
    def ratio(self) -> float | None:
        """Simulated over real; None where the real one is zero."""
        return self.simulated / self.real if self.real else None

    @property
    def alike(self) -> bool:
        """Whether the two are equal or no more than :data:`FACTOR` apart."""
        if self.ratio is None:
            return self.simulated == self.real
        return 1 / FACTOR <= self.ratio <= FACTOR


def realism(
    simulated: Sequence[LabelledDemonstration], real: Sequence[LabelledDemonstration]
) -> tuple[Comparison, ...]:
    """Compare simulated with real recordings of one task.

    `simulated`, `real`: which spell the actions alike. Gives figures that a side does not tell are
    left out. An action that only one side has shows in its number of segments, which is then zero
    on the other.
    """
    sides = simulated, real
    spelled = [segment.action for side in sides for item in side for segment in item.segments]
    ours, theirs = (figures(side, tuple(dict.fromkeys(spelled))) for side in sides)
    return tuple(
        Comparison(name, unit, value, theirs[name, unit])
        for (name, unit), value in ours.items()
        if np.isfinite([value, theirs.get((name, unit), np.nan)]).all()
    )


def recognition(
    simulated: Sequence[LabelledDemonstration],
    real: Sequence[LabelledDemonstration],
    jobs: int = 1,
) -> Generator[Progress, None, tuple[Comparison, ...]]:
    """Compare how well a recogniser does on each side, leaving one demonstration out.

    A simulation that is recognised much better than the real recordings is a toy. The recogniser
    is trained on every tenth sample, which scores the same.
    """
    settings = preset("paper").replace(stride=10)
    scores = []
    for side in (simulated, real):
        evaluation = yield from leave_one_out_job(side, settings, jobs=jobs)
        scores.append(
            {
                f"{which}: {measure.replace('_', ' ')}": getattr(
                    evaluation.scores(which)[0], measure
                )
                for which in ("raw", "filtered")
                for measure in ("accuracy", "balanced_accuracy", "edit")
            }
        )
    ours, theirs = scores
    return tuple(
        Comparison(name, "", ours[name], theirs[name])
        for name in ours
        if ours[name] is not None and theirs[name] is not None
    )


def cells(rows: Sequence[Comparison]) -> list[list[str]]:
    """Header and rows as text: the mark of what is not alike, figure, unit and three numbers."""
    return [
        ["", "figure", "unit", "simulated", "real", "ratio"],
        *(
            [
                "" if row.alike else MARK,
                row.name,
                row.unit,
                f"{row.simulated:.3g}",
                f"{row.real:.3g}",
                "-" if row.ratio is None else f"{row.ratio:.2f}",
            ]
            for row in rows
        ),
    ]


#: Real recordings start and end this long before and after what is labelled, s.
LEAD = 0.08
#: Leaving one demonstration out leaves something to learn from.
FEWEST = 2
#: How many demonstrations of each task are simulated.
SIMULATED = 10
#: How the recordings published with the paper spell the actions.
PUBLISHED = MergeMap(
    {
        "grab_pen": "grab",
        "pull_pen": "pull",
        "slip_pen": "slip",
        "sliptransition_pen": "slip transition",
        "slipped_pen": "slipped",
        "grab_soft": "grab",
        "hold_soft": "hold",
        "release_soft": "release",
    }
)


@dataclass(frozen=True)
class Beside:
    """One task's comparison."""

    task: Task
    #: simulated and real: Number of demonstrations.
    simulated: int
    real: int
    rows: tuple[Comparison, ...]


def comparing(
    path: Path, author: str | None = None, jobs: int = 1
) -> Generator[Progress, None, tuple[Beside, ...]]:
    """Simulate the tasks of a project of real recordings, and compare.

    `path`: A project with two labelled demonstrations or more of each task that is labelled and can
    be simulated; there is at least one such task; `author`: whose labels; may be left out where
    there is one coder. The first of the simulated coders labels the simulated ones. Gives one for
    each task, the recognition by preset ``paper`` included.
    """
    result = []
    for task, real in _recorded(path, author).items():
        simulated = yield from simulated_beside(origins(task, SIMULATED, seed=1), jobs)
        rows = realism(simulated, real)
        rows += yield from recognition(simulated, real, jobs=jobs)
        result.append(Beside(task, len(simulated), len(real), rows))
    return tuple(result)


def _recorded(path: Path, author: str | None) -> dict[Task, list[LabelledDemonstration]]:
    """The labelled demonstrations of a project, by task, spelled as ours; each can be compared."""
    result: dict[Task, list[LabelledDemonstration]] = {}
    with Project.open(path) as project:
        tasks = [
            task for task in TASKS if any(i.authors for i in project.demonstrations.infos(task))
        ]
        if not tasks:
            raise InputError(
                f"'{path}' has no labelled demonstration of a task that can be simulated "
                f"({', '.join(TASKS)}); import some as a task of one of these names."
            )
        for task in tasks:
            found = load_dataset(project, (task,), author, merge=PUBLISHED)
            real = [recording for recording in found.labelled if recording.segments]
            if len(real) < FEWEST:
                raise InputError(
                    f"'{path}' has too few labelled demonstrations of the task '{task}', "
                    f"{len(real)}; a comparison needs {FEWEST} or more."
                )
            figures(real, ())  # refuses what has no 3-axis force sensor
            result[task] = real
    return result


def simulated_beside(
    recorded_origins: Sequence[Origin], jobs: int = 1
) -> Generator[Progress, None, list[LabelledDemonstration]]:
    """Simulate demonstrations as the paper's were recorded: without video and taps.

    `jobs`: processes that share the work. Gives by the first of the simulated coders.
    """
    coder = CODERS[0].name
    orders = [Order(origin, coders=(coder,), video=False) for origin in recorded_origins]
    with tempfile.TemporaryDirectory() as scratch:
        recordings = yield from produce_demonstrations(orders, Path(scratch), jobs)
    return [
        LabelledDemonstration(
            _task_only(recording.demonstration, recording.tracks[0].segments),
            recording.tracks[0].segments,
        )
        for recording in recordings
    ]


def _task_only(demonstration: Demonstration, segments: Segments) -> Demonstration:
    """A demonstration without its taps, which the real recordings do not have."""
    times = demonstration.times
    in_task = (times >= segments[0].start - LEAD) & (times < segments[-1].end + LEAD)
    return replace(demonstration, times=times[in_task], signals=demonstration.signals[in_task])
