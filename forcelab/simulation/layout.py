"""Which states a scene has, and what it leaves out."""

from __future__ import annotations

from dataclasses import dataclass

from forcelab.simulation.parts import Axis
from forcelab.simulation.scene import Scene

__all__ = ["Layout", "left_out"]


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
