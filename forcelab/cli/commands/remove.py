"""Remove demonstrations, runs and recognisers.

A demonstration goes for good, with its video, everybody's labels and their history,
notes, assignments and verdicts; runs and recognisers stay. A run goes with what it
predicted and its recogniser, unless another run has that too; labels stay, those
accepted from it as well, and verdicts, but not of which run they were. 'forcelab runs'
tells what each takes up. Without --yes it only says what would go.

for example:
  forcelab remove lab.forcelab pull-03 pull-04
  forcelab remove lab.forcelab --run 3 4 --yes
"""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from forcelab.cli.options import UsageError, add_project, json_flag
from forcelab.cli.output import json_text, percent, printable
from forcelab.errors import InputError
from forcelab.project import DemonstrationInfo, Project
from forcelab.text import amount, counted, listed

#: How many things a sentence names one by one.
NAMED = 8
#: Digits of an id that tell a recogniser, and that stand for its name where that is damaged.
SHORTEST, NAME = 6, 8


@dataclass
class _Removal:
    """What is to be removed, each once, and what goes with it, one text each.

    Recognisers are ids with names.
    """

    infos: list[DemonstrationInfo] = field(default_factory=list)
    heads: dict[str, dict[str, int]] = field(default_factory=dict)
    runs: list[int] = field(default_factory=list)
    recognisers: dict[str, str] = field(default_factory=dict)
    named: list[str] = field(default_factory=list)
    goes: list[str] = field(default_factory=list)
    bytes: int = 0


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    add_project(parser)
    parser.add_argument("demonstrations", metavar="DEMO", nargs="*", help="names or ids")
    parser.add_argument("--run", metavar="N", type=int, nargs="+", help="numbers of runs")
    parser.add_argument(
        "--recogniser", metavar="ID", nargs="+", help="ids of recognisers, or how they begin"
    )
    parser.add_argument(
        "--yes", action="store_true", help="remove it, with all that would go with it"
    )
    json_flag(parser)


def run(arguments: argparse.Namespace) -> None:
    """Say what would go with demonstrations, runs and recognisers, or remove them."""
    if not (arguments.demonstrations or arguments.run or arguments.recogniser):
        raise UsageError("Name what is to be removed: demonstrations, --run or --recogniser.")
    with Project.open(arguments.project) as project:
        asked = _Removal()
        with project.snapshot():  # what is asked twice is the same then
            _ask_demonstrations(project, arguments.demonstrations, asked)
            _ask_runs(project, arguments.run or (), asked)
            _ask_recognisers(project, arguments.recogniser or (), asked)
        goes = ", ".join(asked.goes)
        if not arguments.yes:
            one = len(asked.named) == 1
            raise InputError(
                f"{listed(asked.named, NAMED)} {'was' if one else 'were'} not removed: with "
                f"{'it' if one else 'them'} would go {goes}, for good; give --yes "
                f"to remove {'it' if one else 'them'}."
            )
        project.refuse_read_only()
        project.demonstrations.remove_all(asked.heads)
        for number in asked.runs:
            if project.runs.uses(number):  # somebody may have been quicker
                project.runs.remove(number)
        for id_ in asked.recognisers:
            if id_ in project.runs.recogniser_bytes():
                project.runs.remove_recogniser(id_)
    if arguments.json:
        print(json_text(_json_content(asked)))
        return
    print(printable(f"Removed {listed(asked.named, NAMED)}: {goes}."))


