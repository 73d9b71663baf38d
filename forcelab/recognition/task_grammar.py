"""What training tracks say of a task: durations of actions, their order, and where they change.

Durations are log-normal. Those of an action seen a few times are drawn towards what all actions
have in common, and are the wider for it; an order that was never seen is unlikely, not impossible.
Unlabelled time is missing, not an action: a short hole between two segments belongs half to each,
and over a longer one nothing is learnt about what follows what. So is a slip of the brush, far
shorter than its action usually lasts: a few of them would teach that two actions flicker, and the
decoder would let them. Sources: Yu, "Hidden semi-Markov models", Artificial Intelligence 174, 2010;
Gelman et al., "Bayesian data analysis", 3rd ed., 2013, ch. 5, means and variances drawn together.

The boundary model is learnt apart. Trees that tell actions apart are grown on labelled time, and
where one action gives way to another coders mostly leave a little unlabelled. What happens just
there, a contact, a slip or a snap, they hardly see. So some more trees are grown on all the time
around: they tell what lies near such a change from what does not. The decoder changes the action
where a change is likelier than usual.

Over simulated tasks, five of them and six seeds of five demonstrations each, `best` gains 0.5 ± 0.1
points of accuracy by it, and 1.5 ± 0.6 of the boundaries found within 100 ms; `fast` as much. On
the paper's recordings, over eight seeds of `best`, accuracy stays (0.2 ± 0.4 and 0.0 ± 0.1); of the
boundaries of the stylus 3.4 ± 1.3 points more are found, of foam's forty 1.3 ± 1.0 fewer. A stream
is decoded without it (:mod:`forcelab.recognition.live_model`).
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Any

import numpy as np

from forcelab.arrays import Codes, Real
from forcelab.jobs import Progress, finish
from forcelab.labels import UNLABELLED, Segment, Segments
from forcelab.recognition.ensemble import (
    CalibratedEnsemble,
    FitOptions,
    fit_ensemble,
    training_steps,
)
from forcelab.recognition.examples import Examples
from forcelab.recognition.forest import require
from forcelab.recognition.settings import Settings
from forcelab.segment_edits import fill_gaps

#: Seconds of unlabelled time between two segments up to which one follows the other.
HOLE = 0.25
#: Segments that last less than this share of their action's median, or so many seconds, are slips
#: of the brush; but never the longest of an action.
SLIP, SLIP_SECONDS = 0.2, 0.03
#: How many segments, starts or followers the common knowledge counts as beside those seen.
MEAN_COUNT, SPREAD_COUNT, ORDER_COUNT = 0.25, 4.0, 1.0
#: Median in seconds and spread (sd of log seconds) of actions of which nothing is known at all.
USUAL, SPREAD = 1.0, 0.5
#: No action repeats more exactly than this.
LEAST_SPREAD = 0.1
#: Seconds of each action that count as seen beforehand in the shares of time.
SHARE_SECONDS = 0.5
#: Log seconds of an action (a microsecond to eleven days) and their sd that a file may tell.
LONGEST, WIDEST = 14.0, 10.0
_ARRAYS = ("mean", "sd", "share", "start", "follow")


@dataclass(frozen=True, eq=False)
class TaskGrammar:
    """Durations and order of the actions in the training tracks; K actions."""

    actions: tuple[str, ...]  # length K; the action with code ``i`` is ``actions[i]``
    #: mean, sd: (K,); of the logarithm of each action's duration in seconds
    mean: Real
    sd: Real
    share: Real  # (K,); share of the labelled time of each action; sums to 1
    start: Real  # (K,); how probably a demonstration starts with each action; sums to 1
    #: (K, K); how probably the row's action is followed by the column's; rows sum to 1 and the
    #: diagonal is 0. All 0 where there is one action only.
    follow: Real

    @classmethod
    def learn(cls, tracks: Iterable[Segments], actions: Sequence[str]) -> TaskGrammar:
        """Learn from tracks; segments of other actions than `actions` count as unlabelled."""
        number = {action: code for code, action in enumerate(actions)}
        sequences = [tuple(s for s in track if s.action in number) for track in tracks]
        sequences = _without_slips(sequences)
        runs = [run for track in sequences for run in _runs(track)]
        K = len(actions)
        logs: list[list[float]] = [[] for _ in range(K)]
        seconds, follow = np.full(K, SHARE_SECONDS), np.zeros((K, K))
        for run in runs:
            codes = [number[segment.action] for segment in run]
            for code, segment in zip(codes, run, strict=True):
                logs[code].append(math.log(segment.duration))
                seconds[code] += segment.duration
            np.add.at(follow, (codes[:-1], codes[1:]), 1.0)
        start = np.zeros(K)
        np.add.at(start, [number[track[0].action] for track in sequences if track], 1.0)
        mean, sd = _durations(logs)
        return cls(
            tuple(actions),
            mean,
            sd,
            seconds / seconds.sum(),
            (start + ORDER_COUNT / max(K, 1)) / (start.sum() + ORDER_COUNT),
            _smoothed(follow),
        )

    def to_json(self) -> dict[str, Any]:
        """Plain values."""
        arrays = {name: getattr(self, name).tolist() for name in _ARRAYS}
        return {"actions": list(self.actions)} | arrays

    @classmethod
    def from_json(cls, plain: Mapping[str, Any]) -> TaskGrammar:
        """The inverse of :meth:`to_json`; a ValueError where it is damaged."""
        try:
            actions = tuple(str(action) for action in plain["actions"])
            mean, sd, share, start, follow = (
                np.asarray(plain[name], dtype=np.float64) for name in _ARRAYS
            )
        except (KeyError, TypeError) as error:
            raise ValueError(f"the choreography is not whole: {error}") from error
        K = len(actions)
        follow = follow.reshape(K, K)
        rows = (mean, sd, share, start)
        sound = all(row.shape == (K,) and np.isfinite(row).all() for row in rows)
        sound = sound and bool(
            (np.abs(mean) <= LONGEST).all() and ((sd > 0) & (sd <= WIDEST)).all()
        )
        for chances in (share, start, follow):
            sound = sound and bool(((chances >= 0) & (chances <= 1)).all())
        if not (sound and (share > 0).all() and (start > 0).all()):
            raise ValueError("the choreography holds numbers that cannot be")
        return cls(actions, mean, sd, share, start, follow)


def _runs(track: Segments) -> list[Segments]:
    """The track cut at its holes; within a run one segment follows the other, of another action."""
    runs: list[list[Any]] = []
    for segment in fill_gaps(track, HOLE):
        last = runs[-1][-1] if runs else None
        if last is None or segment.start - last.end > HOLE / 2:
            runs.append([segment])
        elif last.action == segment.action:
            # Two that touch are one action that goes on.
            runs[-1][-1] = type(segment)(last.start, segment.end, segment.action)
        else:
            runs[-1].append(segment)
    return [tuple(run) for run in runs]


def _without_slips(tracks: Sequence[Segments]) -> list[Segments]:
    """The tracks without segments that are far too short; their holes are filled by neighbours."""
    seconds: dict[str, list[float]] = {}
    for segment in (segment for track in tracks for segment in track):
        seconds.setdefault(segment.action, []).append(segment.duration)
    least = {
        action: min(max(SLIP * median(durations), SLIP_SECONDS), max(durations))
        for action, durations in seconds.items()
    }
    return [tuple(s for s in track if s.duration >= least[s.action]) for track in tracks]


def _durations(logs: Sequence[Sequence[float]]) -> tuple[Real, Real]:
    """Mean and sd of each action's log durations, drawn towards what all have in common."""
    counts = np.array([len(action_logs) for action_logs in logs], dtype=np.float64)
    is_observed = counts > 0
    if not is_observed.any():
        return np.full(len(logs), math.log(USUAL)), np.full(len(logs), 2 * SPREAD)
    means = np.array([np.mean(action_logs) if action_logs else 0.0 for action_logs in logs])
    pairs = zip(logs, means, strict=True)
    squares = np.array([np.sum((np.array(action_logs) - m) ** 2) for action_logs, m in pairs])
    free = np.maximum(counts - 1, 0)
    common = means[is_observed].mean()
    within = (squares.sum() + SPREAD_COUNT * SPREAD**2) / (free.sum() + SPREAD_COUNT)
    between = means[is_observed].var()
    mean = (counts * means + MEAN_COUNT * common) / (counts + MEAN_COUNT)
    variance = (squares + SPREAD_COUNT * within) / (free + SPREAD_COUNT)
    # The mean itself is known but roughly: the next duration spreads by so much more.
    variance = np.where(
        is_observed, variance * (1 + 1 / np.maximum(counts, 1)), 2 * within + between
    )
    return np.where(is_observed, mean, common), np.maximum(np.sqrt(variance), LEAST_SPREAD)


