"""The overlay of a human and a predicted track, which every metric starts from."""

from __future__ import annotations

from collections.abc import Callable, Sized
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import UNLABELLED
from forcelab.runs import Runs, sample_ends, stretches

__all__ = ["Overlay", "overlay"]


@dataclass(frozen=True, eq=False, slots=True)
class Overlay:
    """A human and a predicted track over one demonstration, cut into pieces; p pieces.

    Parameters
    ----------
    human, predicted : Stretches
        The segments of both, the predicted ones masked to where the human labelled.
    pieces : Stretches
        Every stretch the human labelled, cut wherever either track changes. Its codes number the
        pairs of actions and mean nothing by themselves.
    human_codes, predicted_codes : ndarray of int64, shape (p,)
        The actions of each piece; the predicted one may be unlabelled.
    actions : int
        How many actions there are.
    """

    human: Runs
    predicted: Runs
    pieces: Runs
    human_codes: NDArray[np.int64]
    predicted_codes: NDArray[np.int64]
    actions: int

    @classmethod
    def gathered(
        cls,
        human: NDArray[np.int64],
        predicted: NDArray[np.int64],
        actions: int,
        gather: Callable[[NDArray[np.int64]], Runs],
    ) -> Overlay:
        """Mask the prediction to where the human labelled, and gather both tracks and their pairs.

        Parameters
        ----------
        human, predicted : ndarray of int64, shape (n,)
            Codes of both tracks at the same places, below `actions`; negative ones are unlabelled.
        actions : int
        gather : callable
            Makes stretches out of such codes.
        """
        masked = np.where(human < 0, UNLABELLED, np.maximum(predicted, UNLABELLED))
        columns = actions + 1  # unlabelled is the first
        pieces = gather(np.where(human < 0, UNLABELLED, human * columns + masked + 1))
        return cls(
            human=gather(human),
            predicted=gather(masked),
            pieces=pieces,
            human_codes=pieces.codes // columns,
            predicted_codes=pieces.codes % columns - 1,
            actions=actions,
        )


def overlay(
    human: NDArray[np.int64],
    predicted: NDArray[np.int64],
    times: NDArray[np.float64],
    actions: Sized,
) -> Overlay:
    """Lay a predicted track over a human one.

    Where the human left a sample unlabelled the prediction is unlabelled too before anything is
    gathered, so that what was predicted there cannot matter to anything.

    Parameters
    ----------
    human, predicted : ndarray of int64, shape (n,)
        Codes of both tracks; every negative code means unlabelled.
    times : ndarray, shape (n,)
        Times of the samples in seconds, strictly increasing.
    actions : sized
        As many actions as there are codes.

    Raises
    ------
    ValueError
        If the lengths disagree, or a code has no action.
    """
    k = len(actions)
    if not len(human) == len(predicted) == len(times):
        raise ValueError(
            f"{len(human)} human and {len(predicted)} predicted codes for {len(times)} times"
        )
    highest = max(human.max(initial=-1), predicted[human >= 0].max(initial=-1))
    if highest >= k:
        raise ValueError(f"a code of {highest} for {k} actions")
    ends = sample_ends(times)
    return Overlay.gathered(human, predicted, k, lambda codes: stretches(codes, times, ends))
