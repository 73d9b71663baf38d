"""Error against run time of the wavelet transform: the engine's tolerances beside other libraries.

Everybody makes the same: log magnitude and phase of each coefficient, on one thread, into tables
that are there. The memory is that beside the tables.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.jobs import Progress
from forcelab.measure.rows import Row, Table, with_front
from forcelab.measure.streams import forces
from forcelab.measure.timing import Timed, Way, timed_ways
from forcelab.measure.wavelet_ways import PEERS, Features, Peer, Tables, ours
from forcelab.signals.cwt import usual_scales
from forcelab.signals.engine.design import TOLERANCES
from forcelab.signals.engine.plan import plan_for
from forcelab.signals.wavelets import Morlet

__all__ = ["direct_sums", "measuring", "tabulate", "tapered"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Samples, channels, and distances of scales in octaves.
SIZES = ((1 << 12, 4), (1 << 16, 4), (1 << 20, 1))
SPACINGS = (1.0, 0.125)
#: Coefficients above which only the engine's fast tolerances are measured: others take minutes.
MANY = 1 << 26
#: Errors are looked at from this scale on, below which the wavelet is cut at the Nyquist frequency
#: and its sum is another; at so many scales and places.
FIRST = 4.5
LOOKED, PLACES = 12, 12


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all tolerances and all peers that are installed, at all sizes.

    With `quick` the two smaller sizes, once.
    """
    rows: list[Row] = []
    for n, channels in SIZES[: 2 if quick else None]:
        for spacing in SPACINGS[: 1 if quick else None]:
            made = yield from measuring(tapered(n, channels), spacing, 1 if quick else 5)
            rows += made
    return Table(
        "Wavelet transform to log magnitude and phase",
        "error (of largest)",
        "CPU ms",
        with_front(rows),
    )


def tapered(n: int, channels: int) -> Real:
    """Forces that rise from nothing and end in nothing: all conventions for ends agree on them."""
    x = forces(n, channels).T
    x = x - np.median(x, axis=1, keepdims=True)
    edge = max(1, n // 8)
    rise = np.sin(0.5 * np.pi * np.arange(edge) / edge) ** 2
    x[:, :edge] *= rise
    x[:, -edge:] *= rise[::-1]
    return np.ascontiguousarray(x / np.abs(x).max(axis=1, keepdims=True))


def measuring(
    x: Real, spacing: float, repetitions: int, tolerances: Sequence[float] = tuple(TOLERANCES)
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure all ways on some channels.

    The error is the largest difference of a coefficient from the direct sum at some places of some
    scales, relative to the largest coefficient of its scale and channel. Peers are first multiplied
    by the one number for each scale that suits them best, for their conventions differ.

    Parameters
    ----------
    x : ndarray, shape (c, n)
        Zero at both ends.
    spacing : float
        Of the scales from 2 samples to n, in octaves.
    repetitions : int
    tolerances : sequence of float
        Of the engine.
    """
    c, n = x.shape
    scales = usual_scales(n, spacing=spacing)
    if x.size * len(scales) > MANY:
        tolerances = [tolerance for tolerance in tolerances if tolerance == 1e-7]
    places = np.unique(np.linspace(0, n - 1, PLACES).astype(int))
    wide = np.flatnonzero(scales >= FIRST)
    looked = wide[np.unique(np.linspace(0, len(wide) - 1, LOOKED).astype(int))]
    yield Progress(0, 1, "direct sums")
    wanted = direct_sums(x, scales[looked], places)
    size = f"{n} samples x {c} channels x {len(scales)} scales ({spacing:g} octaves apart)"
    row = Row(
        "",
        "",
        size,
        f"direct sums at {len(places)} places of {len(looked)} scales from {FIRST:g} samples on",
        refusal="to be measured",
    )
    rows = ours(x, scales, 1e-7, Tables())[0]
    largest = np.exp(rows[:, looked].max(axis=2, keepdims=True).astype(np.float64))
    del rows
    judged = _Judged(wanted, largest, looked, places)
    tables = Tables()
    ways = [
        Way(
            f"tolerance {tolerance:g}",
            partial(ours, x, scales, tolerance, tables),
            partial(_our_error, judged, x, scales, tolerance),
        )
        for tolerance in tolerances
    ]
    ways += [
        Way(peer.name, partial(_peer, peer, x, scales, tables), partial(_peers_error, judged))
        for peer in PEERS
    ]
    timed = yield from timed_ways(ways, repetitions)
    return tuple(
        _row(row, way.name, found, i < len(tolerances))
        for i, (way, found) in enumerate(zip(ways, timed, strict=True))
    )


def direct_sums(x: Real, scales: Real, places: NDArray[np.int_], p: float = 5.0) -> Complex:
    """``a^-1/2 sum_n x_n conj(psi((n - b) / a))`` as it stands, of channels that are 0 outside.

    Returns
    -------
    ndarray of complex128, shape (c, len(scales), len(places))
    """
    n = x.shape[1]
    out = np.empty((len(x), len(scales), len(places)), dtype=np.complex128)
    for j, a in enumerate(scales.tolist()):
        for i, b in enumerate(places.tolist()):
            reach = math.ceil(9.5 * a)
            part = slice(max(0, b - reach), min(n, b + reach + 1))
            t = (np.arange(part.start, part.stop) - b) / a
            bell = math.pi**-0.25 / math.sqrt(a) * np.exp(-0.5 * t * t)
            out[:, j, i] = x[:, part] @ ((np.cos(p * t) - math.exp(-0.5 * p * p)) * bell)
            out[:, j, i] -= 1j * (x[:, part] @ (np.sin(p * t) * bell))
    return out


def _peer(peer: Peer, x: Real, scales: Real, tables: Tables) -> Features:
    """What a peer makes of the channels, BLAS and its like on one thread."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(1):
        return peer.features(x, scales, tables)


@dataclass(frozen=True)
class _Judged:
    """What is right at some places of some scales, and the largest coefficient of each of them."""

    wanted: Complex
    largest: Real
    scales: NDArray[np.int_]
    places: NDArray[np.int_]


def _our_error(judged: _Judged, x: Real, scales: Real, tolerance: float, _: Features) -> float:
    """The largest error of the coefficients whose features were timed."""
    plan = plan_for(x.shape[1], scales, Morlet(), tolerance)
    found = plan.coefficients(x)[:, judged.scales][:, :, judged.places]
    return float(np.max(np.abs(found - judged.wanted) / judged.largest))


def _peers_error(judged: _Judged, found: Features) -> float:
    """The largest error; each scale is allowed a factor of its own."""
    rows = (one[:, judged.scales][:, :, judged.places].astype(np.float64) for one in found)
    magnitudes, phases = rows
    made = np.exp(magnitudes + 1j * phases)
    power = (np.abs(made) ** 2).sum(axis=(0, 2))
    factor = (np.conj(made) * judged.wanted).sum(axis=(0, 2)) / np.where(power > 0, power, 1.0)
    return float(np.max(np.abs(made * factor[:, None] - judged.wanted) / judged.largest))


def _row(row: Row, name: str, found: Timed[float], engine: bool) -> Row:
    """A row of one way; milliseconds."""
    name, setting = ("forcelab", name) if engine else (name, "as it comes")
    if found.refusal or found.seen is None:
        return replace(row, name=name, setting=setting, refusal=found.refusal)
    return replace(
        row,
        name=name,
        setting=setting,
        error=found.seen,
        seconds=1e3 * found.seconds,
        spread=1e3 * found.spread,
        peak_bytes=found.peak_bytes,
        refusal="",
    )
