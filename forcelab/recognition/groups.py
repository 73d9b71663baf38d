"""Which demonstrations are left out together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

from forcelab.demonstration import Demonstration
from forcelab.errors import InputError
from forcelab.recognition.copies import find_copies, find_equal

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


def fold_groups(demonstrations: Sequence[Demonstration], folds: int | None) -> list[list[int]]:
    """Indices of the demonstrations that are left out together, one group after the other.

    Neighbours in the order are in different groups, so that each group has some of every task;
    those that hold the same recording, or nearly, are left out together. With 0 or None folds each
    recording is a group. Of a single one those are told apart that are not quite equal.
    """
    check_folds(folds)
    recordings = find_copies(demonstrations)
    if len(recordings) == 1:
        recordings = find_equal(demonstrations)
    parts = min(folds or len(recordings), len(recordings))
    return [sorted(chain(*recordings[first::parts])) for first in range(parts)]
