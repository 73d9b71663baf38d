"""How far each channel is from its highest and lowest level, before and after a time step.

A Gaussian window looks to both sides alike: it cannot tell a force that has peaked from one that
is about to. Here each channel's smoothed level is compared with its highest and its lowest one
within some seconds before, and within as many after. Beyond its ends a recording goes on with its
end values.

The vector of one time step with q channels and k spans of seconds holds the blocks highest before,
highest after, lowest before and lowest after, each of them the k spans of channel 1, then those of
channel 2, and so on.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.windows import own_amplitude, smoothed
from forcelab.signals.conditioning import bridge

__all__ = ["PEAKS", "SPANS", "peak_features"]

Real = NDArray[np.float64]

#: Seconds to either side: about a snap, an action, and the actions next to it.
SPANS = (0.2, 0.5, 1.5)
#: What is known of each channel in each span.
PEAKS = ("highest before", "highest after", "lowest before", "lowest after")


def peak_features(
    channels: Real,
    rate: float,
    window: float,
    places: NDArray[np.int64],
    own: bool = False,
) -> Real:
    """Compute the features of some time steps.

    Parameters
    ----------
    channels : ndarray, shape (q, n)
        Recognition channels on a uniform grid; NaN and infinity are bridged.
    rate : float
        Samples a second.
    window : float
        Standard deviation of the Gaussian window that smooths levels, in seconds.
    places : ndarray of int64, shape (m,)
        Samples at which there is a time step.
    own : bool
        Whether distances are in units of the demonstration's own amplitude, the root mean square
        of the channels' own ones. One unit for all of them: how one force compares with another,
        as friction does, stays what it is.

    Returns
    -------
    ndarray of float64, shape (m, 4 q k)
        Never below 0 for the highest, never above 0 for the lowest; finite for channels below
        1e150.
    """
    from scipy.ndimage import maximum_filter1d, minimum_filter1d  # takes long to load

    ready = np.stack([bridge(channel) for channel in channels])
    every = np.arange(ready.shape[1])
    level = np.stack([smoothed(channel, rate, (window,), every)[0][0] for channel in ready])
    if own:
        level /= _common(own_amplitude(ready, rate)[1])
    now = level[:, places]
    out = np.empty((len(places), len(PEAKS), len(ready), len(SPANS)))
    for j, span in enumerate(SPANS):
        # Farther than the recording is long there is nothing new.
        reach = min(max(1, round(span * rate)), len(every))
        for kind, (extreme, side) in enumerate(
            (extreme, side)
            for extreme in (maximum_filter1d, minimum_filter1d)
            for side in (reach // 2, -((reach + 1) // 2))
        ):
            found = extreme(level, reach + 1, axis=1, mode="nearest", origin=side)
            out[:, kind, :, j] = (found[:, places] - now).T
    return out.reshape(len(places), -1)


def _common(sizes: Real) -> float:
    """The root mean square of sizes, which may be as large as numbers get."""
    most = float(sizes.max())
    return most * float(np.sqrt(np.mean((sizes / most) ** 2)))
