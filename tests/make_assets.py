"""Makes the example recordings and pictures in assets/: ``python tests/make_assets.py``.

Six synthetic foam pick-ups at 200 Hz, one CSV each, with a coder's labels in the last column; and
out of simulated videos a picture of every action, as it begins and as it ends, and one of every
task.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
from factories import synthetic_set

from forcelab.demonstration import Demonstration
from forcelab.jobs import finish
from forcelab.labels import UNLABELLED, Segments, to_codes
from forcelab.simulation.rendering import Stage
from forcelab.simulation.scene import TASKS, Performance, Task
from forcelab.simulation.tasks import perform_job
from forcelab.terms import glossary

ASSETS = Path(__file__).resolve().parents[1] / "assets"
COUNT, RATE = 6, 200.0
#: The task in which an action is shown.
SHOWN_IN: dict[str, Task] = {
    "still": "LEGO",
    "grab": "foam",
    "hold": "foam",
    "search": "LEGO",
    "insert": "cartridge",
    "release": "LEGO",
    "pull": "cartridge",
    "slip": "stylus",
    "slip transition": "stylus",
    "slipped": "stylus",
    "twist": "marker",
}
#: When in an action its two pictures are taken, as shares of it.
BEGINNING, END = 0.1, 0.95
#: When each task is at its most telling: the action, and a share of it.
TELLING: dict[Task, tuple[str, float]] = {
    "LEGO": ("search", 0.5),
    "cartridge": ("insert", 0.6),
    "stylus": ("slip transition", 0.5),
    "marker": ("twist", 0.8),
    "foam": ("hold", 0.5),
}


def as_csv(demonstration: Demonstration, segments: Segments) -> str:
    """A table of stamps, signals and labels; samples without a label have an empty last cell."""
    actions = sorted({segment.action for segment in segments})
    names = [f"{channel.name} [{channel.unit}]" for channel in demonstration.channels]
    lines = [",".join(["time [s]", *names, "action"])]
    codes = to_codes(segments, demonstration.times, actions)
    for t, row, code in zip(demonstration.times, demonstration.signals, codes, strict=True):
        action = "" if code == UNLABELLED else actions[code]
        lines.append(",".join([f"{t:.3f}", *(f"{v:.5f}" for v in row), action]))
    return "\n".join(lines) + "\n"


def assets() -> dict[str, str]:
    """The name and the text of each example recording."""
    performances = synthetic_set(COUNT, RATE)
    return {f"{d.name.replace(' ', '-')}.csv": as_csv(d, s) for d, s in performances}


def instant(performance: Performance, action: str, share: float) -> float:
    """A time within the first segment of an action, s."""
    segment = next(segment for segment in performance.actions if segment.action == action)
    return segment.start + share * segment.duration


def pictures() -> dict[str, np.ndarray]:
    """The file name and the pixels of each picture."""
    performed = {task: finish(perform_job(task, 1, [1], taps=False))[0] for task in TASKS}
    stages = {task: Stage(performance, (640, 360)) for task, performance in performed.items()}
    gap = np.full((180, 8, 3), 255, np.uint8)

    def frame(task: Task, action: str, share: float, width: int) -> np.ndarray:
        shown = stages[task].frame(instant(performed[task], action, share))
        size = (width, width * 9 // 16)
        return np.asarray(cv2.resize(shown, size, interpolation=cv2.INTER_AREA))

    images = {}
    for entry in glossary():
        task = SHOWN_IN[entry.action]
        pair = [frame(task, entry.action, share, 320) for share in (BEGINNING, END)]
        images[entry.picture] = np.hstack([pair[0], gap, pair[1]])
    strip = [frame(task, *TELLING[task], 384) for task in TASKS]
    images["guide/pictures/tasks.png"] = np.hstack(strip)
    return images


if __name__ == "__main__":
    for name, pixels in pictures().items():
        path = ASSETS / name
        path.parent.mkdir(exist_ok=True)
        cv2.imwrite(str(path), pixels, [cv2.IMWRITE_PNG_COMPRESSION, 9])
        print(path, file=sys.stderr)
    for name, text in assets().items():
        (ASSETS / name).write_text(text, encoding="utf-8", newline="\n")
        print(ASSETS / name, file=sys.stderr)
