"""The commands that fill a project and bring its contents out again."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import (
    PROJECT,
    Commands,
    column_options,
    command,
    json_flag,
    name_of,
    path_of,
    project_command,
)

__all__ = [
    "add_agree",
    "add_demo",
    "add_export",
    "add_import",
    "add_list",
    "add_replay",
    "add_runs",
    "add_simulate",
]


def add_demo(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``demo`` to the commands."""
    parser = command(
        commands,
        "demo",
        "demonstrating",
        "make the sample project",
        "Thirty simulated demonstrations of five tasks, with force, video and the labels of two\n"
        "coders, and a recogniser. It takes its name once it is complete; where it is already,\n"
        "nothing is changed.",
    )
    parser.add_argument(
        "folder",
        metavar="DIR",
        type=path_of,
        nargs="?",
        default=Path("sample.forcelab"),
        help="project folder to make (default: sample.forcelab)",
    )
    json_flag(parser)


def add_simulate(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``simulate`` to the commands."""
    parser = command(
        commands,
        "simulate",
        "simulating",
        "simulate demonstrations with a physical model of the tongs",
        "They go into a project, which is made if it does not exist, labelled by two simulated\n"
        "coders. The same task and seed give the same demonstrations: number 2 is the same\n"
        "whether 3 or 30 are made, filmed or not.",
    )
    parser.add_argument(
        "--task",
        type=name_of,
        required=True,
        help="LEGO, cartridge, stylus, marker or foam (whatever the case)",
    )
    parser.add_argument(
        "--count", metavar="N", type=int, required=True, help="number of demonstrations"
    )
    parser.add_argument("--seed", metavar="S", type=int, required=True, help="of everything random")
    parser.add_argument("--out", metavar="PROJECT", type=path_of, required=True, help=PROJECT)
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=float,
        default=1000.0,
        help="samples a second, 50 to 4000 (1000)",
    )
    parser.add_argument(
        "--no-video", dest="video", action="store_false", help="forces and labels only"
    )
    json_flag(parser)


def add_import(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``import`` to the commands."""
    parser = project_command(
        commands,
        "import",
        "importing",
        "read recordings into a project",
        "The project is made if it does not exist. Formats are told apart by content: tables\n"
        "(CSV, TSV, spaces), the paper's databases (*.pdl), archives of projects, ROS bags (with\n"
        "the package rosbags), raw dumps of OptoForce sensors. Labels of a table may stand in a\n"
        "column of it, or beside it in NAME.labels.csv (start, end, action) or an Audacity label\n"
        "track NAME.txt. A video named with its recording (pull.csv pull.mp4) is attached to it.\n"
        "A recording that is there already is updated, not doubled; read with other columns it\n"
        "is another demonstration. A file that cannot be read is named and left out, and the exit\n"
        "status is 1 then; with --strict nothing is imported at all. An archive alone, into a new\n"
        "project, brings back everything it holds; into one that is there, the recordings and\n"
        "coders' labels that this one has not got.",
    )
    parser.add_argument("files", metavar="FILE", type=Path, nargs="+", help="recordings")
    parser.add_argument("--task", metavar="TASK", type=name_of, help="task of the demonstrations")
    parser.add_argument(
        "--author",
        metavar="NAME",
        type=name_of,
        default="coder",
        help="author of the labels in files that name none (default: coder)",
    )
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=float,
        help="samples a second, where a file has no column of times; "
        "otherwise the rate at which features are computed",
    )
    parser.add_argument(
        "--format",
        choices=("archive", "pdl", "rosbag", "table", "optoforce"),
        help="read the files as this, whatever they look like",
    )
    parser.add_argument(
        "--calibration",
        metavar="FILE",
        type=Path,
        help="TOML file that turns an OptoForce dump's counts into newtons",
    )
    column_options(parser)
    parser.add_argument("--label", metavar="COL", help="name or number of the column of labels")
    parser.add_argument(
        "--videos",
        action="store_true",
        help="attach the video beside a recording that is called as it is: pull.mp4 to pull.csv",
    )
    parser.add_argument(
        "--strict",
        action="store_true",
        help="refuse gaps and what would be repaired, and take all files or none",
    )
    json_flag(parser)


