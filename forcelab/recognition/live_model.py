"""The live models of a recogniser whose features or decoder need whole demonstrations.

The same demonstrations are learnt once more, from what a stream knows of them: for each of a few
times ahead a classifier of :class:`CausalWindows`. Trees and logistic regression are averaged,
which does as well as either on each of the paper's recordings, and takes no choosing.

Where offline probabilities are calibrated, these are, too, in the same way: on demonstrations that
inner fits have not seen. One exponent, found for the time ahead in the middle, serves all. On the
paper's stylus recordings it takes the expected calibration error from 4.3 to 3.4 points and the
Brier score from 0.253 to 0.254, on foam from 1.7 to 2.1 and from 0.0930 to 0.0925; decoded, 0.2 and
0.04 points more of the labels are right.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from forcelab.arrays import Real, Whole
from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.recognition.ensemble import (
    CalibratedEnsemble,
    FitOptions,
    fit_ensemble,
    training_steps,
)
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.features import (
    KINDS,
    RunningSize,
    contraharmonic_size,
    cut_window_features,
)
from forcelab.recognition.forest import require, require_numbers
from forcelab.recognition.settings import Settings
from forcelab.signals.channels import channel_map
from forcelab.signals.grid import on_grid

#: Seconds ahead that there is a classifier for.
LOOKS = (0.0, 0.05, 0.15)
#: The one of them for which probabilities are calibrated: inner fits take five times as long.
CALIBRATING = 0.05
#: Share of a latency that may go into looking ahead; the decoder has the rest.
SHARE = 0.6
#: Seconds from one time step to the next where the settings say nothing.
STEP = 0.02
#: What learns; see the module.
CLASSIFIER = "ensemble"


#: Channels beyond so many times their usual size count as this.
LARGEST = 1e6


@dataclass(frozen=True, eq=False)
class CausalWindows:
    """The windows of a stream, and the units of its forces."""

    windows: tuple[float, ...]  # length k; standard deviations in seconds
    look: float  # seconds after a time step that may be seen
    usual: Real  # (q,); size of each channel's movements in training, above 0
    own: bool  # whether forces are in units of the stream's own size

    @property
    def width(self) -> int:
        """Features of a time step: for each kind all windows of channel 1, then of channel 2."""
        return len(KINDS) * len(self.usual) * len(self.windows)

    def features(
        self, channels: Real, rate: float, steps: Whole, size: RunningSize, first: int = 0
    ) -> Real:
        """Features (m, f) of rising time steps of finite channels (q, n) at `rate` Hz.

        `size` is the stream's, which has taken the samples before `first`.
        """
        ahead = round(self.look * rate)
        ready = np.clip(channels / self.usual[:, None], -LARGEST, LARGEST)
        features = cut_window_features(ready, rate, self.windows, steps, ahead)
        if self.own:
            for values, last in zip(features, (steps + ahead + 1).tolist(), strict=True):
                rest, own_size = size.take(ready[:, first:last])
                first = max(first, last)
                values[0] -= rest[:, None]
                np.divide(values, own_size[:, None], out=values)
        return features.reshape(len(steps), -1)


@dataclass(frozen=True, eq=False)
class LiveModel:
    """A classifier of causal windows, whose codes are the recogniser's."""

    windows: CausalWindows
    classifier: CalibratedEnsemble  # its codes are the recogniser's

    def plain(self) -> dict[str, Any]:
        """Numbers, lists and arrays for :meth:`from_plain`."""
        windows = self.windows
        return {
            "windows": list(windows.windows),
            "look": windows.look,
            "usual": windows.usual,
            "own": windows.own,
            "classifier": self.classifier.plain(),
        }

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any], channels: int, actions: int) -> LiveModel:
        """Check what was read from a file, of so many channels and actions.

        A ValueError where it does not fit together; a missing or wrong part may raise other errors.
        """
        usual = plain["usual"]
        require_numbers(usual, (channels,))
        require((usual > 0).all(), "usual sizes above 0")
        look, own = float(plain["look"]), plain["own"]
        require(0 <= look <= max(LOOKS) and isinstance(own, bool), "windows of a stream")
        try:  # the settings know what windows may be
            spreads = Settings(windows=tuple(plain["windows"])).windows
        except InputError as error:
            raise ValueError("windows that there can be") from error
        windows = CausalWindows(spreads, look, usual, own)
        known = CalibratedEnsemble.from_plain(plain["classifier"], windows.width, actions)
        return cls(windows, known)


