"""Show what is computed for a demonstration, and what is left out.

Which modules, panels and decoders the window needs for it, and what is computed to
recognise it with these settings, or those of a trained recogniser. Of a simulated
demonstration also which states the mechanics have and which parts the scene does
without. Nothing of it is computed, unless --measure asks what all of it costs.

for example:
  forcelab plan lab.forcelab pull-03 --preset best --measure
"""

from __future__ import annotations

import argparse
from collections.abc import Generator, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

from forcelab.cli.options import UsageError, add_demonstration, add_file, add_json, add_project
from forcelab.cli.output import json_text, printable, progress_bar, table
from forcelab.cli.settings_options import add_changes, settings_from
from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import Progress, finish
from forcelab.measure.rows import MEGABYTE
from forcelab.measure.timing import VIDEO, Work, measure_works
from forcelab.project import Project
from forcelab.recognition.examples import LabelledDemonstration, prepare_examples
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import FIELDS, Settings, why_not_applied
from forcelab.signals.channels import ChannelMap, channel_map
from forcelab.signals.cwt import frequencies, usual_scales
from forcelab.signals.scalogram import open_channel, row_scales, scalogram
from forcelab.simulation.mechanics import Layout, left_out
from forcelab.simulation.origin import Origin

#: Samples of a long demonstration that are turned into features to tell what that costs.
MEASURED = 1 << 16
#: A scalogram of a wide screen: rows, columns and the largest scale in samples.
ROWS, COLUMNS, LARGEST = 100, 1920, 1024.0
FEATURES, REST = "features of the settings", "all other features"
WORDS = {True: "computed", False: "left out"}


