"""Attach a video to a demonstration.

The video is copied into the project and replaces the present one. Where its clock is
not that of the forces, 'forcelab sync' finds the offset.

for example:
  forcelab attach lab.forcelab pull-03 pull-03.mp4
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from forcelab.cli.options import add_demonstration, add_json, add_project
from forcelab.cli.output import print_result, printable
from forcelab.clock import ClockMap
from forcelab.project import Project
from forcelab.video.validate import check_video


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_demonstration(parser)
    parser.add_argument("video", metavar="VIDEO", type=Path, help="video file")
    parser.add_argument(
        "--offset",
        metavar="S",
        type=float,
        default=0.0,
        help="force time at which the video's clock reads zero, s (0)",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    """Copy a video into the project, beside the demonstration that it shows."""
    clock = ClockMap(arguments.offset)
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
        damage = check_video(arguments.video, demonstration.duration)
        project.media.attach_video(demonstration.id, arguments.video, clock)
    content = {
        "demonstration": demonstration.name,
        "id": demonstration.id,
        "video": str(arguments.video),
        "replaced": demonstration.video is not None,
        "offset": clock.offset,
        "remarks": [damage] if damage else [],
    }
    video, name = str(arguments.video), demonstration.name
    sentence = (
        f"Attached '{video}' to '{name}'"
        if demonstration.video is None
        else f"Replaced the video of '{name}' by '{video}'"
    )
    text = f"{sentence}, offset {clock.offset:+.4f} s; 'forcelab sync' can find the offset."
    print_result(arguments.json, content, printable(text))
    if damage and not arguments.json:
        print(f"forcelab: {printable(damage)}", file=sys.stderr)
