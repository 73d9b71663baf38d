"""Remove demonstrations, videos, runs and recognisers.

A demonstration is removed for good, with its videos, all labels and their history,
notes, assignments and verdicts; runs and recognisers stay. With --video only that video
of it goes. A run is removed with its
predictions and its recogniser, unless another run shares that; labels stay, those
accepted from it as well, and so do verdicts, which then name no run. 'forcelab runs'
lists the disk space of each. Without --yes it only says what would be removed.

for example:
  forcelab remove lab.forcelab pull-03 pull-04
  forcelab remove lab.forcelab pull-03 --video left --yes
  forcelab remove lab.forcelab --run 3 4 --yes
"""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from forcelab.cli.options import UsageError, add_json, add_project
from forcelab.cli.output import print_result, printable
from forcelab.errors import InputError
from forcelab.project import DemonstrationInfo, Project
from forcelab.text import amount, counted, listed, percent

#: How many things a sentence names one by one.
NAMED = 8
#: Digits of an id that tell a recogniser, and that stand for its name where that is damaged.
SHORTEST_PREFIX, SHORT_ID = 6, 8


@dataclass
class _Removal:
    """What is to be removed, each once, and texts on what goes with it."""

    videos: dict[str, str] = field(default_factory=dict)  #: names by the demonstration's id
    infos: list[DemonstrationInfo] = field(default_factory=list)
    heads: dict[str, dict[str, int]] = field(default_factory=dict)
    runs: list[int] = field(default_factory=list)
    recognisers: dict[str, str] = field(default_factory=dict)  #: names by id
    named: list[str] = field(default_factory=list)
    goes: list[str] = field(default_factory=list)
    bytes: int = 0


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument("demonstrations", metavar="DEMO", nargs="*", help="names or ids")
    parser.add_argument("--video", metavar="NAME", help="only the video of this name")
    parser.add_argument("--run", metavar="N", type=int, nargs="+", help="numbers of runs")
    parser.add_argument(
        "--recogniser", metavar="ID", nargs="+", help="ids of recognisers, or their first digits"
    )
    parser.add_argument("--yes", action="store_true", help="remove it, with all that belongs to it")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    if not (arguments.demonstrations or arguments.run or arguments.recogniser):
        raise UsageError("Name what is to be removed: demonstrations, --run or --recogniser.")
    if arguments.video is not None and not arguments.demonstrations:
        raise UsageError("Name the demonstration whose video is to be removed.")
    with Project.open(arguments.project) as project:
        removal = _Removal()
        with project.snapshot():  # what is asked twice is the same then
            if arguments.video is None:
                _ask_demonstrations(project, arguments.demonstrations, removal)
            else:
                _ask_videos(project, arguments.demonstrations, arguments.video, removal)
            _ask_runs(project, arguments.run or (), removal)
            _ask_recognisers(project, arguments.recogniser or (), removal)
        losses = ", ".join(removal.goes)
        if not arguments.yes:
            single = len(removal.named) == 1
            raise InputError(
                f"{listed(removal.named, NAMED)} {'was' if single else 'were'} not removed: with "
                f"{'it' if single else 'them'} would go {losses}, for good; give --yes "
                f"to remove {'it' if single else 'them'}."
            )
        project.refuse_read_only()
        for id_, name in removal.videos.items():
            project.media.remove_video(id_, name)
        project.demonstrations.remove_all(removal.heads)
        for number in removal.runs:
            if project.runs.uses(number):  # somebody may have been quicker
                project.runs.remove(number)
        for id_ in removal.recognisers:
            if id_ in project.runs.recogniser_bytes():
                project.runs.remove_recogniser(id_)
    text = printable(f"Removed {listed(removal.named, NAMED)}: {losses}.")
    print_result(arguments.json, _json_content(removal), text)


def _ask_demonstrations(project: Project, keys: Sequence[str], removal: _Removal) -> None:
    """What goes with demonstrations."""
    for id_ in dict.fromkeys(project.demonstrations.id_of(key) for key in keys):
        info = project.demonstrations.info(id_)
        removal.heads[id_] = {name: project.tracks.head(id_, name) for name in info.authors}
        removal.infos.append(info)
        removal.named.append(f"'{info.name}'")
    seconds = sum(info.duration for info in removal.infos)
    if not removal.infos:
        return
    single = len(removal.infos) == 1
    removal.goes.append(f"the recording{'' if single else 's'} ({seconds:.2f} s)")
    videos = sum(len(info.videos) for info in removal.infos)
    if videos:
        removal.goes.append("its video" if single and videos == 1 else counted(videos, "video"))
    labelled: dict[str, float] = {}
    for info in removal.infos:
        for name, duration in info.labelled.items():
            labelled[name] = labelled.get(name, 0.0) + duration
    removal.goes += [
        f"the labels of {name} ({percent(min(duration / seconds, 1.0))} %)"
        for name, duration in labelled.items()
    ]
    assigned = [a for a in project.coding.assignments() if a.demonstration in removal.heads]
    if assigned:
        removal.goes.append(counted(len(assigned), "assignment"))
    if notes := sum(note.demonstration in removal.heads for note in project.coding.notes()):
        removal.goes.append(counted(notes, "note"))


