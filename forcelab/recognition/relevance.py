"""Which settings count beside the others: to windows the scales of wavelets are nothing."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from forcelab.recognition.settings import CLASSIFIERS, PLAIN_CLASSIFIERS
from forcelab.signals.wavelets import WAVELETS

__all__ = ["counts", "obstacle"]

#: A setting, and what it has to be.
Need = tuple[str, Collection[Any]]

_WAVELETS: Need = ("features", ("wavelets",))
_WINDOWS: Need = ("features", ("windows",))
_PLAIN: Need = ("classifier", PLAIN_CLASSIFIERS)
#: Of classifiers something is drawn at random, but of these.
_DRAWN: Need = (
    "classifier",
    tuple(
        name
        for name in CLASSIFIERS
        if name not in ("naive-bayes", "nearest-neighbours", "logistic")
    ),
)
_DECODER: Need = ("decoder", ("semi-markov",))
_FILTERS: Need = ("decoder", ("filters",))
#: What has to be so for a setting to count; one that is not named always does.
_NEEDS: Mapping[str, tuple[Need, ...]] = {
    **dict.fromkeys(("wavelet", "min_scale", "max_scale", "spacing", "phase"), (_WAVELETS,)),
    "parameter": (_WAVELETS, ("wavelet", tuple(name for name in WAVELETS if name != "haar"))),
    "circular": (_WAVELETS, ("phase", (True,))),
    **dict.fromkeys(("windows", "amplitude", "peaks"), (_WINDOWS,)),
    **dict.fromkeys(("balanced", "calibrated"), (_PLAIN,)),
    "seed": (_DRAWN,),
    **dict.fromkeys(("choreography", "changes"), (_DECODER,)),
    **dict.fromkeys(("threshold", "median", "drop"), (_FILTERS,)),
}


def counts(name: str, values: Mapping[str, Any]) -> bool:
    """Whether a setting changes anything, told from all of them by name."""
    return _missing(name, values) is None


def obstacle(name: str, values: Mapping[str, Any]) -> str:
    """Why a setting changes nothing, as the end of a sentence; empty where it does."""
    need = _missing(name, values)
    if need is None:
        return ""
    other, wanted = need
    return (
        f"with {other} {_word(values[other])}; it needs {other} {' or '.join(map(_word, wanted))}"
    )


def _missing(name: str, values: Mapping[str, Any]) -> Need | None:
    """The first thing that would have to be otherwise."""
    if name == "seed" and (values["trimmed"] or (values["changes"] and counts("changes", values))):
        return None  # of them, too, something is drawn
    return next((need for need in _NEEDS.get(name, ()) if values[need[0]] not in need[1]), None)


def _word(value: object) -> str:
    """A value as it is written."""
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)
