"""What acts on the body besides the jaws: the table it lies on and the socket it snaps into."""

from __future__ import annotations

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from forcelab.simulation import contact
from forcelab.simulation.contact import Array

__all__ = ["STRAIGHTEN", "Table", "sliding_friction", "socket_push", "table_under"]

#: Bristles that bear nothing straighten with this time constant, s.
STRAIGHTEN = 5e-3
#: Share of the socket's depth over which its walls and its friction set in.
RIM = 0.25
#: The bumps around a socket fade over this many pitches.
BUMPY = 3.0


class Table(NamedTuple):
    """The table under the body: how deep it is pressed in, how fast, and the slope there."""

    depth: Array
    rate: Array
    slope: Array | None


def table_under(place: Array, speed: Array, socket: SimpleNamespace | None) -> Table:
    """Where the body stands relative to the table's surface.

    The surface is flat at z = 0 but for the bumps around a socket, between which it lies:
    ``h/2 (1 - cos(2 pi e / pitch)) exp(-(e / (3 pitch))^4)`` at e from its place.

    Parameters
    ----------
    place, speed : ndarray, shape (axes, n)
        Of the body along y, where it moves so, and z: m and m/s.
    socket : namespace of ndarray, shape (b,), optional
        The numbers of `Socket`.
    """
    if socket is None:
        return Table(-place[-1], -speed[-1], None)
    e = place[0] - socket.place
    k = 2.0 * np.pi / socket.pitch
    reach = BUMPY * socket.pitch
    far = e / reach
    cube = far * far * far  # numpy's own powers cost more than all the rest
    fade = 0.5 * socket.studs * np.exp(-far * cube)
    turns = k * e
    bump = 1.0 - np.cos(turns)
    slope = fade * (k * np.sin(turns) - bump * (4.0 / reach) * cube)
    return Table(fade * bump - place[-1], slope * speed[0] - speed[-1], slope)


def sliding_friction(
    normal: Array, velocity: Array, bristles: Array, pads: SimpleNamespace
) -> tuple[Array, Array, Array]:
    """Friction against a motion along one or more axes that share their bristles' limit.

    Parameters
    ----------
    normal : ndarray, shape (..., n)
        N.
    velocity, bristles : ndarray, shape (axes, ..., n)
        m/s and m.
    pads : namespace of ndarray, shape (b,)
        The numbers of `Pads`.

    Returns
    -------
    force, bristle_rate : ndarray, shape (axes, ..., n)
        The force along `velocity` that drives the other side, N; and m/s.
    limit : ndarray, shape (..., n)
        The coefficient of friction that the bristles can bear at this speed.
    """
    limit = contact.bristle_limit(
        contact.length(velocity), pads.static, pads.kinetic, pads.stribeck
    )
    rate = contact.bristle_rate(velocity, bristles, pads.stiffness, limit)
    force = contact.lugre(
        normal, velocity, bristles, rate, pads.stiffness, pads.damping, pads.viscous
    )
    rate -= bristles * ((normal <= 0.0) * (1.0 / STRAIGHTEN))
    return force, rate, limit


def socket_push(
    place: Array, speed: Array, inside: Array, socket: SimpleNamespace, damping: Array
) -> tuple[Array, Array]:
    """Forces of the socket on a body that is in it, but for the friction of its walls.

    Parameters
    ----------
    place, speed : ndarray, shape (3, n)
        x, y and z of the body, m, and their rates, m/s.
    inside : ndarray, shape (n,)
        1 where the body is in the socket, else 0: there it feels nothing of it.
    socket : namespace of ndarray, shape (b,)
        The numbers of `Socket`.
    damping : ndarray, shape (b,)
        Hunt and Crossley's, of the body on the bottom, s/m.

    Returns
    -------
    force : ndarray, shape (3, n)
        Along x, y and z, N.
    hold : ndarray, shape (n,)
        How hard the walls press on the body, which rubs along z, N.

    Notes
    -----
    Walls, ends, snap and friction set in over the first quarter of the depth as
    ``e = 3 u^2 - 2 u^3``, so that a body enters without a jump. The force is minus the slope of the
    energy ``e (walls askew^2 / 2 + ends x^2 / 2 + snap)``: a body that is askew at the rim is
    pushed out again, as by a chamfer.
    """
    depth, x, askew = -place[2], place[0], place[1] - socket.place
    rim = RIM * socket.depth
    u = np.maximum(depth / rim, 0.0)
    np.minimum(u, 1.0, out=u)
    entered = u * u * (3.0 - 2.0 * u) * inside
    click = socket.snap, socket.snap_depth, socket.snap_width
    wall, end = socket.walls * askew, socket.ends * x
    stored = 0.5 * (wall * askew + end * x) + contact.snap_energy(depth, *click)
    chamfer = 6.0 * u * (1.0 - u) / rim * stored
    bottom = contact.hunt_crossley(depth - socket.depth, -speed[2], socket.bottom, damping)
    force = np.empty(place.shape)
    np.multiply(-entered, end + socket.wall_damping * speed[0], out=force[0])
    np.multiply(-entered, wall + socket.wall_damping * speed[1], out=force[1])
    np.multiply(inside, chamfer + bottom, out=force[2])
    force[2] -= entered * contact.snap(depth, *click)
    return force, socket.friction * entered
