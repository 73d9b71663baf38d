"""Segments and tracks: who saw which action when.

A segment is ``[start, end)`` in seconds. A track holds one author's segments over one
demonstration, in order and never overlapping. Time that no segment covers is unlabelled.
The verbs that paint on tracks are in :mod:`forcelab.segment_edits`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.sample_runs import sample_ends, stretches

#: The code of a sample that no segment covers, in dense arrays.
UNLABELLED = -1

#: Characters of an action's name.
LONGEST_ACTION = 1000

#: Names, in lower case, that say that there is no action: in a file they are no label, and nobody
#: calls an action so, which tables and figures could not tell from what has none.
_UNLABELLED_NAMES = frozenset(
    ["unlabelled", "unlabeled", "not labelled", "not labeled", "no label"]
)

#: What the names of models among the authors begin with, in every file and project, so that a
#: prediction never turns into a coder's label on its way.
MODEL_PREFIX = "model "


@dataclass(frozen=True, slots=True, order=True)
class Segment:
    """One action over ``[start, end)``.

    Parameters
    ----------
    start, end : float
        Seconds from the start of the force recording, finite, ``start < end``.
    action : str
        The label's name, such as ``"grab"``; not empty.

    Raises
    ------
    InputError
        If the segment is empty, runs backwards or names no action.

    Examples
    --------
    >>> forcelab.Segment(0.5, 2.0, "grab").duration
    1.5
    """

    start: float
    end: float
    action: str

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start) and math.isfinite(self.end) and self.start < self.end):
            raise InputError(
                f"A segment must end after it starts; '{self.action}' goes from {self.start} s "
                f"to {self.end} s."
            )
        if not self.action:
            raise InputError(
                f"The segment at {self.start:g} s names no action; leave unlabelled time empty."
            )

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.end - self.start


@dataclass(frozen=True, slots=True)
class Interval:
    """A stretch of a demonstration with its human and its predicted action.

    Where two coders are compared, `human` is the first one's action and `predicted` the second's.

    Parameters
    ----------
    demonstration : str
        Its id.
    start, end : float
        Seconds, ``start < end``.
    human, predicted : str, optional
        The action that each sees there; None where it is unlabelled or nothing is known.
    confidence : float, optional
        Mean probability, 0 to 1, that the model gives to what it predicts.
    """

    demonstration: str
    start: float
    end: float
    human: str | None = None
    predicted: str | None = None
    confidence: float | None = None

    @property
    def duration(self) -> float:
        """Length in seconds."""
        return self.end - self.start

    @property
    def differs(self) -> bool:
        """Whether human and model see different actions."""
        return self.human != self.predicted

    @property
    def score(self) -> float:
        """Seconds times confidence, for ordering; seconds where that is unknown."""
        return self.duration * (1.0 if self.confidence is None else self.confidence)


def model_author(name: str) -> str:
    """The author of what a recogniser called `name` predicts."""
    return f"{MODEL_PREFIX}{name}"


def is_model(author: str) -> bool:
    """Whether an author is a model, not a coder."""
    return author.startswith(MODEL_PREFIX)


def means_unlabelled(name: str) -> bool:
    """Whether a name says that there is no action, in whatever case."""
    return " ".join(name.lower().replace("_", " ").split()) in _UNLABELLED_NAMES


def overhang(duration: float) -> float:
    """Seconds by which labels may lie beyond their recording: 5 % of it, or one second."""
    return max(1.0, 0.05 * duration)


def first_beyond(segments: Iterable[Segment], start: float, end: float) -> Segment | None:
    """The first segment too far beyond a recording from `start` to `end` s, if there is one."""
    slack = overhang(end - start)
    return next((s for s in segments if s.start < start - slack or s.end > end + slack), None)


def check_within(segments: Iterable[Segment], start: float, end: float, cure: str) -> None:
    """Refuse labels beyond their recording from `start` to `end` s; `cure` says what to do."""
    if (segment := first_beyond(segments, start, end)) is not None:
        raise InputError(
            f"'{segment.action}' from {segment.start:.6g} to {segment.end:.6g} s lies beyond its "
            f"recording, which goes from {start:.6g} to {end:.6g} s{cure}"
        )


def check_name(name: str) -> None:
    """Refuse an action's name that no table can hold."""
    if len(name) > LONGEST_ACTION or "\0" in name:
        raise InputError(
            f"{name[:40]!a} is no name for an action: it has up to {LONGEST_ACTION:,} "
            "characters, and no NUL among them; give it another one."
        )


