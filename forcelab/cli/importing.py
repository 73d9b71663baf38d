"""``forcelab import``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from forcelab.cli.newcomers import telling_newcomers
from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text, printable, progress_bar
from forcelab.formats.importing import ImportReport, importing
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import finish
from forcelab.text import counted


def run(arguments: argparse.Namespace) -> int:
    """Import the files and tell what became of them; gives 1 where a file was left out."""
    if Path("-") in arguments.files and not Path("-").exists():
        raise WrongWordError(
            "Recordings are read from files, not from standard input ('-'); save it as a file and "
            "name that, such as recordings/*.csv."
        )
    options = ReadOptions(
        task=arguments.task,
        author=arguments.author,
        rate=arguments.rate,
        time=arguments.time,
        label=arguments.label,
        counter=arguments.counter,
        leave_out=tuple(arguments.leave_out),
        signals=tuple(arguments.signal),
        videos=arguments.videos,
        strict=arguments.strict,
        jitter=arguments.jitter,
        format=arguments.format,
        calibration=arguments.calibration,
    )
    with telling_newcomers(arguments.project), progress_bar() as watch:
        job = importing(arguments.project, arguments.files, options)
        report = finish(job, watch)
    print(json_text(_plain(report)) if arguments.json else _told(report))
    for reason in report.unread.values():
        print(f"forcelab: left out: {printable(reason)}", file=sys.stderr)
    return 1 if report.unread else 0


def _told(report: ImportReport) -> str:
    """The report for people; of what was there already, the number says enough."""
    told = [one.added for one in report.demonstrations if one.added.status != "unchanged"]
    lines = [f"{added.status:<9}  {printable(added.name)}" for added in told]
    lines += map(printable, report.told())
    counts = [f"{report.count(status)} {status}" for status in ("new", "updated", "unchanged")]
    total = counted(len(report.demonstrations), "recording")
    if report.unread:
        counts.append(f"{counted(len(report.unread), 'file')} left out")
    return "\n".join([*lines, f"{total}: {', '.join(counts)}."])


def _plain(report: ImportReport) -> dict[str, object]:
    """The report as plain values."""
    return {
        "demonstrations": [
            {
                "file": str(one.file),
                "id": one.added.id,
                "name": one.added.name,
                "status": one.added.status,
            }
            for one in report.demonstrations
        ],
        "remarks": {str(path): list(remarks) for path, remarks in report.remarks.items()},
        "unread": {str(path): reason for path, reason in report.unread.items()},
        **report.statistics,
    }