def needs_live_model(settings: Settings) -> bool:
    """Whether features or decoder need all of a demonstration, so that streams cannot do."""
    own = settings.features != "wavelets" or settings.circular or settings.step is not None
    return own or settings.decodes


def live_hop(settings: Settings, rate: float) -> int:
    """Samples between two time steps of a stream at this rate."""
    return max(1, round((settings.step or STEP) * rate))


def choose_live_model(parts: Sequence[LiveModel], seconds: float) -> LiveModel:
    """The live model that suits so many seconds to look ahead and to decode in."""
    fits = [part for part in parts if part.windows.look <= SHARE * seconds]
    return fits[-1] if fits else parts[0]


def fit_live_models(
    labelled: Sequence[LabelledDemonstration],
    settings: Settings,
    rate: float,
    actions: tuple[str, ...],
    own: bool,
) -> Generator[Progress, None, tuple[LiveModel, ...]]:
    """Learn the actions from demonstrations as a stream would know them, on a grid of `rate` Hz.

    With `own` forces count in units of each demonstration's own size; labels of other actions are
    left out.
    """
    stepping = settings.replace(step=settings.step or STEP)
    prepared = [prepare_examples(item, stepping, rate, kept=False) for item in labelled]
    sizes = [contraharmonic_size(*_gridded(item, settings, rate)) for item in labelled]
    usual = np.median(sizes, axis=0)
    usual[usual == 0] = 1.0  # of a channel that never moves
    y, groups, steps = training_steps([examples.codes(actions) for examples in prepared])
    if len(np.unique(y)) < 2:  # all but one fell between two steps: no stream can be followed
        return ()
    parts: dict[float, LiveModel] = {}
    exponent = 1.0
    for i, look in enumerate(sorted(LOOKS, key=lambda look: look != CALIBRATING)):
        windows = CausalWindows(settings.windows, look, usual, own)
        calibrated = settings.calibrated and look == CALIBRATING
        options = FitOptions(groups, balanced=settings.balanced, calibrated=calibrated)
        # Of one demonstration after the other only what is learnt from: that is a part of it.
        X, done = np.empty((len(y), windows.width)), 0
        for item, own_steps in zip(labelled, steps, strict=True):
            channels, own_rate = _gridded(item, settings, rate)
            every = stepping.steps(channels.shape[1], own_rate)
            places = np.arange(channels.shape[1])[every]
            size = RunningSize(len(channels), own_rate)
            found = windows.features(channels, own_rate, places, size)
            X[done : done + len(own_steps)] = found[own_steps]
            done += len(own_steps)
        ensemble = finish(fit_ensemble(CLASSIFIER, X, y, settings.seed, options))
        del X  # before the next one is gathered
        exponent = ensemble.exponent if calibrated else exponent
        parts[look] = LiveModel(windows, replace(ensemble, exponent=exponent))
        yield Progress(i + 1, len(LOOKS), "fit")
    return tuple(parts[look] for look in LOOKS)


def _gridded(item: LabelledDemonstration, settings: Settings, rate: float) -> tuple[Real, float]:
    """The channels of a demonstration on its grid, (q, n), and their rate; not kept."""
    channels = channel_map(item.demonstration.channels, settings.channels)
    grid = on_grid(item.demonstration, rate, channels.recorded)
    return channels.apply(grid.signals), grid.rate
