"""The cartridge: put into its console until it clicks, let go, grasped again and pulled out."""

from __future__ import annotations

from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.insertion import HAND, in_and_out

__all__ = ["HAND", "play"]


def play(hand: Choreography) -> None:
    """Insert and pull once; the fumbling counts as inserting, as in the paper."""
    in_and_out(hand, fumbling="insert", regrasping=0.3)
