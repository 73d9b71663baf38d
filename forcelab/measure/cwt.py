"""Error against run time of the wavelet transform: the engine's tolerances beside other libraries.

All are measured on made-up forces, each on one thread, with its own conventions undone, called as
its documentation advises for many transforms of one kind, in its default precision. All give log
magnitude and phase of each coefficient: ours directly, of others ``np.log(np.abs(W))`` and
``np.angle(W)`` are taken. What a library keeps for the next call is kept here too (our plan,
ssqueezepy's wavelet); both are measured with that made anew as well. The memory is that beside the
result.

ssqueezepy errs at the widest scales alone: it pads no further than to a power of two, of which a
wavelet as wide as the recording reaches around the whole; and with its own setting, reflected ends,
from scales of a hundredth of the recording on, by 1 % and more. So it is told of zeros beyond the
ends, which is what the channels have, and the error up to a sixteenth of the recording stands
beside that at all scales. What our error costs with it is a row of its own.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Flags, Floats, Real
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.labels import Segment, Segments
from forcelab.measure.rows import Judgement, Row, Table, timed_row, with_front
from forcelab.measure.timing import Method, Timed, timed_methods
from forcelab.signals.cwt import usual_scales
from forcelab.signals.cwt_blocks import SINGLE, TOLERANCES
from forcelab.signals.cwt_engine import Plan, plan_for
from forcelab.signals.wavelets import Morlet

CHANNELS = tuple(Channel(f"f{axis}{sensor}", "N") for sensor in (1, 2) for axis in "xyz")
ACTIONS = ("still", "grab", "hold", "release")


def made_up_demonstration(seconds: float, rate: float, seed: int) -> tuple[Demonstration, Segments]:
    """Grabs, holds and releases, one after another, with tremor, noise and knocks."""
    random = np.random.default_rng(seed)
    starts: list[float] = []
    codes: list[int] = []
    clock = 0.0
    while clock < seconds:
        starts.append(clock)
        codes.append(len(codes) % 4)
        clock += random.uniform(0.2, 0.5) if codes[-1] % 2 else random.uniform(0.8, 1.6)
    n = int(clock * rate)
    times = np.arange(n) / rate
    edges = [*starts, clock]
    grips = np.array([0.0, 0.0, 1.0, 1.0, 0.0])
    knots = [grips[code] for code in codes] + [grips[(codes[-1] + 1) % 4]]
    grip = np.interp(times, edges, knots)
    tremor = 0.05 * grip * np.sin(2 * np.pi * (9 * times + 0.2 * np.sin(times)))
    columns = []
    for _ in CHANNELS:
        knocks = np.zeros(n)
        knocks[np.searchsorted(times, edges[1:-1])] = random.uniform(0.2, 1.0, len(edges) - 2)
        rung = np.convolve(knocks, np.exp(-np.arange(40) / 8) * np.sin(np.arange(40)))[:n]
        size = random.uniform(2.0, 8.0)
        noise = 0.005 * random.standard_normal(n)
        drift = 0.02 * np.cumsum(random.standard_normal(n)) / np.sqrt(rate)
        columns.append(size * (grip + tremor) + rung + noise + drift)
    segments = tuple(
        Segment(start, end, ACTIONS[code])
        for start, end, code in zip(edges[:-1], edges[1:], codes, strict=True)
        if end <= times[-1]
    )
    name = f"made up {seed}"
    return Demonstration(name, "made up", times, np.stack(columns, axis=1), CHANNELS), segments


def made_up_forces(n: int, channels: int) -> Real:
    """The first `n` samples of `channels` such forces at 1 kHz, shape (n, channels)."""
    whole = made_up_demonstration(n / 1000.0 + 1.0, 1000.0, 0)[0].signals
    return whole[:n, np.arange(channels) % whole.shape[1]]


Complex = NDArray[np.complexfloating[Any, Any]]
#: Log magnitudes and phases, shape (c, k, n).
Features = tuple[Floats, Floats]

#: Of the Morlet wavelet that all libraries take, :class:`Morlet` by default.
P = 5.0
#: How many widths of the Gaussian a wavelet reaches until it is below 1e-7 of its peak.
REACH = 5.7


@dataclass(frozen=True)
class Library:
    """A library that is measured beside ours, here or by the benchmarks for developers."""

    name: str
    module: str  # which is imported

    @property
    def installed(self) -> bool:
        return find_spec(self.module) is not None

    def check(self) -> None:
        """Raise an `InputError` if it is not installed."""
        if not self.installed:
            raise InputError(
                f"{self.name} is not installed ({self.module}); pip install 'forcelab[peers]' has "
                f"it."
            )


@dataclass(frozen=True)
class Peer(Library):
    """A library that transforms with a Morlet wavelet."""

    #: Takes channels, shape (c, n), and scales in samples (rising, equally spaced in octaves);
    #: gives coefficients, shape (c, k, n), but for a factor of each scale.
    transform: Callable[[Real, Real], Complex]
    setting: str = "as it comes"  # how it is called

    def coefficients(self, x: Real, scales: Real) -> Complex:
        self.check()
        try:
            return self.transform(x, scales)
        except ImportError as error:
            raise InputError(f"{self.name} cannot be loaded: {error}.") from error

    def features(self, x: Real, scales: Real) -> Features:
        """Log magnitudes and phases of its coefficients."""
        return features_of(self.coefficients(x, scales))


def our_features(x: Real, scales: Real, tolerance: float) -> Features:
    """Log magnitudes and phases by the engine, without its plan, which is kept."""
    return plan_for(x.shape[1], scales, Morlet(), tolerance).log_polar(x)


def our_features_anew(x: Real, scales: Real, tolerance: float) -> Features:
    """The same with a plan that is made for this one call."""
    single = tolerance >= SINGLE
    return Plan(x.shape[1], scales.tolist(), Morlet(), tolerance, single).log_polar(x)


def features_of(coefficients: Complex) -> Features:
    """Log magnitudes and phases of an array of coefficients, without care for zeros."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return np.log(np.abs(coefficients)), np.angle(coefficients)


