"""Scenes: what is on the table, and how it is held. Numbers only; the mechanics read them.

A scene holds only the parts it has. A part that is ``None`` has no state, no force and no cost:
without an arm nothing moves tangentially and there is no friction; without a socket nothing snaps.
The parts are in :mod:`forcelab.simulation.parts`.

Axes: x is the grip axis (left jaw to right jaw), y lateral along the table, z upwards; metres,
newtons, kilograms, seconds and radians throughout. The middle between the jaws of the resting
tongs is x = 0, the table's top is z = 0 where the body's lower face touches it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Literal, get_args

from forcelab.errors import InputError
from forcelab.simulation.parts import Arm, Body, Ground, Holder, Jaws, Profile, Socket, Thread

__all__ = ["TASKS", "Scene", "Task"]

Task = Literal["LEGO", "cartridge", "stylus", "marker", "foam"]

#: The tasks of the paper, in the order in which they are listed.
TASKS: tuple[Task, ...] = get_args(Task)


@dataclass(frozen=True)
class Scene:
    """A task's scene.

    Parameters
    ----------
    task : str
        Such as ``"LEGO"``.
    jaws, body
        Always there.
    arm, ground, holder, socket, profile, thread
        Where the scene has them.
    gravity : float
        m/s^2.

    Raises
    ------
    InputError
        If parts are missing that other parts need.
    """

    task: str
    jaws: Jaws
    body: Body
    arm: Arm | None = None
    ground: Ground | None = None
    holder: Holder | None = None
    socket: Socket | None = None
    profile: Profile | None = None
    thread: Thread | None = None
    gravity: float = 9.81

    @property
    def parts(self) -> tuple[object, ...]:
        """Which parts it has, and the axes of its arm: what a batch has in common."""
        has = tuple(getattr(self, field.name) is not None for field in fields(self))
        return (*has, self.arm.axes if self.arm else ())

    def __post_init__(self) -> None:
        axes = self.arm.axes if self.arm else ()
        needs = (
            (self.ground, "z" in axes, "a table needs an arm that moves along z"),
            (self.socket, self.ground is not None and "y" in axes, "a socket needs a table and y"),
            (self.profile, "z" in axes, "a width that varies needs an arm that moves along z"),
            (self.thread, self.arm is None, "a thread and an arm are not combined"),
        )
        for part, met, sentence in needs:
            if part is not None and not met:
                raise InputError(f"The scene of '{self.task}' does not fit together: {sentence}.")
