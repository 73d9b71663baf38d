"""Features of every time step: wavelets, Gaussian windows, and distances from the extremes.

* Wavelets: with q channels and k scales a vector is ``[M_1 .. M_q, phi_1 .. phi_q]``, where ``M_i``
  and ``phi_i`` are the k log magnitudes and the k phases of channel i.
* Windows: a wavelet has zero mean and cannot see how hard one grips; level, slope and strength in
  Gaussian windows, from milliseconds to seconds, can. In a window of standard deviation s around a
  time step the *level* is the weighted mean of the channel, the *slope* its derivative and the
  *rms* the weighted standard deviation. A vector holds the blocks level, slope and rms, each of
  them the k windows of channel 1, then those of channel 2, and so on; where each demonstration's
  own amplitude matters, the same blocks once more in units of it.
* Peaks: a Gaussian window looks to both sides alike and cannot tell a force that has peaked from
  one that is about to. Each channel's smoothed level is compared with its highest and its lowest
  one within some seconds before, and within as many after. A vector holds the blocks highest
  before, highest after, lowest before and lowest after, each of them the k spans of channel 1, then
  those of channel 2, and so on.
* One's own: what a function from outside forcelab makes of the channels
  (:mod:`forcelab.recognition.plugins`). They come last.

Beyond its ends a recording goes on with its end values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from forcelab.arrays import Real, Whole
from forcelab.errors import InputError
from forcelab.recognition.plugins import load_plugin, naming_plugin
from forcelab.signals.conditioning import SPIKE, bridge, condition
from forcelab.signals.wavelets import Wavelet

#: What is known of each channel in each window.
KINDS = ("level", "slope", "rms")
#: Standard deviations of a window after which its weight, 3e-4 of its middle's, is left out.
REACH = 4.0
#: Share of the samples that lie below what counts as the size of a channel's movements.
SIZE = 0.95
#: Seconds at the beginning over which a channel is at rest, as nothing is held yet.
REST = 0.2


def own_amplitude(channels: Real, rate: float) -> tuple[Real, Real]:
    """Level at rest and size of the movements of each channel (q, n): two arrays (q,).

    The median of the first 0.2 s, and the 95th percentile of the distances from it, 1 for a channel
    that never moves. Rare peaks leave both alone.
    """
    rest = np.median(channels[:, : max(1, round(REST * rate))], axis=1)
    size = np.quantile(np.abs(channels - rest[:, None]), SIZE, axis=1)
    return rest, np.where(size > 0, size, 1.0)


def window_features(
    channels: Real,
    rate: float,
    windows: Sequence[float],
    places: Whole,
    amplitude: str = "absolute",
) -> Real:
    """Level, slope and rms of channels (q, n) at the samples `places` (m,): (m, 3 q k), both 6 q k.

    NaN and infinity are bridged. `windows` are k standard deviations in seconds; `amplitude` is
    "absolute", in the channels' units, "own", in units of each channel's own amplitude, or "both".
    Finite for channels below 1e150; slopes are per second.
    """
    ready = np.stack([bridge(channel) for channel in channels])
    q, k = len(ready), len(windows)
    absolute = np.empty((len(places), len(KINDS), q, k))
    for i, channel in enumerate(ready):
        for kind, values in enumerate(window_moments(channel, rate, windows, places)):
            absolute[:, kind, i] = values.T
    blocks = [absolute] if amplitude != "own" else []
    if amplitude != "absolute":
        rest, size = own_amplitude(ready, rate)
        relative = absolute / size[:, None]
        relative[:, 0] -= (rest / size)[:, None]
        blocks.append(relative)
    return np.concatenate([block.reshape(len(places), -1) for block in blocks], axis=1)


def window_moments(
    channel: Real, rate: float, windows: Sequence[float], places: Whole
) -> tuple[Real, Real, Real]:
    """Level, slope and rms, each (k, m), of one finite channel (n,) at some samples."""
    from scipy.fft import irfft, next_fast_len, rfft, rfftfreq  # takes long to load

    n = len(channel)
    middle = float(np.median(channel))
    scale = float(np.max(np.abs(channel - middle))) or 1.0
    # Around the middle: the variance is a difference of squares, which must not be large.
    levelled = (channel - middle) / scale
    level, slope, rms = (np.empty((len(windows), len(places))) for _ in KINDS)
    for j, window in enumerate(windows):
        pad = int(np.ceil(REACH * window * rate)) + 1
        length = next_fast_len(n + 2 * pad, real=True)
        padded = np.pad(levelled, (pad, length - n - pad), mode="edge")
        # What is beyond the right pad comes round to the left: it must be the left end's value.
        padded[n + 2 * pad :] = levelled[0]
        omega = 2 * np.pi * rfftfreq(length)
        weights = np.exp(-0.5 * (omega * window * rate) ** 2)
        at = places + pad
        spectrum = rfft(padded) * weights
        mean = irfft(spectrum, length)[at]
        squares = irfft(rfft(padded**2) * weights, length)[at]
        level[j] = middle + scale * mean
        slope[j] = scale * rate * irfft(1j * omega * spectrum, length)[at]
        rms[j] = scale * np.sqrt(np.maximum(squares - mean**2, 0.0))
    return level, slope, rms


#: Places whose cut windows are summed up at once: copies of their samples must stay small.
PLACES = 32


def cut_window_features(
    channels: Real, rate: float, windows: Sequence[float], places: Whole, ahead: int
) -> Real:
    """Level, slope and rms of windows that see only `ahead` samples after each place: (m, 3, q, k).

    What a stream knows: the Gaussian windows of :func:`window_features`, cut off there and
    normalised again, so that a wide one mostly looks back. In what is left of a window the *level*
    is the weighted mean, the *slope* that of the weighted line of best fit, and the *rms* the
    weighted standard deviation; of a whole window these are what its convolutions give. Each place
    costs as many products as its windows have samples. `channels` (q, n) are finite.
    """
    n = channels.shape[1]
    out = np.empty((len(places), len(KINDS), len(channels), len(windows)))
    for j, window in enumerate(windows):
        spread = max(window, 0.5 / rate)  # a line needs two values
        reach = int(np.ceil(REACH * spread * rate))
        offsets = np.arange(-reach, min(ahead, reach) + 1)
        weights = np.exp(-0.5 * (offsets / rate / spread) ** 2)
        weights /= weights.sum()
        off = offsets / rate - weights @ offsets / rate
        sloping = weights * off / (weights @ off**2)
        for start in range(0, len(places), PLACES):
            block = slice(start, start + PLACES)
            values = channels[:, np.clip(places[block, None] + offsets, 0, n - 1)]
            first = values[:, :, :1].copy()
            values -= first  # so that what is constant is so without rounding
            mean = values @ weights
            out[block, 0, :, j] = (first[:, :, 0] + mean).T
            out[block, 1, :, j] = (values @ sloping).T
            values -= mean[:, :, None]
            out[block, 2, :, j] = np.sqrt(np.square(values, out=values) @ weights).T
    return out


#: Seconds over which the running size forgets, and for how many seconds of usual strength the
#: size known from training counts beside it.
FORGETTING, TRUST = 20.0, 1.5
#: Samples more than so many times as far from rest as the middle one of their block count as this
#: in the running size: it would take minutes to forget a glitch. Where a block has fewer samples
#: than the second number they are compared with so many latest ones, and each, which lasts longer,
#: may be the third number of times as far.
OUTLYING, LATEST, OUTLYING_FEW = 30.0, 2 * SPIKE + 1, 5.0


def contraharmonic_size(channels: Real, rate: float) -> Real:
    """Size of each channel's movements, shape (q,), 0 for one that never moves.

    The contraharmonic mean of the distances from rest: that of squares over that of sizes, to which
    rest adds nothing.
    """
    rest = np.median(channels[:, : max(1, round(REST * rate))], axis=1)
    away = np.abs(channels - rest[:, None])
    most = np.max(away, axis=1)
    share = away / np.where(most > 0, most, 1.0)[:, None]
    total = share.sum(axis=1)
    return most * (share**2).sum(axis=1) / np.where(total > 0, total, 1.0)


class RunningSize:
    """The recent size of a stream's forces, in units of the usual one.

    The mean of :func:`contraharmonic_size` over the last :data:`FORGETTING` seconds; in a long rest
    it goes back to the usual one.
    """

    def __init__(self, channels: int, rate: float) -> None:
        self._rate, self._limit = rate, max(1, round(REST * rate))
        self._first = self._latest = np.empty((channels, 0))
        self._rest = self._squares = self._sizes = np.zeros(channels)

    def take(self, samples: Real) -> tuple[Real, Real]:
        """Take the next samples (q, m); level at rest and size (q,) as known with them."""
        m = samples.shape[1]
        if m and self._first.shape[1] < self._limit:
            self._first = np.concatenate([self._first, samples], axis=1)[:, : self._limit]
            self._rest = np.median(self._first, axis=1)
        if m:
            if not self._latest.shape[1]:
                self._latest = np.repeat(samples[:, :1], LATEST, axis=1)
            self._latest = np.concatenate([self._latest, samples], axis=1)[:, -max(m, LATEST) :]
            near = np.abs(self._latest - self._rest[:, None])
            most = OUTLYING if m >= LATEST else OUTLYING_FEW
            middle = np.partition(near, near.shape[1] // 2, axis=1)[:, near.shape[1] // 2]
            away = np.minimum(np.abs(samples - self._rest[:, None]), most * middle[:, None])
            fading = np.exp(-m / self._rate / FORGETTING)
            self._squares = fading * self._squares + np.square(away).sum(axis=1) / self._rate
            self._sizes = fading * self._sizes + away.sum(axis=1) / self._rate
        return self._rest, (self._squares + TRUST) / (self._sizes + TRUST)


#: Seconds to either side: about a snap, an action, and the actions next to it.
SPANS = (0.2, 0.5, 1.5)
#: What is known of each channel in each span.
PEAKS = ("highest before", "highest after", "lowest before", "lowest after")


def peak_features(
    channels: Real, rate: float, window: float, places: Whole, own: bool = False
) -> Real:
    """Distances of channels (q, n) from their extremes at the samples `places` (m,): (m, 4 q k).

    Levels are smoothed by a Gaussian window of standard deviation `window` in seconds. With `own`
    distances are in units of the root mean square of the channels' own amplitudes. One unit for all
    of them: how one force compares with another, as friction does, stays what it is. Never below 0
    for the highest, never above 0 for the lowest; finite for channels below 1e150.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # takes long to load

    ready = np.stack([bridge(channel) for channel in channels])
    samples = np.arange(ready.shape[1])
    level = np.stack([window_moments(channel, rate, (window,), samples)[0][0] for channel in ready])
    if own:
        level /= _common(own_amplitude(ready, rate)[1])
    now = level[:, places]
    out = np.empty((len(places), len(PEAKS), len(ready), len(SPANS)))
    for j, span in enumerate(SPANS):
        # Farther than the recording is long there is nothing new.
        reach = min(max(1, round(span * rate)), len(samples))
        for kind, (extreme, side) in enumerate(
            (extreme, side)
            for extreme in (maximum_filter1d, minimum_filter1d)
            for side in (reach // 2, -((reach + 1) // 2))
        ):
            peaks = extreme(level, reach + 1, axis=1, mode="nearest", origin=side)
            out[:, kind, :, j] = (peaks[:, places] - now).T
    return out.reshape(len(places), -1)


def _common(sizes: Real) -> float:
    """The root mean square of sizes, which may be as large as numbers get."""
    most = float(sizes.max())
    return most * float(np.sqrt(np.mean((sizes / most) ** 2)))


#: Magnitudes are floored at this share of the channel's noise: far below what white noise gives.
NOISE_SHARE = 1e-3
#: The smallest floor, as a share of the channel's amplitude: above the rounding of the transform.
ROUNDING = 1e-13
#: Time steps that are turned from rows of scales into rows of steps at once: they fit the cache.
BLOCK = 1024
#: Samples of channels that are transformed at once.
TOGETHER = 1 << 15


def wavelet_features(
    channels: Real,
    scales: Real,
    wavelet: Wavelet,
    phase: bool = True,
    noise: Real | None = None,
    *,
    circular: bool = False,
    places: slice = slice(None),
    tolerance: float = 1e-14,
) -> Real:
    """Compute the features of every time step, or of some.

    Parameters
    ----------
    channels : ndarray, shape (q, n)
        Recognition channels on a uniform grid; NaN and infinity are bridged.
    scales : ndarray, shape (k,)
        In samples.
    wavelet : Wavelet
    phase : bool
        Whether to append the phases.
    noise : ndarray, shape (q,), optional
        Standard deviation of each channel's noise in its own unit, not negative. By default it is
        estimated from `channels` by :func:`~forcelab.signals.conditioning.noise_level`; give it
        where features of several recordings, or of parts of one, must have the same floor.
    circular : bool
        Whether cosine and sine of the phase stand for the phase. Both fade to 0 towards the floor:
        times ``1 - (floor / magnitude)^2``.
    places : slice
        The m samples whose features are wanted: of a stream the latest, of a coarser step some.
    tolerance : float
        Error of the coefficients as of :func:`~forcelab.signals.cwt_engine.plan_for`.

    Returns
    -------
    ndarray of float64, shape (m, q * k), (m, 2 * q * k), or circular (m, 3 * q * k)
        Always finite. Natural logarithms of magnitudes in the unit of the channel, phases in
        radians in [-pi, pi].

    Raises
    ------
    InputError
        If `noise` is not one number for each channel, finite and not negative.

    Notes
    -----
    The transform of white noise of standard deviation s has magnitudes of about s at every scale
    (the wavelets have unit energy), so that the floor stands in relation to the channel's noise:
    a thousandth of it, and never less than 1e-13 of the channel's amplitude. Where a magnitude is
    at its floor the phase means nothing and is 0. A channel without any variation has the floor
    of one of amplitude 1.

    Examples
    --------
    >>> scales = np.array([4.0, 8.0])
    >>> forcelab.wavelet_features(np.zeros((100, 2)), scales, forcelab.Morlet()).shape
    (2, 400)
    """
    q, n = channels.shape
    k = len(scales)
    if noise is not None and not (noise.shape == (q,) and np.all((noise >= 0) & (noise < np.inf))):
        raise InputError(f"The noise of {q} channels is {q} finite numbers from 0, not {noise}.")
    m = len(range(n)[places])
    out = np.empty((m, (1 + (2 if circular else 1) * phase) * q * k))
    # It loads SciPy, and settings, which are read early, import this file.
    from forcelab.signals.cwt_engine import plan_for

    plan = plan_for(n, scales, wavelet, tolerance)
    ready = condition(channels, noise_known=noise is not None)
    # Of long channels one at a time: their coefficients stay small beside the features of all.
    together = max(1, TOGETHER // n)
    for i in range(q):
        if i % together == 0:
            transformed = plan.coefficients(ready.values[i : i + together], places)
        coefficients = transformed[i % together]
        shift = ready.exponent[i] * np.log(2.0)
        with np.errstate(divide="ignore"):  # no noise has the logarithm -inf
            level = np.log(ready.noise[i]) if noise is None else np.log(noise[i]) - shift
        floor = np.maximum(np.log(NOISE_SHARE) + level, np.log(ROUNDING * np.sqrt(scales)))[:, None]
        for start in range(0, m, BLOCK):
            rows = slice(start, start + BLOCK)
            real, imaginary = coefficients.real[:, rows], coefficients.imag[:, rows]
            power = np.maximum(real**2 + imaginary**2, np.finfo(np.float64).tiny)
            magnitude = 0.5 * np.log(power)
            out[rows, i * k : (i + 1) * k] = (np.maximum(magnitude, floor) + shift).T
            if phase and circular:
                # The cosine is the real part over the magnitude, without an angle on the way.
                power = np.maximum(power, np.exp(2 * floor))
                fading = -np.expm1(2 * floor - np.log(power)) / np.sqrt(power)
                for kind, part in enumerate((real, imaginary), start=1):
                    first = (kind * q + i) * k
                    out[rows, first : first + k] = (part * fading).T
            elif phase:
                angle = np.arctan2(imaginary, real)
                angle[magnitude <= floor] = 0.0
                out[rows, (q + i) * k : (q + i + 1) * k] = angle.T
        del coefficients, real, imaginary
        if (i + 1) % together == 0:
            del transformed  # before the next channels' are made
    return out


#: Samples of white noise by which it is seen how many features a function makes.
PROBE = 1000


def plugin_features(path: str, channels: Real, rate: float, places: slice = slice(None)) -> Real:
    """Features that a function from outside makes of channels (q, n) at m samples: (m, f).

    NaN and infinity are bridged, as they are for ours. An InputError says that its import path was
    not named here, it failed, or what it gave is not a finite row for each sample.
    """
    function = load_plugin("features", path)
    ready = np.stack([bridge(channel) for channel in channels], axis=1)
    with naming_plugin(path, "failed as features", "correct it, or choose other features"):
        found = np.asarray(function(ready, rate), dtype=np.float64)
        if found.ndim == 1:
            found = found[:, None]
        if found.ndim != 2 or len(found) != len(ready):
            raise ValueError(
                f"it gave an array of shape {found.shape} for {len(ready)} samples, which each "
                f"need a row"
            )
        if not np.isfinite(found).all():
            raise ValueError("it gave numbers that are not finite")
    return found[places]


def plugin_width(path: str, channels: int, rate: float) -> int:
    """How many features a function from outside makes of so many channels."""
    noise = np.random.default_rng(0).standard_normal((channels, PROBE))
    return plugin_features(path, noise, rate).shape[1]
