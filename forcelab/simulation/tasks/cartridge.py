"""The cartridge: put into its console until it clicks, let go, grasped again and pulled out."""

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
    """Insert and pull once; the fumbling counts as inserting, as in the paper."""
    hand.start["body x"] = hand.between(-1.0, 1.0) * hand.hand["off_centre"]
    hand.phase("still", hand.lasts("still"))
    grab(hand)
    carry_and_fumble(hand, "insert")
    press_in(hand)
    let_go(hand, "still_between")
    grab(hand, "pull" if hand.chance(0.7) else "grab")
    pull_out(hand)
    let_go(hand, "still_after")
