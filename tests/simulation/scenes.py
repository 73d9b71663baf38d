"""Scenes small enough to be solved by hand, and their energy as a function of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from forcelab.simulation.hand import Trajectory
from forcelab.simulation.mechanics import Layout, Mechanics, stack_numbers, width_at
from forcelab.simulation.scene import (
    Arm,
    Body,
    Ground,
    Holder,
    Jaws,
    Pads,
    Profile,
    Scene,
    Socket,
    Thread,
)

#: Almost no friction, with bristles that are not stiff to solve.
SLIPPERY = Pads(static=1e-9, kinetic=1e-9, stiffness=1e-6, damping=0.0, viscous=0.0)
FREE = Jaws(stiffness=0.0, damping=0.0)

_BOX = Body("block", mass=0.05, half_width=0.02, stiffness=3e3)
_HERTZ = Body("block", mass=0.05, half_width=0.02, stiffness=2e5, exponent=1.5)
_LIFT = Arm(axes=("z",))
_REACH = Arm(axes=("y", "z"))
_SOCKET = Socket(
    place=0.02, depth=0.004, friction=4.0, snap=5.0, snap_depth=0.0028, snap_width=6e-4
)

#: One scene for each of the parts that there are, and combinations of them.
SCENES = {
    "grip": Scene("foam", Jaws(), _BOX),
    "curved": Scene("foam", Jaws(asymmetry=1.3), _HERTZ),
    "lift": Scene("foam", Jaws(), _BOX, arm=_LIFT, ground=Ground()),
    "held": Scene("stylus", Jaws(), _BOX, arm=_REACH, holder=Holder()),
    "tapering": Scene(
        "stylus",
        Jaws(),
        _HERTZ,
        arm=Arm(axes=("z",), pads=Pads(asymmetry=0.7)),
        holder=Holder(),
        profile=Profile(0.03, 0.01, 0.1, 0.02, rim=1e-3, lopsided=0.3),
    ),
    "socket": Scene("LEGO", Jaws(), _BOX, arm=_REACH, ground=Ground(), socket=_SOCKET),
    "twist": Scene("marker", Jaws(), _BOX, holder=Holder(), thread=Thread(0.008, 2e-6, 0.03, 0.02)),
}


def mechanics(scene: Scene, commands: Mapping[str, float] | None = None) -> Mechanics:
    """One lane whose hand stays where it is: commands by name, 0 where not told."""
    commanded = dict(commands or {})
    values = [commanded.pop(name, 0.0) for name in Layout.of(scene).commands]
    assert not commanded
    return Mechanics([scene], Trajectory.through([np.tile(values, (3, 1))]))


def state(system: Mechanics, numbers: Mapping[str, float]) -> np.ndarray:
    """A state (s,) by names, 0 where not told."""
    given_numbers = dict(numbers)
    result = np.array([given_numbers.pop(name, 0.0) for name in system.names])
    assert not given_numbers
    return result


def named(system: Mechanics, states: np.ndarray) -> dict[str, np.ndarray]:
    """States, or their rates, by name."""
    return dict(zip(system.names, states, strict=True))


def follow(system: Mechanics, start: np.ndarray, end: float, method: str = "LSODA", **options):
    """The motion by scipy, which shares nothing with the solvers of the simulation."""
    settings = {"rtol": 1e-9, "atol": 1e-11, "max_step": end / 20, **options}
    return solve_ivp(
        lambda t, y: system.rates(np.array([t]), y[:, None])[:, 0],
        (0.0, end),
        start,
        method,
        **settings,
    )


def scattered(system: Mechanics, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random states (s, count) near and in all contacts, sliding slower than 0.3 m/s."""
    scene, rows = system.scenes[0], []
    for name in system.names:
        low, high = -0.1, 0.1
        if "bristle" in name:
            limit, stiffness = bristle_numbers(scene, name)
            high = limit / stiffness / np.sqrt(2.0)
            low = -high
        elif name.endswith("angle rate"):
            low, high = -8.0, 8.0
        elif name.endswith("jaw"):
            low, high = -0.2 * scene.body.half_width, 1.2 * scene.body.half_width
        elif name == "tongs z":
            low, high = -0.01, 0.045
        elif name in {"body x", "body z"}:
            low, high = -5e-3, 3e-3
        elif name.endswith(" y"):
            low, high = 0.015, 0.025
        if name == "in the socket":
            rows.append(rng.integers(0, 2, count).astype(float))
        else:
            rows.append(rng.uniform(low, high, count))
    return np.array(rows)


def bristle_numbers(scene: Scene, name: str) -> tuple[float, float]:
    """The most that these bristles bear at rest, and their stiffness, per newton of load."""
    if name.startswith("thread"):
        return scene.thread.static / scene.thread.kinetic, scene.thread.stiffness
    if name.startswith("table"):
        pads = scene.ground.friction
    elif name.startswith("socket"):
        pads = scene.socket.rubbing
    else:
        pads = (scene.arm or scene.thread).pads
    return pads.static, pads.stiffness


