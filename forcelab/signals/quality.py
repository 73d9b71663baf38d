"""What is worth a look in a recording before anybody learns from it, a sentence each."""

from __future__ import annotations

import numpy as np

from forcelab.demonstration import Demonstration
from forcelab.signals.conditioning import glitches
from forcelab.signals.grid import measured
from forcelab.text import counted


def glitch_remarks(demonstration: Demonstration) -> list[str]:
    """A remark on samples that :func:`~forcelab.signals.conditioning.glitches` finds, if any."""
    counts = {}
    for channel, values in zip(demonstration.channels, demonstration.signals.T, strict=True):
        if number := int(glitches(np.where(measured(values), values, np.nan)).sum()):
            counts[channel.name] = number
    if not counts:
        return []
    total = sum(counts.values())
    each = ", ".join(f"{name} {number:,}" for name, number in counts.items())
    are = "is a glitch, no force, and counts" if total == 1 else "are glitches, no force, and count"
    return [f"{counted(total, 'sample')} {are} as missing ({each})."]
