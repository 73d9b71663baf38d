"""The marker: its cap is grasped, twisted with stick-slip in several goes, and let go."""

from __future__ import annotations

from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.ground_truth import (
    CONTACT_LOST,
    CONTACT_MADE,
    first,
    grip_settled,
    last,
)

__all__ = ["HAND", "play"]

#: Numbers of the recipe that this choreography asks for.
HAND = ("still", "close", "grip", "grab", "twist", "pace", "hold", "open", "release", "still_after")


def play(hand: Choreography) -> None:
    """Twist two or three times, with a rest between."""
    thread = hand.scene.thread
    assert thread is not None
    hand.phase("still", hand.lasts("still"))
    close = hand.lasts("close")
    hand.grip(hand.hand["grip"], hand.t - 0.4 * close, close, lag=hand.between(-0.015, 0.03))
    hand.phase("grab", hand.lasts("grab"), first(*CONTACT_MADE))

    angle = 0.0
    yields, turns_on = (
        thread.static / thread.wrist_stiffness,
        thread.kinetic / thread.wrist_stiffness,
    )
    for twist in range(2 if hand.chance(0.6) else 3):
        lasts = hand.lasts("twist") * hand.between(0.75, 1.25)
        pace = hand.hand["pace"] * hand.between(0.8, 1.2)
        if hand.chance(0.35):
            hand.grip(hand.hold * hand.between(0.9, 1.25), hand.t, 0.25)
        hand.pull("wrist angle", pace + 0.7 * yields / lasts, hand.t - 0.04, lasts)
        angle += pace * lasts + 0.7 * yields
        hand.phase("twist", lasts, grip_settled if twist == 0 else None)
        # The wrist gives way until the thread holds the cap again.
        angle -= hand.between(0.5, 1.0) * turns_on
        hand.move("wrist angle", angle, hand.t, 0.25)
        hand.phase("hold", hand.lasts("hold") * hand.between(0.7, 1.3))
    # "twist, hold, twist": the last rest is part of letting go.
    hand.phases.pop()
    hand.t = hand.phases[-1].end
    hand.open(hand.t + 0.05, hand.lasts("open"))
    hand.phase("release", hand.lasts("release"))
    hand.phase("still", hand.lasts("still_after"), last(*CONTACT_LOST, near=0.4))
