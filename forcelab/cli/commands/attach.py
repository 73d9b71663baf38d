"""Attach a video to a demonstration.

The video is copied into the project. With --name it is a further one, or replaces the
one of that name; without, it replaces the first one. Where its clock is not that of the
forces, 'forcelab sync' finds the offset.

for example:
  forcelab attach lab.forcelab pull-03 pull-03.mp4
  forcelab attach lab.forcelab pull-03 side.mp4 --name left
"""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import add_demonstration, add_json, add_project, name_of
from forcelab.cli.output import print_remark, print_result, printable
from forcelab.clock import ClockMap
from forcelab.formats import naming_recording
from forcelab.project import Project
from forcelab.project.media import video_title
from forcelab.video.validate import check_video


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_demonstration(parser)
    parser.add_argument("video", metavar="VIDEO", type=Path, help="video file")
    parser.add_argument(
        "--name", metavar="NAME", type=name_of, help="what it is called among several, such as left"
    )
    parser.add_argument(
        "--offset",
        metavar="S",
        type=float,
        default=0.0,
        help="force time at which the video's clock reads zero, s (0)",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    clock = ClockMap(arguments.offset)
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
        with naming_recording(arguments.video):
            damage = check_video(arguments.video, demonstration.duration)
        project.media.attach_video(demonstration.id, arguments.video, clock, arguments.name)
        videos = project.demonstrations.info(demonstration.id).videos
    replaced = len(videos) == len(demonstration.videos)
    content = {
        "demonstration": demonstration.name,
        "id": demonstration.id,
        "video": str(arguments.video),
        "name": videos[0] if arguments.name is None else arguments.name,
        "replaced": replaced,
        "offset": clock.offset,
        "remarks": [damage] if damage else [],
    }
    video, name = str(arguments.video), demonstration.name
    sentence = f"Attached '{video}' to '{name}'"
    if replaced:
        title = video_title(demonstration.find_video(arguments.name), demonstration)
        sentence = f"Replaced {title} by '{video}'"
    elif len(videos) > 1:
        sentence += f" as '{videos[-1]}'"
    text = f"{sentence}, offset {clock.offset:+.4f} s; 'forcelab sync' can find the offset."
    print_result(arguments.json, content, printable(text))
    if damage and not arguments.json:
        print_remark(f"forcelab: {damage}")
