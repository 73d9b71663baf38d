"""``forcelab capture --list``."""

from __future__ import annotations

import argparse

from forcelab.capture.discovery import cameras, find_ports
from forcelab.cli.output import json_text, table

NOTHING = "No serial port and no camera is plugged in, or this user may not see them."


def run(arguments: argparse.Namespace) -> None:
    """Print the serial ports and cameras, and what they seem to be."""
    ports, films = find_ports(), cameras()
    if arguments.json:
        content = {
            "ports": [
                {
                    "port": port.path,
                    "kind": port.kind,
                    "device": port.device,
                    "description": port.description,
                    "serial": port.serial,
                    "usb": None if port.usb is None else f"{port.usb[0]:04x}:{port.usb[1]:04x}",
                    "usable": port.usable,
                }
                for port in ports
            ],
            "cameras": [
                {"camera": film.device, "name": film.name, "usable": film.usable} for film in films
            ],
        }
        print(json_text(content))
        return
    if not ports and not films:
        print(NOTHING)
        return
    rows = [["what to say", "what it seems to be", "serial number", ""]]
    rows += [
        [
            f"--device {port.device or f'KIND:{port.path}'}",
            port.description,
            port.serial or "-",
            _access(port.usable),
        ]
        for port in ports
    ]
    rows += [
        [f"--camera {film.device.removeprefix('/dev/video')}", film.name, "-", _access(film.usable)]
        for film in films
    ]
    print(table(rows))
    if not all(port.usable for port in ports):
        print("\nPorts that are not yours: sudo usermod -a -G dialout $USER, then log in again.")
    if any(port.device is None for port in ports):
        print("\nKIND is optoforce, text or encoder.")


def _access(usable: bool) -> str:
    """What stands behind a device that cannot be opened."""
    return "" if usable else "not yours to open"
