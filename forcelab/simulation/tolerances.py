"""Numbers by row of the state: the hand's springs, the masses, and the tolerances."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from forcelab.simulation.contact import Array
from forcelab.simulation.layout import Layout

__all__ = ["hand_numbers", "state_scales"]

#: Normal force for which the scales of friction and of curved contacts are made, N.
TYPICAL_GRIP = 10.0


def hand_numbers(layout: Layout, numbers: SimpleNamespace) -> tuple[Array, Array, Array]:
    """Stiffness and damping of the driven coordinates, and the mass of all.

    Parameters
    ----------
    layout : Layout
    numbers : namespace
        The numbers of the scenes, from `stacked`.

    Returns
    -------
    stiffness, damping : ndarray, shape (driven, b)
        N/m and N s/m; of the wrist N m/rad and N m s/rad.
    mass : ndarray, shape (coordinates, b)
        kg; of wrist and cap kg m^2.
    """
    p, a = numbers, len(layout.axes)
    stiffness = [p.jaws.stiffness, p.jaws.asymmetry * p.jaws.stiffness]
    damping = [p.jaws.damping] * 2
    mass, passive = [p.jaws.mass] * 2, [p.body.mass] * (1 + a)
    if layout.axes:
        stiffness += [p.arm.stiffness] * a
        damping += [p.arm.damping] * a
        mass += [p.arm.mass] * a
    if layout.thread:
        stiffness.append(p.thread.wrist_stiffness)
        damping.append(p.thread.wrist_damping)
        mass.append(p.thread.wrist_inertia)
        passive.append(p.thread.inertia)
    return np.stack(stiffness), np.stack(damping), np.stack([*mass, *passive])


def state_scales(layout: Layout, numbers: SimpleNamespace) -> Array:
    """The change of each state that moves a force by about one newton.

    Parameters
    ----------
    layout : Layout
    numbers : namespace
        The numbers of the scenes, from `stacked`.

    Returns
    -------
    ndarray, shape (s, b)
        ``1 / k`` for a coordinate that is held by the stiffness k, ``1 / sqrt(k m)`` for its
        velocity, as of an oscillator, ``1 / (N s0)`` for bristles. The mode has one: it never
        drifts.
    """
    p = numbers
    n = p.body.exponent
    grip = n * p.body.stiffness ** (1.0 / n) * TYPICAL_GRIP ** (1.0 - 1.0 / n)
    mass = dict(zip(layout.coordinates, hand_numbers(layout, p)[2], strict=True))
    stiff: dict[str, Array] = {"left jaw": grip, "right jaw": grip, "body x": 2.0 * grip}
    if layout.rubbing:
        pads = (p.arm or p.thread).pads.stiffness * TYPICAL_GRIP
    for axis in layout.axes:
        stiff[f"tongs {axis}"] = stiff[f"body {axis}"] = 2.0 * pads
    if layout.ground:
        stiff["body z"] = np.maximum(stiff["body z"], p.ground.stiffness)
    if layout.socket:
        stiff["body z"] = np.maximum(stiff["body z"], p.socket.bottom)
    if layout.thread:
        radius = p.thread.radius
        stiff["wrist angle"] = stiff["cap angle"] = 2.0 * pads * radius
        mass["wrist angle"] = mass["wrist angle"] / radius
        mass["cap angle"] = mass["cap angle"] / radius
    rows = [1.0 / stiff[name] for name in layout.coordinates]
    rows += [1.0 / np.sqrt(stiff[name] * mass[name]) for name in layout.coordinates]
    for name in layout.bristles:
        if name.startswith("table"):
            rows.append(1.0 / (p.ground.friction.stiffness * TYPICAL_GRIP))
        elif name.startswith("socket"):
            rows.append(1.0 / (p.socket.rubbing.stiffness * np.maximum(p.socket.friction, 1.0)))
        elif name.startswith("thread"):
            rows.append(p.thread.radius / (p.thread.stiffness * p.thread.kinetic))
        else:
            rows.append(1.0 / pads)
    if layout.socket:
        rows.append(np.ones_like(grip))
    return np.stack(rows)