@dataclass(frozen=True, slots=True)
class Part:
    """Something that costs time or memory where it is computed, and what measures it."""

    name: str
    computed: bool
    why: str
    work: Work = ""


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_demonstration(parser)
    add_file(parser, "--recogniser", "use a recogniser's settings")
    parser.add_argument("--measure", action="store_true", help="time and memory, taken and saved")
    parser.set_defaults(merge=None)
    add_changes(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    settings = settings_from(arguments)
    if arguments.recogniser is not None:
        if settings != preset("paper"):
            raise UsageError("A recogniser brings its own settings; give --recogniser alone.")
        from forcelab.recognition.storage import load_recogniser  # needs scikit-learn

        recogniser = load_recogniser(arguments.recogniser)
        settings = recogniser.settings.replace(channels=recogniser.channels, rate=recogniser.rate)
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
        info = next(i for i in project.demonstrations.infos() if i.id == demonstration.id)
    viewing = list(viewing_parts(demonstration, info.authors))
    parts = list(recognition_parts(demonstration, settings))
    content = dict[str, Any](demonstration=info.name, id=info.id, mechanics=None, measured=None)
    texts = [printable(f"{info.name} of task '{info.task}', {info.duration:.2f} s")]
    plans = {"viewing": ("to view it", viewing), "recognition": ("to recognise it", parts)}
    for key, (title, plan) in plans.items():
        content[key] = [{"name": p.name, "computed": p.computed, "why": p.why} for p in plan]
        rows = [[WORDS[part.computed], part.name, part.why] for part in plan]
        texts.append(table([["", title, "why"], *sorted(rows, key=lambda row: row[0])]))
    if (origin := Origin.parsed(info.source)) is not None:
        from forcelab.simulation.tasks import scene_of  # needs scipy.integrate

        scene = scene_of(origin.task, origin.seed, origin.number)
        states, missing = Layout.of(scene).names, left_out(scene)
        content["mechanics"] = {"source": info.source, "states": states, "left out": missing}
        texts += [info.source, f"The mechanics have {len(states)} states: {', '.join(states)}."]
        texts.append("\n  ".join(["They leave out:", *missing]))
    if arguments.measure:
        with progress_bar("measuring") as watch:
            content["measured"] = finish(measure_parts([*viewing, *parts]), watch)
        texts.append(costs_text(content["measured"]))
    print(json_text(content) if arguments.json else "\n\n".join(texts))


def viewing_parts(demonstration: Demonstration, authors: Sequence[str]) -> Iterator[Part]:
    """What the window loads, builds and computes to show a demonstration with these tracks."""
    yield Part("Qt and the window", True, "the command line does without", "forcelab.gui.window")
    yield Part("scipy.fft", True, "for the scalogram, while that is shown", "scipy.fft")
    video = demonstration.video
    why = "there is no video" if video is None else "there is a video"
    yield Part("OpenCV", video is not None, why, "cv2")
    yield Part("video decoder", video is not None, why, f"{VIDEO}{video.path}" if video else "")
    for other in demonstration.videos[1:]:
        yield Part(
            f"decoder of '{other.name}'", False, "not shown at first", f"{VIDEO}{other.path}"
        )
    yield Part("video panel", video is not None, why)
    yield Part("timelines", bool(authors), f"labelled by {', '.join(authors) or 'nobody'}")
    names = channel_map(demonstration.channels).names  # in this order the window offers them
    shown, hidden = (partial(_scalograms, demonstration, part) for part in (names[:1], names[1:]))
    yield Part("scalogram of 1 channel", True, "the visible span at the screen's resolution", shown)
    if more := len(names) - 1:
        yield Part(f"scalograms of {more} more", False, "only the channel that is shown", hidden)
    why = "nothing is trained or predicted to view it"
    yield Part("scikit-learn", False, why, "sklearn.neural_network")
    yield Part("ensembles of scikit-learn", False, why, "sklearn.ensemble")
    yield Part("Review workspace", False, "built when opened", "forcelab.gui.review.workspace")
    yield Part("Capture workspace", False, "built when opened", "forcelab.gui.capture.workspace")
    yield Part("pyserial", False, "nothing is captured", "serial")


def recognition_parts(demonstration: Demonstration, settings: Settings) -> Iterator[Part]:
    """What is computed to recognise a demonstration; `InputError` if a channel is missing."""
    recorded, rate = demonstration.channels, settings.rate or demonstration.rate
    chosen = channel_map(recorded, settings.channels)
    times, signals = demonstration.times[:MEASURED], demonstration.signals[:MEASURED]
    beginning = LabelledDemonstration(replace(demonstration, times=times, signals=signals))
    samples = round(demonstration.duration * rate)
    if "windows" in settings.known_features:
        sizes = ", ".join(f"{1000 * window:g}" for window in settings.windows)
        yield Part(f"{len(settings.windows)} windows", True, f"of {sizes} ms")
    if settings.known_features == "windows":
        paper = preset("paper").replace(channels=settings.channels, rate=settings.rate)
        wavelets = partial(prepare_examples, beginning, paper)
        yield Part("wavelets", False, "windows are looked at in their place", wavelets)
    elif settings.known_features:
        scales, hertz = settings.scales, frequencies(settings.scales, rate, settings.mother)
        span = f"{scales[0]:g} to {scales[-1]:g} samples at {rate:.6g} Hz, {settings.wavelet} of "
        yield Part(f"{len(scales)} scales", True, f"{span}{hertz[0]:.3g} to {hertz[-1]:.3g} Hz")
        possible = usual_scales(samples, settings.min_scale, settings.spacing)
        if wider := ", ".join(f"{scale:g}" for scale in possible[len(scales) :]):
            yield Part(f"scales of {wider} samples", False, "wider than the settings' largest")
    for path in settings.own_features:
        yield Part(path, True, "features of your own, beside these or alone")
    yield from _channel_parts(recorded, chosen)
    if settings.step is not None:
        yield Part("every time step", False, f"decided at {rate / settings.hop(rate):.6g} Hz")
    why = f"{settings.width(len(chosen.names), rate)} a time step"
    yield Part(FEATURES, True, why, partial(prepare_examples, beginning, settings))
    widest = max(settings.max_scale, float(min(samples, MEASURED)))
    complete = settings.replace(channels=None, step=None, phase=True, max_scale=widest)
    why = "those of all channels, scales, phases and time steps"
    yield Part(REST, False, why, partial(prepare_examples, beginning, complete))
    needed = settings.needs_probabilities
    why = "decoder or threshold need them" if needed else "no filter that is on needs them"
    yield Part("probabilities", needed, why)
    yield from _setting_parts(settings)


def _channel_parts(recorded: Sequence[Channel], chosen: ChannelMap) -> Iterator[Part]:
    """The channels that are recognised by, and what is left out of the recorded ones."""
    offered = channel_map(recorded)
    for name, places in zip(chosen.names, chosen.columns, strict=True):
        columns = ", ".join(recorded[chosen.recorded[place]].name for place in places)
        yield Part(f"channel {name}", True, f"from {columns}")
    for name in (name for name in offered.names if name not in chosen.names):
        yield Part(f"channel {name}", False, "the settings do not name it")
    for column in sorted(set(offered.recorded).difference(chosen.recorded)):
        yield Part(f"column {recorded[column].name}", False, "no computed channel needs it")


def _setting_parts(settings: Settings) -> Iterator[Part]:
    """The settings that are one of several words, and the filters."""
    for field in FIELDS:
        if field.kind in ("flag", "choice") or field.name in ("threshold", "median", "drop"):
            value, why = getattr(settings, field.name), why_not_applied(field.name, vars(settings))
            used = not why and value is not None and value is not False
            setting_text = (
                ("on" if value is True else f"{value} {field.unit}".strip()) if used else "off"
            )
            yield Part(field.label[0].lower() + field.label[1:], used, why or setting_text)


def _scalograms(demonstration: Demonstration, names: Sequence[str]) -> None:
    start, end, scales = demonstration.start, demonstration.end, row_scales(ROWS, LARGEST)
    for name in names:
        view = finish(open_channel(demonstration, name, LARGEST))
        finish(scalogram(view, start, end, scales=scales, columns=COLUMNS))


def measure_parts(parts: Sequence[Part]) -> Generator[Progress, None, list[dict[str, Any]]]:
    """Median CPU seconds and bytes of the parts that can be measured; None where one refuses."""
    costs = yield from measure_works({p.name: p.work for p in parts if p.work})
    costs[REST] = costs[REST].without(costs[FEATURES])  # which are measured in it
    measured = [p for p in parts if p.name in costs]
    return [{"name": p.name, "computed": p.computed} | asdict(costs[p.name]) for p in measured]


def costs_text(costs: Sequence[dict[str, Any]]) -> str:
    """What is paid for, then what is saved, each with its sum; then what refused."""
    rows: list[list[str]] = []
    for computed, word in WORDS.items():
        some = [c for c in costs if c["computed"] == computed and not c["refusal"]]
        measured = [(c["name"], c["seconds"], c["bytes"]) for c in some]
        measured.append(
            ("all of this", sum(row[1] for row in measured), sum(row[2] for row in measured))
        )
        rows += [[word, n, f"{cpu:.3f}", f"{memory / MEGABYTE:.1f}"] for n, cpu, memory in measured]
    refused = [printable(f"{cost['name']}: {cost['refusal']}") for cost in costs if cost["refusal"]]
    return "\n".join([table([["", "measured", "CPU s", "MB"], *rows], right=(2, 3)), *refused])
