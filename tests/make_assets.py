"""Makes the example recordings in assets/: ``python tests/make_assets.py``.

Six synthetic foam pick-ups at 200 Hz, one CSV each, with a coder's labels in the last column.
"""

from __future__ import annotations

import sys
from pathlib import Path

from synthetic import synthetic_set

from forcelab.demonstration import Demonstration
from forcelab.labels import UNLABELLED, Segments, to_codes

ASSETS = Path(__file__).resolve().parents[1] / "assets"
COUNT, RATE = 6, 200.0


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
    made = synthetic_set(COUNT, RATE)
    return {f"{d.name.replace(' ', '-')}.csv": as_csv(d, s) for d, s in made}


if __name__ == "__main__":
    ASSETS.mkdir(exist_ok=True)
    for name, text in assets().items():
        (ASSETS / name).write_text(text, encoding="utf-8", newline="\n")
        print(ASSETS / name, file=sys.stderr)
