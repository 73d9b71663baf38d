"""What is where at one instant, ready to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcelab.simulation.motion import Performance

__all__ = ["State", "States"]

#: Seconds over which a frame's forces are averaged, as a camera's shutter does.
EXPOSURE = 0.012


@dataclass(frozen=True)
class State:
    """One instant of a performance.

    Parameters
    ----------
    jaws : tuple of float
        Distance of the left and the right jaw from the tongs' middle, m.
    tongs : tuple of float
        y (m), z (m) and angle (rad).
    body : tuple of float
        x, y, z (m) and angle (rad).
    normal : tuple of float
        What presses on the left and on the right jaw, N.
    drag : tuple of float
        Force on both domes together along y and z, N.
    torsion : float
        Force along y on the left dome less that on the right one, N: what a twist makes of it.
    sliding : float
        How fast the tongs rise along the body, m/s.
    """

    jaws: tuple[float, ...]
    tongs: tuple[float, ...]
    body: tuple[float, ...]
    normal: tuple[float, ...]
    drag: tuple[float, ...]
    torsion: float
    sliding: float


class States:
    """The states of a performance at any time; it rests before its start and after its end."""

    def __init__(self, performance: Performance) -> None:
        motion, forces = performance.motion, performance.forces
        self.times = motion.times
        self.tracks = np.column_stack([motion.jaws, motion.tongs, motion.body])
        drag = np.column_stack([forces[:, 0] + forces[:, 3], forces[:, 1] + forces[:, 4]])
        torsion = forces[:, 0] - forces[:, 3]
        felt = np.column_stack([motion.normal, drag, torsion])
        self.risen = motion.tongs[:, 1] - motion.body[:, 2]
        # The mean over a shutter's time is a difference of the running sum.
        self.sums = np.concatenate([np.zeros((1, 5)), np.cumsum(felt, axis=0)])
        self.step = float(self.times[1] - self.times[0])

    def at(self, time: float) -> State:
        """The state at a time on the force clock, s."""
        last = len(self.times) - 1
        place = float(np.clip((time - self.times[0]) / self.step, 0.0, last))
        row = min(int(place), last - 1)
        part = place - row
        track = ((1.0 - part) * self.tracks[row] + part * self.tracks[row + 1]).tolist()
        half = max(1, round(0.5 * EXPOSURE / self.step))
        first, end = max(row - half, 0), min(row + half + 1, last + 1)
        felt = ((self.sums[end] - self.sums[first]) / (end - first)).tolist()
        climbed = float(self.risen[end - 1] - self.risen[first])
        return State(
            jaws=tuple(track[:2]),
            tongs=tuple(track[2:5]),
            body=tuple(track[5:]),
            normal=tuple(felt[:2]),
            drag=tuple(felt[2:4]),
            torsion=felt[4],
            sliding=climbed / max((end - 1 - first) * self.step, self.step),
        )
