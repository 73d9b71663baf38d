"""All settings of a recogniser: ranges, which apply beside the others, and how each is presented.

Command line and dialog are made from the table of fields. Named sets of settings are in
:mod:`forcelab.recognition.presets`.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from forcelab.arrays import Real, Whole
from forcelab.errors import InputError
from forcelab.label_map import MergeMap
from forcelab.recognition.classifiers import REGISTRY
from forcelab.recognition.features import KINDS, PEAKS, SPANS, plugin_width
from forcelab.recognition.plugins import Kind, Named, is_import_path, name_as, named_here
from forcelab.setting_field import SettingField
from forcelab.signals.cwt import frequencies, geometric_scales
from forcelab.signals.wavelets import WAVELETS, Wavelet, wavelet_named
from forcelab.text import unknown_word

#: Classifiers that are kept as plain arrays.
PLAIN_CLASSIFIERS = tuple(name for name, kind in REGISTRY.items() if kind.plain)
#: Standard deviations in seconds of the windows in which channels are looked at.
WINDOWS = (0.01, 0.04, 0.16, 0.64)
#: Samples a second that a grid may have, and the samples that a running median may look at.
RATES = (1e-3, 1e6)
WIDEST = 10_000_000
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
        One of :data:`~forcelab.recognition.classifiers.REGISTRY`, or one's own by its import path
        (:func:`~forcelab.recognition.plugins.register_classifier`).
    stride : int
        Train on every `stride`-th time step; recognition always covers all of them. See
        :meth:`training_stride`.
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
    features : str
        ``"wavelets"``, or level, slope and strength in Gaussian ``"windows"``, or both side by
        side, ``"windows+wavelets"``. One's own by their import path stand for them, or beside
        them: ``"windows+mylab.features:band_energy"``
        (:func:`~forcelab.recognition.plugins.register_features`).
    circular : bool
        Whether cosine and sine of each phase, fading where there is only noise, stand for it:
        an angle jumps at half a turn.
    windows : tuple of float
        Standard deviations of the windows in seconds, rising.
    step : float, optional
        Seconds between two time steps that have features; every sample of the grid by default.
    amplitude : str
        The unit of forces in windows: ``"absolute"``, as recorded, ``"own"``, each demonstration's
        own amplitude, or ``"both"`` side by side.
    peaks : bool
        Whether distances from the highest and the lowest level, before and after, stand beside the
        windows; of windows only.
    balanced : bool
        Whether every action counts the same in training; see :attr:`standardises`.
    calibrated : bool
        Whether probabilities are calibrated on left-out demonstrations; where balanced, too.
    trimmed : bool
        Whether segments that the other demonstrations contradict are left out of training.
    changes : bool
        Whether it is learnt where actions change, for the decoder.
    decoder : str
        ``"filters"``, or ``"semi-markov"``: the decoder takes the place of all filters.
    choreography : str
        What of the training tracks the decoder may use: ``"none"``, ``"durations"``, or with them
        the ``"order"``.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> forcelab.preset("best").replace(decoder="filters").decoder
    'filters'
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
    features: str = "wavelets"
    circular: bool = False
    windows: tuple[float, ...] = WINDOWS
    step: float | None = None
    amplitude: str = "absolute"
    peaks: bool = False
    balanced: bool = False
    calibrated: bool = False
    trimmed: bool = False
    changes: bool = False
    decoder: str = "filters"
    choreography: str = "order"

    def __post_init__(self) -> None:
        own = {
            "classifier": is_import_path(self.classifier),
            "features": isinstance(self.features, str)
            and len(set(self.own_features)) == len(self.own_features) > 0
            and self.known_features in ("", *_CHOICES["features"]),
        }
        for name, choices in _CHOICES.items():
            if getattr(self, name) not in choices and not own.get(name):
                noun = "kind of features" if name == "features" else name
                raise InputError(unknown_word(noun, getattr(self, name), choices))
        for name, (in_range, need) in _RANGES.items():
            if not in_range(value := getattr(self, name)):
                raise InputError(f"The setting {name} must {need}, not {_value_text(value)}.")
        if self.max_scale < self.min_scale:
            raise InputError(
                f"The setting max_scale must be at least min_scale, which is {self.min_scale:g} "
                f"samples, not {self.max_scale:g}."
            )
        self.mother  # noqa: B018 - a wrong wavelet or scale is refused here, not mid-training
        self.scales  # noqa: B018

    @property
    def mother(self) -> Wavelet:
        """The wavelet itself."""
        return wavelet_named(self.wavelet, self.parameter)

    @property
    def scales(self) -> Real:
        """Scales in samples, shape (k,)."""
        return geometric_scales(self.min_scale, self.max_scale, self.spacing)

    @property
    def known_features(self) -> str:
        """The kind of features without one's own; empty where these stand alone."""
        return _known_features(self.features)

    @property
    def own_features(self) -> tuple[str, ...]:
        """The import paths of one's own features, which come after the others."""
        return tuple(filter(is_import_path, self.features.split("+")))

    @property
    def needs_probabilities(self) -> bool:
        """Whether anything uses more than the most probable action."""
        return self.decodes or self.threshold is not None

    @property
    def standardises(self) -> bool:
        """Whether the classifier gets its features standardised, and can be calibrated.

        The paper gave its classifiers the wavelets' as they are: log magnitudes and angles, whose
        sizes compare. Those of windows are newtons and newtons per second.
        """
        return self.classifier in PLAIN_CLASSIFIERS or self.features != "wavelets"

    @property
    def decodes(self) -> bool:
        """Whether a decoder takes the place of the filters."""
        return self.decoder != "filters"

    def bands(self, rate: float) -> Real:
        """The frequency in Hz that each window, or else scale, answers to, shape (k,), falling.

        Of a window the angular frequency is one over its standard deviation: what changes faster
        is mostly averaged out.

        Parameters
        ----------
        rate : float
            Samples a second of the grid.
        """
        if "windows" in self.known_features:
            return 1.0 / (2 * np.pi * np.array(self.windows))
        if not self.known_features:
            return np.empty(0)
        return frequencies(self.scales, rate, self.mother)

    def width(self, channels: int, rate: float) -> int:
        """Number of features of a time step, of so many channels on a grid of `rate` Hz."""
        own = (plugin_width(path, channels, rate) for path in self.own_features)
        return len(self.feature_bands(channels, rate)) + sum(own)

    def _blocks(self, rate: float) -> list[tuple[str, list[str], Whole]]:
        """Each block of features: what of a channel, by which windows or scales, of which band.

        A peak belongs to the window that is about as long as it looks, a wavelet beside windows to
        the one of the nearest frequency.
        """
        blocks: list[tuple[str, list[str], Whole]] = []
        bands = self.bands(rate)
        if "windows" in self.known_features:
            names, own = [f"{window:.6g} s" for window in self.windows], np.arange(len(bands))
            units = {"absolute": ("",), "own": ("own ",), "both": ("", "own ")}[self.amplitude]
            blocks += [(unit + kind, names, own) for unit in units for kind in KINDS]
            if self.peaks:
                names, nearest = [f"{span:g} s" for span in SPANS], _nearest(SPANS, self.windows)
                blocks += [(kind, names, nearest) for kind in PEAKS]
        if "wavelets" in self.known_features:
            hertz = frequencies(self.scales, rate, self.mother)
            names, nearest = [f"{f:.6g} Hz" for f in hertz], _nearest(hertz, bands)
            phases = ("cosine of phase", "sine of phase") if self.circular else ("phase",)
            blocks += [(kind, names, nearest) for kind in ("log magnitude", *phases * self.phase)]
        return blocks

    def feature_bands(self, channels: int, rate: float) -> Whole:
        """Which of the k :meth:`bands` of which channel each feature is of, shape (f,).

        k times the channel, plus the band. One's own features, which are of none, are left out.
        """
        firsts = len(self.bands(rate)) * np.arange(channels)[:, None]
        blocks = [(firsts + bands).ravel() for _, _, bands in self._blocks(rate)]
        return np.concatenate([np.empty(0, dtype=np.int64), *blocks])

    def feature_names(self, channels: Sequence[str], rate: float) -> tuple[str, ...]:
        """What each feature is: channel, kind, and window or span in seconds, or frequency in Hz.

        Parameters
        ----------
        channels : sequence of str
            Recognition channels, in order.
        rate : float
            Samples a second of the grid.
        """
        known = (
            f"{channel} {kind} {name}"
            for kind, names, _ in self._blocks(rate)
            for channel in channels
            for name in names
        )
        own = (
            f"{path} {number}"
            for path in self.own_features
            for number in range(1, plugin_width(path, len(channels), rate) + 1)
        )
        return (*known, *own)

    def hop(self, rate: float) -> int:
        """Samples of the grid from one time step with features to the next."""
        return 1 if self.step is None else max(1, round(self.step * rate))

    def steps(self, samples: int, rate: float) -> slice:
        """Which of so many samples of the grid are time steps with features.

        Each lies in the middle of the samples that it stands for; every one where there is no step.
        """
        hop = self.hop(rate)
        return slice(min(hop // 2, samples - 1), None, hop)

    def training_stride(self, rate: float) -> int:
        """Time steps from one that is trained on to the next, at this rate of the grid.

        Where samples are farther apart than time steps are to be, fewer of them take as many
        seconds as `stride` time steps.
        """
        if self.step is None or self.step * rate >= 1:
            return self.stride
        return max(1, round(self.stride * self.step * rate))

    @property
    def plugins(self) -> tuple[tuple[Kind, str], ...]:
        """The import paths that these settings name, with their kinds."""
        features: list[tuple[Kind, str]] = [("features", path) for path in self.own_features]
        if is_import_path(self.classifier):
            return ("classifier", self.classifier), *features
        return tuple(features)

    def __reduce__(self) -> tuple[Any, ...]:
        """A copy for another process: what was named here is named there."""
        return _unpickle, (dict(vars(self)), named_here(self.plugins))

    def replace(self, **changes: Any) -> Settings:
        """The same settings with some values changed."""
        return dataclasses.replace(self, **changes)

    def to_json(self) -> dict[str, Any]:
        """Plain values that :meth:`from_json` turns back into equal settings."""
        values = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        values["channels"] = None if self.channels is None else list(self.channels)
        values["windows"] = list(self.windows)
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
        field_names = {f.name for f in dataclasses.fields(cls)}
        unknown = sorted(set(values) - field_names)
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
            if (windows := changed.get("windows")) is not None:
                if not isinstance(windows, list):
                    raise TypeError("windows is no list of numbers")
                changed["windows"] = tuple(windows)
            if changed.get("amplitude") == "chosen":  # of older versions; features are the same
                changed["amplitude"] = "both"
            changed["merge"] = MergeMap.from_json(changed.get("merge", {}))
            return cls(**changed)
        except TypeError as error:
            raise InputError(f"The settings hold a value of the wrong type: {error}.") from error


def _unpickle(values: dict[str, Any], named: tuple[Named, ...]) -> Settings:
    name_as(named)
    return Settings(**values)


_FEATURE_FIELDS = (
    SettingField(
        "features",
        "choice",
        "Features",
        (
            "Wavelets distinguish frequencies; windows also see how firm the grip is and take less "
            "time."
        ),
        options=(
            ("wavelets", "Wavelets"),
            ("windows", "Level, slope and strength in windows"),
            ("windows+wavelets", "Windows and wavelets"),
        ),
    ),
    SettingField(
        "channels",
        "channels",
        "Channels",
        "The channels the recogniser uses; leaving some out saves time.",
    ),
    SettingField(
        "rate",
        "number",
        "Rate",
        "Samples per second at which features are computed; off: the rate of the demonstrations.",
        lowest=0.1,
        highest=1e5,
        step=100.0,
        decimals=1,
        unit="Hz",
        default=1000.0,
    ),
    SettingField(
        "wavelet",
        "choice",
        "Wavelet",
        "The waveform with which the forces are compared at every scale.",
        options=(
            ("morlet", "Morlet (complex)"),
            ("real-morlet", "Morlet (real part)"),
            ("uncorrected-morlet", "Morlet (uncorrected)"),
            ("torrence-compo", "Morlet (Torrence and Compo)"),
            ("dog", "Derivative of a Gaussian"),
            ("haar", "Haar"),
        ),
    ),
    SettingField(
        "parameter",
        "number",
        "Parameter p",
        (
            "Morlet: number of oscillations; more resolve frequency better, fewer resolve time "
            "better. Gaussian: order of the derivative."
        ),
        highest=1000.0,
        decimals=2,
    ),
    SettingField(
        "min_scale",
        "number",
        "Smallest scale",
        "The finest detail that is analysed.",
        lowest=0.1,
        highest=1e5,
        decimals=1,
        unit="samples",
    ),
    SettingField(
        "max_scale",
        "number",
        "Largest scale",
        (
            "The slowest movement that is analysed. Very large scales show the position within "
            "the choreography, which need not carry over to another task."
        ),
        lowest=0.1,
        highest=1e5,
        step=64.0,
        decimals=1,
        unit="samples",
    ),
    SettingField(
        "spacing",
        "number",
        "Octaves apart",
        "Octaves from one scale to the next.",
        lowest=0.01,
        highest=10.0,
        step=0.25,
        decimals=2,
    ),
    SettingField("phase", "flag", "Phases", "Phases beside the magnitudes: twice the features."),
    SettingField(
        "circular",
        "flag",
        "Cosine and sine",
        "Of each phase, in place of the angle, which jumps at half a turn.",
    ),
    SettingField(
        "amplitude",
        "choice",
        "Unit of forces",
        (
            "Dividing by each demonstration's own amplitude removes how hard people grip; but "
            "hard and soft objects differ in nothing else."
        ),
        options=(
            ("absolute", "As recorded"),
            ("own", "Each demonstration's own amplitude"),
            ("both", "Both side by side"),
        ),
    ),
    SettingField(
        "peaks",
        "flag",
        "Peaks",
        (
            "How far each channel is from its highest and its lowest level, before and after: "
            "whether it has peaked or is about to."
        ),
    ),
    SettingField(
        "step",
        "number",
        "Time step",
        "Between two decisions; off: every sample. 0.02 s costs no accuracy.",
        lowest=0.001,
        highest=10.0,
        step=0.01,
        decimals=3,
        unit="s",
        default=0.02,
    ),
)


#: What learns the actions, and from how much.
_CLASSIFIER_FIELDS = (
    SettingField(
        "classifier",
        "choice",
        "Classifier",
        "What learns the actions from the features.",
        options=tuple((name, kind.label) for name, kind in REGISTRY.items()),
    ),
    SettingField(
        "balanced", "flag", "Balance rare actions", "Every action has the same weight in training."
    ),
    SettingField(
        "calibrated",
        "flag",
        "Calibrate",
        "Of predictions at 80 % probability, 80 % are right; fitted on demonstrations left out.",
    ),
    SettingField(
        "trimmed",
        "flag",
        "Skip contradicted segments",
        (
            "Train without the segments that the other demonstrations contradict, which are likely "
            "coding errors; at most a third of an action's."
        ),
    ),
    SettingField(
        "stride",
        "whole",
        "Stride",
        (
            "Train on every Nth time step. Neighbouring ones are almost copies: with every 10th "
            "sample, training takes a sixth of the time. Recognition always covers all of them."
        ),
        lowest=1,
        highest=1e6,
        unit="time steps",
    ),
    SettingField(
        "seed", "whole", "Seed", "The same seed gives the same recogniser again.", highest=2**32 - 1
    ),
)

#: How single decisions become segments.
_DECODER_FIELDS = (
    SettingField(
        "decoder",
        "choice",
        "Decoder",
        (
            "How single decisions become segments: by filters, or as the most probable course of "
            "the whole demonstration."
        ),
        options=(("filters", "Filters"), ("semi-markov", "Semi-Markov decoder")),
    ),
    SettingField(
        "choreography",
        "choice",
        "Choreography",
        "What the decoder learns of the task; the less, the better it carries over to others.",
        options=(
            ("none", "Nothing"),
            ("durations", "Durations of actions"),
            ("order", "Durations and order"),
        ),
    ),
    SettingField(
        "changes",
        "flag",
        "Learn where actions change",
        "A contact, a slip or a snap tells the decoder where one action gives way to another.",
    ),
    SettingField(
        "threshold",
        "number",
        "Probability threshold",
        "Decisions less probable than this become unlabelled.",
        highest=1.0,
        step=0.05,
        decimals=2,
        default=0.8,
    ),
    SettingField(
        "median",
        "whole",
        "Median filter",
        (
            "Width of a running median over the labels' numbers. An even width can give an "
            "action that neither neighbour has."
        ),
        lowest=1,
        highest=1e5,
        unit="samples",
        default=10,
    ),
    SettingField(
        "drop",
        "number",
        "Drop segments shorter than",
        "As a share of the shortest training segment of the same action.",
        highest=100.0,
        step=0.025,
        decimals=3,
        unit="of the shortest",
        default=0.125,
    ),
)

_MERGE_FIELD = SettingField(
    "merge",
    "merge",
    "Merge map",
    "Spellings to take as one action in training and scoring; your labels stay as they are.",
)

#: The parts of the form, in order, each with its title.
FIELD_GROUPS = {
    "Features": _FEATURE_FIELDS,
    "Classifier": _CLASSIFIER_FIELDS,
    "Timeline": _DECODER_FIELDS,
    "Labels": (_MERGE_FIELD,),
}

#: Every setting of the form, in its order.
FIELDS = tuple(field for fields in FIELD_GROUPS.values() for field in fields)

#: The settings of the command line that the form has no room for.
WINDOWS_FIELD = SettingField(
    "windows", "windows", "Windows", "Standard deviations of the windows, rising.", unit="s"
)

#: The words of each setting that is one of several, but of the wavelet, which says itself what it
#: may be; and the settings that are on or off.
_CHOICES = {
    field.name: tuple(word for word, _ in field.options)
    for field in FIELDS
    if field.options and field.name != "wavelet"
}
_SWITCHES = [field.name for field in FIELDS if field.kind == "flag"]


def _value_text(value: object) -> str:
    """A value in a sentence."""
    if isinstance(value, tuple):
        return ", ".join(str(item) for item in value) or "none"
    return str(value)


Check = Callable[[Any], bool]


def _number(least: float, most: float) -> Check:
    """A number (True and False are none) in a range; NaN is in none."""
    return lambda value: type(value) in (int, float) and least <= value <= most


def _whole(least: int, most: int) -> Check:
    """An int (True and False are none) in a range."""
    return lambda value: type(value) is int and least <= value <= most


def _optional(check: Check) -> Check:
    return lambda value: value is None or check(value)


def _are_names(values: Sequence[object]) -> bool:
    return all(isinstance(name, str) for name in values) and len(set(values)) == len(values)


def _are_windows(values: object) -> bool:
    return (
        isinstance(values, tuple)
        and 1 <= len(values) <= 32
        and all(map(_number(1e-4, 1e3), values))
        and all(a < b for a, b in itertools.pairwise(values))
    )


_SCALE = (_number(1e-3, LARGEST_SCALE), f"be from 0.001 to {LARGEST_SCALE:.0f} samples")
#: Whether a setting's value is in its range, and what the range is.
_RANGES: Mapping[str, tuple[Check, str]] = {
    "preset": (lambda value: isinstance(value, str), "be a name"),
    "channels": (_optional(_are_names), "name each channel once"),
    "rate": (_optional(_number(*RATES)), f"be from {RATES[0]:g} to {RATES[1]:,.0f} Hz"),
    "parameter": (_optional(_number(0, 1e6)), "be from 0 to 1,000,000"),
    "min_scale": _SCALE,
    "max_scale": _SCALE,
    "spacing": (_number(1e-3, 100), "be from 0.001 to 100 octaves"),
    **dict.fromkeys(_SWITCHES, (lambda value: isinstance(value, bool), "be true or false")),
    "windows": (
        _are_windows,
        "be 1 to 32 numbers of seconds from 0.0001 to 1000, the smallest first",
    ),
    "step": (_optional(_number(1e-6, 1e3)), "be from 0.000001 to 1000 seconds"),
    "stride": (_whole(1, 2**31 - 1), "be a whole number from 1 to 2^31 - 1"),
    "threshold": (_optional(_number(0, 1)), "be from 0 to 1"),
    "median": (_optional(_whole(1, WIDEST)), f"be a whole number from 1 to {WIDEST:,}"),
    "drop": (_optional(_number(0, 1e6)), "be from 0 to 1,000,000"),
    "seed": (_whole(0, 2**32 - 1), "be a whole number from 0 to 2^32 - 1"),
}


#: A setting, and what it has to be.
Need = tuple[str, Collection[Any]]

_WAVELETS: Need = ("features", tuple(f for f in _CHOICES["features"] if "wavelets" in f))
_WINDOWS: Need = ("features", tuple(f for f in _CHOICES["features"] if "windows" in f))
_PLAIN: Need = ("classifier", PLAIN_CLASSIFIERS)
#: Those that draw something at random.
_DRAWN: Need = ("classifier", tuple(name for name, kind in REGISTRY.items() if kind.random))
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


def applies(name: str, values: Mapping[str, Any]) -> bool:
    """Whether a setting changes anything, given all of them by name."""
    return _unmet_need(name, values) is None


def why_not_applied(name: str, values: Mapping[str, Any]) -> str:
    """Why a setting changes nothing, as the end of a sentence; empty where it does."""
    need = _unmet_need(name, values)
    if need is None:
        return ""
    other, accepted = need
    return (
        f"with {other} {_word(values[other])}; it needs {other} {' or '.join(map(_word, accepted))}"
    )


def _unmet_need(name: str, values: Mapping[str, Any]) -> Need | None:
    """The first condition of a setting that is not met."""
    if name == "seed" and is_import_path(values["classifier"]):
        return None  # which may draw something
    if name == "seed" and (values["trimmed"] or (values["changes"] and applies("changes", values))):
        return None  # of them, too, something is drawn
    if name in ("balanced", "calibrated") and values["features"] != "wavelets":
        return None  # of any classifier: the features are standardised
    values = {**values, "features": _known_features(values["features"])}
    return next((need for need in _NEEDS.get(name, ()) if values[need[0]] not in need[1]), None)


def _nearest(values: ArrayLike, bands: ArrayLike) -> Whole:
    """Which band is nearest to each value, in octaves."""
    return np.abs(np.log(np.divide.outer(values, bands))).argmin(axis=1)


def _known_features(features: str) -> str:
    """A kind of features without one's own."""
    return "+".join(part for part in features.split("+") if not is_import_path(part))


def _word(value: object) -> str:
    """A value as it is written."""
    return {True: "on", False: "off"}[value] if isinstance(value, bool) else str(value)
