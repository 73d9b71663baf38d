"""Which demonstrations are left out together."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from itertools import chain

import numpy as np

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError

#: More labelled demonstrations than `MANY` are left out in so many groups by default: half
#: an hour of training for each by itself is minutes then, and each is still recognised by a
#: recogniser that has not seen it.
MANY, GROUPS = 20, 10


def default_fold_count(labelled: int) -> int:
    """The default number of groups to leave out; 0: each demonstration by itself."""
    return GROUPS if labelled > MANY else 0


def check_folds(folds: int | None) -> None:
    """Refuse a negative number of groups, or a single one."""
    if folds is not None and (folds < 0 or folds == 1):
        raise InputError(f"Demonstrations are left out in two groups or more, not in {folds}.")


def find_duplicates(demonstrations: Sequence[Demonstration]) -> list[list[int]]:
    """Indices of the demonstrations of each recording, usually one, in order.

    Ids differ as soon as a stamp does; equal signals are still the same recording.
    """
    places: dict[bytes, list[int]] = {}
    for i, demonstration in enumerate(demonstrations):
        signals = np.ascontiguousarray(demonstration.signals, dtype=np.float64)
        places.setdefault(hashlib.sha256(signals.tobytes()).digest(), []).append(i)
    return list(places.values())


def fold_groups(demonstrations: Sequence[Demonstration], folds: int | None) -> list[list[int]]:
    """Indices of the demonstrations that are left out together, one group after the other.

    Neighbours in the order are in different groups, so that each group has some of every task;
    those that hold the same recording are left out together. With 0 or None folds each recording is
    a group.
    """
    check_folds(folds)
    recordings = find_duplicates(demonstrations)
    parts = min(folds or len(recordings), len(recordings))
    return [sorted(chain(*recordings[first::parts])) for first in range(parts)]
