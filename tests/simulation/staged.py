"""Performances of all five tasks made by hand: plausible motion without mechanics."""

import numpy as np

from forcelab.labels import Segment
from forcelab.simulation.scene import (
    Arm,
    Body,
    Ground,
    Holder,
    Jaws,
    Motion,
    Performance,
    Profile,
    Scene,
    Socket,
    Thread,
)

RATE = 1000.0
#: How far the jaws are open beyond the body, m, and what a finger's spring is, N/m.
OPEN, FINGER = 0.009, 1200.0
TAPS = (0.35,)

SCENES = {
    "LEGO": Scene(
        "LEGO",
        Jaws(),
        Body("brick", 0.006, 0.008, 8e4, height=0.0096),
        arm=Arm(axes=("y", "z")),
        ground=Ground(),
        socket=Socket(0.12, 0.0022, 2.0, 1.5, 0.0015, 0.0004),
    ),
    "cartridge": Scene(
        "cartridge",
        Jaws(),
        Body("cartridge", 0.07, 0.009, 1e5, height=0.05),
        arm=Arm(axes=("y", "z")),
        ground=Ground(),
        socket=Socket(0.15, 0.009, 3.0, 5.0, 0.006, 0.001),
    ),
    "stylus": Scene(
        "stylus",
        Jaws(),
        Body("stylus", 0.012, 0.005, 9e4),
        arm=Arm(),
        holder=Holder(),
        profile=Profile(0.035, 0.007, 0.05, 0.03),
    ),
    "marker": Scene(
        "marker",
        Jaws(),
        Body("marker", 0.02, 0.009, 6e4),
        holder=Holder(),
        thread=Thread(0.009, 2e-6, 0.12, 0.07),
    ),
    "foam": Scene(
        "foam",
        Jaws(),
        Body("block", 0.02, 0.02, 500.0, height=0.04),
        arm=Arm(),
        ground=Ground(),
    ),
}

#: Action, seconds, and where things are at its end: grip in N (negative: open), z, y, angle of the
#: tongs, and depth or drag where they matter.
CHOREOGRAPHIES = {
    "LEGO": [
        ("still", 1.0, {}), ("grab", 0.5, {"grip": 6}), ("hold", 1.2, {"z": 0.03, "y": 0.119}),
        ("search", 1.2, {"z": 0.0003, "wiggle": 0.004}), ("insert", 0.6, {"z": -0.0022, "y": 0.12}),
        ("release", 0.4, {"grip": 0}), ("still", 0.6, {}), ("grab", 0.4, {"grip": 8}),
        ("pull", 0.6, {"z": 0.02, "drag": 6}), ("hold", 1.2, {"y": 0.0, "z": 0.0}),
        ("release", 0.4, {"grip": 0}), ("still", 1.0, {}),
    ],
    "cartridge": [
        ("still", 1.0, {}), ("grab", 0.5, {"grip": 10}), ("hold", 1.2, {"z": 0.04, "y": 0.149}),
        ("insert", 1.0, {"z": -0.009, "y": 0.15}), ("release", 0.4, {"grip": 0}),
        ("still", 0.6, {}), ("pull", 0.9, {"grip": 13, "z": 0.03, "drag": 9}),
        ("hold", 1.2, {"y": 0.0, "z": 0.0}), ("release", 0.4, {"grip": 0}), ("still", 1.0, {}),
    ],
    "stylus": [
        ("still", 1.0, {}), ("grab", 0.5, {"grip": 7}), ("hold", 0.8, {}),
        ("slip", 0.4, {"tongs": 0.004, "drag": 8}), ("sliptrans", 0.7, {"tongs": 0.036, "drag": 7}),
        ("slipped", 0.5, {"tongs": 0.055, "clap": 1}), ("still", 0.8, {"grip": 0}),
    ],
    "marker": [
        ("still", 1.0, {}), ("grab", 0.5, {"grip": 10}), ("hold", 0.6, {}),
        ("twist", 0.8, {"angle": 1.0}), ("hold", 0.4, {}), ("twist", 0.8, {"angle": 2.0}),
        ("release", 0.4, {"grip": 0}), ("still", 1.0, {}),
    ],
    "foam": [
        ("still", 1.0, {}), ("grab", 0.6, {"grip": 4}), ("hold", 1.6, {"z": 0.04}),
        ("release", 0.5, {"grip": 0}), ("still", 0.8, {}),
    ],
}  # fmt: skip


def staged(task, taps=TAPS):
    """The performance of a task, at 1 kHz."""
    scene, steps = SCENES[task], CHOREOGRAPHIES[task]
    duration = sum(seconds for _, seconds, _ in steps)
    times = np.arange(round(duration * RATE)) / RATE
    half = scene.body.half_width
    give = 1.0 / scene.body.stiffness
    tracks = {name: np.zeros(times.size) for name in ("grip", "z", "y", "angle", "tongs", "drag")}
    clap = np.zeros(times.size)
    actions, start = [], 0.0
    for action, seconds, ends in steps:
        actions.append(Segment(start, start + seconds, action))
        part = np.clip((times - start) / seconds, 0, 1)
        ease = part**3 * (10 - 15 * part + 6 * part**2)
        for name, end in ends.items():
            if name == "wiggle":
                tracks["y"] += end * np.sin(np.pi * 4 * part) * np.sin(np.pi * part)
            elif name == "drag":
                tracks["drag"] += end * np.sin(np.pi * part)
            elif name == "clap":
                clap = ease
            else:
                tracks[name] += ease * (end - tracks[name][-1])
        start += seconds
    grip = tracks["grip"]
    closed = np.clip(grip / 2.0, 0, 1)
    jaw = half + OPEN * (1 - closed) - closed * grip * give - half * clap * closed
    jaws = np.column_stack([jaw, jaw])
    normal = np.column_stack([grip, grip])
    for tap in taps:
        pulse = 4.5 * np.exp(-(((times - tap) / 0.009) ** 2))
        jaws[:, 0] += pulse / FINGER
        normal[:, 0] += pulse
    tongs = np.column_stack([tracks["y"], tracks["z"] + tracks["tongs"], tracks["angle"]])
    zero = np.zeros(times.size)
    carried = tracks["z"] if scene.arm and scene.ground else zero
    body = np.column_stack([zero, tracks["y"], carried, np.where(scene.thread, tracks["angle"], 0)])
    forces = np.zeros((times.size, 6))
    forces[:, [2, 5]] = -normal
    forces[:, [1, 4]] = -0.5 * tracks["drag"][:, None]
    return Performance(
        scene, Motion(times, jaws, tongs, body, normal), forces, RATE, tuple(actions), (), taps
    )
