"""Kappa: agreement beyond chance of two coders or more, in time of each pair of actions.

Sources: Cohen, "A coefficient of agreement for nominal scales", Educ. Psychol. Meas. 20, 1960.
Fleiss, "Measuring nominal scale agreement among many raters", Psychol. Bull. 76, 1971, in the form
for ratings that are missing: Gwet, "Handbook of inter-rater reliability", 4th ed., 2014. Spitzer
and Fleiss, "A re-analysis of the reliability of psychiatric diagnosis", Br. J. Psychiatry 125,
1974: the specific agreement. Landis and Koch, Biometrics 33, 1977: the words.
"""

from __future__ import annotations

import math

import numpy as np

from forcelab.arrays import Real, Whole
from forcelab.recognition.intervals import FEWEST, draw_resamples, percentile_interval

#: Each word with the kappa up to which it holds.
WORDS = (
    (0.0, "poor"),
    (0.20, "slight"),
    (0.40, "fair"),
    (0.60, "moderate"),
    (0.80, "substantial"),
    (1.0, "almost perfect"),
)
#: Resamples of the bootstrap.
RESAMPLES = 1000


def cohen_kappa(seconds: Real) -> float | None:
    """Cohen's kappa of the seconds (K, K) of each pair of actions by two coders.

    1 for full agreement, 0 for what chance brings; None where there is no common time, or both know
    but one action: chance alone then agrees always.
    """
    kappa = float(_kappas(seconds[None])[0])
    return None if math.isnan(kappa) else kappa


def _kappas(seconds: Real) -> Real:
    """Cohen's kappa of each of some tables (m, K, K), nan where there is none."""
    total = seconds.sum(axis=(1, 2))
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = seconds / total[:, None, None]
        expected = (shares.sum(axis=2) * shares.sum(axis=1)).sum(axis=1)
        kappas = (np.trace(shares, axis1=1, axis2=2) - expected) / (1 - expected)
    return np.where((total > 0) & (1 - expected >= 1e-12), kappas, np.nan)


def fleiss_kappa(ratings: Whole, weights: Real) -> float | None:
    """Fleiss' kappa of how many coders gave each action (p, K), weighted by seconds (p,).

    Pieces with fewer than two are left out. None as of :func:`cohen_kappa`; with equally many
    coders throughout it is the figure of Fleiss (1971).
    """
    coders = ratings.sum(axis=1)
    comparable = coders >= 2
    n, w = ratings[comparable].astype(np.float64), weights[comparable]
    if not w.sum() > 0:
        return None
    m, w = coders[comparable].astype(np.float64), w / w.sum()
    agreed = float(w @ ((n * (n - 1)).sum(axis=1) / (m * (m - 1))))
    expected = float((((w / m) @ n) ** 2).sum())
    return None if 1 - expected < 1e-12 else (agreed - expected) / (1 - expected)


def specific_agreement(seconds: Real) -> Real:
    """Positive specific agreement of each action, shape (K,); nan where neither labelled it.

    ``2 n_kk / (n_k. + n_.k)``: if one of the two, drawn by lot, says the action, how probably the
    other says it too. `seconds` as of :func:`cohen_kappa`.
    """
    labelled = seconds.sum(axis=0) + seconds.sum(axis=1)
    shares = np.full(len(seconds), np.nan)
    np.divide(2 * np.diag(seconds), labelled, out=shares, where=labelled > 0)
    return shares


def kappa_interval(matrices: Real) -> tuple[float, float] | None:
    """95 % interval of Cohen's kappa by the percentile bootstrap over demonstrations (D, K, K).

    None with fewer than three: they cannot tell how much demonstrations vary.
    """
    count = len(matrices)
    if count < FEWEST:
        return None
    weights = draw_resamples(count, RESAMPLES, 0).astype(np.float64)
    return percentile_interval(_kappas(np.tensordot(weights, matrices, axes=1)))


def landis_koch(kappa: float) -> str:
    """The word of Landis and Koch for a kappa, such as ``"substantial"``."""
    return next((word for limit, word in WORDS if kappa <= limit + 1e-12), WORDS[-1][1])