def _pywavelets(x: Real, scales: Real) -> Complex:
    """cmorB-C with B = 2 and C = p / 2 pi is ours but for a constant; by FFT, the faster way."""
    import pywt

    wavelet = pywt.ContinuousWavelet(f"cmor2-{P / (2 * np.pi):.17g}")
    coefficients, _ = pywt.cwt(x, scales, wavelet, method="fft", axis=-1)
    return np.asarray(np.moveaxis(coefficients, 0, 1))


@cache
def cached_wavelet(_part: int = 0, dtype: str = "float32") -> Any:
    """The wavelet as an object of ssqueezepy, which keeps the spectra of its last scales.

    So there is one for each part of the scales that is asked for by itself.
    """
    import ssqueezepy

    with _one_thread_of_ssqueezepy():
        return ssqueezepy.Wavelet(("morlet", {"mu": P}), dtype=dtype)


def _ssqueezepy(
    x: Real, scales: Real, padding: str = "reflect", *, resampled: bool = False
) -> Complex:
    """As its performance guide advises: all channels in one call, with a wavelet that is kept.

    Single precision, normalisation and padding to a power of two are its defaults. With `resampled`
    the wavelet is given by its name, as in its first examples, and sampled in each call.
    """
    import ssqueezepy

    wavelet = ("morlet", {"mu": P}) if resampled else cached_wavelet()
    with _one_thread_of_ssqueezepy():
        return np.asarray(ssqueezepy.cwt(x, wavelet, scales=scales, padtype=padding)[0])


