"""Where things are drawn: where the motion has them, but for what one would not see of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from forcelab.simulation.parts import Socket
from forcelab.simulation.rendering.state import State
from forcelab.simulation.rendering.view import Proportions, View
from forcelab.simulation.scene import Scene

__all__ = ["LEAD", "Pose", "posed"]

#: A body in a holder is drawn that many times as far from its place as it is.
STRAIN = 4.0
#: How far the hand turns ahead of the tongs, rad for each newton of torsion.
LEAD = 0.05
#: Greatest tilt of a body that feels for its socket, rad.
TILT = 0.14
#: By what share it leans less half way between two places where it catches, and their distance, m.
ROCKING = 0.4
OVER = 0.003
#: How far from its place it is tilted by three quarters of that, m; up to where at all, m; and how
#: high over the socket's rim, and how deep below it, it is upright again, m.
OFF = 0.0012
AROUND = 0.016
HOVERING = 0.0012
SUNK = 0.0006


@dataclass(frozen=True)
class Pose:
    """What is where on the stage: lengths in m of the picture, not of the motion.

    Parameters
    ----------
    tongs : tuple of float
        y and z of the place between the domes, and the angle, rad.
    body : tuple of float
        x, y, z and angle, rad.
    jaws : tuple of float
        Distance of the left and the right jaw from the tongs' middle.
    tilt : float
        By how much the body leans to the right, rad, about the place between the domes.
    lead : float
        By how much the hand has turned further than the arms that it twists, rad.
    inside : bool
        Whether the domes press on the middle of the body's sides, so that it hides the right one.
    """

    tongs: tuple[float, float, float]
    body: tuple[float, float, float, float]
    jaws: tuple[float, ...]
    tilt: float
    lead: float = 0.0
    inside: bool = False


def posed(scene: Scene, sizes: Proportions, view: View, state: State) -> Pose:
    """The pose in which a state is drawn."""
    y, z, angle = state.tongs
    x, body_y, body_z, turn = state.body
    if scene.holder is not None:
        risen = STRAIN * body_z
        up = risen + float(view.climbed(np.array(z - body_z)))
        lead = LEAD * state.torsion if scene.thread is not None else 0.0
        return Pose((y, up, angle), (x, body_y, risen, turn), state.jaws, 0.0, lead)
    tilt = _tilt(scene.socket, body_y, body_z) if scene.socket is not None else 0.0
    # What is tilted rests on its lower corner.
    lift = scene.body.half_width * abs(float(np.sin(tilt)))
    # The domes press on the middle of a block's sides; of flat bodies one sees no difference.
    inner = sizes.back if scene.body.shape == "block" else 0.0
    return Pose(
        (view.along(y) - inner, view.above(z) + lift + sizes.grip, angle),
        (x, view.along(body_y), view.above(body_z) + lift, turn),
        state.jaws,
        tilt,
        inside=inner > 0.0,
    )


def _tilt(socket: Socket, y: float, z: float) -> float:
    """How far a body leans that stands on a socket's rim beside its place, rad."""
    away = y - socket.place
    near = float(np.clip(2.0 - 2.0 * abs(away) / AROUND, 0.0, 1.0))
    low = float(np.clip(1.0 - z / HOVERING if z > 0.0 else 1.0 + z / SUNK, 0.0, 1.0))
    rocking = 1.0 - ROCKING * (0.5 - 0.5 * np.cos(2.0 * np.pi * away / OVER))
    return TILT * near * low * float(rocking * np.tanh(away / OFF))
