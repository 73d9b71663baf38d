"""What the sensors' domes feel of the forces in a scene."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from forcelab.simulation.contact import Array
from forcelab.simulation.layout import Layout
from forcelab.simulation.parts import Jaws

__all__ = ["SIDES", "dome_forces"]

#: Left jaw, right jaw: the sign of the force with which each pushes the body along x.
SIDES = np.array([[1.0], [-1.0]])


def dome_forces(
    seen: SimpleNamespace, acceleration: Array, layout: Layout, numbers: SimpleNamespace, jaws: Jaws
) -> Array:
    """Forces on the domes of one lane.

    Parameters
    ----------
    seen : namespace
        From :meth:`Mechanics.look`.
    acceleration : ndarray, shape (coordinates, n)
        m/s^2; of the wrist rad/s^2.
    layout : Layout
    numbers : namespace
        The numbers of the scene, from `stacked`.
    jaws : Jaws
        How the sensors are tilted.

    Returns
    -------
    ndarray, shape (6, n)
        As of :meth:`Mechanics.felt`.
    """
    dome = numbers.jaws.dome
    forces = np.zeros((2, 3, seen.tap.size))
    forces[:, 2] = dome * acceleration[:2] - seen.pressed
    forces[0, 2] -= seen.tap
    if layout.thread:
        inertia = dome * numbers.thread.radius * acceleration[2]
        forces[:, 0] = (seen.friction[0] + inertia) * SIDES
    for row, axis in enumerate(layout.axes):
        inertia = dome * acceleration[2 + row]
        forces[:, "yz".index(axis)] = -seen.friction[row] - inertia
    if numbers.profile is not None:
        forces[:, 1] += seen.widening
    return (_tilts(jaws) @ forces).reshape(6, -1)


def _tilts(jaws: Jaws) -> Array:
    """Rotations, shape (2, 3, 3), from the scene's axes to those of the tilted sensors."""
    turns = []
    for tilt, azimuth in (
        (jaws.tilt_left, jaws.azimuth_left),
        (jaws.tilt_right, jaws.azimuth_right),
    ):
        towards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        across = np.array([-towards[1], towards[0], 0.0])
        normal = np.array([0.0, 0.0, 1.0])
        tilted = np.cos(tilt) * towards - np.sin(tilt) * normal
        frame = np.array([towards, across, normal])
        turned = [tilted, across, np.sin(tilt) * towards + np.cos(tilt) * normal]
        turns.append(frame.T @ np.array(turned))
    return np.stack(turns)
