"""Read recordings into a project.

The project is created if need be. Formats are recognised by content; in brackets is the
extra that some need, as in pip install 'forcelab[excel]':
  tables        CSV, TSV, spaces; Excel, each sheet a demonstration (excel); Parquet and
                Feather (parquet)
  arrays        NumPy (*.npy, *.npz); HDF5 (hdf5); MATLAB (*.mat; of version 7.3: hdf5)
  streams       ROS bags, whose pictures become videos (rosbag); XDF (xdf); TDMS (tdms);
                C3D; raw dumps of OptoForce sensors
  datasets      LeRobot folders, each episode a demonstration (lerobot); the databases of
                the paper's authors (*.pdl)
  projects      archives that 'forcelab export' wrote

Labels may be a column, or lie beside the recording in NAME.labels.csv (start, end,
action) or an Audacity label track NAME.txt. A video named with its recording (pull.csv
pull.mp4) is attached to it, and so are further ones by what follows its name after a
dot, dash or underscore: pull.left.mp4, pull_left.mp4 and pull-left.mp4 are its video
'left'.

--time, --counter, --label, --signal and --leave-out name columns. In a ROS bag these are
/topic or /topic.field, in XDF, TDMS and C3D STREAM or STREAM.CHANNEL, in a LeRobot
dataset a feature, a number in it or a camera, and in files of arrays an array, a group
of them (obs) or a column of one ("data 2"); groups that are numbered as demonstrations
(demo_0, trial 1) are one each.

A recording that the project has already is updated, not doubled; read with other
columns or units it is another demonstration. A file that cannot be read is reported and left
out, and the exit status is then 1; with --strict nothing is imported at all. A single
archive imported into a new project restores everything it holds; into an existing one,
the recordings and coders' labels that it lacks.

for example:
  forcelab import lab.forcelab recordings/*.csv --task stylus --videos
  forcelab import lab.forcelab left.bin --task foam --calibration left.toml
  forcelab import lab.forcelab fold.hdf5 --signal observations/qpos --rate 50
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from forcelab.cli.options import (
    UsageError,
    add_author,
    add_column_options,
    add_file,
    add_json,
    add_project,
    add_task,
    columns_from,
)
from forcelab.cli.output import print_result, printable, progress_bar
from forcelab.cli.project_hints import hint_at_new_names
from forcelab.formats import format_names
from forcelab.formats.importing import ImportReport, importing
from forcelab.formats.recording import ReadOptions, parse_episodes
from forcelab.formats.table_columns import SEVERAL_AUTHORS
from forcelab.jobs import finish
from forcelab.text import counted


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help="recordings")
    group = parser.add_argument_group("demonstrations")
    add_task(group, "task of the demonstrations")
    add_author(
        group, "author of the labels in files that name none (default: coder)", default="coder"
    )
    group = parser.add_argument_group("how files are read")
    group.add_argument(
        "--rate",
        metavar="HZ",
        type=float,
        help="samples a second, where a file has no column of times; "
        "otherwise the rate at which features are computed",
    )
    group.add_argument(
        "--format",
        choices=format_names(),
        help="read the files as this, whatever their content suggests",
    )
    add_file(group, "--calibration", "TOML file that turns an OptoForce dump's counts into newtons")
    group.add_argument(
        "--episodes",
        metavar="0-9,12",
        default="",
        help="episodes to read of a LeRobot dataset (all)",
    )
    group = parser.add_argument_group("columns")
    add_column_options(group)
    group.add_argument(
        "--label", metavar="COL", action="append", help="name or number of the column of labels"
    )
    group = parser.add_argument_group("what is imported")
    group.add_argument(
        "--videos",
        action="store_true",
        help="attach videos beside each recording that have its name: pull.mp4 and "
        "pull.left.mp4 to pull.csv",
    )
    group.add_argument(
        "--strict",
        action="store_true",
        help="refuse gaps and repairs, and import all files or none",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Import the files and print the result; gives 1 where a file was left out."""
    if Path("-") in arguments.files and not Path("-").exists():
        raise UsageError(
            "Recordings are read from files, not from standard input ('-'); save it as a file and "
            "name that, such as recordings/*.csv."
        )
    labels = arguments.label or [None]
    if len(labels) > 1:
        raise UsageError(
            f"--label was given {len(labels)} times and names one column; {SEVERAL_AUTHORS}."
        )
    options = ReadOptions(
        task=arguments.task,
        author=arguments.author,
        rate=arguments.rate,
        label=labels[0],
        videos=arguments.videos,
        strict=arguments.strict,
        format=arguments.format,
        calibration=arguments.calibration,
        episodes=parse_episodes(arguments.episodes),
        **columns_from(arguments),
    )
    with hint_at_new_names(arguments.project), progress_bar() as watch:
        job = importing(arguments.project, arguments.files, options)
        report = finish(job, watch)
    print_result(arguments.json, _json_content(report), _summary(report))
    for reason in report.unread.values():
        print(f"forcelab: left out: {printable(reason)}", file=sys.stderr)
    return 1 if report.unread else 0


def _summary(report: ImportReport) -> str:
    """The report for people; unchanged demonstrations are only counted."""
    lines = [
        f"{imported.added.status:<9}  {printable(imported.added.name)}"
        for imported in report.demonstrations
        if imported.added.status != "unchanged"
    ]
    lines += map(printable, report.remark_lines())
    counts = [f"{report.count(status)} {status}" for status in ("new", "updated", "unchanged")]
    total = counted(len(report.demonstrations), "recording")
    if report.unread:
        counts.append(f"{counted(len(report.unread), 'file')} left out")
    return "\n".join([*lines, f"{total}: {', '.join(counts)}."])


def _json_content(report: ImportReport) -> dict[str, object]:
    return {
        "demonstrations": [
            {
                "file": str(imported.file),
                "id": imported.added.id,
                "name": imported.added.name,
                "status": imported.added.status,
            }
            for imported in report.demonstrations
        ],
        "remarks": {str(path): list(remarks) for path, remarks in report.remarks.items()},
        "unread": {str(path): reason for path, reason in report.unread.items()},
        **report.statistics,
    }
