"""The foam block: grasped, lifted, held, put down and let go."""

from __future__ import annotations

from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.ground_truth import CONTACT_LOST, CONTACT_MADE, first, last

__all__ = ["HAND", "play"]

#: Numbers of the recipe that this choreography asks for.
HAND = (
    "off_centre",
    "still",
    "close",
    "squeeze",
    "grip",
    "grab",
    "hold",
    "lift",
    "open",
    "release",
    "still_after",
)


def play(hand: Choreography) -> None:
    """Pick the block up once and put it down again."""
    hand.start["body x"] = hand.between(-1.0, 1.0) * hand.hand["off_centre"]
    hand.phase("still", hand.lasts("still"))

    # The jaws come fast, knock against the block, and squeeze.
    close, squeeze = hand.lasts("close"), hand.lasts("squeeze")
    touch, lag = hand.t - 0.5 * close, hand.between(0.0, 0.08)
    hand.grip(hand.hand["grip"] * hand.between(0.1, 0.45), touch, close, lag)
    hand.grip(hand.hand["grip"], hand.t + hand.between(0.3, 0.7) * close, squeeze, lag)
    hand.phase("grab", hand.lasts("grab"), first(*CONTACT_MADE))

    held = hand.lasts("hold")
    hand.move("tongs z", hand.hand["lift"], hand.t + 0.05 * held, 0.4 * held)
    # The grip sags while the block is held, or is set right.
    sag = hand.between(0.5, 0.8) if hand.chance(0.7) else hand.between(0.9, 1.15)
    hand.grip(hand.hold * sag, hand.t + 0.05 * held, 0.9 * held)
    hand.move("tongs z", hand.between(-0.001, 0.0), hand.t + 0.6 * held, 0.4 * held)
    hand.phase("hold", held)

    opening = hand.lasts("open")
    hand.open(hand.t - 0.12 * opening, opening)
    hand.phase("release", hand.lasts("release"))
    hand.phase("still", hand.lasts("still_after"), last(*CONTACT_LOST, near=0.4))
