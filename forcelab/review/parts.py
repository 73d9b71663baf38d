"""Parts of a human's segments that the model contradicts, while the rest may be right.

So it is where a coder ends an action far too early, or overlooks a short one. A part is what the
prediction cuts off a segment called x and calls y. The evidence is a log ratio as in
:mod:`forcelab.recognition.witnesses`,

    log E = sum_k r_k log(P[k | y] / P[k | x]) + w (log P[the order with y] - log P[as coded]),

with `r` the mean probability of each action over the part and the order as a Markov chain; all
this is learnt from the other segments, and w is how much the order tells at all. If a share of the
other segments of x hold such a part too, P[y | x] is no less than that: what happens everywhere is
the model's weakness. The suspicion is q E / (1 + E), with q the mean probability of y, times the
length as a share of the median length of y, where it is shorter: so neither a stretch that the
model is not sure of nor an edge that is a little displaced makes anybody suspicious.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from statistics import median

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.witnesses import MARGIN, PSEUDO, told
from forcelab.review.differences import Difference
from forcelab.review.hearing import Heard

__all__ = ["suspect_parts"]

Real = NDArray[np.float64]

#: A part is like another one if it lasts at least this share of it.
ALIKE = 0.5


@dataclass(frozen=True)
class _Part:
    """A part, in numbers.

    Parameters
    ----------
    difference : Difference
    number : int
        Of its segment, among all.
    start : float
        Of its segment, in seconds.
    x, y : int
        The codes of what human and model see.
    said : ndarray of float64, shape (K,)
    coded, instead : tuple of int
        The order of actions around it as it was coded, and with y.
    """

    difference: Difference
    number: int
    start: float
    x: int
    y: int
    said: Real
    coded: tuple[int, ...]
    instead: tuple[int, ...]


def suspect_parts(
    everything: Sequence[Heard], actions: Sequence[str]
) -> Mapping[tuple[str, float], list[Difference]]:
    """The parts with their suspicion, by demonstration and start of their segment.

    Parameters
    ----------
    everything : sequence of Heard
    actions : sequence of str, length K
        The columns of what was heard; parts that are called otherwise are left out.
    """
    codes = {action: code for code, action in enumerate(actions)}
    parts = list(_numbered(everything, codes))
    words, order = _Words(everything, codes, parts), _Order(everything, codes)
    lengths: dict[str | None, list[float]] = defaultdict(list)
    for one in everything:
        for segment in one.segments:
            lengths[segment.action].append(segment.duration)
    usual = {action: median(found) for action, found in lengths.items()}
    result = defaultdict(list)
    for part in parts:
        difference = part.difference
        evidence = words.evidence(part) + order.evidence(part)
        share = min(1.0, difference.duration / usual.get(difference.predicted, math.inf))
        sure = float(part.said[part.y])
        suspicion = sure * share * float(np.exp(-np.logaddexp(0.0, -evidence)))
        place = difference.demonstration, part.start
        result[place].append(replace(difference, suspicion=suspicion))
    return result


def _numbered(everything: Sequence[Heard], codes: Mapping[str, int]) -> Iterator[_Part]:
    """The parts whose actions are known."""
    before = 0
    for one in everything:
        line = _line(one, codes)
        starts = [segment.start for segment in one.segments]
        for difference, said in zip(one.parts, one.of_parts, strict=True):
            x, y = codes.get(difference.human or ""), codes.get(difference.predicted or "")
            k = bisect_right(starts, difference.start) - 1
            most = (1.0 - 2.0 * MARGIN) * one.segments[k].duration  # which is the whole segment
            if x is None or y is None or difference.duration >= most:
                continue
            left, _, right = line[k : k + 3]
            ahead = [x] if difference.start > starts[k] else []
            rest = [x] if difference.end < one.segments[k].end else []
            # An action that goes on is one.
            instead = tuple(code for code, _ in groupby([left, *ahead, y, *rest, right]))
            coded = (left, x, right)
            yield _Part(difference, before + k, starts[k], x, y, said, coded, instead)
        before += len(starts)


def _line(heard: Heard, codes: Mapping[str, int]) -> list[int]:
    """The codes of a demonstration's segments; K stands for either end and for the unknown."""
    K = len(codes)
    return [K, *(codes.get(segment.action, K) for segment in heard.segments), K]


class _Words:
    """How the model speaks of each action."""

    def __init__(
        self, everything: Sequence[Heard], codes: Mapping[str, int], parts: Sequence[_Part]
    ) -> None:
        K = len(codes)
        own = [code for one in everything for code in _line(one, codes)[1:-1]]
        self._said = np.concatenate([one.said for one in everything])
        self._totals = np.zeros((K + 1, K))
        np.add.at(self._totals, own, self._said)
        self._counts = np.bincount(own, minlength=K + 1)
        self._longest: dict[tuple[int, int], dict[int, float]] = defaultdict(dict)
        for part in parts:
            known = self._longest[part.x, part.y]
            length = part.difference.duration
            known[part.number] = max(known.get(part.number, 0.0), length)

    def evidence(self, part: _Part) -> float:
        """Log ratio of what it says over a part."""
        x, y, spread = part.x, part.y, 1.0 / len(part.said)
        called_y = (self._totals[y] + spread) / (self._counts[y] + 1)
        without = np.maximum(self._totals[x] - self._said[part.number], 0.0)
        least = ALIKE * part.difference.duration
        longest = self._longest[x, y].items()
        alike = sum(length >= least for number, length in longest if number != part.number)
        without[y] = max(without[y], alike)
        called_x = (without + spread) / self._counts[x]
        return float(part.said @ np.log(called_y / called_x))


class _Order:
    """Which action follows which."""

    def __init__(self, everything: Sequence[Heard], codes: Mapping[str, int]) -> None:
        self._met = np.zeros((len(codes) + 1, len(codes) + 1))
        for one in everything:
            for pair in pairwise(_line(one, codes)):
                self._met[pair] += 1.0
        self._told = told(self._met)

    def evidence(self, part: _Part) -> float:
        """Log ratio of the order with a part."""
        met = self._met.copy()
        for pair in pairwise(part.coded):
            met[pair] -= 1.0
        chances = (met + PSEUDO) / (met.sum(axis=1) + PSEUDO * len(met))[:, None]
        instead, coded = (
            sum(math.log(chances[pair]) for pair in pairwise(path))
            for path in (part.instead, part.coded)
        )
        return self._told * (instead - coded)
