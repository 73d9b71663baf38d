"""What the scalogram's panel says in words: values, units, and what was approximated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from forcelab.gui.figures.text import signed
from forcelab.gui.label.scalogram_drawing import Rows, amount
from forcelab.gui.numerals import thousands

if TYPE_CHECKING:
    from forcelab.signals.scalogram import Scalogram

__all__ = ["ends", "note", "value"]


#: Decades beyond the last colour from which on something is a spike: impacts are less.
SPIKE = 0.5


def value(picture: Scalogram, rows: Rows, time: float, y: float) -> str:
    """What is known at a time and a height, such as ``12.3 Hz at 4.250 s: |W| = 0.42``.

    The transform's own measure, without the channel's unit: a tone of 1 N has more the wider the
    wavelet is.
    """
    scale = rows.scale(y)
    k, c = picture.values.shape
    row = math.floor(math.log(scale / rows.smallest) / math.log(rows.largest / rows.smallest) * k)
    column = math.floor((time - picture.start) / (picture.end - picture.start) * c)
    where = f"{rows.hertz(scale):.3g} Hz at {time:.3f} s"
    if not (0 <= row < k and 0 <= column < c) or not np.isfinite(picture.values[row, column]):
        return where
    here = float(picture.values[row, column])
    if picture.phase:
        return "{}: {} rad".format(where, signed(f"{here:.2f}"))
    return f"{where}: |W| = {10.0**here:.3g}"


def note(picture: Scalogram, high: float) -> str:
    """What was approximated or left out in the picture; empty where that is nothing.

    Parameters
    ----------
    picture : Scalogram
    high : float
        Decimal logarithm of the magnitude for the last colour.
    """
    if picture.coarse:
        return "coarse picture; computing the exact one…"
    return ", ".join(filter(None, (_fineness(picture), _left_out(picture, high))))


def _left_out(picture: Scalogram, high: float) -> str:
    """What the colours do not tell apart or show."""
    source, notes = picture.view.source, []
    number = source.left_out(source.place(picture.start), source.place(picture.end))
    if number:
        one, many = (
            "1 glitch left out",
            "{0} glitches left out",
        )
        notes.append(one if number == 1 else many.format(thousands(number)))
    if not picture.phase and np.fmax.reduce(picture.values, axis=None) > high + SPIKE:
        notes.append("spikes share the last colour")
    return ", ".join(notes)


def _fineness(picture: Scalogram) -> str:
    """How much of the recording each pixel is about."""
    samples = (picture.end - picture.start) * picture.view.source.rate
    each = samples / picture.values.shape[1]
    if each < 2:
        return ""
    if picture.phase:
        return f"phase every {each:.3g} samples"
    return f"largest of {each:.0f} samples a pixel"


def ends(low: float, high: float, phase: bool) -> tuple[str, str]:
    """What stands beside the legend's ends; `low` and `high` are decimal logarithms."""
    if phase:
        return "\N{MINUS SIGN}\N{GREEK SMALL LETTER PI}", "\N{GREEK SMALL LETTER PI}"
    return amount(10.0**low), f"|W| {amount(10.0**high)}"
