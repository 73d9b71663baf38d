"""Brief performances and films that cost nothing, where mechanics and pictures do not matter."""

from __future__ import annotations

import numpy as np

from forcelab.clock import ClockMap
from forcelab.jobs import Progress
from forcelab.labels import Segment
from forcelab.simulation.scene import Body, Jaws, Motion, Performance, Scene
from forcelab.simulation.system import Event

RATE, LENGTH = 2000.0, 0.8
#: A grip: the jaws close, hold and open.
KNOTS = [0.0, 0.2, 0.3, 0.5, 0.6, LENGTH]


def performing(task, seed, numbers, taps):
    """Grips of a strength that depends on the seed and the number alone."""
    made = []
    for number in numbers:
        yield Progress(len(made), len(numbers), task)
        times = np.arange(round(LENGTH * RATE) + 1) / RATE
        strength = np.random.default_rng([seed, number]).uniform(3.0, 6.0)
        grip = strength * np.interp(times, KNOTS, [0, 0, 1, 1, 0, 0])
        jaw = 0.04 - np.interp(times, KNOTS, [0, 0.02, 0.021, 0.021, 0.02, 0])
        zero = np.zeros_like(times)
        motion = Motion(
            times=times,
            jaws=np.stack([jaw, jaw], axis=1),
            tongs=np.zeros((len(times), 3)),
            body=np.zeros((len(times), 4)),
            normal=np.stack([grip, grip], axis=1),
        )
        side = [0.3 * grip, zero, -grip]
        actions = [
            Segment(start, end, action)
            for start, end, action in zip(
                KNOTS, KNOTS[1:], ("still", "grab", "hold", "release", "still"), strict=False
            )
        ]
        made.append(
            Performance(
                scene=Scene(task, Jaws(), Body("block", 0.02, 0.02, 500.0)),
                motion=motion,
                forces=np.stack([*side, *side], axis=1),
                rate=RATE,
                actions=tuple(actions),
                events=(Event(0.2, "left jaw: contact made"),),
                taps=(0.05, 0.75) if taps else (),
            )
        )
    return tuple(made)


def filmed(performance, origin, scratch):
    """No film, but a file for it."""
    path = scratch / f"{origin.name}.mp4"
    path.write_bytes(str(origin).encode())
    clock = ClockMap(0.25, 1 + 30e-6)
    return path, {"offset": clock.offset, "rate": clock.rate, "frames": [], "late": []}, clock
