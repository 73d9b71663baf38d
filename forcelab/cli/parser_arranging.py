"""The commands that put in order what is in a project: videos, their clocks, who labels what."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import Commands, json_flag, name_of, project_command

__all__ = ["add_assign", "add_attach", "add_note", "add_remove", "add_rename", "add_sync"]


def add_attach(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``attach`` to the commands."""
    parser = project_command(
        commands,
        "attach",
        "attaching",
        "attach a video to a demonstration",
        "The video is copied into the project, in place of the one that is there. Where its clock\n"
        "is not that of the forces, 'forcelab sync' finds the offset.",
    )
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
    parser = project_command(
        commands,
        "remove",
        "removing",
        "remove demonstrations, runs and recognisers",
        "A demonstration goes for good, with its video, everybody's labels and their history,\n"
        "notes, assignments and verdicts; runs and recognisers stay. A run goes with what it\n"
        "predicted and its recogniser, unless another run has that too; labels stay, those\n"
        "accepted from it as well, and verdicts, but not of which run they were. 'forcelab runs'\n"
        "tells what each takes up. Without --yes it only says what would go.",
    )
    parser.add_argument("demonstrations", metavar="DEMO", nargs="*", help="names or ids")
    parser.add_argument("--run", metavar="N", type=int, nargs="+", help="numbers of runs")
    parser.add_argument(
        "--recogniser", metavar="ID", nargs="+", help="ids of recognisers, or how they begin"
    )
    parser.add_argument(
        "--yes", action="store_true", help="remove it, with all that would go with it"
    )
    json_flag(parser)


def add_rename(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``rename`` to the commands."""
    parser = project_command(
        commands,
        "rename",
        "renaming",
        "rename an action in a coder's labels, or merge it into another",
        "All of the coder's segments of the action get the new name, one edit a demonstration,\n"
        "which can be undone there. Others' labels stay as they are: where they use the action,\n"
        "it stays beside the new one. Recognisers and runs keep the old name.",
    )
    parser.add_argument("old", metavar="ACTION", type=name_of, help="the action")
    parser.add_argument("new", metavar="NAME", type=name_of, help="what it is called from now on")
    parser.add_argument(
        "--author", metavar="NAME", type=name_of, required=True, help="whose labels change"
    )
    parser.add_argument(
        "--task", metavar="TASK", type=name_of, action="append", help="only this; may be repeated"
    )
    parser.add_argument(
        "--yes", action="store_true", help="merge the two if there is an action NAME already"
    )
    json_flag(parser)


def add_assign(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``assign`` to the commands."""
    parser = project_command(
        commands,
        "assign",
        "assigning",
        "say who is to label what, blind to the others' labels or not",
        "A coder who is assigned a demonstration blind sees neither the tracks and notes of the\n"
        "others nor predictions in the window until it is done. Without DEMO and --task: shows\n"
        "what is assigned. Every assignment, and when it was done or opened again, is kept for\n"
        "ever.",
    )
    parser.add_argument(
        "demonstrations", metavar="DEMO", nargs="*", help="names or ids of demonstrations"
    )
    parser.add_argument(
        "--author",
        metavar="NAME",
        type=name_of,
        help="the coder; without DEMO and --task: only this one's",
    )
    parser.add_argument(
        "--task", metavar="TASK", type=name_of, help="all demonstrations of this task"
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--open", action="store_true", help="assign openly, not blind")
    what.add_argument("--done", action="store_true", help="mark as done")
    what.add_argument("--reopen", action="store_true", help="mark as not done after all")
    what.add_argument("--remove", action="store_true", help="take the assignment back")
    json_flag(parser)


def add_note(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``note`` to the commands."""
    parser = project_command(
        commands,
        "note",
        "noting",
        "write what others should know about a demonstration",
        "Each coder has one note on each demonstration, in place of which another TEXT is put; an\n"
        "empty one ('') takes it away. Without TEXT: shows the notes there are. Every note that\n"
        "was ever written is kept.",
    )
    parser.add_argument("demonstration", metavar="DEMO", nargs="?", help="its name or id")
    parser.add_argument("text", metavar="TEXT", nargs="?", help="the note, one line")
    parser.add_argument(
        "--author", metavar="NAME", type=name_of, help="whose note; without TEXT: only this one's"
    )
    parser.add_argument(
        "--history", action="store_true", help="show every note ever written, also those replaced"
    )
    json_flag(parser)


def add_sync(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``sync`` to the commands."""
    parser = project_command(
        commands,
        "sync",
        "synchronising",
        "find or set the clock of a demonstration's video",
        "Proposes from the video's motion and the force which force time a frame belongs to, with\n"
        "its confidence (0 to 1; below 0.5 it should be looked at) and how far the taps lie from\n"
        "it. Force time is offset + rate * video time; with an offset below 0 the video began so\n"
        "much earlier than the forces.",
    )
    parser.add_argument("demonstration", metavar="DEMO", help="its name or id")
    parser.add_argument(
        "--accept",
        action="store_true",
        help="store what is proposed, if its confidence is 0.5 or more",
    )
    parser.add_argument(
        "--offset",
        metavar="S",
        type=float,
        help="store this: the force time at which the video's clock reads zero, s",
    )
    parser.add_argument(
        "--rate",
        metavar="R",
        type=float,
        help="store this: force seconds that pass in a second of the video, such as 1.00002",
    )
    json_flag(parser)
