"""Which states a scene has, what it leaves out, and the tolerances of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from forcelab.simulation.scene import Axis, Scene
from forcelab.simulation.system import Array


def stacked(parts: Sequence[Any]) -> SimpleNamespace:
    """The numbers of equal parts as arrays.

    Parameters
    ----------
    parts : sequence of dataclasses, length b
        Of one class, such as scenes, in which the same parts are ``None``.

    Returns
    -------
    SimpleNamespace
        Each number as an array of shape (b,), each part as such a namespace; texts are left out.
    """
    result = SimpleNamespace()
    for field in fields(parts[0]):
        values = [getattr(part, field.name) for part in parts]
        if values[0] is None:
            setattr(result, field.name, None)
        elif is_dataclass(values[0]):
            setattr(result, field.name, stacked(values))
        elif isinstance(values[0], (int, float)):
            setattr(result, field.name, np.array(values, dtype=np.float64))
    return result


def beside(parts: Sequence[SimpleNamespace]) -> SimpleNamespace:
    """The numbers of equal parts of one scene, such as its surfaces, from `stacked`.

    Returns
    -------
    SimpleNamespace
        Each number as an array of shape (parts, b).
    """
    names = vars(parts[0])
    return SimpleNamespace(**{name: np.stack([vars(one)[name] for one in parts]) for name in names})


@dataclass(frozen=True)
class Layout:
    """The rows of a scene's state: coordinates, their velocities, bristles, and the mode.

    Parameters
    ----------
    axes : tuple of str
        Axes along which the arm moves.
    ground, socket, thread : bool
        Whether the scene has them.
    """

    axes: tuple[Axis, ...]
    ground: bool
    socket: bool
    thread: bool

    @classmethod
    def of(cls, scene: Scene) -> Layout:
        """The layout of a scene."""
        return cls(
            axes=scene.arm.axes if scene.arm else (),
            ground=scene.ground is not None,
            socket=scene.socket is not None,
            thread=scene.thread is not None,
        )

    @property
    def driven(self) -> tuple[str, ...]:
        """Names of the coordinates that the hand drives."""
        turning = ("wrist angle",) if self.thread else ()
        return ("left jaw", "right jaw", *(f"tongs {axis}" for axis in self.axes), *turning)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates: each has a row for itself and one for its velocity."""
        turning = ("cap angle",) if self.thread else ()
        return (*self.driven, "body x", *(f"body {axis}" for axis in self.axes), *turning)

    @property
    def rubbing(self) -> tuple[str, ...]:
        """Directions in which the jaws rub on the body."""
        return ("turn",) if self.thread else self.axes

    @property
    def sliding(self) -> tuple[str, ...]:
        """Directions in which the body slides on the table."""
        return ("x", *(axis for axis in self.axes if axis != "z")) if self.ground else ()

    @property
    def bristles(self) -> tuple[str, ...]:
        """Names of the bristles: one for each place and direction of friction."""
        jaws = [f"{side} jaw bristle {d}" for d in self.rubbing for side in ("left", "right")]
        table = [f"table bristle {direction}" for direction in self.sliding]
        socket = ["socket bristle"] if self.socket else []
        thread = ["thread bristle"] if self.thread else []
        return (*jaws, *table, *socket, *thread)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all rows."""
        rates = tuple(f"{name} rate" for name in self.coordinates)
        mode = ("in the socket",) if self.socket else ()
        return (*self.coordinates, *rates, *self.bristles, *mode)

    @property
    def commands(self) -> tuple[str, ...]:
        """What is commanded: the driven coordinates (m, rad), and a tap on the left dome (N)."""
        return (*self.driven, "tap")


def left_out(scene: Scene) -> tuple[str, ...]:
    """What a scene does without, each with the states or forces that this saves.

    Parameters
    ----------
    scene : Scene
        Of any task.
    """
    layout = Layout.of(scene)
    missing = []
    if not layout.axes:
        missing.append("motion along y and z: 8 states")
    elif "y" not in layout.axes:
        missing.append("motion along y: 4 states, 2 jaw bristles")
    if not layout.rubbing:
        missing.append("friction of the jaws: no bristles")
    if not layout.ground:
        missing.append("table: no contact, no table bristles")
    if not layout.socket:
        missing.append("socket and snap: no bristle, no mode")
    if not layout.thread:
        missing.append("twist: 4 states, no thread bristle")
    if scene.profile is None:
        missing.append("width that varies: the body is as wide everywhere")
    if scene.holder is None:
        missing.append("holder: nothing holds the body but jaws and table")
    return tuple(missing)


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
