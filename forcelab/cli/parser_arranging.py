"""The commands that put right what is in a project."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import PROJECT, Commands, command, json_flag

__all__ = ["add_attach", "add_remove"]


def add_attach(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``attach`` to the commands."""
    parser = command(
        commands,
        "attach",
        "attaching",
        "attach a video to a demonstration",
        "The video is copied into the project, in place of the one that is there. Where its clock\n"
        "is not that of the forces, 'forcelab sync' finds the offset.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument("video", metavar="VIDEO", type=Path, help="video file")
    parser.add_argument(
        "--offset",
        metavar="S",
        type=float,
        default=0.0,
        help="force time at which the video's clock reads zero, s (0)",
    )
    json_flag(parser)


def add_remove(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``remove`` to the commands."""
    parser = command(
        commands,
        "remove",
        "removing",
        "remove demonstrations, runs and recognisers",
        "A demonstration goes for good, with its video, everybody's labels and their history,\n"
        "assignments and verdicts; runs and recognisers stay. A run goes with what it predicted\n"
        "and its recogniser, unless another run has that too; labels stay, those accepted from it\n"
        "as well, and verdicts, but not of which run they were. 'forcelab runs' tells what each\n"
        "takes up. Without --yes it only says what would go.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, help=PROJECT)
    parser.add_argument("demonstrations", metavar="DEMO", nargs="*", help="names or ids")
    parser.add_argument("--run", metavar="N", type=int, nargs="+", help="numbers of runs")
    parser.add_argument(
        "--recogniser", metavar="ID", nargs="+", help="ids of recognisers, or how they begin"
    )
    parser.add_argument("--yes", action="store_true", help="remove it, with all that was told")
    json_flag(parser)
