"""Clusters of time steps: what wavelet features tell apart without any labels.

A force that rises, holds and falls again looks the same forwards and backwards to the magnitude of
any wavelet that is itself symmetric or antisymmetric. The phase of a complex wavelet tells the two
flanks apart, which is why it is among the method's features.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sklearn.cluster import KMeans
from threadpoolctl import threadpool_limits

from forcelab.arrays import Codes, Real
from forcelab.errors import InputError
from forcelab.signals.cwt import cwt, usual_scales
from forcelab.signals.wavelets import DOG, Haar, Morlet, Wavelet

#: Magnitudes below this share of the largest are taken as this: no sensor resolves them.
FLOOR = 1e-3
#: Weight of the phases beside the standardised log magnitudes. Twice to three times theirs is
#: where clusters come out the same for every seed.
PHASE_WEIGHT = 3.0
#: Scales an octave, finer than for recognition: k-means weighs a flank by how many scales see it.
SPACING = 0.25


@dataclass(frozen=True, eq=False)
class Clustering:
    """A cluster for every time step."""

    title: str  # the features, such as ``"Morlet, magnitude and phase"``
    codes: Codes  # (n,); 0, 1, ... in the order of first occurrence.


def trapezoid() -> tuple[Real, Real]:
    """Times and samples (801,) of a force that rises to 10 N, holds and falls: 8 s at 100 Hz.

    It is the same forwards and backwards.
    """
    times = np.arange(801) / 100
    return times, np.interp(times, [0, 2, 3, 5, 6, 8], [0, 0, 10, 10, 0, 0])


def cluster(
    signal: Real, wavelet: Wavelet, *, phase: bool, clusters: int = 4, seed: int = 0
) -> Codes:
    """Group the time steps of one channel (n,) by k-means over its wavelet features.

    A phase enters as its cosine and sine, so that -pi and pi are neighbours, times how far the log
    magnitude stands above its floor (0 to 1): the phase of nothing counts for nothing. Codes (n,)
    are numbered by first occurrence.
    """
    if not 1 <= clusters <= len(signal):
        raise InputError(f"{len(signal)} time steps cannot be grouped into {clusters} clusters.")
    coefficients = cwt(signal, usual_scales(len(signal), spacing=SPACING), wavelet).T
    magnitudes = np.abs(coefficients)
    floor = FLOOR * magnitudes.max()
    if floor == 0.0:
        raise InputError("A signal that never changes has no clusters; choose another.")
    logs = np.log(np.maximum(magnitudes, floor))
    columns = [_standardised(logs)]
    if phase:
        prominence = (logs - np.log(floor)) / -np.log(FLOOR)
        angles = np.angle(coefficients)
        columns += [PHASE_WEIGHT * prominence * part(angles) for part in (np.cos, np.sin)]
    # One thread: sums in another order could tip a time step between two clusters.
    with threadpool_limits(1):
        means = KMeans(clusters, n_init=10, random_state=seed).fit(np.hstack(columns))
    _, firsts, codes = np.unique(means.labels_, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(firsts))[codes].astype(np.int64)


def compare_wavelets(signal: Real, seed: int = 0) -> tuple[Clustering, ...]:
    """Cluster one channel (n,) in the four ways that the paper compares."""
    variants: tuple[tuple[str, Wavelet, bool], ...] = (
        ("Morlet, magnitude and phase", Morlet(), True),
        ("Morlet, magnitude only", Morlet(), False),
        ("Derivative of Gaussian", DOG(), False),
        ("Haar", Haar(), False),
    )
    return tuple(
        Clustering(title, cluster(signal, wavelet, phase=phase, seed=seed))
        for title, wavelet, phase in variants
    )


def _standardised(columns: Real) -> Real:
    """Columns of mean 0 and standard deviation 1; those that never change are 0."""
    spread = columns.std(axis=0)
    scaled: Real = (columns - columns.mean(axis=0)) / np.where(spread > 0, spread, 1)
    return scaled
