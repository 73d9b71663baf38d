"""Everything a recogniser is made with, and the presets.

A preset is a named set of settings. ``paper`` is the published method, unchanged for ever;
improvements are other presets, measured against it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from forcelab.errors import InputError
from forcelab.merging import MergeMap
from forcelab.signals.cwt import geometric_scales
from forcelab.signals.wavelets import Wavelet, wavelet_named

__all__ = ["CLASSIFIERS", "PRESETS", "Settings", "preset"]

#: Classifiers by name: the paper's choice and those it was compared with.
CLASSIFIERS = ("mlp", "naive-bayes", "decision-tree", "svm", "nearest-neighbours")

#: A wavelet of this scale, in samples, already lasts minutes at 1 kHz; its padding takes memory.
LARGEST_SCALE = 2.0**17


@dataclass(frozen=True)
class Settings:
    """Settings of features, classifier and filters; the defaults are preset ``paper``.

    Parameters
    ----------
    preset : str
        Name of the preset these settings started from.
    channels : tuple of str, optional
        Recognition channels to use, in this order; all by default.
    rate : float, optional
        Samples a second of the grid; by default the median rate of the training demonstrations.
    wavelet : str
        One of :data:`forcelab.signals.wavelets.WAVELETS`.
    parameter : float, optional
        p of a Morlet, order of a derivative of Gaussian; the wavelet's default if left out.
    min_scale, max_scale : float
        Smallest and largest scale, in samples.
    spacing : float
        Octaves between neighbouring scales.
    phase : bool
        Whether the phases stand beside the log magnitudes.
    classifier : str
        One of :data:`CLASSIFIERS`.
    stride : int
        Train on every `stride`-th sample; recognition always covers every sample.
    threshold : float, optional
        Less probable than this: unlabelled. None switches the filter off.
    median : int, optional
        Width in samples of the running median over label numbers. None switches it off.
    drop : float, optional
        Predicted segments shorter than this share of the shortest training segment of their
        action: unlabelled. None switches it off.
    merge : MergeMap
        Spellings to take as one action in training and scoring.
    seed : int
        Of everything random.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    preset: str = "paper"
    channels: tuple[str, ...] | None = None
    rate: float | None = None
    wavelet: str = "morlet"
    parameter: float | None = None
    min_scale: float = 2.0
    max_scale: float = 1024.0
    spacing: float = 1.0
    phase: bool = True
    classifier: str = "mlp"
    stride: int = 1
    threshold: float | None = 0.8
    median: int | None = 10
    drop: float | None = 0.125
    merge: MergeMap = field(default_factory=MergeMap)
    seed: int = 0

    def __post_init__(self) -> None:
        if self.classifier not in CLASSIFIERS:
            raise InputError(
                f"There is no classifier '{self.classifier}'; choose from {', '.join(CLASSIFIERS)}."
            )
        for name, (fine, need) in self._ranges().items():
            if not fine:
                raise InputError(f"The setting {name} must be {need}, not {getattr(self, name)}.")
        self.mother  # noqa: B018 - a wrong wavelet or scale is refused here, not mid-training
        self.scales  # noqa: B018

    def _ranges(self) -> dict[str, tuple[bool, str]]:
        """Whether each value is in its range, and what the range is."""
        names = self.channels
        distinct = names is None or len(set(names)) == len(names)
        return {
            "preset": (isinstance(self.preset, str), "a name"),
            "channels": (
                distinct and all(isinstance(n, str) for n in names or ()),
                "distinct names",
            ),
            "rate": (self.rate is None or _number(self.rate, 1e-6, 1e9), "a positive number of Hz"),
            "parameter": (
                self.parameter is None or _number(self.parameter, 0, 1e6),
                "from 0 to 1e6",
            ),
            "min_scale": (
                _number(self.min_scale, 1e-3, LARGEST_SCALE),
                f"from 0.001 to {LARGEST_SCALE:.0f} samples",
            ),
            "max_scale": (
                _number(self.max_scale, 1e-3, LARGEST_SCALE),
                f"from 0.001 to {LARGEST_SCALE:.0f} samples",
            ),
            "spacing": (_number(self.spacing, 1e-3, 100), "from 0.001 to 100 octaves"),
            "phase": (isinstance(self.phase, bool), "true or false"),
            "stride": (_whole(self.stride, 1), "a whole number from 1"),
            "threshold": (self.threshold is None or _number(self.threshold, 0, 1), "from 0 to 1"),
            "median": (self.median is None or _whole(self.median, 1), "a whole number from 1"),
            "drop": (self.drop is None or _number(self.drop, 0, 1e9), "a number from 0"),
            "seed": (_whole(self.seed, 0) and self.seed < 2**32, "a whole number below 2^32"),
        }

    @property
    def mother(self) -> Wavelet:
        """The wavelet itself."""
        return wavelet_named(self.wavelet, self.parameter)

    @property
    def scales(self) -> NDArray[np.float64]:
        """Scales in samples, shape (k,)."""
        return geometric_scales(self.min_scale, self.max_scale, self.spacing)

    @property
    def needs_probabilities(self) -> bool:
        """Whether anything uses more than the most probable action."""
        return self.threshold is not None

    def replace(self, **changes: Any) -> Settings:
        """The same settings with some values changed."""
        return dataclasses.replace(self, **changes)

    def to_json(self) -> dict[str, Any]:
        """Plain values that :meth:`from_json` turns back into equal settings."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        values["channels"] = None if self.channels is None else list(self.channels)
        values["merge"] = self.merge.to_json()
        return values

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Settings:
        """Build settings from what :meth:`to_json` gave.

        Raises
        ------
        InputError
            If a name is unknown or a value has the wrong type.
        """
        known = {f.name for f in dataclasses.fields(cls)}
        unknown = sorted(set(values) - known)
        if unknown:
            raise InputError(
                f"The setting '{unknown[0]}' is unknown; it may come from a newer forcelab."
            )
        changed = dict(values)
        try:
            if (names := changed.get("channels")) is not None:
                if not isinstance(names, list):
                    raise TypeError("channels is no list of names")
                changed["channels"] = tuple(names)
            changed["merge"] = MergeMap.from_json(changed.get("merge", {}))
            return cls(**changed)
        except TypeError as error:
            raise InputError(f"The settings hold a value of the wrong type: {error}.") from error


def _number(value: object, least: float, most: float) -> bool:
    """Whether a value is a number (True and False are not) in a range; NaN is in none."""
    return type(value) in (int, float) and least <= value <= most  # type: ignore[operator]


def _whole(value: object, least: int) -> bool:
    """Whether a value is an int (True and False are not) of at least `least`."""
    return type(value) is int and value >= least


#: All presets by name. ``paper`` is written out: no default that changes may ever change it.
PRESETS: Mapping[str, Settings] = {
    "paper": Settings(
        preset="paper",
        wavelet="morlet",
        parameter=5.0,
        min_scale=2.0,
        max_scale=1024.0,
        spacing=1.0,
        phase=True,
        classifier="mlp",
        stride=1,
        threshold=0.8,
        median=10,
        drop=1 / 8,
        seed=0,
    )
}


def preset(name: str) -> Settings:
    """Look up a preset.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in PRESETS:
        raise InputError(f"There is no preset '{name}'; choose from {', '.join(PRESETS)}.")
    return PRESETS[name]