def _ask_demonstrations(project: Project, keys: Sequence[str], asked: _Removal) -> None:
    """What goes with demonstrations."""
    for id_ in dict.fromkeys(project.demonstrations.id_of(key) for key in keys):
        authors = project.demonstrations.info(id_).authors
        asked.heads[id_] = {name: project.tracks.head(id_, name) for name in authors}
        info = project.demonstrations.info(id_)
        asked.infos.append(info)
        asked.named.append(f"'{info.name}'")
    seconds = sum(info.duration for info in asked.infos)
    if not asked.infos:
        return
    one = len(asked.infos) == 1
    asked.goes.append(f"the recording{'' if one else 's'} ({seconds:.2f} s)")
    videos = sum(info.has_video for info in asked.infos)
    if videos:
        asked.goes.append("its video" if one else counted(videos, "video"))
    labelled: dict[str, float] = {}
    for info in asked.infos:
        for name, spent in info.labelled.items():
            labelled[name] = labelled.get(name, 0.0) + spent
    asked.goes += [
        f"the labels of {name} ({percent(min(spent / seconds, 1.0))} %)"
        for name, spent in labelled.items()
    ]
    assigned = [one for one in project.coding.assignments() if one.demonstration in asked.heads]
    if assigned:
        asked.goes.append(counted(len(assigned), "assignment"))
    if notes := sum(one.demonstration in asked.heads for one in project.coding.notes()):
        asked.goes.append(counted(notes, "note"))


def _ask_runs(project: Project, numbers: Sequence[int], asked: _Removal) -> None:
    """What goes with runs, and what stays without the run that it came from."""
    if not numbers:
        return
    every = {use.run: use for use in project.runs.uses()}
    uses = []
    for number in dict.fromkeys(numbers):
        if number not in every:
            project.runs.get(number)  # says that there is none
        uses.append(every[number])
        asked.runs.append(number)
        asked.named.append(f"run {number}")
    own = sum(bool(use.recogniser) for use in uses)
    told = f"{'its' if len(uses) == 1 else 'their'} predictions and scores"
    if own:
        told += " and its recogniser" if len(uses) == 1 else f" and {counted(own, 'recogniser')}"
    size = sum(use.bytes for use in uses)
    told += f" ({amount(size)})"
    if verdicts := sum(use.verdicts for use in uses):
        told += f", while {counted(verdicts, 'verdict')} on what was predicted stay"
    if accepted := sum(use.accepted for use in uses):
        told += f", while labels that {counted(accepted, 'edit')} accepted stay"
    asked.goes.append(told)
    asked.bytes += size


def _ask_recognisers(project: Project, keys: Sequence[str], asked: _Removal) -> None:
    """What goes with recognisers, told by their ids or the first six or more digits of them."""
    if not keys:
        return
    sizes, uses = project.runs.recogniser_bytes(), project.runs.uses()
    gone = {use.recogniser for use in uses if use.run in asked.runs}  # with their runs
    meant = _recognisers(project, keys)
    found = {id_: name for id_, name in meant.items() if id_ not in gone}
    asked.recognisers |= found
    asked.named += [f"recogniser '{name}'" for name in found.values()]
    size = sum(sizes[id_] for id_ in found)
    if found:
        told = "its file" if len(found) == 1 else "their files"
        told += f" ({amount(size)})"
        if any(use.recogniser in found for use in uses):
            told += ", while runs keep what they found"
        asked.goes.append(told)
        asked.bytes += size


def _recognisers(project: Project, keys: Sequence[str]) -> dict[str, str]:
    """Ids of the recognisers that are meant, and their names; two runs may share one."""
    every = {id_: id_[:NAME] for id_ in project.runs.recogniser_bytes()}
    with contextlib.suppress(InputError):  # a damaged one can be removed, too
        every |= {one.id: one.name for one in project.runs.recognisers()}
    meant = {}
    for key in keys:
        found = [
            id_ for id_ in every if id_ == key or (len(key) >= SHORTEST and id_.startswith(key))
        ]
        if len(found) != 1:
            how_many = "more than one" if found else "no"
            raise InputError(
                f"There is {how_many} recogniser '{key}' in '{project.path}'; 'forcelab runs' and "
                f"'forcelab list --json' tell those that there are."
            )
        meant[found[0]] = every[found[0]]
    return meant


def _json_content(asked: _Removal) -> dict[str, object]:
    """What was removed, as plain values."""
    return {
        "removed": [{"id": info.id, "name": info.name, "task": info.task} for info in asked.infos],
        "runs": asked.runs,
        "recognisers": [{"id": id_, "name": name} for id_, name in asked.recognisers.items()],
        "bytes": asked.bytes,
    }
