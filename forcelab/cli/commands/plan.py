"""Tell what is computed of a demonstration, and what is left out.

Which modules, panels and decoders the window needs for it, and what is computed to
recognise it with these settings, or those of a trained recogniser. Of a simulated
demonstration also which states the mechanics have and which parts the scene does
without. Nothing of it is computed, unless --measure asks what all of it costs.

for example:
  forcelab plan lab.forcelab pull-03 --preset best --measure
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from forcelab.cli.options import UsageError, add_json, add_project
from forcelab.cli.output import json_text, printable, progress_bar, table
from forcelab.cli.settings_options import add_changes, settings_from
from forcelab.demonstration import Demonstration
from forcelab.jobs import finish
from forcelab.measure.needs import Cost, measuring_needs, viewed
from forcelab.measure.rows import MEGABYTE
from forcelab.project import DemonstrationInfo, Project
from forcelab.recognition.planning import Part, planned
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    add_project(parser)
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument(
        "--recogniser",
        metavar="FILE",
        type=Path,
        help="with the settings of this one, a file that train wrote",
    )
    parser.add_argument(
        "--measure", action="store_true", help="measure time and memory, taken and saved"
    )
    parser.set_defaults(merge=None)
    add_changes(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    """Tell what is computed of a demonstration and what is left out."""
    settings = settings_from(arguments)
    if arguments.recogniser is not None:
        if settings != preset("paper"):
            raise UsageError("A recogniser brings its own settings; give --recogniser alone.")
        settings = _settings_of(arguments.recogniser)
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
        info = next(i for i in project.demonstrations.infos() if i.id == demonstration.id)
        viewing = viewed(demonstration, info.authors)
        parts = planned(demonstration, settings)
        costs = _measured(demonstration, settings) if arguments.measure else None
    mechanics = _mechanics(info)
    if arguments.json:
        content = {
            "demonstration": info.name,
            "id": info.id,
            "viewing": [asdict(part) for part in viewing],
            "recognition": [asdict(part) for part in parts],
            "mechanics": mechanics,
            "measured": None if costs is None else [asdict(cost) for cost in costs],
        }
        print(json_text(content))
        return
    title = printable(f"{info.name} of task '{info.task}', {info.duration:.2f} s")
    told = [_parts_table("to view it", viewing), _parts_table("to recognise it", parts)]
    measured = [] if costs is None else [_costs_table(costs)]
    print("\n\n".join([title, *told, *_mechanics_lines(mechanics), *measured]))


def _measured(demonstration: Demonstration, settings: Settings) -> tuple[Cost, ...]:
    """What everything costs, or would cost."""
    with progress_bar("measuring") as watch:
        return finish(measuring_needs(demonstration, settings), watch)


def _settings_of(file: Path) -> Settings:
    """The settings of a trained recogniser, with the channels and the rate it learnt."""
    from forcelab.recognition.storage import load

    recogniser = load(file)
    return recogniser.settings.replace(channels=recogniser.channels, rate=recogniser.rate)


def _mechanics(info: DemonstrationInfo) -> dict[str, Any] | None:
    """The states that a simulated demonstration was made with; None for any other."""
    from forcelab.simulation.origin import Origin

    origin = Origin.parsed(info.source)
    if origin is None:
        return None
    from forcelab.simulation.state_layout import Layout, left_out
    from forcelab.simulation.tasks import scene_of

    scene = scene_of(origin.task, origin.seed, origin.number)
    return {
        "source": info.source,
        "states": list(Layout.of(scene).names),
        "left out": list(left_out(scene)),
    }


#: What is said of a part that is computed, and of one that is not.
_WORDS = {True: "computed", False: "left out"}


def _parts_table(title: str, parts: Sequence[Part]) -> str:
    """What is computed, then what is left out."""
    rows = [
        [_WORDS[part.computed], part.name, part.why]
        for part in sorted(parts, key=lambda part: not part.computed)
    ]
    return table([["", title, "why"], *rows])


def _costs_table(costs: Sequence[Cost]) -> str:
    """What is paid for, then what is saved, each with its sum."""
    rows = []
    for computed, word in _WORDS.items():
        some = [cost for cost in costs if cost.computed == computed]
        rows += [
            [word, cost.name, _amount(cost.seconds), _amount(cost.bytes, MEGABYTE)] for cost in some
        ]
        seconds = sum(cost.seconds or 0.0 for cost in some)
        taken = sum(cost.bytes or 0 for cost in some)
        rows.append([word, "all of this", _amount(seconds), _amount(taken, MEGABYTE)])
    refused = [printable(f"{cost.name}: {cost.refusal}") for cost in costs if cost.refusal]
    return "\n".join([table([["", "measured", "CPU s", "MB"], *rows], right=(2, 3)), *refused])


def _amount(value: float | None, unit: float = 1.0) -> str:
    """A number for a column; a dash where there is none."""
    return "-" if value is None else f"{value / unit:.3f}" if unit == 1 else f"{value / unit:.1f}"


def _mechanics_lines(mechanics: dict[str, Any] | None) -> list[str]:
    """The mechanics of a simulated demonstration."""
    if mechanics is None:
        return []
    states, left_out = mechanics["states"], mechanics["left out"]
    return [
        f"{mechanics['source']}",
        f"The mechanics have {len(states)} states: {', '.join(states)}.",
        "\n".join(["They leave out:", *(f"  {what}" for what in left_out)]),
    ]
