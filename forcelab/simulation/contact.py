"""Laws of contact: normal force, friction with a stick phase, and the barrier of a snap-fit.

Plain functions of arrays of any shape that broadcast. Metres, newtons, seconds; energies in joules.
"""

from __future__ import annotations

import numpy as np

from forcelab.arrays import Real

#: Bristles bent to this share of what they bear begin to yield.
YIELD = 0.7


def hunt_crossley(
    depth: Real, rate: Real, stiffness: Real, damping: Real, exponent: Real | None = None
) -> Real:
    """Normal force ``K d^n (1 + lambda d')`` where ``d > 0``, never below zero.

    The damping grows with the depth, so that the force is continuous when contact is made and
    lost, unlike a dashpot's.

    `depth`, `rate`: how far the bodies overlap (m), and how fast that grows (m/s); `stiffness`,
    `damping`: K in N/m^n, lambda in s/m; `exponent`: n; 1 where it is not given.

    K. H. Hunt, F. R. E. Crossley, "Coefficient of restitution interpreted as damping in
    vibroimpact", Journal of Applied Mechanics 42 (1975) 440-445.
    """
    overlap = np.maximum(depth, 0.0)
    if exponent is not None:
        overlap = overlap**exponent
    return stiffness * overlap * np.maximum(1.0 + damping * rate, 0.0)


def hunt_crossley_energy(depth: Real, stiffness: Real, exponent: Real | None = None) -> Real:
    """Energy stored in the contact: ``K d^(n+1) / (n+1)``."""
    n = 1.0 if exponent is None else exponent
    return stiffness * np.maximum(depth, 0.0) ** (n + 1.0) / (n + 1.0)


def kelvin_voigt(depth: Real, rate: Real, stiffness: Real, damping: Real) -> Real:
    """Force ``K d + c d'`` of a spring beside a dashpot where ``d > 0``, never below zero.

    Jumps by ``c d'`` when contact is made. K in N/m, c in N s/m.
    """
    return np.where(depth > 0.0, np.maximum(stiffness * depth + damping * rate, 0.0), 0.0)


def bristle_limit(speed: Real, static: Real, kinetic: Real, stribeck: Real) -> Real:
    """Stribeck's curve: the coefficient of friction in steady motion at `speed` (m/s)."""
    share = speed / stribeck
    return kinetic + (static - kinetic) * np.exp(-share * share)


def bristle_rate(velocity: Real, bristle: Real, stiffness: Real, limit: Real) -> Real:
    """How fast the bristles of :func:`lugre` bend, m/s: as the surfaces move, until they yield.

    ``z' = v - Y s0 |v| z / g(v)`` while v bends them further, and v while it lets them go. Y grows
    from 0 to 1 as ``3 u^2 - 2 u^3`` while ``s0 |z|`` grows from 0.7 g to g: below that they are
    a spring, so that a trembling hand does not creep along what it holds, as it would with Y = 1.

    `velocity`, `bristle` (axes, ...): v (m/s) and z (m) along one or more axes; `stiffness`,
    `limit`: s0 (1/m), and g from :func:`bristle_limit`.

    P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, "Single state elastoplastic friction models",
    IEEE Transactions on Automatic Control 47 (2002) 787-792.
    """
    onwards = dot(velocity, bristle)
    ratio = stiffness / limit
    share = ratio * length(bristle)
    u = np.minimum(np.maximum((share - YIELD) * (1.0 / (1.0 - YIELD)), 0.0), 1.0)
    yields = u * u * (3.0 - 2.0 * u) / np.maximum(share, YIELD)
    yields *= ratio
    yields *= ratio
    yields *= np.maximum(onwards, 0.0)
    return velocity - yields * bristle


def dot(first: Real, second: Real) -> Real:
    """Products of vectors along one or two axes, the first of the arrays."""
    products = first * second
    # For so few axes, numpy's own sums cost more than all the rest.
    product: Real = products[0] + products[1] if len(products) == 2 else products[0]
    return product


def length(vector: Real) -> Real:
    """Lengths of vectors along one or two axes, the first of the array."""
    if len(vector) == 2:
        long: Real = np.hypot(vector[0], vector[1])
        return long
    return np.abs(vector[0])


def lugre(
    normal: Real,
    velocity: Real,
    bristle: Real,
    rate: Real,
    stiffness: Real,
    damping: Real,
    viscous: Real,
) -> Real:
    """Friction ``N (s0 z + s1 z' + s2 v)`` of bristles bent by z: the LuGre model.

    At rest the bristles are a spring, so that a body sticks, with an elastic give of up to
    ``mu / s0``; in steady motion ``s0 z`` is Coulomb's coefficient with Stribeck's dip. A body
    gives way at ``mu_static N`` when it is pulled slowly: with the pads' usual numbers at 98 % of
    that when the pull grows to it within 4 s, at 96 % within 1 s and at 91 % within 0.2 s.

    Under a load N that is constant or falls it only takes energy, counting ``V = N s0 z^2 / 2``
    that the bristles store, while the speed is below ``4 mu_kinetic (s1 + s2) / s1^2`` (1.2 m/s
    for the pads' usual numbers), and at any speed where ``mu_static <= mu_kinetic (1 + s2 / s1)``.
    This follows from ``F v - V' = N v (Y w^2 / g - s1 v Y w / g + (s1 + s2) v)`` for v > 0, with
    ``w = s0 z``, Y <= 1 from :func:`bristle_rate` and g from :func:`bristle_limit`. A load that
    rises stiffens bristles that are bent already, which gives them ``s0 z^2 N' / 2`` for nothing:
    never more than ``mu_static^2 / (2 s0)`` for each newton of a rise, 0.15 mJ with those numbers.

    `normal`: N, newtons; `velocity`, `bristle`, `rate`: v (m/s), z (m) and z' from
    :func:`bristle_rate` (m/s); `stiffness`, `damping`, `viscous`: s0 (1/m), s1 (s/m) and s2 (s/m),
    per newton of normal force.

    C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, "A new model for control of systems
    with friction", IEEE Transactions on Automatic Control 40 (1995) 419-425.
    """
    return normal * (stiffness * bristle + damping * rate + viscous * velocity)


def snap(depth: Real, force: Real, place: Real, width: Real) -> Real:
    """Force along the depth of a bump that has to be pushed across: a snap-fit.

    It is minus the slope of ``A w exp((1 - u^2) / 2)``, with ``u = (d - place) / w``: up to A
    against the way in before the bump, up to A onwards behind it, and the same on the way out.

    `depth`: m; `force`: A, N: the most that it resists; `place`, `width`: where the bump's top is,
    and w, m.
    """
    u = (depth - place) / width
    return force * u * np.exp(0.5 - 0.5 * u * u)


def snap_energy(depth: Real, force: Real, place: Real, width: Real) -> Real:
    """Energy stored while crossing the bump of :func:`snap`."""
    u = (depth - place) / width
    return force * width * np.exp(0.5 - 0.5 * u * u)
