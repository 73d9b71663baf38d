"""Play a demonstration as if its sensors were plugged in.

Each 3-axis sensor becomes a pseudo-terminal that sends and answers in real time what an
OptoForce DAQ would. With --as text all channels, whatever they measure, become one that
prints lines as a microcontroller does. It starts when all of them have been opened.

for example:
  forcelab replay lab.forcelab pull-03 --as text --lead 10
"""

from __future__ import annotations

import argparse
import shlex
import time
from collections.abc import Sequence
from contextlib import suppress

from forcelab.capture.device_names import quote_value
from forcelab.capture.optoforce import speed_code
from forcelab.capture.replay import Board, Replay, Sensor, extract_board, extract_sensors
from forcelab.cli.interrupts import interruptible
from forcelab.cli.options import UsageError, add_demonstration, add_file, add_json, add_project
from forcelab.cli.output import json_text, printable
from forcelab.errors import InputError
from forcelab.formats.calibration import read_calibrations
from forcelab.project import Project
from forcelab.resources import asset
from forcelab.text import counted

#: Seconds between two looks at whether all has been played.
POLL_INTERVAL = 0.1
#: Seconds that readers have for the last samples before the ports are gone.
GRACE = 0.3


def add_options(parser: argparse.ArgumentParser) -> None:
    add_project(parser)
    add_demonstration(parser)
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
        help="pause between the opening of the last port and the start (1)",
    )
    add_file(parser, "--calibration", "TOML file of newtons per count (a sensor of 40 N)")
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    calibration = arguments.calibration or asset("calibrations", "3-axis-40N.toml")
    with Project.open(arguments.project) as project:
        demonstration = project.demonstrations.load(arguments.demonstration)
    parts: Sequence[Sensor | Board]
    if arguments.kind == "text":
        if arguments.calibration is not None:
            raise UsageError("Lines of text hold no counts; leave --calibration away.")
        parts, behind = [extract_board(demonstration)], ""
    else:
        parts = extract_sensors(demonstration, read_calibrations(calibration))
        behind = f"?calibration={quote_value(str(calibration))}"
        with suppress(InputError):  # of a rate that no DAQ has
            code = speed_code(demonstration.rate * arguments.speed)
            behind += f"&rate={1000 / code:.5g}" if code > 1 else ""
    replay = Replay(demonstration, parts, speed=arguments.speed, lead=arguments.lead)
    with interruptible(), replay:
        devices = [f"{arguments.kind}:{quote_value(port)}{behind}" for port in replay.ports]
        if arguments.json:
            print(json_text(_json_content(replay, devices)), flush=True)
        else:
            words = " ".join(f"--device {shlex.quote(device)}" for device in devices)
            print(
                f"{_port_lines(replay)}\n"
                f"\n"
                f"'{printable(demonstration.name)}' begins {arguments.lead:g} s after the last "
                f"port is opened and lasts {replay.seconds:.2f} s; Ctrl+C ends it. To record it:\n"
                f"  forcelab capture PROJECT {words} --task NAME --seconds "
                f"{replay.seconds + arguments.lead:.0f}",
                flush=True,
            )
        while not replay.ended(POLL_INTERVAL):
            pass
        time.sleep(GRACE)
    overrun = sum(device.overrun for device in replay.devices)
    if overrun and not arguments.json:
        print(f"{counted(overrun, 'byte')} were lost, as nobody read them.")


def _port_lines(replay: Replay) -> str:
    lines = []
    for port, part in zip(replay.ports, replay.parts, strict=True):
        line = f"{port}  {printable(' '.join(part.names))}"
        if isinstance(part, Sensor):
            clipped = f", {counted(part.clipped, 'sample')} clipped" if part.clipped else ""
            line += f", serial number {part.serial}{clipped}"
        lines.append(line)
    return "\n".join(lines)


def _json_content(replay: Replay, devices: list[str]) -> dict[str, object]:
    ports: list[dict[str, object]] = []
    for port, device, part in zip(replay.ports, devices, replay.parts, strict=True):
        plain: dict[str, object] = {"port": port, "device": device, "channels": list(part.names)}
        if isinstance(part, Sensor):
            plain |= {"serial": part.serial, "clipped": part.clipped}
        ports.append(plain)
    return {"seconds": replay.seconds, "ports": ports}
