"""The status word of an OptoForce packet: errors, overload, and which sensor it is about.

====== ==================================================================
bits   meaning
====== ==================================================================
15-13  the DAQ: 1 error, 2 communication error
12-10  the sensor: 1 absent, 2 failure, 4 temperature out of range
9-4    overload of Fx, Fy, Fz, Tx, Ty, Tz
3      several sensors are concerned
2-0    number of the sensor that the word is about
====== ==================================================================
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["faulty", "overloaded", "sentences"]

_DAQ: Final = (
    (1, "the DAQ reports an error; unplug it and plug it in again"),
    (2, "the DAQ cannot talk to the sensor; check the sensor's cable"),
)
_SENSOR: Final = (
    (1, "is absent; check its cable"),
    (2, "has failed; it may have to be repaired"),
    (4, "is too hot or too cold; let it come to room temperature"),
)
_AXES: Final = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")
_FAULTY, _OVERLOADED = 0xFC00, 0x03F0


def faulty(status: ArrayLike) -> NDArray[np.bool_]:
    """Whether the DAQ or a sensor reports an error, for status words of any shape."""
    return (np.asarray(status, np.uint16) & _FAULTY) != 0


def overloaded(status: ArrayLike) -> NDArray[np.bool_]:
    """Whether an axis is beyond its capacity, for status words of any shape."""
    return (np.asarray(status, np.uint16) & _OVERLOADED) != 0


def sentences(status: int) -> tuple[str, ...]:
    """What a status word says, a sentence each; nothing if all is well.

    Parameters
    ----------
    status : int
        One word, 0 to 65,535.
    """
    number = status & 7
    which = f"sensor {number}" if number else "the sensor"
    if status & 8:
        which += " (and others)"
    said = [text for bit, text in _DAQ if status >> 13 & bit]
    said += [f"{which} {text}" for bit, text in _SENSOR if status >> 10 & bit]
    axes = [axis for place, axis in enumerate(_AXES) if status >> (9 - place) & 1]
    if axes:
        said.append(f"{which} is overloaded in {', '.join(axes)}; press less")
    return tuple(f"{text[0].upper()}{text[1:]}." for text in said)
