"""Events: where an event function crosses zero within a step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.simulation.system import Array, System

__all__ = ["CLOSE", "Passage", "Watch", "calm_lanes"]

#: Width in seconds to which a crossing is bracketed.
_WIDTH = 1e-10
#: A step that ends within this time of an event, in seconds, ends at the event.
CLOSE = 1e-9
_PARTS = 64


@dataclass(frozen=True)
class Passage:
    """How event functions passed through a step, as far as the first event.

    Parameters
    ----------
    share : float
        Of the step, from 0 to 1: just after the first event, or 1 where there is none.
    sides : ndarray, shape (e,)
        The sides on which the event functions are there.
    happened : tuple of (int, bool)
        Event functions that crossed at that instant, and whether they rose.
    """

    share: float
    sides: Array
    happened: tuple[tuple[int, bool], ...]


class Watch:
    """Watches the event functions of a system.

    The *side* of an event function is its last sign that was not zero, and 0 only while it has
    been exactly zero from the start: leaving zero from there, or touching it, crosses nothing.
    To which side it leaves is seen at the end of a step, as a solver's states within a step may
    err to either side.
    """

    def __init__(self, system: System) -> None:
        meanings = [meaning.split("|") for meaning in system.events]
        self._meanings = [(falling, rising) for rising, falling in meanings]
        self._wanted = np.array(
            [[bool(falling), bool(rising)] for falling, rising in self._meanings]
        ).reshape(-1, 2)

    def kinds(self, passage: Passage) -> tuple[str, ...]:
        """What the events of a passage are called."""
        return tuple(self._meanings[event][rising] for event, rising in passage.happened)

    def first(
        self,
        lane: System,
        path: Callable[[Array], tuple[Array, Array]],
        length: float,
        sides: Array,
    ) -> Passage:
        """The first event in a step of one lane, bracketed to a tenth of a nanosecond.

        All event functions are looked at on a grid of the step, then on a grid of that part of it
        where the first crossing is, and so on: crossings there and back within a step are found
        if they are further apart than a 64th of it.

        Parameters
        ----------
        lane : System
            The lane.
        path : callable
            From shares of the step, shape (n,), to times (n,) and states (s, n).
        length : float
            Of the step, s.
        sides : ndarray, shape (e,)
            Where the event functions come from.

        Raises
        ------
        FloatingPointError
            If an event function is not finite.
        """
        low, high = 0.0, 1.0
        decided = sides != 0
        happened: tuple[tuple[int, bool], ...] = ()
        while True:
            shares = np.linspace(low, high, _PARTS + 1)
            values = lane.watched(*path(shares))
            if not np.isfinite(values).all():
                raise FloatingPointError("an event function is not finite")
            trace = _sides(sides, values)
            crossed = trace[:, 1:] * trace[:, :-1] < 0
            crossed &= self._wanted[np.arange(len(trace))[:, None], (trace[:, 1:] > 0).astype(int)]
            crossed &= decided[:, None]
            columns = np.flatnonzero(crossed.any(axis=0))
            if not len(columns):
                # Rounding may hide on the finer grid what the coarser one showed at its edge.
                return Passage(high, trace[:, -1], happened)
            part = columns[0]
            happened = tuple(
                (int(event), bool(trace[event, part + 1] > 0))
                for event in np.flatnonzero(crossed[:, part])
            )
            low, high = float(shares[part]), float(shares[part + 1])
            if (high - low) * length <= _WIDTH or high - low < 1e-14:
                return Passage(high, np.where(decided, trace[:, part + 1], 0), happened)
            sides = np.where(decided, trace[:, part], 0)

    @staticmethod
    def after(
        lane: System, passage: Passage, time: float, state: Array
    ) -> tuple[Array, Array, Array]:
        """The state (s,) right after the events of a passage, its event functions, and their sides.

        A jump may move an event function to its other side; one that is zero then comes from where
        it was.
        """
        for event, rising in passage.happened:
            state = lane.jump(event, rising, state)
        values = lane.watched(np.array([time]), state[:, None])[:, 0]
        return state, values, np.where(values != 0, np.sign(values), passage.sides)


def _sides(before: Array, values: Array) -> Array:
    """The sides along a row of values (e, n), the first of which is where they come from."""
    signs = np.sign(values)
    signs[:, 0] = before
    number: NDArray[np.intp] = np.where(signs != 0, np.arange(signs.shape[1]), 0)
    return np.take_along_axis(signs, np.maximum.accumulate(number, axis=1), axis=1)


def calm_lanes(traces: Array) -> NDArray[np.bool_]:
    """In which lanes no event function can have changed sides within the step, shape (b,).

    Parameters
    ----------
    traces : ndarray, shape (e, looks, b)
        Event functions times their sides, evenly spaced over the step: all but the first are above
        zero where nothing happened. No parabola through three of them may dip below zero either.
    """
    before, halfway, after = traces[:, :-2], traces[:, 1:-1], traces[:, 2:]
    bend = before + after - 2 * halfway
    climb = after - before
    level = (climb * climb <= 8 * bend * halfway) | (np.abs(climb) >= 2 * bend)
    # Not calm where a value is not a number.
    calm: NDArray[np.bool_] = level.all(axis=(0, 1)) & (traces[:, 1:].min(axis=(0, 1)) >= 0)
    return calm
