"""``forcelab replay``."""

from __future__ import annotations

import argparse
import shlex
import time

from forcelab.assets import asset
from forcelab.capture.calibration import read_calibrations
from forcelab.capture.replaying import Replay, Sensor, sensors_of
from forcelab.cli.output import counted, json_text, printable
from forcelab.cli.stopping import stoppable
from forcelab.project import Project

#: Seconds between two looks at whether all has been played.
LOOK = 0.1
#: Seconds that readers have for the last samples before the ports are gone.
LAST = 0.3


def run(arguments: argparse.Namespace) -> None:
    """Play a demonstration through pseudo-terminals until it ends or Ctrl+C."""
    calibration = arguments.calibration or asset("calibrations", "3-axis-40N.toml")
    with Project.open(arguments.project) as project:
        demonstration = project.load(arguments.demonstration)
    sensors = sensors_of(demonstration, read_calibrations(calibration))
    replay = Replay(demonstration, sensors, speed=arguments.speed, lead=arguments.lead)
    with stoppable(), replay:
        devices = [f"optoforce:{port}?calibration={calibration}" for port in replay.ports]
        if arguments.json:
            print(json_text(_plain(replay, devices)), flush=True)
        else:
            words = " ".join(f"--device {shlex.quote(device)}" for device in devices)
            print(
                f"{_told(replay, sensors)}\n"
                f"\n"
                f"'{printable(demonstration.name)}' begins {arguments.lead:g} s after the last "
                f"port is opened and lasts {replay.seconds:.2f} s; Ctrl+C ends it. To record it:\n"
                f"  forcelab capture PROJECT {words} --task NAME --seconds "
                f"{replay.seconds + arguments.lead:.0f}",
                flush=True,
            )
        while not replay.ended(LOOK):
            pass
        time.sleep(LAST)
    overrun = sum(device.overrun for device in replay.devices)
    if overrun and not arguments.json:
        print(f"{counted(overrun, 'byte')} were lost, as nobody read them.")


def _told(replay: Replay, sensors: tuple[Sensor, ...]) -> str:
    """A line for each port."""
    lines = []
    for port, sensor in zip(replay.ports, sensors, strict=True):
        clipped = f", {counted(sensor.clipped, 'sample')} clipped" if sensor.clipped else ""
        names = printable(" ".join(sensor.names))
        lines.append(f"{port}  {names}, serial number {sensor.serial}{clipped}")
    return "\n".join(lines)


def _plain(replay: Replay, devices: list[str]) -> dict[str, object]:
    """The same as plain values."""
    return {
        "seconds": replay.seconds,
        "ports": [
            {
                "port": port,
                "device": device,
                "channels": list(sensor.names),
                "serial": sensor.serial,
                "clipped": sensor.clipped,
            }
            for port, device, sensor in zip(replay.ports, devices, replay.sensors, strict=True)
        ],
    }
