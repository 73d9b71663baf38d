"""Level, slope and strength of each channel in Gaussian windows, from milliseconds to seconds.

A wavelet has zero mean and cannot see how hard one grips; these can. In a Gaussian window of
standard deviation s around a time step the *level* is the weighted mean of the channel, the
*slope* its derivative and the *rms* the weighted standard deviation. Beyond its ends a recording
goes on with its end values.

The vector of one time step with q channels and k windows holds the blocks level, slope and rms,
each of them the k windows of channel 1, then those of channel 2, and so on. Where each
demonstration's own amplitude matters, there are the same blocks once more in units of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forcelab.signals.conditioning import bridge

__all__ = ["KINDS", "own_amplitude", "smoothed", "window_features"]

Real = NDArray[np.float64]

#: What is known of each channel in each window.
KINDS = ("level", "slope", "rms")
#: Standard deviations of a window after which its weight, 3e-4 of its middle's, is left out.
REACH = 4.0
#: Share of the samples that lie below what counts as the size of a channel's movements.
SIZE = 0.95
#: Seconds at the beginning over which a channel is at rest, as nothing is held yet.
REST = 0.2


def own_amplitude(channels: Real, rate: float) -> tuple[Real, Real]:
    """Each channel's level at rest and the size of its movements from there.

    Parameters
    ----------
    channels : ndarray, shape (q, n)
        Finite.
    rate : float
        Samples a second.

    Returns
    -------
    rest, size : ndarray, shape (q,)
        The median of the first 0.2 s, and the 95th percentile of the distances from it, 1 for a
        channel that never moves. Rare peaks leave both alone.
    """
    rest = np.median(channels[:, : max(1, round(REST * rate))], axis=1)
    size = np.quantile(np.abs(channels - rest[:, None]), SIZE, axis=1)
    return rest, np.where(size > 0, size, 1.0)


def window_features(
    channels: Real,
    rate: float,
    windows: Sequence[float],
    places: NDArray[np.int64],
    amplitude: str = "absolute",
) -> Real:
    """Compute the features of some time steps.

    Parameters
    ----------
    channels : ndarray, shape (q, n)
        Recognition channels on a uniform grid; NaN and infinity are bridged.
    rate : float
        Samples a second.
    windows : sequence of float, length k
        Standard deviations in seconds.
    places : ndarray of int64, shape (m,)
        Samples at which there is a time step.
    amplitude : "absolute", "own" or "both"
        In the channels' units, in units of each channel's own amplitude, or both side by side.

    Returns
    -------
    ndarray of float64, shape (m, 3 q k), or (m, 6 q k) for "both"
        Always finite for channels below 1e150. Slopes are per second.
    """
    ready = np.stack([bridge(channel) for channel in channels])
    q, k = len(ready), len(windows)
    absolute = np.empty((len(places), len(KINDS), q, k))
    for i, channel in enumerate(ready):
        for kind, values in enumerate(smoothed(channel, rate, windows, places)):
            absolute[:, kind, i] = values.T
    blocks = [absolute] if amplitude != "own" else []
    if amplitude != "absolute":
        rest, size = own_amplitude(ready, rate)
        own = absolute / size[:, None]
        own[:, 0] -= (rest / size)[:, None]
        blocks.append(own)
    return np.concatenate([block.reshape(len(places), -1) for block in blocks], axis=1)


def smoothed(
    channel: Real, rate: float, windows: Sequence[float], places: NDArray[np.int64]
) -> tuple[Real, Real, Real]:
    """Level, slope and rms of one channel in each window at some samples, each of shape (k, m).

    Parameters
    ----------
    channel : ndarray, shape (n,)
        Finite.
    rate, windows, places
        As of :func:`window_features`.
    """
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
        held = np.pad(levelled, (pad, length - n - pad), mode="edge")
        # What is beyond the right pad comes round to the left: it must be the left end's value.
        held[n + 2 * pad :] = levelled[0]
        omega = 2 * np.pi * rfftfreq(length)
        weights = np.exp(-0.5 * (omega * window * rate) ** 2)
        at = places + pad
        spectrum = rfft(held) * weights
        mean = irfft(spectrum, length)[at]
        squares = irfft(rfft(held**2) * weights, length)[at]
        level[j] = middle + scale * mean
        slope[j] = scale * rate * irfft(1j * omega * spectrum, length)[at]
        rms[j] = scale * np.sqrt(np.maximum(squares - mean**2, 0.0))
    return level, slope, rms
