"""What a simulated demonstration did: where everything was, and what the sensors felt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.labels import Segments
from forcelab.simulation.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, order=True)
class Event:
    """Something that happened at an instant, located to less than a microsecond.

    Parameters
    ----------
    time : float
        Seconds from the start of the force recording.
    kind : str
        Such as ``"left jaw: contact made"``, ``"left jaw: slip begins"`` or ``"snap in"``.
    """

    time: float
    kind: str


@dataclass(frozen=True)
class Motion:
    """Where jaws, tongs and body are; what a scene does not have stays zero.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Seconds on the force clock, evenly spaced.
    jaws : ndarray, shape (n, 2)
        Distance of the left and the right jaw from the tongs' middle, m.
    tongs : ndarray, shape (n, 3)
        y (m), z (m) and angle (rad) of the tongs.
    body : ndarray, shape (n, 4)
        x, y, z (m) and angle (rad) of the body; z is that of its lower face above the table.
    normal : ndarray, shape (n, 2)
        Force that presses on the left and on the right jaw, N, not negative.
    """

    times: Array
    jaws: Array
    tongs: Array
    body: Array
    normal: Array


@dataclass(frozen=True)
class Performance:
    """One simulated demonstration, before sensors, coders and camera had a look at it.

    Parameters
    ----------
    scene : Scene
        With the numbers of this demonstration.
    motion : Motion
    forces : ndarray, shape (n, 6)
        What the two sensors' domes feel, N: fx, fy, fz of the left one, then of the right one;
        fz is normal and negative in compression, fx along y, fy along z.
    rate : float
        Of `forces` and `motion`, Hz; several times that of the recording.
    actions : tuple of Segment
        What was done when, without gaps.
    events : tuple of Event
        In order of time.
    taps : tuple of float
        Times at which a fingertip taps the left dome, so that force and video can be
        synchronised, s.
    """

    scene: Scene
    motion: Motion
    forces: Array
    rate: float
    actions: Segments
    events: tuple[Event, ...]
    taps: tuple[float, ...] = ()
