"""Ways to transform channels, ours and those of others, each with its own conventions undone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.signals.engine.plan import plan_for
from forcelab.signals.wavelets import Morlet

__all__ = ["PEERS", "Peer", "Tables", "features_of", "ours", "peers_of_tapered"]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]
#: Log magnitudes and phases, shape (c, k, n).
Features = tuple[Floats, Floats]

#: Samples whose logarithm and angle are taken at once: they stay in the cache.
BLOCK = 1 << 14


@dataclass(frozen=True)
class Peer:
    """A library that transforms with a Morlet wavelet.

    Parameters
    ----------
    name : str
    module : str
        What is imported.
    transform : callable
        Takes channels, shape (c, n), scales in samples (rising, equally spaced in octaves) and p;
        gives coefficients, shape (c, k, n), but for a factor of each scale.
    setting : str
        How it is called.
    """

    name: str
    module: str
    transform: Callable[[Real, Real, float], Complex]
    setting: str = "as it comes"

    @property
    def installed(self) -> bool:
        """Whether it can be imported."""
        return find_spec(self.module) is not None

    def coefficients(self, x: Real, scales: Real, p: float = 5.0) -> Complex:
        """Transform channels.

        Raises
        ------
        InputError
            If the library is not installed or cannot be loaded.
        """
        if not self.installed:
            raise InputError(f"{self.name} is not installed; pip install 'forcelab[peers]' has it.")
        try:
            return self.transform(x, scales, p)
        except ImportError as error:
            raise InputError(f"{self.name} cannot be loaded: {error}.") from error

    def features(self, x: Real, scales: Real, tables: Tables) -> Features:
        """Log magnitudes and phases of its coefficients."""
        found = self.coefficients(x, scales)
        return features_of(found, tables.of(found.shape, found.real.dtype))


class Tables:
    """Memory for results, kept: the system's handing it out costs as much as some transforms."""

    def __init__(self) -> None:
        self._kept: dict[np.dtype[Any], Features] = {}

    def of(self, shape: tuple[int, ...], kind: np.dtype[Any]) -> Features:
        """Two tables, the same ones as long as the shape is the same."""
        kept = self._kept.get(kind)
        if kept is None or kept[0].shape != shape:
            kept = self._kept[kind] = np.zeros(shape, kind), np.zeros(shape, kind)
        return kept


def ours(x: Real, scales: Real, tolerance: float, tables: Tables) -> Features:
    """Log magnitudes and phases by the engine, without its plan, which is kept."""
    plan = plan_for(x.shape[1], scales, Morlet(), tolerance)
    kind = np.dtype(np.float32 if plan.single else np.float64)
    return plan.log_polar(x, out=tables.of((len(x), len(scales), x.shape[1]), kind))


def features_of(coefficients: Complex, out: Features | None = None) -> Features:
    """Log magnitudes and phases in the cheapest way known, so that no peer loses by it."""
    kind = coefficients.real.dtype
    magnitudes, phases = out or Tables().of(coefficients.shape, kind)
    rows = coefficients.reshape(-1, coefficients.shape[-1])
    into = magnitudes.reshape(rows.shape), phases.reshape(rows.shape)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        for i in range(len(rows)):
            for start in range(0, rows.shape[1], BLOCK):
                part = slice(start, start + BLOCK)
                real, imag = rows[i, part].real.copy(), rows[i, part].imag.copy()
                np.arctan2(imag, real, out=into[1][i, part])
                real *= real
                imag *= imag
                real += imag
                np.log(real, out=real)
                np.multiply(real, kind.type(0.5), out=into[0][i, part])
    return magnitudes, phases


def _pywavelets(x: Real, scales: Real, p: float) -> Complex:
    """cmorB-C with B = 2 and C = p / 2 pi is ours but for a constant; by FFT, the faster way."""
    import pywt

    wavelet = pywt.ContinuousWavelet(f"cmor2-{p / (2 * np.pi):.17g}")
    found, _ = pywt.cwt(x, scales, wavelet, method="fft", axis=-1)
    return np.asarray(np.moveaxis(found, 0, 1))


def _ssqueezepy(x: Real, scales: Real, p: float, padding: str = "reflect") -> Complex:
    """With its own settings: single precision, padded to a power of two, threads.

    All channels in one call.
    """
    import ssqueezepy

    wavelet = ("morlet", {"mu": p})
    found = ssqueezepy.cwt(x, wavelet, scales=scales, l1_norm=False, padtype=padding)[0]
    return np.asarray(found)


def _one_by_one(x: Real, scales: Real, p: float) -> Complex:
    """ssqueezepy, as whoever has one channel at a time calls it."""
    return np.concatenate([_ssqueezepy(one[np.newaxis], scales, p, "zero") for one in x])


def _fcwt(x: Real, scales: Real, p: float) -> Complex:
    """Its Morlet has p = 2 pi times its bandwidth; a single thread, as for all others."""
    import fcwt

    # Its C++ side does not keep the wavelet alive.
    wavelet = fcwt.Morlet(p / (2 * np.pi))
    scale = fcwt.Scales(
        wavelet,
        fcwt.FCWT_LOGSCALES,
        1_000_000,
        1e6 * p / (2 * np.pi * scales[-1]),
        1e6 * p / (2 * np.pi * scales[0]),
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


def peers_of_tapered(channels: int) -> tuple[Peer, ...]:
    """The same for channels that are 0 beyond their ends, which ssqueezepy is told.

    It is measured with one call for all channels and, where there are several, with one for each.
    """
    zeros = "zeros beyond the ends"
    padded = Peer("ssqueezepy", "ssqueezepy", partial(_ssqueezepy, padding="zero"), zeros)
    one_by_one = Peer("ssqueezepy, a call a channel", "ssqueezepy", _one_by_one, zeros)
    known = tuple(padded if peer.name == padded.name else peer for peer in PEERS)
    return (*known, one_by_one) if channels > 1 and one_by_one.installed else known
