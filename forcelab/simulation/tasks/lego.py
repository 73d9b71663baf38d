"""LEGO: a brick is put onto another one, let go, grasped again and pulled off."""

from __future__ import annotations

from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.insertion import HAND, in_and_out

__all__ = ["HAND", "play"]


def play(hand: Choreography) -> None:
    """Assemble and disassemble once."""
    in_and_out(hand, fumbling="search", regrasping=0.0)
