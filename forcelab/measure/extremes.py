"""Extreme inputs with known answers: which transforms give them, ours and other libraries'."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Real
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.cwt import PEERS, Features, Peer, features_of
from forcelab.measure.timing import machine
from forcelab.resources import versions
from forcelab.signals.conditioning import condition
from forcelab.signals.cwt import cwt
from forcelab.signals.cwt_engine import plan_for

Complex = NDArray[np.complexfloating[Any, Any]]
#: Gives coefficients and features, shape (1, k, n), of one channel.
Transformer = Callable[[NDArray[Any], Real], tuple[Complex, Features]]

#: Largest error that is still right, of the largest coefficient of its scale.
RIGHT = 0.01
#: What libraries raise when they cannot go on.
RAISED = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
)
#: Others are only judged so many scales away from the ends, where their conventions do not count.
AWAY = 4.5
SOME = 4.5 * 2.5 ** np.arange(4.0)  # some libraries ask for equal ratios
N = 900


@dataclass(frozen=True)
class Case:
    name: str
    x: NDArray[Any]  # (1, n)
    scales: Real


@dataclass(frozen=True)
class Verdicts:
    """Right, wrong, not finite or raised: of each case by each way.

    Finite is what cannot be judged: others so near to the ends that conventions differ.
    """

    methods: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]  # a case's name, and a word for each way
    left_out: tuple[str, ...]  # sentences about those that are not installed

    def cells(self) -> list[list[str]]:
        return [["", *self.methods], *([name, *words] for name, words in self.rows)]

    def to_json(self) -> dict[str, Any]:
        """The table, the machine and the versions as plain values."""
        return {
            "title": "Extreme inputs",
            "machine": machine(),
            "versions": versions(),
            "rows": [
                {"name": name, **dict(zip(self.methods, words, strict=True))}
                for name, words in self.rows
            ],
        }


def _cases() -> tuple[Case, ...]:
    """All cases; vibration and noise are such that every scale has something to answer."""
    random = np.random.default_rng(0)
    noise = random.standard_normal(N)
    t = np.arange(N)

    def impulse(place: int) -> Real:
        return np.where(t == place, 1.0, 0.0)

    gaps = noise.copy()
    gaps[[100, 101, 102, 500]] = np.nan, np.inf, -np.inf, np.nan
    wide = np.zeros((N, 3))
    wide[:, 1] = noise
    frozen = noise.copy()
    frozen.flags.writeable = False
    named: list[tuple[str, NDArray[Any]]] = [
        ("zeros", np.zeros(N)),
        *((f"constant {value:g}", np.full(N, value)) for value in (1e-300, 7.0, 1e300)),
        ("1e-6 of vibration on 1e9", 1e9 + 1e-6 * np.round(20 * np.sin(t / 15.0))),
        *((f"amplitude {size:g}", noise * size) for size in (1e-300, 1e-30, 1e30, 1e300)),
        ("denormal numbers", noise * 1e-310),
        *((f"an impulse at {place}", impulse(place)) for place in (0, N // 2, N - 1)),
        ("a step", np.where(t < N // 2, 0.0, 1.0)),
        ("a ramp of 1e6", np.linspace(0.0, 1e6, N)),
        ("int16 counts", np.round(8000 * noise).astype(np.int16)),
        ("big-endian", noise.astype(">f8")),
        ("single precision", noise.astype(np.float32)),
        ("every third of a table", wide[:, 1]),
        ("read-only", frozen),
        ("NaN, infinities and a gap", gaps),
        ("all missing", np.full(N, np.nan)),
        ("a prime length", noise[:883]),
    ]
    cases = [Case(name, x[np.newaxis], SOME) for name, x in named]
    cases += [
        Case(f"{n} samples", noise[np.newaxis, :n], np.geomspace(4.5, 10.0 * n, 3))
        for n in (1, 2, 3, 5, 8)
    ]
    cases.append(Case("scales to ten times the signal", noise[np.newaxis], SOME * 100))
    return tuple(cases)


CASES = _cases()


def tabulate_extremes(cases: Sequence[Case] = CASES) -> Generator[Progress, None, Verdicts]:
    """Judge ours and all peers that are installed."""
    methods: dict[str, tuple[Transformer, bool]] = {
        "forcelab 1e-7": (_engine(1e-7), True),
        "forcelab 1e-14": (_engine(1e-14), True),
        "forcelab, plain": (_plain, True),
    }
    tried = {peer.name: _try_peer(peer) for peer in PEERS}
    left_out = [reason for reason in tried.values() if isinstance(reason, str)]
    methods |= {
        name: (method, False) for name, method in tried.items() if not isinstance(method, str)
    }
    rows = []
    for i, case in enumerate(cases):
        yield Progress(i, len(cases), case.name)
        expected = _expected(case)
        words = [
            _verdict(transform, case, expected, edges) for transform, edges in methods.values()
        ]
        rows.append((case.name, tuple(words)))
    return Verdicts(tuple(methods), tuple(rows), tuple(left_out))


def _try_peer(peer: Peer) -> Transformer | str:
    """A peer's way, or the sentence why there is none."""
    try:
        return _calibrated(peer.coefficients)
    except InputError as error:
        return str(error)


