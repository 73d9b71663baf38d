"""A demonstration with a video whose clock is known: what is felt is seen to jump."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference

__all__ = ["OFFSET", "TAPS", "filmed_demonstration"]

#: Force time at which the video begins, and the times of the taps, s.
OFFSET, TAPS = -0.4, (0.5, 5.4)
LENGTH, RATE, FRAMES = 6.0, 500.0, 30.0
CONTACTS = (1.31, 1.87, 2.66, 3.05, 3.74, 4.49)


def filmed_demonstration(folder: Path, clock: ClockMap | None = None) -> Demonstration:
    """Two channels with contacts and two taps, and a disc that jumps at each of them.

    `folder`: where the video is written; `clock`: what the demonstration believes; by default that
    video and force begin together.
    """
    rng = np.random.default_rng(5)
    t = np.arange(0.0, LENGTH, 1.0 / RATE)
    force = 0.01 * rng.standard_normal((t.size, 2))
    for number, contact in enumerate(CONTACTS):
        pressed = np.clip((t - contact) / 0.02, 0.0, 1.0)
        force[:, 1] += 2.0 * (-1) ** number * pressed
    for tap in TAPS:
        force[:, 0] += 4.0 * np.exp(-0.5 * ((t - tap) / 0.007) ** 2)
    seen = OFFSET + np.arange(0.0, LENGTH + 0.5, 1.0 / FRAMES)
    events = np.sort([*CONTACTS, *TAPS])
    path = folder / "filmed.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), FRAMES, (320, 180))
    for time in seen:
        past = np.searchsorted(events, time)
        x = int(60 + 25 * past + 3 * np.sin(2 * time))
        picture = np.full((180, 320, 3), 60, dtype=np.uint8)
        cv2.circle(picture, (x, 90), 30, (90, 200, 220), -1)
        writer.write(picture)
    writer.release()
    return Demonstration(
        "filmed 1",
        "foam",
        t,
        force,
        (Channel("fx1", "N"), Channel("fz1", "N")),
        video=VideoReference(path, clock or ClockMap()),
    )
