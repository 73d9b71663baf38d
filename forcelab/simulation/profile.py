"""The width of a body that varies along z, such as a stylus with a thick end and a tapered tip."""

from __future__ import annotations

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from forcelab.simulation.contact import Array
from forcelab.simulation.hand import reach

__all__ = ["Width", "width_at"]


class Width(NamedTuple):
    """The body where the jaws are, each array of shape (2, n) or (n,).

    Parameters
    ----------
    half, slope : ndarray, shape (2, n)
        Half width (m) that the left and the right jaw see, and how it changes along z.
    left, left_slope : ndarray, shape (n,)
        How much of the body is left for the jaws to press on, from 1 to 0, and how that changes
        along z, 1/m.
    tip : ndarray, shape (n,)
        How far the jaws are from the tip, m; beyond it, where it is negative, nothing is left.
    """

    half: Array
    slope: Array
    left: Array
    left_slope: Array
    tip: Array


def width_at(up: Array, half_width: Array, profile: SimpleNamespace) -> Width:
    """Width at the height of the jaws.

    ``(w0 + (1 -+ lopsided) (waviness w0 sin(2 pi up / wavelength) + rim R(up))) left(up)``, where
    R rises and `left` falls like a minimum-jerk reach over the lengths of rim and taper.

    Parameters
    ----------
    up : ndarray, shape (n,)
        Height of the jaws over where they first gripped, m.
    half_width : ndarray, shape (b,)
        w0, m.
    profile : namespace of ndarray, shape (b,)
        The numbers of `Profile`.
    """
    over = up - profile.end
    rim_length = profile.rim_length
    # Both steps at once: numpy takes as long for one of them.
    (gone, rim), (gone_slope, rim_slope) = _step(
        np.stack([over, over + rim_length]), np.stack([profile.taper, rim_length])
    )
    k = 2.0 * np.pi / profile.wavelength
    wave, turns = profile.waviness * half_width, k * up
    uneven = wave * np.sin(turns) + profile.rim * rim
    uneven_slope = wave * k * np.cos(turns) + profile.rim * rim_slope
    share = np.stack([1.0 - profile.lopsided, 1.0 + profile.lopsided])
    full = half_width + share * uneven
    left = 1.0 - gone
    slope = share * uneven_slope * left - full * gone_slope
    return Width(full * left, slope, left, -gone_slope, profile.taper - over)


def _step(along: Array, length: Array) -> tuple[Array, Array]:
    """A smooth step from 0 to 1 over a length, and its slope."""
    u = np.maximum(along / length, 0.0)
    np.minimum(u, 1.0, out=u)
    rest = u * (1.0 - u)
    return reach(u), 30.0 * rest * rest / length