def _engine(tolerance: float) -> Transformer:
    def transform(x: NDArray[Any], scales: Real) -> tuple[Complex, Features]:
        ready = condition(x)
        plan = plan_for(ready.values.shape[1], scales, tolerance=tolerance)
        coefficients = plan.coefficients(ready.values).astype(np.complex128)
        magnitudes, phases = plan.log_polar(ready.values)
        exponent = ready.exponent[:, None, None]
        for part in (coefficients.real, coefficients.imag):
            np.ldexp(part, exponent, out=part)
        return coefficients, (magnitudes + exponent * math.log(2.0), phases)

    return transform


def _plain(x: NDArray[Any], scales: Real) -> tuple[Complex, Features]:
    return cwt(x[0], scales)[np.newaxis], _engine(1e-14)(x, scales)[1]


def _factors(coefficients: Callable[[Real, Real], Complex], scales: Real) -> Complex:
    """By what a peer's coefficients of common noise are multiplied to suit best, per scale."""
    margin = int(AWAY * scales[-1])
    common = np.random.default_rng(1).standard_normal((1, 2 * margin + N))
    inner = slice(margin, margin + N)
    peer = coefficients(common, scales)[0, :, inner].astype(np.complex128)
    right = cwt(common[0], scales)[:, inner]
    power = np.maximum((np.abs(peer) ** 2).sum(axis=1), np.finfo(np.float64).tiny)
    return np.asarray((np.conj(peer) * right).sum(axis=1) / power)


def _calibrated(coefficients: Callable[[Real, Real], Complex]) -> Transformer:
    """A peer's coefficients with the factor of each scale that suits it on common noise."""

    @cache
    def factors(scales: tuple[float, ...]) -> Complex:
        return _factors(coefficients, np.array(scales))

    def transform(x: NDArray[Any], scales: Real) -> tuple[Complex, Features]:
        factor = factors(tuple(scales.tolist()))
        rows = coefficients(x, scales)
        with np.errstate(all="ignore"):
            return rows * factor[:, None], features_of(rows)

    factors(tuple(SOME.tolist()))  # raises where the library is missing
    return transform


def _expected(case: Case) -> Complex:
    """The direct sum over the held and bridged signal, from its definition."""
    ready = condition(case.x)
    x, n = ready.values[0], ready.values.shape[1]
    out = np.empty((len(case.scales), n), dtype=np.complex128)
    for j, a in enumerate(case.scales.tolist()):
        reach = int(np.ceil(9.0 * a))
        t = np.arange(-reach, reach + 1) / a
        psi = np.pi**-0.25 * (np.exp(5j * t) - np.exp(-12.5)) * np.exp(-0.5 * t * t) / np.sqrt(a)
        # As a difference from the end values: what is constant gives nothing but rounding.
        out[j] = np.correlate(np.pad(x, reach, mode="edge"), psi, mode="valid")
    for part in (out.real, out.imag):
        np.ldexp(part, int(ready.exponent[0]), out=part)
    return out


def _verdict(transform: Transformer, case: Case, expected: Complex, edges: bool) -> str:
    try:
        with np.errstate(all="ignore"):
            coefficients, features = transform(case.x, case.scales)
    except RAISED:
        return "raised"
    if not all(np.isfinite(rows).all() for rows in (coefficients, *features)):
        return "not finite"
    n = case.x.shape[1]
    index = np.arange(n)
    judged_any = False
    for j, a in enumerate(case.scales.tolist()):
        margin = 0 if edges else AWAY * a
        judged = (index >= margin) & (index <= n - 1 - margin)
        judged_any |= bool(judged.any())
        # Scaled by a power of two first: the size of numbers near 1e300 overflows.
        largest = max(np.abs(expected[j].real).max(), np.abs(expected[j].imag).max())
        power = -int(np.frexp(largest)[1]) if largest > 0 else 0
        errors = _scaled(
            coefficients[0, j, judged].astype(np.complex128) - expected[j, judged], power
        )
        rounding = 1e-13 * np.sqrt(a) if largest > 0 else 0.0
        if judged.any() and np.abs(errors).max() > max(RIGHT, rounding):
            return "wrong"
    return "right" if judged_any else "finite"


def _scaled(values: Complex, power: int) -> Complex:
    return np.asarray(np.ldexp(values.real, power) + 1j * np.ldexp(values.imag, power))
