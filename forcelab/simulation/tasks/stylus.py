"""The stylus: grasped, pulled until it slips, over its thick end and off."""

from __future__ import annotations

from forcelab.simulation.scene import Arm, Profile
from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.ground_truth import CONTACT_MADE, Course, Cue, first, last

__all__ = ["HAND", "play"]

#: Numbers of the recipe that this choreography asks for.
HAND = ("still", "close", "grip", "grab", "pace", "clench", "slipped", "open", "still_after")

#: Slope of a minimum-jerk step at its steepest, over its mean slope.
STEEPEST = 1.875
#: Grip on the rim over that on the shaft, at most.
SPREAD = 1.2


def play(hand: Choreography) -> None:
    """Pull once, all the way."""
    profile, arm = hand.scene.profile, hand.scene.arm
    assert profile is not None
    assert arm is not None
    hand.phase("still", hand.lasts("still"))

    close = hand.lasts("close")
    hand.grip(hand.hand["grip"], hand.t - 0.4 * close, close, lag=hand.between(-0.01, 0.01))
    hand.phase("grab", hand.lasts("grab"), first(*CONTACT_MADE))

    # The arm goes on at a steady pace; friction, the thick end and the tip do the rest.
    pace, start = hand.hand["pace"], hand.t - 0.22
    regrip = hand.between(0.8, 1.2) if hand.chance(0.5) else 1.0
    slips, comes_off = _plan(hand.hold * max(1.0, regrip), profile, arm, pace)
    hand.pull("tongs z", pace, start, comes_off + 0.35)
    hand.grip(hand.hold * regrip, start + 0.5 * slips, 0.4)
    hand.phase("pull", slips)
    at_rim = _reaches(profile.end - 1.2 * profile.rim_length)
    hand.phase(
        "slip", 0.5 * (comes_off - slips), first("left jaw: slip begins", "right jaw: slip begins")
    )
    hand.phase("slip transition", start + comes_off - hand.t, at_rim)

    hand.grip(hand.hold + hand.hand["clench"], hand.t + 0.08, 0.22)
    hand.phase(
        "slipped",
        hand.lasts("slipped"),
        first("jaws meet", near=1.5, lead=hand.between(0.05, 0.11)),
    )
    opening = hand.lasts("open")
    hand.open(hand.t - 0.75 * opening, opening)
    hand.phase("still", hand.lasts("still_after"), last("jaws part", near=0.6 * opening))


def _plan(grip: float, profile: Profile, arm: Arm, pace: float) -> tuple[float, float]:
    """When the jaws will slip and when they will come off, s after the arm has set off.

    The arm is a spring that is stretched at `pace`; it gives way where it bears more than friction
    does, and at the end where it bears more than friction, should the jaws stick there once more,
    and the steepest of the rim, which spreads them and so makes the grip firmer.
    """
    both = 1.0 + arm.pads.asymmetry
    slips = grip * arm.pads.static * both / arm.stiffness / pace
    steepest = 2.0 * STEEPEST * profile.rim / profile.rim_length
    held = SPREAD * grip * (arm.pads.static * both + steepest)
    reach = profile.end - 0.5 * profile.rim_length
    return slips, (reach + held / arm.stiffness) / pace


def _reaches(height: float) -> Cue:
    """The jaws are so high up the stylus."""

    def cue(course: Course, planned: float) -> float | None:
        up = course.motion.tongs[:, 1] - course.motion.body[:, 2]
        return course.first_true(up >= height, planned - 1.5, planned + 1.5)

    return cue
