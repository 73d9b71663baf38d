"""What happens at an instant: contact made and lost, slip, and the ways into and out of a socket.

An event function crosses zero when something happens; see `System`.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from forcelab.simulation import contact
from forcelab.simulation.contact import Array
from forcelab.simulation.layout import Layout

__all__ = ["SLIP", "entered", "meanings", "passing_socket", "slipping"]

#: Bristles bent to this share of what they bear slip; below it they stick.
SLIP = 0.95
#: Below this normal force, N, nothing is said to slip, as there is nothing to be felt.
FELT = 0.05
#: A body this far above the table has left its socket, m.
CLEAR = 5e-4

ENTERS, LEAVES = "into the socket", "out of the socket"


def meanings(layout: Layout) -> tuple[str, ...]:
    """What it means that the event functions of a layout cross zero, as `System.events`."""
    jaws = ("left jaw", "right jaw")
    names = [f"{jaw}: contact made|{jaw}: contact lost" for jaw in jaws]
    names.append("jaws meet|jaws part")
    if layout.rubbing:
        names += [f"{jaw}: slip begins|{jaw}: slip ends" for jaw in jaws]
    if layout.thread:
        names.append("cap slips|cap sticks")
    if layout.ground:
        names.append("body set down|body lifted")
    if layout.socket:
        names += [f"{ENTERS}|", f"{LEAVES}|", "snap in|snap out"]
    return tuple(names)


def entered(event: str, rising: bool) -> bool | None:
    """Whether the body is in its socket after an event; None where that changes nothing."""
    return {ENTERS: True, LEAVES: False}.get(event.split("|")[0 if rising else 1])


def slipping(bristles: Array, limit: Array, pads: SimpleNamespace, normal: Array) -> Array:
    """Above zero where a jaw slips on the body, shape (2, n).

    Parameters
    ----------
    bristles : ndarray, shape (directions, 2, n)
    limit : ndarray, shape (n,)
        The coefficient of friction that they can bear.
    pads : namespace of ndarray, shape (b,)
        The numbers of `Pads`.
    normal : ndarray, shape (2, n)
        N. The function fades with it, so that losing contact ends the slip without a jump.
    """
    felt = np.minimum(normal / FELT, 1.0)
    slips: Array = contact.length(bristles) * (pads.stiffness / limit) * felt - SLIP
    return slips


def passing_socket(
    place: Array, depth: Array, inside: Array, socket: SimpleNamespace
) -> tuple[Array, Array, Array]:
    """Above zero where the body goes into its socket, where it leaves, and where it has snapped in.

    Parameters
    ----------
    place : ndarray, shape (2, n)
        y and z of the body, m.
    depth : ndarray, shape (n,)
        By how much it is pressed into the table, m.
    inside : ndarray of bool, shape (n,)
    socket : namespace of ndarray, shape (b,)
        The numbers of `Socket`.
    """
    y, z = place
    off, clear = np.abs(y - socket.place), -depth
    near = np.minimum(socket.tolerance - off, depth)
    # A body above the rim need not be lifted clear of it to leave sideways.
    aside = np.minimum(clear, off - 2.0 * socket.tolerance)
    return (
        np.where(inside, socket.tolerance, near),
        np.where(inside, np.maximum(clear - CLEAR, aside), -CLEAR),
        np.where(inside, -z, 0.0) - socket.snap_depth,
    )
