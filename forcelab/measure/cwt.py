"""Error against run time of the wavelet transform: the engine's tolerances beside other libraries.

Everybody makes the same, log magnitude and phase of each coefficient, on one thread, as its user
writes it: ours are given so; of others ``np.log(np.abs(W))`` and ``np.angle(W)`` are taken. What
a library keeps for the next call is there: our plan, ssqueezepy's wavelet. Both are measured with
that made anew as well. The memory is that beside the result.

ssqueezepy errs at the widest scales alone: it pads no further than to a power of two, of which a
wavelet as wide as the recording reaches around the whole; and with its own setting, reflected ends,
from scales of a hundredth of the recording on, by 1 % and more. So it is told of zeros beyond the
ends, which is what the channels have, and the error up to a sixteenth of the recording stands
beside that at all scales. What our error costs with it is a row of its own.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.streams import forces
from forcelab.measure.timing import Method, Timed, timed_methods
from forcelab.measure.wavelet_ways import Features, P, Peer, ours, ours_anew, peers_of_tapered
from forcelab.signals.cwt import usual_scales
from forcelab.signals.cwt_blocks import TOLERANCES
from forcelab.signals.cwt_engine import plan_for
from forcelab.signals.wavelets import Morlet

__all__ = ["direct_sums", "measuring", "measuring_long", "tabulate", "tapered"]

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Samples, channels, and distances of scales in octaves.
SIZES = ((1 << 12, 4), (1 << 16, 4), (1 << 20, 1))
SPACINGS = (1.0, 0.125)
#: A recording of which the memory is looked at, and its scales: a cut one, then wider and wider.
LONG, LONG_SCALES = 1 << 24, (2.0, 8.0, 256.0, 65536.0)
#: Coefficients above which only the engine's fast tolerances are measured: others take minutes.
MANY = 1 << 26
#: Errors are looked at from this scale on, below which the wavelet is cut at the Nyquist frequency
#: and its sum is another; at so many scales and places.
FIRST = 4.5
LOOKED, PLACES = 12, 12
#: The share of the recording up to which the error of narrower wavelets is told apart.
NARROW = 16
#: Seconds: what all repetitions of one way may take, and above which a peer is left out.
ENOUGH, PATIENCE = 8.0, 60.0

#: Seconds a coefficient that peers have taken in smaller cells, by name.
Spent = dict[str, float]


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Measure all tolerances and all peers that are installed, at all sizes.

    A peer is left out where it would take more than a minute a call, as told from smaller sizes.
    Of the longest recording there is the engine alone, for its memory. With `quick` the two
    smaller sizes, once.
    """
    rows: list[Row] = []
    spent: Spent = {}
    for n, channels in SIZES[: 2 if quick else None]:
        for spacing in SPACINGS[: 1 if quick else None]:
            made = yield from measuring(
                tapered(n, channels), spacing, 1 if quick else 5, spent=spent
            )
            rows += made
    if not quick:
        rows += yield from measuring_long(tapered(LONG, 1), np.array(LONG_SCALES))
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
    x: Real,
    spacing: float,
    repetitions: int,
    tolerances: Sequence[float] = tuple(TOLERANCES),
    spent: Spent | None = None,
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
        Fewer of what takes long.
    tolerances : sequence of float
        Of the engine.
    spent : dict of str to float, optional
        Seconds a coefficient that peers have taken so far, to which theirs are added; who would
        take too long by it is refused.
    """
    scales = usual_scales(x.shape[1], spacing=spacing)
    if x.size * len(scales) > MANY:
        tolerances = [tolerance for tolerance in tolerances if tolerance == 1e-7]
    spent = {} if spent is None else spent
    peers = peers_of_tapered()
    told = f"{len(scales)} scales ({spacing:g} octaves apart)"
    return (yield from _measured(x, scales, told, repetitions, tolerances, peers, spent))


def measuring_long(x: Real, scales: Real) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure the engine alone, at tolerance 1e-7, once; parameters as of :func:`measuring`."""
    told = f"scales {', '.join(f'{scale:g}' for scale in scales.tolist())}"
    return (yield from _measured(x, scales, told, 1, (1e-7,), (), {}))


