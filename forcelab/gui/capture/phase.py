"""What the Capture workspace is doing."""

from __future__ import annotations

from enum import Enum, auto

__all__ = ["WORKING", "Phase"]


class Phase(Enum):
    """What it is doing."""

    APART = auto()
    CONNECTING = auto()
    READY = auto()
    COUNTING = auto()
    STARTING = auto()
    RECORDING = auto()
    KEEPING = auto()
    DISCARDING = auto()
    RECOVERING = auto()
    #: Devices are let go of while nothing is recorded.
    LEAVING = auto()
    #: A recording has ended and could not be kept: stop again, or discard it.
    STUCK = auto()


#: Phases in which a job has the recorder.
WORKING = frozenset(
    {
        Phase.CONNECTING,
        Phase.STARTING,
        Phase.KEEPING,
        Phase.DISCARDING,
        Phase.RECOVERING,
        Phase.LEAVING,
    }
)
