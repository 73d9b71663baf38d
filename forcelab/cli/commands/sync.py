"""Find or set the clock of a demonstration's video.

Proposes, from motion in the video and the forces, which force time a frame belongs to,
with its confidence (0 to 1; below 0.5 check it by eye) and how far the taps lie from
it. Force time is offset + rate * video time; with an offset below 0 the video began
that much before the forces.

for example:
  forcelab sync lab.forcelab pull-03 --accept
  forcelab sync lab.forcelab pull-03 --offset -0.287
"""

from __future__ import annotations

import argparse
from typing import Any

from forcelab.cli.options import UsageError, add_demonstration, add_json, add_project
from forcelab.cli.output import print_result, printable, progress_bar
from forcelab.clock import ClockMap
from forcelab.demonstration import Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.project import Project
from forcelab.project.media import video_title
from forcelab.signals.sync import Proposal, propose_clock_for


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_demonstration(parser)
    parser.add_argument(
        "--video", metavar="NAME", help="which of several videos, as 'forcelab list' has them"
    )
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
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    by_hand = arguments.offset is not None or arguments.rate is not None
    if by_hand and arguments.accept:
        raise UsageError("Give either --accept or a clock by --offset and --rate, not both.")
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
        video = demonstration.find_video(arguments.video)
        before, proposal = video.clock, None
        if by_hand:
            offset = before.offset if arguments.offset is None else arguments.offset
            rate = before.rate if arguments.rate is None else arguments.rate
            clock = ClockMap(offset, rate)
        else:
            with progress_bar() as watch:
                proposal = finish(propose_clock_for(demonstration, video.name), watch)
            clock = proposal.clock
            if arguments.accept and proposal.doubtful:
                raise InputError(_refusal(demonstration, video, proposal))
        stored = bool(by_hand or arguments.accept)
        if stored:
            project.media.set_video_clock(demonstration.id, clock, video.name)
    _print(demonstration, video, clock, proposal, stored, as_json=arguments.json)


def _refusal(demonstration: Demonstration, video: VideoReference, proposal: Proposal) -> str:
    """Why a clock is not stored unseen, and how it is after a look."""
    return (
        f"The clock found for {video_title(video, demonstration)} is not stored, as its confidence "
        f"is only {proposal.confidence:.2f}; compare the frames at a tap, and if they fit give "
        f"{_options(proposal.clock, video.clock)} instead of --accept."
    )


def _options(clock: ClockMap, before: ClockMap) -> str:
    """The options that store a clock in the place of another one."""
    rate = "" if clock.rate == before.rate else f" --rate {clock.rate:.9g}"
    return f"--offset {clock.offset:.4f}{rate}"


def _print(
    demonstration: Demonstration,
    video: VideoReference,
    clock: ClockMap,
    proposal: Proposal | None,
    stored: bool,
    *,
    as_json: bool,
) -> None:
    content: dict[str, Any] = {
        "demonstration": demonstration.name,
        "id": demonstration.id,
        "video": video.name,
        "before": {"offset": video.clock.offset, "rate": video.clock.rate},
        "clock": {"offset": clock.offset, "rate": clock.rate},
        "stored": stored,
    }
    which = f", {video.name}" if len(demonstration.videos) > 1 else ""
    lines = [
        printable(f"{demonstration.name}{which}: the video's clock"),
        f"  before      {_clock(video.clock)}",
        f"  {'now' if stored else 'proposed':<10}  {_clock(clock)}",
    ]
    if proposal is not None:
        content["confidence"] = proposal.confidence
        content["residual"] = proposal.residual
        content["taps"] = [{"video": tap, "force": force} for tap, force in proposal.taps]
        low = ""
        if proposal.doubtful:
            low = "  low: look at the frames at a tap; --accept does not take it"
        lines.append(f"  confidence  {proposal.confidence:.2f}{low}")
        for tap, force in proposal.taps:
            apart = 1000 * (float(clock.to_force(tap)) - force)
            lines.append(
                f"  tap         video {tap:.3f} s, force {force:.3f} s, {apart:+.1f} ms apart"
            )
        if proposal.taps:
            lines.append(f"  residual    {1000 * proposal.residual:.1f} ms")
        if not stored:
            condition, options = "", "--accept"
            if proposal.doubtful:
                condition, options = "if the frames at a tap fit, ", _options(clock, video.clock)
            lines.append(f"Nothing is stored; {condition}give {options} to store it.")
    print_result(as_json, content, "\n".join(lines))


def _clock(clock: ClockMap) -> str:
    return f"offset {clock.offset:+.4f} s, rate {1e6 * (clock.rate - 1):+.1f} ppm"
