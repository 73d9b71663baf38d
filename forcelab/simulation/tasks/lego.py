"""LEGO: a brick is put onto another one, let go, grasped again and pulled off."""

from __future__ import annotations

from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.socketing import (
    HAND,
    carry_and_fumble,
    grab,
    let_go,
    press_in,
    pull_out,
)

__all__ = ["HAND", "play"]


def play(hand: Choreography) -> None:
    """Assemble and disassemble once."""
    hand.start["body x"] = hand.between(-1.0, 1.0) * hand.hand["off_centre"]
    hand.phase("still", hand.lasts("still"))
    grab(hand)
    carry_and_fumble(hand, "search")
    press_in(hand)
    let_go(hand, "still_between")
    # Grasping again is short, and coders see it as part of the pull.
    grab(hand, "pull")
    pull_out(hand)
    let_go(hand, "still_after")