def _ssqueezepy_exact(x: Real, scales: Real) -> Complex:
    """As a user who needs our error would call it: in double precision, with zeros at the end.

    As many zeros as the wavelets reach, four scales at a time: it takes no fewer, and with all at
    once the widest would decide how many. What is given back is in single precision, as ours is.
    """
    import ssqueezepy
    from scipy.fft import next_fast_len

    n = x.shape[1]
    out = np.empty((len(x), len(scales), n), dtype=np.complex64)
    with _one_thread_of_ssqueezepy():
        for part in np.array_split(np.arange(len(scales)), max(1, len(scales) // 4)):
            length = next_fast_len(n + math.ceil(REACH * scales[part[-1]]))
            padded = np.pad(x, ((0, 0), (0, length - n)))
            wavelet = cached_wavelet(int(part[0]), "float64")
            coefficients, _ = ssqueezepy.cwt(padded, wavelet, scales=scales[part], padtype=None)
            out[:, part] = coefficients[:, :, :n]
    return out


@contextmanager
def _one_thread_of_ssqueezepy() -> Iterator[None]:
    """Its own switch, which it looks at in every call."""
    before = os.environ.get("SSQ_PARALLEL")
    os.environ["SSQ_PARALLEL"] = "0"
    try:
        yield
    finally:
        if before is None:
            del os.environ["SSQ_PARALLEL"]
        else:
            os.environ["SSQ_PARALLEL"] = before


def _fcwt(x: Real, scales: Real) -> Complex:
    """Its Morlet has p = 2 pi times its bandwidth; a single thread, as for all others.

    In version 0.1.18 all rows but the first are wrong, and are so of its own ``cwt`` as well.
    """
    import fcwt

    # Its C++ side does not keep the wavelet alive.
    wavelet = fcwt.Morlet(P / (2 * np.pi))
    scale = fcwt.Scales(
        wavelet,
        fcwt.FCWT_LOGSCALES,
        1_000_000,
        1e6 * P / (2 * np.pi * scales[-1]),
        1e6 * P / (2 * np.pi * scales[0]),
        len(scales),
    )
    engine = fcwt.FCWT(wavelet, 1, False, False)
    out = np.zeros((len(x), len(scales), x.shape[1]), dtype=np.complex64)
    for channel, rows in zip(x.astype(np.float32), out, strict=True):
        engine.cwt(np.ascontiguousarray(channel), scale, rows)
    return out


#: Those that are compared with ours, as they come.
PEERS = (
    Peer("PyWavelets", "pywt", _pywavelets),
    Peer("ssqueezepy", "ssqueezepy", _ssqueezepy),
    Peer("fCWT", "fcwt", _fcwt),
)


def peers_of_tapered() -> tuple[Peer, ...]:
    """The same for channels that are 0 beyond their ends, which ssqueezepy is told.

    It is measured with a wavelet that is kept, with one that is sampled in each call, and so that
    it errs no more than ours.
    """
    zeros = "zeros beyond the ends"
    padded = partial(_ssqueezepy, padding="zero")
    cached = Peer("ssqueezepy", "ssqueezepy", padded, zeros)
    resampling = Peer(
        "ssqueezepy, wavelet anew", "ssqueezepy", partial(padded, resampled=True), zeros
    )
    peers = tuple(cached if peer.name == cached.name else peer for peer in PEERS)
    exact = Peer("ssqueezepy, as exact", "ssqueezepy", _ssqueezepy_exact, "double, ends padded")
    return (*peers, resampling, exact) if resampling.installed else peers


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
#: Seconds: what all repetitions of one method may take, and above which a peer is left out.
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
            x, repetitions = tapered_forces(n, channels), 1 if quick else 5
            rows += yield from measure_transforms(x, spacing, repetitions, spent=spent)
    if not quick:
        rows += yield from measure_long_recording(tapered_forces(LONG, 1), np.array(LONG_SCALES))
    return Table(
        "Wavelet transform to log magnitude and phase",
        "error (of largest)",
        "CPU ms",
        with_front(rows),
    )


def tapered_forces(n: int, channels: int) -> Real:
    """Forces that rise from nothing and end in nothing: all conventions for ends agree on them."""
    x = made_up_forces(n, channels).T
    x = x - np.median(x, axis=1, keepdims=True)
    edge = max(1, n // 8)
    rise = np.sin(0.5 * np.pi * np.arange(edge) / edge) ** 2
    x[:, :edge] *= rise
    x[:, -edge:] *= rise[::-1]
    return np.ascontiguousarray(x / np.abs(x).max(axis=1, keepdims=True))


def measure_transforms(
    x: Real,
    spacing: float,
    repetitions: int,
    tolerances: Sequence[float] = tuple(TOLERANCES),
    spent: Spent | None = None,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure all methods on some channels.

    The error is the largest difference of a coefficient from the direct sum at some places of some
    scales, relative to the largest coefficient of its scale and channel. Peers are first multiplied
    by the one number for each scale that suits them best, for their conventions differ.

    `x` (c, n): zero at both ends; `spacing`: of the scales from 2 samples to n, in octaves;
    `repetitions`: fewer of what takes long; `spent`: seconds a coefficient that peers have taken so
    far, to which theirs are added; a peer that would take too long by it is refused.
    """
    scales = usual_scales(x.shape[1], spacing=spacing)
    if x.size * len(scales) > MANY:
        tolerances = [tolerance for tolerance in tolerances if tolerance == 1e-7]
    spent = {} if spent is None else spent
    peers = peers_of_tapered()
    text = f"{len(scales)} scales ({spacing:g} octaves apart)"
    return (yield from _measure(x, scales, text, repetitions, tolerances, peers, spent))


def measure_long_recording(x: Real, scales: Real) -> Generator[Progress, None, tuple[Row, ...]]:
    """Measure the engine alone, at tolerance 1e-7, once."""
    text = f"scales {', '.join(f'{scale:g}' for scale in scales.tolist())}"
    return (yield from _measure(x, scales, text, 1, (1e-7,), (), {}))


def _measure(
    x: Real,
    scales: Real,
    scales_text: str,
    repetitions: int,
    tolerances: Sequence[float],
    peers: Sequence[Peer],
    spent: Spent,
) -> Generator[Progress, None, tuple[Row, ...]]:
    """Rows of the engine's tolerances, then of peers."""
    c, n = x.shape
    places = np.unique(np.linspace(0, n - 1, PLACES).astype(int))
    wide = np.flatnonzero(scales >= FIRST)
    judged = wide[np.unique(np.linspace(0, len(wide) - 1, LOOKED).astype(int))]
    yield Progress(0, 1, "direct sums")
    expected = direct_sums(x, scales[judged], places)
    size = f"{n} samples x {c} channels x {scales_text}"
    reference = (
        f"direct sums at {len(places)} places of {len(judged)} scales from {FIRST:g} samples on"
    )
    rows = our_features(x, scales, 1e-7)[0]
    largest = np.exp(rows[:, judged].max(axis=2, keepdims=True).astype(np.float64))
    reference_values = _Reference(expected, largest, judged, places, scales[judged] <= n / NARROW)
    named = [("forcelab", tolerance, our_features) for tolerance in tolerances]
    if 1e-7 in tolerances and peers:
        named.append(("forcelab, plan anew", 1e-7, our_features_anew))
    methods = [
        Method(
            f"{name}, {tolerance:g}",
            partial(run, x, scales, tolerance),
            partial(_our_errors, reference_values, x, scales, tolerance),
        )
        for name, tolerance, run in named
    ]
    methods += [
        Method(
            peer.name,
            partial(_peer, peer, x, scales, spent.get(peer.name, 0.0)),
            partial(_peer_errors, reference_values),
        )
        for peer in peers
    ]
    for peer in peers:  # what is loaded and compiled at first is no method's memory
        with suppress(InputError):
            peer.coefficients(x[:, :1024], scales[:8])
    timed = yield from timed_methods(methods, repetitions, longest=ENOUGH)
    labels = [(name, f"tolerance {tolerance:g}") for name, tolerance, _ in named]
    labels += [(peer.name, peer.setting) for peer in peers]
    for peer, timing in zip(peers, timed[len(named) :], strict=True):
        if not timing.refusal:
            spent[peer.name] = timing.seconds / (x.size * len(scales))
    return tuple(
        _row(name, setting, size, reference, timing)
        for (name, setting), timing in zip(labels, timed, strict=True)
    )


def direct_sums(x: Real, scales: Real, places: NDArray[np.int_]) -> NDArray[np.complex128]:
    """``a^-1/2 sum_n x_n conj(psi((n - b) / a))`` as it stands, of channels that are 0 outside.

    Gives (c, len(scales), len(places)).
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
    """What a peer makes of the channels, BLAS and its like on one thread."""
    from threadpoolctl import threadpool_limits

    expected = spent * x.size * len(scales)
    if expected > PATIENCE:
        raise InputError(
            f"{peer.name} is left out: at its {1e9 * spent:.0f} ns a coefficient it would take "
            f"{expected:.0f} s a call, more than {PATIENCE:g} s."
        )
    with threadpool_limits(1):
        return peer.features(x, scales)


@dataclass(frozen=True)
class _Reference:
    """What is right at some places of some scales, and the largest coefficient of each of them."""

    expected: NDArray[np.complex128]  # (c, scales, places)
    largest: Real
    scales: NDArray[np.int_]
    places: NDArray[np.int_]
    narrow: Flags  # which of the scales are narrow beside the recording

    def errors(self, coefficients: Complex, features: Features) -> _Errors:
        """The largest errors of coefficients at these scales and places."""
        errors = (np.abs(coefficients - self.expected) / self.largest).max(axis=(0, 2))
        size = sum(part.nbytes for part in features)
        return _Errors(float(errors.max()), float(errors[self.narrow].max(initial=0.0)), size)


@dataclass(frozen=True)
class _Errors:
    """Errors at all scales and at narrow ones, and the bytes of the result."""

    error: float
    narrow: float
    size: int


def _our_errors(
    reference: _Reference, x: Real, scales: Real, tolerance: float, features: Features
) -> _Errors:
    """Errors of the coefficients whose features were timed, without the rounding of logarithms."""
    plan = plan_for(x.shape[1], scales, Morlet(), tolerance)
    coefficients = plan.coefficients(x)[:, reference.scales][:, :, reference.places]
    return reference.errors(np.asarray(coefficients, dtype=np.complex128), features)


def _peer_errors(reference: _Reference, features: Features) -> _Errors:
    """The largest errors; each scale is allowed a factor of its own."""
    magnitudes, phases = (
        part[:, reference.scales][:, :, reference.places].astype(np.float64) for part in features
    )
    coefficients = np.exp(magnitudes + 1j * phases)
    power = (np.abs(coefficients) ** 2).sum(axis=(0, 2))
    product = (np.conj(coefficients) * reference.expected).sum(axis=(0, 2))
    factor = product / np.where(power > 0, power, 1.0)
    return reference.errors(coefficients * factor[:, None], features)


def _row(name: str, setting: str, size: str, reference: str, timed: Timed[_Errors]) -> Row:
    """The row of one method; milliseconds, and the memory beside the result."""
    judged: Timed[Judgement] = Timed(None, refusal=timed.refusal)
    if timed.judged is not None:
        figures = {f"scales to n / {NARROW}": timed.judged.narrow}
        memory = timed.peak_bytes - timed.judged.size
        judged = Timed((timed.judged.error, figures), timed.seconds, timed.spread, memory)
    return timed_row(name, setting, size, reference, judged, 1e3)
