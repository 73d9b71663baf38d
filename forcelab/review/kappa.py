"""Cohen's and Fleiss' kappa over time: agreement beyond what chance alone would bring.

Time is weighed in seconds, not counted in samples. Unlabelled time is no class: kappa is taken
over the time that both (or, for Fleiss, two or more) labelled.

Sources
-------
Cohen, "A coefficient of agreement for nominal scales", Educ. Psychol. Meas. 20, 1960. Fleiss,
"Measuring nominal scale agreement among many raters", Psychol. Bull. 76, 1971, in the form for
ratings that are missing: Gwet, "Handbook of inter-rater reliability", 4th ed., 2014. Spitzer and
Fleiss, "A re-analysis of the reliability of psychiatric diagnosis", Br. J. Psychiatry 125, 1974:
the specific agreement. Landis and Koch, Biometrics 33, 1977: the words.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from forcelab.recognition.intervals import FEWEST, LEVEL
from forcelab.recognition.resampling import draws

__all__ = ["cohen", "fleiss", "landis_koch", "specific", "spread"]

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


def cohen(seconds: NDArray[np.float64]) -> float | None:
    """Cohen's kappa of two coders.

    Parameters
    ----------
    seconds : ndarray, shape (K, K)
        How long one said the row's action while the other said the column's.

    Returns
    -------
    float or None
        1 for full agreement, 0 for what chance brings; None where there is no common time, or both
        know but one action: chance alone then agrees always.
    """
    total = float(seconds.sum())
    if total <= 0:
        return None
    shares = seconds / total
    expected = float(shares.sum(axis=1) @ shares.sum(axis=0))
    if 1 - expected < 1e-12:
        return None
    return (float(np.trace(shares)) - expected) / (1 - expected)


def fleiss(ratings: NDArray[np.int64], weights: NDArray[np.float64]) -> float | None:
    """Fleiss' kappa of any number of coders.

    Parameters
    ----------
    ratings : ndarray of int64, shape (p, K)
        How many coders gave each action to a piece of time; pieces with fewer than two are left
        out.
    weights : ndarray, shape (p,)
        Seconds.

    Returns
    -------
    float or None
        As of :func:`cohen`. With equally many coders throughout it is the figure of Fleiss (1971).
    """
    coders = ratings.sum(axis=1)
    enough = coders >= 2
    n, w = ratings[enough].astype(np.float64), weights[enough]
    if not w.sum() > 0:
        return None
    m, w = coders[enough].astype(np.float64), w / w.sum()
    agreed = float(w @ ((n * (n - 1)).sum(axis=1) / (m * (m - 1))))
    expected = float((((w / m) @ n) ** 2).sum())
    return None if 1 - expected < 1e-12 else (agreed - expected) / (1 - expected)


def specific(seconds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Positive specific agreement of each action, shape (K,); nan where neither said it.

    ``2 n_kk / (n_k. + n_.k)``: if one of the two, drawn by lot, says the action, how probably the
    other says it too. `seconds` as of :func:`cohen`.
    """
    said = seconds.sum(axis=0) + seconds.sum(axis=1)
    shares = np.full(len(seconds), np.nan)
    np.divide(2 * np.diag(seconds), said, out=shares, where=said > 0)
    return shares


def spread(matrices: NDArray[np.float64]) -> tuple[float, float] | None:
    """95 % interval of Cohen's kappa by the percentile bootstrap over demonstrations.

    Parameters
    ----------
    matrices : ndarray, shape (D, K, K)
        One of :func:`cohen` for each demonstration.

    Returns
    -------
    tuple of float or None
        None with fewer than three demonstrations: they cannot tell how much demonstrations vary.
    """
    count = len(matrices)
    if count < FEWEST:
        return None
    weights = draws(count, RESAMPLES, 0).astype(np.float64)
    kappas = [k for k in map(cohen, np.tensordot(weights, matrices, axes=1)) if k is not None]
    if not kappas:
        return None
    aside = 50 * (1 - LEVEL)
    low, high = np.percentile(kappas, [aside, 100 - aside])
    return float(low), float(high)


def landis_koch(kappa: float) -> str:
    """The word of Landis and Koch for a kappa, such as ``"substantial"``."""
    return next((word for limit, word in WORDS if kappa <= limit + 1e-12), WORDS[-1][1])
