"""Import labels from other programs onto demonstrations that are in a project.

These are read:
  tables        CSV or TSV of start, end, action and perhaps author, as 'forcelab
                export' writes them
  ELAN          *.eaf, EAF 2.7 to 3.0
  Praat         TextGrids
  Audacity      label tracks
  BORIS         projects (*.boris); tabular and aggregated events as CSV or TSV
  Label Studio  exports (JSON, JSON-MIN), without predictions

A file belongs to the demonstration that it, or its media, is named after: exactly, else
whatever the case and suffix. 'TASK - NAME' tells demonstrations of one name apart, and
'NAME - AUTHOR' gives the author. Of several that fit, the one as long as the labels is
taken; else choose one with --demo.

A tier of ELAN or Praat is an author, called by its annotator or else as the tier. With
--tiers actions it is an action, and all tiers of an annotator are one track.
Without text an author's annotation is unlabelled. Points, and annotations without times
of their own, are left out.

Times are seconds from the start of the forces; those of labels made on a video are
carried over by its clock. --offset is added. Where labels would agree much better with
others of the demonstration at another offset, it is proposed.

Each author's labels become a track, and actions that the task lacks are added to it and
named. Labels that an author has already stay unless --replace is given, which tells what
it changes and can be undone.
Labels that lie beyond the demonstration or belong nowhere are left out with a sentence.
So is a whole file in which one row overlaps another of its author, or ends before it
starts; of BORIS only that observation, as where a state event has no partner. The exit
status is then 1.

for example:
  forcelab labels lab.forcelab corrected/*.eaf --replace
  forcelab labels lab.forcelab ines.txt --demo pull-03 --author Ines --dry-run
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from forcelab.cli.options import add_author, add_json, add_project
from forcelab.cli.output import print_result, printable, progress_bar
from forcelab.cli.project_hints import hint_at_new_names
from forcelab.formats.label_files import LabelOptions, LabelReport, importing_labels
from forcelab.jobs import finish
from forcelab.text import counted


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help="label files")
    add_author(
        parser, "author of the labels in files that name none (default: coder)", default="coder"
    )
    parser.add_argument(
        "--tiers",
        choices=("authors", "actions"),
        default="authors",
        help="what the tiers of ELAN and Praat are (authors)",
    )
    parser.add_argument(
        "--demo", metavar="NAME", help="the demonstration, whatever the file is called"
    )
    parser.add_argument(
        "--offset", metavar="S", type=float, default=0.0, help="seconds added to all times (0)"
    )
    parser.add_argument(
        "--replace", action="store_true", help="replace what the authors have labelled there"
    )
    parser.add_argument(
        "--dry-run", action="store_true", help="tell what would be imported, and import nothing"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Import the labels and print the result; gives 1 where something was left out."""
    options = LabelOptions(arguments.author, arguments.tiers, arguments.offset)
    with hint_at_new_names(arguments.project), progress_bar() as watch:
        job = importing_labels(
            arguments.project,
            arguments.files,
            options,
            demonstration=arguments.demo,
            replacing=arguments.replace,
            writing=not arguments.dry_run,
        )
        report = finish(job, watch)
    summary = _summary(report, arguments.dry_run)
    if arguments.json or summary:
        print_result(arguments.json, _json_content(report), summary)
    trouble = report.trouble()
    for path, reasons in trouble.items():
        for reason in reasons:
            sentence = reason if path.name in reason else f"{path}: {reason}"
            print(f"forcelab: left out: {printable(sentence)}", file=sys.stderr)
    return 1 if trouble else 0


def _summary(report: LabelReport, dry_run: bool) -> str:
    """The report for people; what is unchanged is only counted."""
    lines = [
        f"{track.status:<9}  {printable(track.demonstration.name)}  {printable(track.author)}  "
        f"{counted(track.segments, 'segment')}{track.changes and ': '}{track.changes}"
        for track in report.tracks
        if track.demonstration is not None and track.status in {"new", "replaced"}
    ]
    for path, remarks in report.remarks.items():
        lines += [printable(f"{path.name}: {remark}") for remark in remarks]
    counts = [f"{report.count(status)} {status}" for status in ("new", "replaced", "unchanged")]
    if left := report.count("left out"):
        counts.append(f"{left} left out")
    if report.tracks:
        lines.append(f"{counted(len(report.tracks), 'track')}: {', '.join(counts)}.")
    return "\n".join([*lines, *(["Nothing was imported (--dry-run)."] if dry_run else [])])


def _json_content(report: LabelReport) -> dict[str, object]:
    return {
        "tracks": [
            {
                "file": str(track.file),
                "demonstration": track.demonstration and track.demonstration.id,
                "name": track.demonstration.name if track.demonstration else track.name,
                "author": track.author,
                "segments": track.segments,
                "status": track.status,
                "reason": track.reason,
                "changes": track.changes,
            }
            for track in report.tracks
        ],
        "remarks": {str(path): list(remarks) for path, remarks in report.remarks.items()},
        "unread": {str(path): reason for path, reason in report.unread.items()},
    }