def check_action_name(name: str) -> None:
    """Refuse a new action that is called like no action."""
    if means_unlabelled(name):
        raise InputError(
            f"An action cannot be called '{name}', as time without a label is; leave such time "
            "empty, or give the action another name."
        )


def check_author(name: str) -> None:
    """Refuse an author without a name."""
    if not name.strip():
        raise InputError("A track needs an author.")


#: What a track holds and the painting verbs take and give: in order, never overlapping.
Segments = tuple[Segment, ...]


def ordered(segments: Iterable[Segment]) -> Segments:
    """Sort segments by time; refuse those that overlap."""
    result = tuple(sorted(segments))
    for left, right in pairwise(result):
        if right.start < left.end:
            raise InputError(
                f"Segments of one author overlap: '{left.action}' ends at {left.end:g} s and "
                f"'{right.action}' starts at {right.start:g} s."
            )
    return result


@dataclass(frozen=True, slots=True)
class Track:
    """One author's segments over one demonstration.

    Parameters
    ----------
    author : str
        The coder or the model run that made the segments; not empty.
    segments : iterable of Segment
        In any order; stored sorted.

    Raises
    ------
    InputError
        If segments overlap or the author is unknown.

    Examples
    --------
    >>> segments = (forcelab.Segment(2.0, 3.0, "hold"), forcelab.Segment(0.0, 2.0, "grab"))
    >>> track = forcelab.Track("Ada", segments)
    >>> track.actions, track.labelled
    (('grab', 'hold'), 3.0)
    """

    author: str
    segments: Segments = ()

    def __post_init__(self) -> None:
        check_author(self.author)
        object.__setattr__(self, "segments", ordered(self.segments))

    @property
    def actions(self) -> tuple[str, ...]:
        """The actions in the order of their first occurrence."""
        return tuple(dict.fromkeys(segment.action for segment in self.segments))

    @property
    def labelled(self) -> float:
        """Seconds covered by a segment."""
        return math.fsum(segment.duration for segment in self.segments)


def to_codes(
    segments: Sequence[Segment], times: NDArray[np.float64], actions: Sequence[str]
) -> NDArray[np.int64]:
    """The code of each sample (n,) at `times`, which increase: its action's place in `actions`.

    It is :data:`UNLABELLED` where no segment covers the sample's time. `segments` are in order and
    never overlap; an action that is not among `actions` is refused.
    """
    number = {action: code for code, action in enumerate(actions)}
    codes = np.full(len(times), UNLABELLED, dtype=np.int64)
    firsts = np.searchsorted(times, [segment.start for segment in segments])
    lasts = np.searchsorted(times, [segment.end for segment in segments])
    for segment, first, last in zip(segments, firsts, lasts, strict=True):
        if segment.action not in number:
            raise InputError(
                f"The action '{segment.action}' at {segment.start:g} s is not among "
                f"{', '.join(actions) or 'no actions'}."
            )
        codes[first:last] = number[segment.action]
    return codes


def from_codes(
    codes: NDArray[np.integer], times: NDArray[np.float64], actions: Sequence[str]
) -> Segments:
    """Gather neighbouring samples of equal code into segments; the inverse of :func:`to_codes`.

    Segments end by the rule of :mod:`forcelab.sample_runs`: a gap in the stamps splits a segment
    that goes across it.

    Parameters
    ----------
    codes : ndarray of int, shape (n,)
        Codes as of :func:`to_codes`; every negative code means unlabelled.
    times : ndarray, shape (n,)
        Times of the samples in seconds, strictly increasing.
    actions : sequence of str
        The action with code ``i`` is ``actions[i]``.

    Returns
    -------
    tuple of Segment
        ``to_codes(from_codes(codes, ...), ...)`` equals `codes`, always. The other way round is
        exact for segments whose edges lie on samples, that cross no gap, and whose touching
        neighbours differ.

    Examples
    --------
    >>> codes, times = np.array([-1, 0, 0, 1]), np.array([0.0, 0.1, 0.2, 0.3])
    >>> [segment.action for segment in forcelab.segments_from_codes(codes, times, ["grab", "hold"])]
    ['grab', 'hold']
    """
    runs = stretches(np.asarray(codes, dtype=np.int64), times, sample_ends(times))
    return tuple(
        Segment(start, end, actions[code])
        for code, start, end in zip(
            runs.codes.tolist(), runs.starts.tolist(), runs.ends.tolist(), strict=True
        )
    )
