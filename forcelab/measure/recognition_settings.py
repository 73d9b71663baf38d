"""Which settings of the recogniser are measured beside each other, and what they share."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from forcelab.recognition.presets import PRESETS
from forcelab.recognition.settings import Settings

__all__ = ["QUICK", "VARIANTS", "Variant", "fitted_alike", "seen_alike", "with_data_of"]


@dataclass(frozen=True)
class Variant:
    """Settings with the words that tell them from the others.

    Parameters
    ----------
    name : str
        What is varied, such as ``"classifier"``; ``"preset"`` of the presets.
    setting : str
        How, such as ``"extra-trees"``.
    settings : Settings
    """

    name: str
    setting: str
    settings: Settings


#: Preset ``paper`` trained on fewer samples, which are almost copies of each other: what the
#: wavelet variants differ from, as training on all of them takes minutes.
_PAPER = PRESETS["paper"].replace(stride=50)
_FAST = PRESETS["fast"]
_NO_CHANGES = _FAST.replace(changes=False)
_OFF: dict[str, Any] = {"threshold": None, "median": None, "drop": None}

#: All wavelet variants but the presets train on every fiftieth sample unless they say otherwise.
VARIANTS: tuple[Variant, ...] = (
    *(Variant("preset", name, settings) for name, settings in PRESETS.items()),
    Variant("stride", "every 200th sample", _PAPER.replace(stride=200)),
    Variant("stride", "every 50th sample", _PAPER),
    Variant("scales", "every 2 octaves", _PAPER.replace(spacing=2.0)),
    Variant("scales", "every 1/2 octave", _PAPER.replace(spacing=0.5)),
    Variant("phase", "none", _PAPER.replace(phase=False)),
    Variant("phase", "cos and sin", _PAPER.replace(circular=True)),
    Variant("classifier", "naive-bayes", _PAPER.replace(classifier="naive-bayes")),
    Variant("classifier", "decision-tree", _PAPER.replace(classifier="decision-tree")),
    Variant("classifier", "logistic", _PAPER.replace(classifier="logistic")),
    Variant("classifier", "extra-trees", _PAPER.replace(classifier="extra-trees")),
    Variant("filters", "none", _PAPER.replace(**_OFF)),
    Variant("filters", "median of 101", _PAPER.replace(threshold=None, median=101)),
    Variant("decoder", "order", _PAPER.replace(**_OFF, decoder="semi-markov")),
    Variant("windows", "filters", _NO_CHANGES.replace(decoder="filters", median=5, drop=0.125)),
    Variant("windows", "changes not learnt", _NO_CHANGES),
    Variant("windows", "durations only", _FAST.replace(choreography="durations")),
    Variant("windows", "logistic", _FAST.replace(classifier="logistic")),
)

#: A quick look: little that takes long.
QUICK: tuple[Variant, ...] = tuple(
    variant
    for variant in VARIANTS
    if (variant.name, variant.setting)
    in {
        ("preset", "fast"),
        ("stride", "every 200th sample"),
        ("classifier", "naive-bayes"),
        ("classifier", "extra-trees"),
        ("windows", "durations only"),
    }
)

#: What is done after the classifier, and what a fit needs besides features.
_AFTER = frozenset({"preset", "threshold", "median", "drop", "decoder", "choreography"})
_FIT = frozenset({"classifier", "stride", "seed", "balanced", "calibrated", "trimmed", "changes"})


def with_data_of(settings: Settings, data: Settings) -> Settings:
    """Settings with what belongs to the recordings, not to the method, taken from others."""
    return settings.replace(channels=data.channels, rate=data.rate, merge=data.merge)


def seen_alike(variants: Sequence[Variant]) -> list[list[Variant]]:
    """The variants in groups that share their features; every order is kept."""
    return _alike(variants, [(_key(v.settings, _AFTER | _FIT),) for v in variants])


def fitted_alike(variants: Sequence[Variant]) -> list[list[Variant]]:
    """The variants in groups that share their classifier; features must be shared already."""
    return _alike(
        variants,
        [
            (
                _key(v.settings, _AFTER),
                # Only an SVM is fitted otherwise where nobody asks for probabilities.
                v.settings.classifier == "svm" and v.settings.needs_probabilities,
            )
            for v in variants
        ],
    )


def _key(settings: Settings, without: Iterable[str]) -> tuple[str, ...]:
    """All values that are left, as something to compare by."""
    left_out = set(without)
    return tuple(
        repr(getattr(settings, field.name))
        for field in dataclasses.fields(settings)
        if field.name not in left_out
    )


def _alike(variants: Sequence[Variant], keys: Sequence[tuple[Any, ...]]) -> list[list[Variant]]:
    """Groups of equal key, in the order in which they begin."""
    groups: dict[tuple[Any, ...], list[Variant]] = {}
    for variant, key in zip(variants, keys, strict=True):
        groups.setdefault(key, []).append(variant)
    return list(groups.values())