def _ask_videos(project: Project, keys: Sequence[str], name: str, removal: _Removal) -> None:
    """What goes with the videos of one name."""
    for key in keys:
        demonstration = project.demonstrations.load(key)
        path = demonstration.find_video(name).path
        removal.videos[demonstration.id] = name
        removal.named.append(f"the video '{name}' of '{demonstration.name}'")
        size = path.stat().st_size if path.exists() else 0
        removal.bytes += size
        removal.goes.append(f"its file ({amount(size)})")


def _ask_runs(project: Project, numbers: Sequence[int], removal: _Removal) -> None:
    """What goes with runs, and what stays without the run that it came from."""
    if not numbers:
        return
    uses_by_run = {use.run: use for use in project.runs.uses()}
    uses = []
    for number in dict.fromkeys(numbers):
        if number not in uses_by_run:
            project.runs.get(number)  # says that there is none
        uses.append(uses_by_run[number])
        removal.runs.append(number)
        removal.named.append(f"run {number}")
    own = sum(bool(use.recogniser) for use in uses)
    text = f"{'its' if len(uses) == 1 else 'their'} predictions and scores"
    if own:
        text += " and its recogniser" if len(uses) == 1 else f" and {counted(own, 'recogniser')}"
    size = sum(use.bytes for use in uses)
    text += f" ({amount(size)})"
    if verdicts := sum(use.verdicts for use in uses):
        text += f", while {counted(verdicts, 'verdict')} on what was predicted stay"
    if accepted := sum(use.accepted for use in uses):
        text += f", while labels that {counted(accepted, 'edit')} accepted stay"
    removal.goes.append(text)
    removal.bytes += size


def _ask_recognisers(project: Project, keys: Sequence[str], removal: _Removal) -> None:
    """What goes with recognisers, told by their ids or the first six or more digits of them."""
    if not keys:
        return
    sizes, uses = project.runs.recogniser_bytes(), project.runs.uses()
    removed_ids = {use.recogniser for use in uses if use.run in removal.runs}  # with their runs
    chosen = _recognisers(project, keys)
    remaining = {id_: name for id_, name in chosen.items() if id_ not in removed_ids}
    removal.recognisers |= remaining
    removal.named += [f"recogniser '{name}'" for name in remaining.values()]
    size = sum(sizes[id_] for id_ in remaining)
    if remaining:
        text = "its file" if len(remaining) == 1 else "their files"
        text += f" ({amount(size)})"
        if any(use.recogniser in remaining for use in uses):
            text += ", while runs keep what they found"
        removal.goes.append(text)
        removal.bytes += size


def _recognisers(project: Project, keys: Sequence[str]) -> dict[str, str]:
    """Ids of the recognisers that are meant, and their names; two runs may share one."""
    names = {id_: id_[:SHORT_ID] for id_ in project.runs.recogniser_bytes()}
    with contextlib.suppress(InputError):  # a damaged one can be removed, too
        names |= {r.id: r.name for r in project.runs.recognisers()}
    chosen = {}
    for key in keys:
        matches = [
            id_
            for id_ in names
            if id_ == key or (len(key) >= SHORTEST_PREFIX and id_.startswith(key))
        ]
        if len(matches) != 1:
            how_many = "more than one" if matches else "no"
            raise InputError(
                f"There is {how_many} recogniser '{key}' in '{project.path}'; 'forcelab runs' and "
                f"'forcelab list --json' tell those that there are."
            )
        chosen[matches[0]] = names[matches[0]]
    return chosen


def _json_content(removal: _Removal) -> dict[str, object]:
    return {
        "removed": [
            {"id": info.id, "name": info.name, "task": info.task} for info in removal.infos
        ],
        "videos": [{"demonstration": id_, "name": name} for id_, name in removal.videos.items()],
        "runs": removal.runs,
        "recognisers": [{"id": id_, "name": name} for id_, name in removal.recognisers.items()],
        "bytes": removal.bytes,
    }
