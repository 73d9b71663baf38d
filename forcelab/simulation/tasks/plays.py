"""What the hand does in each task, one thing after another."""

from __future__ import annotations

from collections.abc import Callable

from forcelab.simulation.scene import Arm, Profile, Socket, Task
from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.ground_truth import (
    CONTACT_LOST,
    CONTACT_MADE,
    Course,
    Cue,
    first,
    grip_settled,
    last,
)

#: Height above the table at which a body is carried to its socket's rim, m.
HOVER = 0.003
#: Slope of a minimum-jerk step at its steepest, over its mean slope.
STEEPEST = 1.875
#: Grip on the rim over that on the shaft, at most.
SPREAD = 1.2


def play_foam(hand: Choreography) -> None:
    """Grasp the foam block, lift it, hold it, put it down and let it go."""
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


def play_stylus(hand: Choreography) -> None:
    """Grasp the stylus and pull until it slips, over its thick end and off."""
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
    slips, comes_off = _plan_pull(hand.hold * max(1.0, regrip), profile, arm, pace)
    hand.pull("tongs z", pace, start, comes_off + 0.35)
    hand.grip(hand.hold * regrip, start + 0.5 * slips, 0.4)
    hand.phase("pull", slips)
    at_rim = _reaches_height(profile.end - 1.2 * profile.rim_length)
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


def _plan_pull(grip: float, profile: Profile, arm: Arm, pace: float) -> tuple[float, float]:
    """When the jaws will slip and when they will come off, s after the arm has set off.

    The arm is a spring that is stretched at `pace`; it gives way where it bears more than friction
    does, and at the end where it bears more than friction, should the jaws stick there once more,
    and the steepest of the rim, which spreads them and so makes the grip firmer.
    """
    pads = 1.0 + arm.pads.asymmetry
    slips = grip * arm.pads.static * pads / arm.stiffness / pace
    steepest = 2.0 * STEEPEST * profile.rim / profile.rim_length
    held = SPREAD * grip * (arm.pads.static * pads + steepest)
    reach = profile.end - 0.5 * profile.rim_length
    return slips, (reach + held / arm.stiffness) / pace


def _reaches_height(height: float) -> Cue:
    """The jaws are so high up the stylus."""

    def cue(course: Course, planned: float) -> float | None:
        up = course.motion.tongs[:, 1] - course.motion.body[:, 2]
        return course.first_true(up >= height, planned - 1.5, planned + 1.5)

    return cue


def play_marker(hand: Choreography) -> None:
    """Grasp the marker's cap, twist it two or three times with a rest between, and let it go."""
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


def play_cartridge(hand: Choreography) -> None:
    """Put the cartridge into its console and pull it out; in the paper fumbling is inserting."""
    _play_in_and_out(hand, fumbling="insert", regrasping=0.3)


def play_lego(hand: Choreography) -> None:
    """Put a brick onto another one and pull it off."""
    _play_in_and_out(hand, fumbling="search", regrasping=0.0)


def _play_in_and_out(hand: Choreography, fumbling: str, regrasping: float) -> None:
    """Put the body into its socket, let it go, grasp it again and pull it out.

    `fumbling` is what it is called to feel for the socket, `regrasping` the share of demonstrations
    in which grasping again is an action of its own: otherwise it is so short that coders see it as
    part of the pull.
    """
    hand.start["body x"] = hand.between(-1.0, 1.0) * hand.hand["off_centre"]
    hand.phase("still", hand.lasts("still"))
    _grab(hand, "grab")
    _carry_and_fumble(hand, fumbling)
    _press_in(hand)
    _let_go(hand, "still_between")
    _grab(hand, "grab" if hand.chance(regrasping) else "pull")
    _pull_out(hand)
    _let_go(hand, "still_after")


def _parts(hand: Choreography) -> tuple[Arm, Socket]:
    """Arm and socket, which these scenes have."""
    assert hand.scene.arm is not None
    assert hand.scene.socket is not None
    return hand.scene.arm, hand.scene.socket


def _thrust(hand: Choreography) -> float:
    """Force that takes the body into its socket or out of it, N."""
    _, socket = _parts(hand)
    return socket.friction * socket.rubbing.static + socket.snap


def _grab(hand: Choreography, action: str) -> None:
    """Close the jaws fast, and squeeze."""
    close, lag = hand.lasts("close"), hand.between(-0.015, 0.03)
    force = hand.hand["grip"] * hand.between(0.85, 1.15)
    if hand.chance(0.35):  # in two steps
        hand.grip(force * hand.between(0.3, 0.6), hand.t - 0.45 * close, close, lag)
        hand.grip(force, hand.t + hand.between(0.4, 0.9) * close, hand.lasts("squeeze"), lag)
    else:
        hand.grip(force, hand.t - 0.4 * close, close, lag)
    hand.phase(action, hand.lasts("grab"), first(*CONTACT_MADE))


