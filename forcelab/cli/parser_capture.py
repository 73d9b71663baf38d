"""The command that records."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import PROJECT, Commands, command, json_flag, name_of

__all__ = ["add_capture"]


def add_capture(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add ``capture`` to the commands."""
    parser = command(
        commands,
        "capture",
        "capturing",
        "record a demonstration from sensors and cameras",
        "All devices are recorded on one clock into a project, which is made if it does not\n"
        "exist, for so many seconds or until Ctrl+C. What is recorded is on the disk within\n"
        "0.2 s: after a crash --recover makes demonstrations of what there is. A device that is\n"
        "unplugged is waited for; what was missed is a gap. The videos of further cameras lie\n"
        "beside the first one's, each on the same clock; 'forcelab list' says where.\n\n"
        "A device is KIND:PORT?OPTION=VALUE&... with the kinds optoforce (rate, filter,\n"
        "calibration, serial), text (baud, rate) and encoder (scale, unit, channel, rate,\n"
        "reverse); without PORT the only one of its kind. In a PORT or VALUE write & as %26,\n"
        "? as %3F and % as %25.",
    )
    parser.add_argument("project", metavar="PROJECT", type=Path, nargs="?", help=PROJECT)
    parser.add_argument(
        "--device",
        metavar="DEVICE",
        action="append",
        default=[],
        help="such as optoforce:/dev/ttyACM0; several times for several",
    )
    parser.add_argument(
        "--camera",
        metavar="N",
        action="append",
        default=[],
        help="number or device of a camera; the first one's video goes with the demonstration",
    )
    parser.add_argument("--task", metavar="TASK", type=name_of, help="task of the demonstration")
    parser.add_argument("--name", metavar="NAME", help="its name (the task and the next number)")
    parser.add_argument(
        "--seconds", metavar="N", type=float, help="how long to record (until Ctrl+C)"
    )
    parser.add_argument(
        "--recogniser",
        metavar="FILE",
        type=Path,
        help="label it while it lasts, by what train wrote; the track is kept with it",
    )
    parser.add_argument(
        "--latency",
        metavar="SECONDS",
        type=float,
        help="from a force to its label; the more, the better the label (0.3)",
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--list", action="store_true", help="show what is plugged in")
    what.add_argument(
        "--recover", action="store_true", help="make demonstrations of unfinished recordings"
    )
    json_flag(parser)
