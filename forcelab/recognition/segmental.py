"""Segmental metrics: edit score, F1 at an overlap, and how far the boundaries lie apart.

A frame metric hardly notices a prediction that flickers; these look at the segments.

Sources
-------
Lea, Flynn, Vidal, Reiter and Hager, "Temporal convolutional networks for action segmentation and
detection", CVPR 2017: the edit score and F1@k. Farha and Gall, "MS-TCN", CVPR 2019: the same, in
the form in which they are commonly reported.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.overlay import Overlay

__all__ = [
    "OVERLAPS",
    "Matches",
    "boundary_errors",
    "edit_distance",
    "edit_score",
    "f1",
    "match",
]

#: The overlaps (intersection over union, in percent) at which F1 is reported.
OVERLAPS = (10, 25, 50)


def edit_distance(a: NDArray[np.int64], b: NDArray[np.int64]) -> int:
    """Levenshtein distance of two sequences of codes: insertions, deletions, substitutions.

    Bit-parallel: one column of the usual table is two integers holding the signs of the
    differences between its neighbouring cells (Myers, "A fast bit-vector algorithm for
    approximate string matching based on dynamic programming", J. ACM 46(3), 1999; Hyyrö 2003 for
    the distance of whole sequences). A raw prediction may flicker through 100,000 segments.

    Parameters
    ----------
    a, b : ndarray of int64, shapes (m,) and (n,)
        Any codes.
    """
    short, long = (a, b) if len(a) <= len(b) else (b, a)
    if len(short) == 0:
        return len(long)
    places = {
        code: int.from_bytes(np.packbits(long == code, bitorder="little").tobytes(), "little")
        for code in np.unique(short).tolist()
    }
    everywhere = (1 << len(long)) - 1
    bottom = 1 << (len(long) - 1)
    rises, falls, distance = everywhere, 0, len(long)
    for code in short.tolist():
        equal = places[code]
        diagonal = (((equal & rises) + rises) ^ rises) | equal | falls
        right_rises = falls | (everywhere & ~(diagonal | rises))
        right_falls = rises & diagonal
        distance += bool(right_rises & bottom) - bool(right_falls & bottom)
        right_rises = ((right_rises << 1) | 1) & everywhere
        right_falls = (right_falls << 1) & everywhere
        rises = right_falls | (everywhere & ~(diagonal | right_rises))
        falls = right_rises & diagonal
    return distance


def edit_score(over: Overlay) -> float | None:
    """1 - edit distance of the two sequences of actions / length of the longer (0 to 1).

    Durations play no part. None where the human labelled nothing.
    """
    longer = max(len(over.human), len(over.predicted))
    if longer == 0:
        return None
    return 1.0 - edit_distance(over.human.codes, over.predicted.codes) / longer


@dataclass(frozen=True, eq=False, slots=True)
class Matches:
    """Which predicted segment stands for which human one; m pairs.

    Parameters
    ----------
    human, predicted : ndarray of int64, shape (m,)
        Numbers of the matched segments among the human and the predicted ones.
    """

    human: NDArray[np.int64]
    predicted: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.human)


def match(over: Overlay, overlap: int) -> Matches:
    """Match predicted to human segments as F1@k does.

    In the order of time each predicted segment points at the human segment of its own action with
    the largest intersection over union (the earlier of two equal ones), counted in samples. It is
    matched if that is at least `overlap` and no earlier one was matched to the same human segment;
    it does not turn to its second choice. This is the rule of the published code (``>=``), so that
    figures can be compared.

    Parameters
    ----------
    over : Overlay
        Both tracks.
    overlap : int
        Percent, above 0.
    """
    same = np.flatnonzero(over.human_codes == over.predicted_codes)
    firsts = over.pieces.firsts[same]
    human, predicted = over.human.holding(firsts), over.predicted.holding(firsts)
    # Two segments share at most one stretch, so these pairs are all the pairs that overlap.
    shared = over.pieces.samples[same]
    union = over.human.samples[human] + over.predicted.samples[predicted] - shared
    choice = np.lexsort((human, -shared / union, predicted))
    _, best = np.unique(predicted[choice], return_index=True)
    best = choice[best]
    # Whole numbers on both sides: an overlap of exactly one half is one half.
    best = best[100 * shared[best] >= overlap * union[best]]
    matched, earliest = np.unique(human[best], return_index=True)
    return Matches(matched, predicted[best[earliest]])


def f1(true: int, false: int, missed: int) -> float | None:
    """F1 of counts of segments: matched, predicted without match, human without match.

    None where there is no segment at all.
    """
    total = 2 * true + false + missed
    return 2 * true / total if total else None


def boundary_errors(over: Overlay, matches: Matches) -> NDArray[np.float64]:
    """How far matched segments' edges lie apart.

    Both edges of every matched pair are counted, start against start and end against end. Edges
    that meet because unlabelled human time, a gap or an end of the recording cuts both segments at
    the same place are counted as they are, with an error of zero.

    Returns
    -------
    ndarray of float64, shape (2 m,)
        Distances in milliseconds, never negative.
    """
    human, predicted = matches.human, matches.predicted
    starts = over.human.starts[human] - over.predicted.starts[predicted]
    ends = over.human.ends[human] - over.predicted.ends[predicted]
    return 1000.0 * np.abs(np.concatenate([starts, ends]))