def _carry_and_fumble(hand: Choreography, action: str) -> None:
    """Carry the body to its socket, and feel with it where it goes in."""
    arm, socket = _parts(hand)
    held, fumbled = hand.lasts("hold"), hand.lasts("fumble")
    off = hand.between(0.5, 0.8) * socket.pitch * (1.0 if hand.chance(0.5) else -1.0)
    hand.move("tongs z", hand.hand["lift"], hand.t + 0.05 * held, 0.45 * held)
    hand.move("tongs y", socket.place + off, hand.t + 0.25 * held, 0.65 * held)
    hand.move("tongs z", HOVER, hand.t + 0.7 * held, 0.3 * held)
    hand.phase("hold", held, grip_settled)

    pushing = hand.hand["push"]
    hand.move("tongs z", -pushing / arm.stiffness, hand.t - 0.05, min(0.25, 0.6 * fumbled))
    feels = max(1, round(fumbled / 0.35))
    for feel in range(feels):
        start = hand.t + 0.12 + feel * (fumbled - 0.2) / feels
        swing = hand.between(0.2, 0.35) * socket.pitch
        end = min(start + hand.between(0.3, 0.7), hand.t + fumbled)
        hand.wiggle("tongs y", start, end, swing, hand.between(1.5, 4.5))
        if hand.chance(0.4):
            size = hand.between(0.2, 0.5) * pushing / arm.stiffness
            hand.wiggle("tongs z", start, end, size, hand.between(1.0, 4.0))
    # At last it feels the place, eases off and finds it.
    contact = hand.t + 0.8 * fumbled
    hand.move("tongs z", -0.3 * pushing / arm.stiffness, contact - 0.05, 0.1)
    hand.move("tongs y", socket.place, contact, 0.2 * fumbled + 0.08)
    hand.phase(action, fumbled, first("body set down", near=0.5))


def _press_in(hand: Choreography) -> None:
    """Press until it clicks, with a firmer grip."""
    arm, socket = _parts(hand)
    lasts = hand.lasts("press")
    force = _thrust(hand) * hand.between(1.35, 1.9)
    _firm(hand, force)
    hand.wiggle("tongs y", hand.t - 0.05, hand.t + 0.6 * lasts, 1.2 * socket.tolerance, 4.0)
    hand.move(
        "tongs z", -socket.depth - force / arm.stiffness, hand.t, hand.between(0.6, 0.85) * lasts
    )
    hand.phase("insert", lasts, first("into the socket", near=max(0.5, hand.lasts("fumble"))))
    hand.move("tongs z", -socket.depth, hand.t - 0.05, 0.3)


def _pull_out(hand: Choreography) -> None:
    """Pull until it comes out, and carry it back."""
    arm, _ = _parts(hand)
    lasts, held = hand.lasts("pull"), hand.lasts("hold_after")
    force = _thrust(hand) * hand.between(1.3, 1.8)
    _firm(hand, force, early=0.0)
    up = force / arm.stiffness + 0.004
    hand.move("tongs z", up, hand.t, 0.85 * lasts)
    hand.phase("pull", lasts)
    hand.move("tongs z", hand.hand["lift"], hand.t, 0.4 * held)
    hand.move("tongs y", 0.0, hand.t + 0.15 * held, 0.7 * held)
    hand.move("tongs z", 0.0, hand.t + 0.65 * held, 0.35 * held)
    hand.phase("hold", held, last("out of the socket", near=0.8))


def _let_go(hand: Choreography, still: str) -> None:
    """Open the jaws, and rest."""
    hand.open(hand.t, hand.lasts("open"), lag=hand.between(-0.03, 0.03))
    hand.phase("release", hand.lasts("release"))
    hand.phase("still", hand.lasts(still), last(*CONTACT_LOST, near=0.35))


def _firm(hand: Choreography, force: float, early: float = 0.1) -> None:
    """Regrip where the pads would slip under a thrust."""
    arm, _ = _parts(hand)
    needed = force / (arm.pads.kinetic * (1.0 + arm.pads.asymmetry)) * hand.between(1.1, 1.5)
    if hand.hold < needed:
        hand.grip(needed, hand.t - early, hand.between(0.2, 0.4))


PLAYS: dict[Task, Callable[[Choreography], None]] = {
    "LEGO": play_lego,
    "cartridge": play_cartridge,
    "stylus": play_stylus,
    "marker": play_marker,
    "foam": play_foam,
}