def add_list(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``list`` to the commands."""
    parser = project_command(
        commands,
        "list",
        "listing",
        "show what a project holds",
        "Demonstrations by task, with their length, rate, channels and labelled share by author.",
    )
    parser.add_argument("--task", metavar="TASK", type=name_of, help="only this task")
    parser.add_argument(
        "--to-label",
        metavar="NAME",
        type=name_of,
        help="only what this coder has not begun, or has assigned and not done",
    )
    json_flag(parser)


def add_replay(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``replay`` to the commands."""
    parser = project_command(
        commands,
        "replay",
        "replaying",
        "play a demonstration as if its sensors were plugged in",
        "Each 3-axis sensor becomes a pseudo-terminal that sends what an OptoForce DAQ would\n"
        "send, in real time, and answers what a DAQ answers; or all channels, whatever they\n"
        "measure, one that prints lines as a microcontroller does. Nothing begins before all\n"
        "are opened.",
    )
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument(
        "--as",
        dest="kind",
        choices=("optoforce", "text"),
        default="optoforce",
        help="what to play it as (optoforce)",
    )
    parser.add_argument(
        "--speed", metavar="X", type=float, default=1.0, help="recorded seconds a second (1)"
    )
    parser.add_argument(
        "--lead",
        metavar="SECONDS",
        type=float,
        default=1.0,
        help="from the opening of the last port to the beginning (1)",
    )
    parser.add_argument(
        "--calibration",
        metavar="FILE",
        type=Path,
        help="TOML file that says what a count is worth (a sensor of 40 N)",
    )
    json_flag(parser)


def add_runs(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``runs`` to the commands."""
    parser = project_command(
        commands,
        "runs",
        "running",
        "list what was evaluated and trained, or compare two runs",
        "Every evaluation is kept as a run with its settings, seed and labels, whether made by\n"
        "'forcelab evaluate' or in the window. Two are compared over what both tested: a\n"
        "difference is the second's score less the first's. What each takes up on the disk is\n"
        "told, too, and which recognisers belong to none; 'forcelab remove' removes them.",
    )
    parser.add_argument(
        "--compare", metavar=("A", "B"), type=int, nargs=2, help="numbers of two runs"
    )
    json_flag(parser)


def add_agree(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``agree`` to the commands."""
    parser = project_command(
        commands,
        "agree",
        "agreeing",
        "say how far several coders agree, and where they do not",
        "Cohen's kappa of every two coders and Fleiss' kappa of all, over the time that they\n"
        "labelled; agreement of each action, of boundaries and segments, with the worst places;\n"
        "and how consistent each coder is from one demonstration to the next.",
    )
    parser.add_argument("--task", metavar="TASK", type=name_of, help="only this task")
    parser.add_argument(
        "--authors",
        metavar="NAME",
        type=name_of,
        nargs="+",
        help="only these coders (default: all)",
    )
    parser.add_argument(
        "--same",
        type=name_of,
        metavar=("NAME", "AGAIN"),
        nargs=2,
        help="two names of one coder, who labelled twice: how consistent that coder is",
    )
    json_flag(parser)


def add_export(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``export`` to the commands."""
    parser = project_command(
        commands,
        "export",
        "exporting",
        "write labels for other programs, or a whole project as one archive",
        "csv: start,end,action,author; a file a demonstration. table: one CSV of all, a line a\n"
        "segment, for statistics. elan: an .eaf a demonstration, a tier a coder, video linked.\n"
        "boris: one .boris project, an observation a coder and demonstration, video linked.\n"
        "audacity: a label track a coder and demonstration. archive: one zip with everything;\n"
        "'forcelab import' reads it back.\n"
        "Times are seconds from the start of the forces (elan: milliseconds).",
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        required=True,
        help="folder to write into; - prints the text of a single file",
    )
    parser.add_argument(
        "--format",
        choices=("csv", "table", "elan", "boris", "audacity", "archive"),
        default="csv",
        help="what to write (csv)",
    )
    parser.add_argument(
        "--task", metavar="TASK", type=name_of, action="append", help="only this; may be repeated"
    )
    parser.add_argument(
        "--demo", metavar="NAME", action="append", help="only this; may be repeated"
    )
    parser.add_argument(
        "--author", metavar="NAME", type=name_of, action="append", help="only this; may be repeated"
    )
    json_flag(parser)
