"""What a demonstration needs of the program, what it does without, and what either costs."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from forcelab.demonstration import Demonstration
from forcelab.jobs import Progress, finish
from forcelab.measure.loading import VIDEO, loading
from forcelab.measure.timing import Timed, Way, timed_ways
from forcelab.recognition.planning import Part
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings
from forcelab.signals.channels import channel_map
from forcelab.signals.cwt import usual_scales

__all__ = ["Cost", "measuring_needs", "viewed"]

REPETITIONS = 3
#: So much of a long demonstration is transformed, in samples, to tell what that costs.
MEASURED = 1 << 16
#: A scalogram of a wide screen: rows, columns and the largest scale in samples.
ROWS, COLUMNS, LARGEST = 100, 1920, 1024.0

#: Modules that viewing does without, each after what it loads first, and why.
_LATER = (
    ("scikit-learn", "sklearn.neural_network", "nothing is trained or predicted to view it"),
    ("ensembles of scikit-learn", "sklearn.ensemble", "nothing is trained or predicted to view it"),
    ("Review workspace", "forcelab.gui.review.workspace", "built when it is first opened"),
    ("Capture workspace", "forcelab.gui.capture.workspace", "built when it is first opened"),
    ("pyserial", "serial", "nothing is captured"),
)


@dataclass(frozen=True, slots=True)
class Cost:
    """What a part costs, or would cost.

    Parameters
    ----------
    name : str
    computed : bool
        Whether it is paid for, or is saved.
    seconds : float or None
        CPU time, s; None where it could not be measured.
    bytes : int or None
        Memory: what a process holds more, or the peak of a computation.
    refusal : str
        Why it could not be measured; empty otherwise.
    """

    name: str
    computed: bool
    seconds: float | None
    bytes: int | None
    refusal: str = ""


def viewed(demonstration: Demonstration, authors: Sequence[str]) -> tuple[Part, ...]:
    """Tell what the window loads, builds and computes to show a demonstration.

    Parameters
    ----------
    demonstration : Demonstration
    authors : sequence of str
        Whose tracks there are.
    """
    film = demonstration.video is not None
    filmed = "there is a video" if film else "there is no video"
    others = len(channel_map(demonstration.channels).names) - 1
    return (
        Part("Qt and the window", True, "the command line does without"),
        Part("scipy.fft", True, "for the scalogram, while that is shown"),
        Part("OpenCV", film, filmed),
        Part("video decoder", film, filmed),
        Part("video panel", film, filmed),
        Part(
            "timelines",
            bool(authors),
            f"labelled by {', '.join(authors)}" if authors else "nothing is labelled",
        ),
        Part("scalogram of 1 channel", True, "the visible span at the screen's resolution"),
        *(
            Part(f"scalograms of {others} more", False, "only the channel that is shown")
            for _ in range(others > 0)
        ),
        *(Part(name, False, why) for name, _, why in _LATER),
    )


def measuring_needs(
    demonstration: Demonstration, settings: Settings, repetitions: int = REPETITIONS
) -> Generator[Progress, None, tuple[Cost, ...]]:
    """Measure what viewing and recognising a demonstration costs, and what is saved.

    Modules and the video are loaded in processes of their own. Of a long demonstration the first
    :data:`MEASURED` samples are transformed.

    Parameters
    ----------
    demonstration : Demonstration
    settings : Settings
    repetitions : int
        Medians are given.

    Returns
    -------
    tuple of Cost
        Paid and saved ones. What is saved of the features is the difference to all channels,
        scales, phases and time steps.
    """
    stages = tuple(_stages(demonstration))
    loaded = yield from loading([what for _, _, what in stages], repetitions)
    costs = [
        Cost(name, computed, one.seconds, one.resident, one.refusal)
        for (name, computed, _), one in zip(stages, loaded, strict=True)
    ]
    beginning = replace(
        demonstration,
        times=demonstration.times[:MEASURED],
        signals=demonstration.signals[:MEASURED],
    )
    ways = tuple(_ways(beginning, settings))
    timed = yield from timed_ways([way for _, way in ways], repetitions)
    found = {way.name: one for (_, way), one in zip(ways, timed, strict=True)}
    for computed, way in ways:
        costs.append(
            _timed(way.name, computed, found[way.name], found.get(_BESIDE.get(way.name, "")))
        )
    return tuple(costs)


def _stages(demonstration: Demonstration) -> Iterator[tuple[str, bool, str]]:
    """Name, whether it is needed, and what is loaded; what is needed comes first."""
    yield "Qt and the window", True, "forcelab.gui.window"
    yield "scipy.fft", True, "scipy.fft"
    video = demonstration.video
    yield "OpenCV", video is not None, "cv2"
    if video is not None:
        yield "video decoder, first picture", True, f"{VIDEO}{video.path}"
    for name, module, _ in _LATER:
        yield name, False, module


_FEATURES, _REST, _WAVELETS = "features", "channels, scales, phases, steps left out", "wavelets"
_SHOWN, _HIDDEN = "scalogram of 1 channel", "scalograms of the other channels"
#: What is measured with what is needed in it, and is told without it.
_BESIDE = {_REST: _FEATURES}


def _ways(
    demonstration: Demonstration, settings: Settings
) -> Iterator[tuple[bool, Way[None, None]]]:
    """What is transformed, each with whether it is needed."""
    names = channel_map(demonstration.channels).names  # in this order the window offers them
    yield True, _way(_SHOWN, partial(_scalograms, demonstration, names[:1]))
    if len(names) > 1:
        yield False, _way(_HIDDEN, partial(_scalograms, demonstration, names[1:]))
    yield True, _way(_FEATURES, partial(_features, demonstration, settings))
    everything = _everything(demonstration, settings)
    if everything != settings:
        yield False, _way(_REST, partial(_features, demonstration, everything))
    if settings.features == "windows":
        paper = preset("paper").replace(channels=settings.channels, rate=settings.rate)
        yield False, _way(_WAVELETS, partial(_features, demonstration, paper))


def _way(name: str, run: Callable[[], None]) -> Way[None, None]:
    """A way whose result is of no interest."""
    return Way(name, run, lambda _: None)


def _everything(demonstration: Demonstration, settings: Settings) -> Settings:
    """The same features without leaving anything out."""
    every = channel_map(demonstration.channels).names
    channels = settings.channels if settings.channels in (None, every) else None
    if settings.features == "windows":
        return settings.replace(channels=channels, step=None)
    rate = settings.rate or demonstration.rate
    samples = max(1, round(demonstration.duration * rate))
    usual = usual_scales(samples, settings.min_scale, settings.spacing)
    widest = float(max(settings.max_scale, usual[-1] if len(usual) else 0.0))
    return settings.replace(channels=channels, phase=True, step=None, max_scale=widest)


def _features(demonstration: Demonstration, settings: Settings) -> None:
    """Compute the features."""
    from forcelab.recognition.examples import LabelledDemonstration, prepare_examples

    prepare_examples(LabelledDemonstration(demonstration), settings)


def _scalograms(demonstration: Demonstration, names: Sequence[str]) -> None:
    """Compute scalograms of a whole demonstration as a wide screen shows them."""
    from forcelab.signals.scalogram import row_scales, scalogram, survey

    scales = row_scales(ROWS, LARGEST)
    start, end = demonstration.start, demonstration.end
    for name in names:
        view = finish(survey(demonstration, name, LARGEST))
        finish(scalogram(view, start, end, scales=scales, columns=COLUMNS))


def _timed(name: str, computed: bool, one: Timed[None], within: Timed[None] | None) -> Cost:
    """What a computation cost, without what is needed anyhow and is computed within it."""
    if one.refusal:
        return Cost(name, computed, None, None, one.refusal)
    if within is None or within.refusal:
        return Cost(name, computed, one.seconds, one.peak_bytes)
    return Cost(
        name,
        computed,
        max(0.0, one.seconds - within.seconds),
        max(0, one.peak_bytes - within.peak_bytes),
    )
