"""What solvers and mechanics agree on: a batch of initial value problems, and their events."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, order=True)
class Event:
    """Something that happened at an instant, located to less than a microsecond."""

    time: float  # seconds from the start of the force recording
    kind: str  # such as ``"left jaw: contact made"``, ``"left jaw: slip begins"`` or ``"snap in"``


class System(Protocol):
    """A batch of independent problems of one structure; each is a lane, a column of the state."""

    names: tuple[str, ...]  # length s, what the states are
    lanes: int  # number of problems, b
    #: positions and velocities: (p,), rows such that ``rates(t, y)[positions] == y[velocities]``
    #: exactly.
    positions: NDArray[np.intp]
    velocities: NDArray[np.intp]
    #: Length e, what it means when an event function falls and rises through zero, as ``"rising
    #: meaning|falling meaning"``; an empty meaning is no event.
    events: tuple[str, ...]
    #: (s, b), how large a change of each state moves a force of the lane by about one newton: what
    #: turns a tolerance in newtons into one for each state.
    scales: Array

    def rates(self, times: Array, states: Array) -> Array:
        """Derivatives of the states.

        `times` (b,): each lane has its own time; `states` (s, b). Gives (s, b): a new array.
        """

    def watched(self, times: Array, states: Array) -> Array:
        """The event functions, shape (e, b): continuous while no jump happens."""

    def jump(self, event: int, rising: bool, state: Array) -> Array:
        """The state (s,) of one lane right after an event; the same where nothing jumps."""

    def lane(self, number: int) -> System:
        """One lane as a system of its own.

        Its methods also take any number of columns: n times and states of shape (s, n) of that one
        lane, which is how a finished trajectory is looked at all at once.
        """

    def subset(self, lanes: NDArray[np.intp]) -> System:
        """Some of the lanes, in the order given, as a system of their own.

        A solver goes on with these when the others are finished.
        """
