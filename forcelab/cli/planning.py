"""``forcelab plan``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from forcelab.cli.output import json_text, printable, table
from forcelab.cli.settings import settings_from
from forcelab.errors import InputError
from forcelab.project import DemonstrationInfo, Project
from forcelab.recognition.planning import Part, planned
from forcelab.recognition.settings import Settings, preset


def run(arguments: argparse.Namespace) -> None:
    """Tell what is computed of a demonstration and what is left out."""
    settings = settings_from(arguments)
    if arguments.recogniser is not None:
        if settings != preset("paper"):
            raise InputError("A recogniser brings its own settings; give --recogniser alone.")
        settings = _settings_of(arguments.recogniser)
    with Project.open(arguments.project) as project:
        demonstration = project.load(arguments.demonstration)
        info = next(i for i in project.demonstrations() if i.id == demonstration.id)
        parts = planned(demonstration, info.authors, settings)
    mechanics = _mechanics(info)
    if arguments.json:
        content = {
            "demonstration": info.name,
            "id": info.id,
            "recognition": [asdict(part) for part in parts],
            "mechanics": mechanics,
        }
        print(json_text(content))
        return
    title = f"{info.name} of task '{info.task}', {info.duration:.2f} s"
    print("\n\n".join([printable(title), _told(parts), *_told_mechanics(mechanics)]))


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
    from forcelab.simulation.layout import Layout, left_out
    from forcelab.simulation.tasks import scene_of

    scene = scene_of(origin.task, origin.seed, origin.number)
    return {
        "source": info.source,
        "states": list(Layout.of(scene).names),
        "left out": list(left_out(scene)),
    }


def _told(parts: Sequence[Part]) -> str:
    """What is computed, then what is left out."""
    rows = [
        ["computed" if part.computed else "left out", part.name, part.why]
        for part in sorted(parts, key=lambda part: not part.computed)
    ]
    return table([["", "what", "why"], *rows])


def _told_mechanics(mechanics: dict[str, Any] | None) -> list[str]:
    """The mechanics of a simulated demonstration."""
    if mechanics is None:
        return []
    states, left_out = mechanics["states"], mechanics["left out"]
    return [
        f"{mechanics['source']}",
        f"The mechanics have {len(states)} states: {', '.join(states)}.",
        "\n".join(["They leave out:", *(f"  {what}" for what in left_out)]),
    ]