def _smoothed(follow: Real) -> Real:
    """Probabilities from counts; none of an action after itself."""
    K = len(follow)
    if K < 2:
        return np.zeros((K, K))
    counts = follow + ORDER_COUNT / (K - 1)
    np.fill_diagonal(counts, 0.0)
    return counts / counts.sum(axis=1, keepdims=True)


#: Seconds to either side of a change that are near it: about what coders differ by.
NEAR = 0.06
#: Trees of a forest; half of them where what is learnt from lies farther apart than so many
#: seconds, for a quick fit: over the simulated tasks that finds 0.5 points fewer boundaries.
TREES, SPARSE = 50, 0.075
#: Probabilities below this count as this: one of the trees may always say so.
LEAST = 0.02
#: Of fewer changes nothing is learnt but what these happened to look like.
FEWEST = 3


@dataclass(frozen=True, eq=False)
class BoundaryModel:
    """A classifier of the time steps near a change of actions."""

    classifier: CalibratedEnsemble  # of two codes, 1 being near a change
    share: float  # of the time steps that it was trained on, how many are near one, 0 to 1

    def ratios(self, features: Real) -> Real:
        """Log ratio (n,) of how much likelier than usual a change is near features (n, f)."""
        near = self.classifier.predict_proba(features)[:, 1]
        return np.asarray(np.log(np.maximum(near, LEAST) / self.share))

    def plain(self) -> dict[str, Any]:
        """Arrays, numbers and lists for :meth:`from_plain`."""
        return {"classifier": self.classifier.plain(), "share": self.share}

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], width: int) -> BoundaryModel:
        """Check what was read from a file, of `width` features."""
        share = float(plain["share"])
        require(0 < share < 1, "a share near changes between 0 and 1")
        return cls(CalibratedEnsemble.from_plain(plain["classifier"], width, 2), share)