def _measured(
    x: Real,
    scales: Real,
    told: str,
    repetitions: int,
    tolerances: Sequence[float],
    peers: Sequence[Peer],
    spent: Spent,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Rows of the engine's tolerances, then of peers."""
    c, n = x.shape
    places = np.unique(np.linspace(0, n - 1, PLACES).astype(int))
    wide = np.flatnonzero(scales >= FIRST)
    looked = wide[np.unique(np.linspace(0, len(wide) - 1, LOOKED).astype(int))]
    yield Progress(0, 1, "direct sums")
    wanted = direct_sums(x, scales[looked], places)
    size = f"{n} samples x {c} channels x {told}"
    reference = (
        f"direct sums at {len(places)} places of {len(looked)} scales from {FIRST:g} samples on"
    )
    rows = ours(x, scales, 1e-7)[0]
    largest = np.exp(rows[:, looked].max(axis=2, keepdims=True).astype(np.float64))
    judged = _Judged(wanted, largest, looked, places, scales[looked] <= n / NARROW)
    named = [("forcelab", tolerance, ours) for tolerance in tolerances]
    if 1e-7 in tolerances and peers:
        named.append(("forcelab, plan anew", 1e-7, ours_anew))
    ways = [
        Method(
            f"{name}, {tolerance:g}",
            partial(run, x, scales, tolerance),
            partial(_our_errors, judged, x, scales, tolerance),
        )
        for name, tolerance, run in named
    ]
    ways += [
        Method(
            peer.name,
            partial(_peer, peer, x, scales, spent.get(peer.name, 0.0)),
            partial(_peers_errors, judged),
        )
        for peer in peers
    ]
    for peer in peers:  # what is loaded and compiled at first is nobody's memory
        with suppress(InputError):
            peer.coefficients(x[:, :1024], scales[:8])
    timed = yield from timed_methods(ways, repetitions, longest=ENOUGH)
    told_as = [(name, f"tolerance {tolerance:g}") for name, tolerance, _ in named]
    told_as += [(peer.name, peer.setting) for peer in peers]
    for peer, found in zip(peers, timed[len(named) :], strict=True):
        if not found.refusal:
            spent[peer.name] = found.seconds / (x.size * len(scales))
    return tuple(
        _row(name, setting, size, reference, found)
        for (name, setting), found in zip(told_as, timed, strict=True)
    )


def direct_sums(x: Real, scales: Real, places: NDArray[np.int_]) -> Complex:
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
            out[:, j, i] = x[:, part] @ ((np.cos(P * t) - math.exp(-0.5 * P * P)) * bell)
            out[:, j, i] -= 1j * (x[:, part] @ (np.sin(P * t) * bell))
    return out


def _peer(peer: Peer, x: Real, scales: Real, spent: float) -> Features:
    """What a peer makes of the channels, BLAS and its like on one thread.

    Raises
    ------
    InputError
        If it would take too long at `spent` seconds a coefficient.
    """
    from threadpoolctl import threadpool_limits

    likely = spent * x.size * len(scales)
    if likely > PATIENCE:
        raise InputError(
            f"{peer.name} is left out: at its {1e9 * spent:.0f} ns a coefficient it would take "
            f"{likely:.0f} s a call, more than {PATIENCE:g} s."
        )
    with threadpool_limits(1):
        return peer.features(x, scales)


@dataclass(frozen=True)
class _Judged:
    """What is right at some places of some scales, and the largest coefficient of each of them.

    `narrow` tells which of the scales are narrow beside the recording.
    """

    wanted: Complex
    largest: Real
    scales: NDArray[np.int_]
    places: NDArray[np.int_]
    narrow: NDArray[np.bool_]

    def seen(self, found: Complex, given: Features) -> _Seen:
        """The largest errors of coefficients at these scales and places."""
        wrong = (np.abs(found - self.wanted) / self.largest).max(axis=(0, 2))
        size = sum(one.nbytes for one in given)
        return _Seen(float(wrong.max()), float(wrong[self.narrow].max(initial=0.0)), size)


@dataclass(frozen=True)
class _Seen:
    """Errors at all scales and at narrow ones, and the bytes of the result."""

    error: float
    narrow: float
    size: int


def _our_errors(judged: _Judged, x: Real, scales: Real, tolerance: float, given: Features) -> _Seen:
    """The largest errors of the coefficients whose features were timed.

    These hold no rounding of logarithms.
    """
    plan = plan_for(x.shape[1], scales, Morlet(), tolerance)
    found = plan.coefficients(x)[:, judged.scales][:, :, judged.places]
    return judged.seen(np.asarray(found, dtype=np.complex128), given)


def _peers_errors(judged: _Judged, given: Features) -> _Seen:
    """The largest errors; each scale is allowed a factor of its own."""
    rows = (one[:, judged.scales][:, :, judged.places].astype(np.float64) for one in given)
    magnitudes, phases = rows
    made = np.exp(magnitudes + 1j * phases)
    power = (np.abs(made) ** 2).sum(axis=(0, 2))
    factor = (np.conj(made) * judged.wanted).sum(axis=(0, 2)) / np.where(power > 0, power, 1.0)
    return judged.seen(made * factor[:, None], given)


def _row(name: str, setting: str, size: str, reference: str, found: Timed[_Seen]) -> Row:
    """The row of one way; milliseconds, and the memory beside the result."""
    judged: Timed[Judgement] = Timed(None, refusal=found.refusal)
    if found.judged is not None:
        figures = {f"scales to n / {NARROW}": found.judged.narrow}
        memory = found.peak_bytes - found.judged.size
        judged = Timed((found.judged.error, figures), found.seconds, found.spread, memory)
    return timed_row(name, setting, size, reference, judged, 1e3)
