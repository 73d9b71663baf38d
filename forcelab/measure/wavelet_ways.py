"""Ways to transform channels, ours and those of others, each with its own conventions undone.

Each library is called as its own documentation advises who wants many transforms of one kind, in
its default precision, on one thread. What it keeps from call to call, it keeps here too.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.signals.cwt_blocks import SINGLE
from forcelab.signals.cwt_engine import Plan, plan_for
from forcelab.signals.wavelets import Morlet

__all__ = [
    "PEERS",
    "Library",
    "Peer",
    "features_of",
    "kept_wavelet",
    "ours",
    "ours_anew",
    "peers_of_tapered",
]

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]
Complex = NDArray[np.complexfloating[Any, Any]]
#: Log magnitudes and phases, shape (c, k, n).
Features = tuple[Floats, Floats]

#: Of the Morlet wavelet that everybody takes, :class:`Morlet` by default.
P = 5.0
#: How many widths of the Gaussian a wavelet reaches until it is below 1e-7 of its peak.
REACH = 5.7


@dataclass(frozen=True)
class Library:
    """A library by its name, and the module that is imported."""

    name: str
    module: str

    @property
    def installed(self) -> bool:
        """Whether it can be imported."""
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
    """A library that transforms with a Morlet wavelet.

    Parameters
    ----------
    name, module : str
        As of :class:`Library`.
    transform : callable
        Takes channels, shape (c, n), and scales in samples (rising, equally spaced in octaves);
        gives coefficients, shape (c, k, n), but for a factor of each scale.
    setting : str
        How it is called.
    """

    transform: Callable[[Real, Real], Complex]
    setting: str = "as it comes"

    def coefficients(self, x: Real, scales: Real) -> Complex:
        """Transform channels.

        Raises
        ------
        InputError
            If the library is not installed or cannot be loaded.
        """
        self.check()
        try:
            return self.transform(x, scales)
        except ImportError as error:
            raise InputError(f"{self.name} cannot be loaded: {error}.") from error

    def features(self, x: Real, scales: Real) -> Features:
        """Log magnitudes and phases of its coefficients."""
        return features_of(self.coefficients(x, scales))


def ours(x: Real, scales: Real, tolerance: float) -> Features:
    """Log magnitudes and phases by the engine, without its plan, which is kept."""
    return plan_for(x.shape[1], scales, Morlet(), tolerance).log_polar(x)


def ours_anew(x: Real, scales: Real, tolerance: float) -> Features:
    """The same with a plan that is made for this one call."""
    single = tolerance >= SINGLE
    return Plan(x.shape[1], scales.tolist(), Morlet(), tolerance, single).log_polar(x)


def features_of(coefficients: Complex) -> Features:
    """Log magnitudes and phases as whoever has an array of coefficients writes them."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        return np.log(np.abs(coefficients)), np.angle(coefficients)


def _pywavelets(x: Real, scales: Real) -> Complex:
    """cmorB-C with B = 2 and C = p / 2 pi is ours but for a constant; by FFT, the faster way."""
    import pywt

    wavelet = pywt.ContinuousWavelet(f"cmor2-{P / (2 * np.pi):.17g}")
    found, _ = pywt.cwt(x, scales, wavelet, method="fft", axis=-1)
    return np.asarray(np.moveaxis(found, 0, 1))


@cache
def kept_wavelet(_part: int = 0, dtype: str = "float32") -> Any:
    """The wavelet as an object of ssqueezepy, which keeps the spectra of its last scales.

    So there is one for each part of the scales that is asked for by itself.
    """
    import ssqueezepy

    with _one_thread_of_ssqueezepy():
        return ssqueezepy.Wavelet(("morlet", {"mu": P}), dtype=dtype)


def _ssqueezepy(x: Real, scales: Real, padding: str = "reflect", *, anew: bool = False) -> Complex:
    """As its performance guide advises: all channels in one call, with a wavelet that is kept.

    Single precision, normalisation and padding to a power of two are its defaults. With `anew`
    the wavelet is given by its name, as in its first examples, and sampled in each call.
    """
    import ssqueezepy

    wavelet = ("morlet", {"mu": P}) if anew else kept_wavelet()
    with _one_thread_of_ssqueezepy():
        return np.asarray(ssqueezepy.cwt(x, wavelet, scales=scales, padtype=padding)[0])


def _ssqueezepy_exact(x: Real, scales: Real) -> Complex:
    """As whoever needs our error would call it: in double precision, with zeros at the end.

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
            wavelet = kept_wavelet(int(part[0]), "float64")
            found, _ = ssqueezepy.cwt(padded, wavelet, scales=scales[part], padtype=None)
            out[:, part] = found[:, :, :n]
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
    told = partial(_ssqueezepy, padding="zero")
    kept = Peer("ssqueezepy", "ssqueezepy", told, zeros)
    anew = Peer("ssqueezepy, wavelet anew", "ssqueezepy", partial(told, anew=True), zeros)
    known = tuple(kept if peer.name == kept.name else peer for peer in PEERS)
    exact = Peer("ssqueezepy, as exact", "ssqueezepy", _ssqueezepy_exact, "double, ends padded")
    return (*known, anew, exact) if anew.installed else known