def boundary_steps(examples: Sequence[Examples], settings: Settings) -> tuple[Codes, list[Codes]]:
    """1 near a change and 0 elsewhere (m,), of the time steps whose indices are given beside.

    Empty where the settings do without, or hardly any action gives way to another.
    """
    is_used = settings.changes and settings.decodes
    if not is_used or sum(len(_boundary_times(example.segments)) for example in examples) < FEWEST:
        none = np.empty(0, dtype=np.int64)
        return none, [none] * len(examples)
    stride = settings.training_stride(examples[0].rate)
    y, _, steps = training_steps([_near_boundary(example) for example in examples], stride)
    return y, steps


def fit_boundary_model(
    X: Real, y: Codes, spacing: float, seed: int
) -> Generator[Progress, None, BoundaryModel | None]:
    """Learn where actions change, from features (m, f) of the :func:`boundary_steps`.

    `spacing` is how many seconds lie between two of them.

    None where there is no time step near a change, or no other.
    """
    if len(np.unique(y)) < 2:
        return None
    yield Progress(0, 1, "changes")
    trees = TREES if spacing < SPARSE else TREES // 2
    ensemble = finish(fit_ensemble("extra-trees", X, y, seed, FitOptions(trees=trees)))
    return BoundaryModel(ensemble, float(y.mean()))


def _near_boundary(example: Examples) -> Codes:
    """1 for each time step near a change, 0 for others, -1 where nothing is labelled; shape (n,).

    The middle of a short hole between two actions is where they change, and it counts as labelled.
    """
    near = np.full(len(example.times), UNLABELLED, dtype=np.int64)
    holes = [(a.end, b.start) for a, b in _adjacent_pairs(example.segments)]
    for span in [(s.start, s.end) for s in example.segments] + holes:
        near[slice(*np.searchsorted(example.times, span))] = 0
    for change in _boundary_times(example.segments):
        near[(np.abs(example.times - change) <= NEAR) & (near == 0)] = 1
    near[~example.valid] = UNLABELLED
    return near


def _adjacent_pairs(segments: Segments) -> list[tuple[Segment, Segment]]:
    """Neighbours with no more than a short hole between them."""
    return [(a, b) for a, b in pairwise(segments) if b.start - a.end <= HOLE]


def _boundary_times(segments: Segments) -> list[float]:
    """When one action gives way to another, in seconds."""
    return [0.5 * (a.end + b.start) for a, b in _adjacent_pairs(segments) if a.action != b.action]