def energy(system: Mechanics, states: np.ndarray, commands: Mapping[str, float]) -> np.ndarray:
    """All energy but that of the bristles, for commands that stay where they are."""
    scene, q = system.scenes[0], named(system, states)
    arm, thread, socket, holder = scene.arm, scene.thread, scene.socket, scene.holder
    axes = arm.axes if arm else ()

    def springs(*terms):
        return sum(0.5 * k * x**2 for k, x in terms)

    moving = [
        (scene.jaws.mass, q["left jaw rate"]),
        (scene.jaws.mass, q["right jaw rate"]),
        (scene.body.mass, q["body x rate"]),
    ]
    stored = [
        (scene.jaws.stiffness, q["left jaw"] - commands.get("left jaw", 0.0)),
        (
            scene.jaws.stiffness * scene.jaws.asymmetry,
            q["right jaw"] - commands.get("right jaw", 0.0),
        ),
        (scene.jaws.touch, np.maximum(-q["left jaw"] - q["right jaw"], 0.0)),
    ]
    for axis in axes:
        moving += [(arm.mass, q[f"tongs {axis} rate"]), (scene.body.mass, q[f"body {axis} rate"])]
        stored.append((arm.stiffness, q[f"tongs {axis}"] - commands.get(f"tongs {axis}", 0.0)))
    if thread:
        moving += [(thread.wrist_inertia, q["wrist angle rate"])]
        moving += [(thread.inertia, q["cap angle rate"])]
        stored.append((thread.wrist_stiffness, q["wrist angle"] - commands.get("wrist angle", 0.0)))
    if holder:
        stored += [(holder.stiffness, q[f"body {axis}"]) for axis in ("x", *axes)]
    total = springs(*moving, *stored)
    total = total - commands.get("tap", 0.0) * q["left jaw"]
    if "z" in axes and not holder:
        total = total + scene.body.mass * scene.gravity * q["body z"]

    half, left = np.full((2, 1), scene.body.half_width), 1.0
    if scene.profile:
        numbers = stack_numbers([scene])
        width = width_at(q["tongs z"] - q["body z"], numbers.body.half_width, numbers.profile)
        half, left = width.half, width.rest
    n = scene.body.exponent
    for depth in (half[0] - q["left jaw"] - q["body x"], half[1] - q["right jaw"] + q["body x"]):
        total = total + left * scene.body.stiffness * np.maximum(depth, 0.0) ** (n + 1) / (n + 1)

    inside = q.get("in the socket", 0.0)
    if scene.ground:
        sunk = np.maximum(_table(system, q)[0], 0.0)
        total = total + (1.0 - inside) * 0.5 * scene.ground.stiffness * sunk**2
    if socket:
        depth = -q["body z"]
        u = np.clip(depth / (0.25 * socket.depth), 0.0, 1.0)
        bump = np.exp(0.5 - 0.5 * ((depth - socket.snap_depth) / socket.snap_width) ** 2)
        fit = springs((socket.walls, q["body y"] - socket.place), (socket.ends, q["body x"]))
        fit = fit + socket.snap * socket.snap_width * bump
        low = springs((socket.bottom, np.maximum(depth - socket.depth, 0.0)))
        total = total + inside * (u * u * (3.0 - 2.0 * u) * fit + low)
    return total


def _table(system: Mechanics, q: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """How deep the body stands in the table, and how fast it sinks, by a difference."""

    def height(y):
        socket = system.scenes[0].socket
        if socket is None:
            return 0.0
        e = y - socket.place
        fade = np.exp(-((e / (3.0 * socket.pitch)) ** 4))
        return 0.5 * socket.studs * (1.0 - np.cos(2.0 * np.pi * e / socket.pitch)) * fade

    y, step = q.get("body y", 0.0), 1e-5 * q.get("body y rate", 0.0)
    rise = (height(y + step) - height(y - step)) / 2e-5
    return height(y) - q["body z"], rise - q["body z rate"]


def power(system: Mechanics, states: np.ndarray, commands: Mapping[str, float]) -> np.ndarray:
    """How fast the energy grows, with that of the bristles under a constant load, W."""
    scene, q = system.scenes[0], named(system, states)
    evaluated = system.evaluate(np.zeros(states.shape[1]), states)
    step = 1e-7
    ahead, behind = states + step * evaluated.rates, states - step * evaluated.rates
    grows = energy(system, ahead, commands) - energy(system, behind, commands)
    total = grows / (2.0 * step)

    rates = named(system, evaluated.rates)
    inside = q.get("in the socket", np.zeros(states.shape[1]))
    for name, bent in q.items():
        if "bristle" not in name:
            continue
        if "jaw" in name:
            right = name.startswith("right")
            pads = (scene.arm or scene.thread).pads
            load = evaluated.normal[int(right)] * (pads.asymmetry if right else 1.0)
        elif name.startswith("table"):
            depth, rate = _table(system, q)
            pushed = scene.ground.stiffness * depth + scene.ground.damping * rate
            load = np.where(depth > 0.0, np.maximum(pushed, 0.0), 0.0) * (1.0 - inside)
        elif name.startswith("socket"):
            u = np.clip(-q["body z"] / (0.25 * scene.socket.depth), 0.0, 1.0)
            load = inside * u * u * (3.0 - 2.0 * u) * scene.socket.friction
        else:
            load = scene.thread.kinetic
        total = total + load * bristle_numbers(scene, name)[1] * bent * rates[name]
    return total


def without_losses(scene: Scene) -> Scene:
    """The same scene with nothing that takes energy."""

    def smooth(part, **losses):
        return None if part is None else replace(part, **losses)

    assert scene.thread is None
    return replace(
        scene,
        jaws=replace(scene.jaws, damping=0.0),
        body=replace(scene.body, damping=0.0),
        arm=smooth(scene.arm, damping=0.0, pads=SLIPPERY),
        ground=smooth(scene.ground, damping=0.0, friction=SLIPPERY),
        holder=smooth(scene.holder, damping=0.0),
        socket=smooth(scene.socket, friction=0.0, wall_damping=0.0),
    )
