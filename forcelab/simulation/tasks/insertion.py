"""Putting a body into its socket and pulling it out again, as LEGO and cartridge."""

from __future__ import annotations

from forcelab.simulation.scene import Arm, Socket
from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.ground_truth import (
    CONTACT_LOST,
    CONTACT_MADE,
    first,
    grip_settled,
    last,
)

#: Numbers of the recipe that such a choreography asks for.
HAND = (
    "off_centre",
    "still",
    "close",
    "squeeze",
    "grip",
    "grab",
    "hold",
    "lift",
    "fumble",
    "push",
    "press",
    "open",
    "release",
    "still_between",
    "pull",
    "hold_after",
    "still_after",
)
#: Height above the table at which a body is carried to its socket's rim, m.
HOVER = 0.003


def in_and_out(hand: Choreography, fumbling: str, regrasping: float) -> None:
    """Put the body in, let it go, grasp it again and pull it out.

    Parameters
    ----------
    hand : Choreography
    fumbling : str
        What it is called to feel for the socket.
    regrasping : float
        Share of demonstrations in which grasping again is an action of its own. Otherwise it is
        so short that coders see it as part of the pull.
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
    found = hand.t + 0.8 * fumbled
    hand.move("tongs z", -0.3 * pushing / arm.stiffness, found - 0.05, 0.1)
    hand.move("tongs y", socket.place, found, 0.2 * fumbled + 0.08)
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
