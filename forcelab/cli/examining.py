"""``forcelab doctor``."""

from __future__ import annotations

import argparse
import sqlite3
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version

from forcelab.cli.output import json_text
from forcelab.versions import versions

#: Packages of the extras, and how to get them.
EXTRAS = {"rosbags": "rosbag", "dask": "cluster", "distributed": "cluster"}
#: Packages without which a part of the program does not run.
NEEDED = ("PySide6-Essentials", "pyqtgraph", "opencv-contrib-python-headless", "pyserial")


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Parameters
    ----------
    what, found : str
        Its name, and how it is.
    well : bool
        Whether it is as it should be; what is merely absent (a camera) is well.
    cure : str
        What to do; empty where there is nothing to do.
    """

    what: str
    found: str
    well: bool = True
    cure: str = ""


def run(arguments: argparse.Namespace) -> int:
    """Print every finding; exit status 1 if something needed is missing."""
    findings = []
    for finding in _findings():
        findings.append(finding)
        if not arguments.json:
            mark = "ok  " if finding.well else "FAIL"
            cure = f"  ->  {finding.cure}" if finding.cure else ""
            print(f"{mark} {finding.what:<32} {finding.found}{cure}", flush=True)
    if arguments.json:
        print(json_text([asdict(finding) for finding in findings]))
    return 0 if all(finding.well for finding in findings) else 1


def _findings() -> Iterator[Finding]:
    """Look at one thing after the other."""
    for package, found in versions().items():
        yield Finding(package, found)
    yield Finding("sqlite", sqlite3.sqlite_version)
    yield from (_package(name, f"pip install {name}", needed=True) for name in NEEDED)
    for name, extra in EXTRAS.items():
        yield _package(name, f"pip install 'forcelab[{extra}]'", needed=False)
    yield from _qt()
    yield from _codecs()
    yield from _devices()


def _package(name: str, cure: str, *, needed: bool) -> Finding:
    """Whether a package is installed, and in which version."""
    try:
        return Finding(name, version(name))
    except PackageNotFoundError:
        return Finding(name, "missing" if needed else "not installed", not needed, cure)


def _qt() -> Iterator[Finding]:
    """Whether Qt starts and finds fonts."""
    from forcelab.gui.platform import probe

    qt = probe()
    if qt.trouble:
        yield Finding("Qt", qt.trouble, well=False, cure=qt.cure)
        return
    yield Finding("Qt platform", f"{qt.platform} (Qt {qt.version})")
    yield Finding("fonts", f"{qt.fonts} families", well=qt.fonts > 0, cure=qt.cure)


def _codecs() -> Iterator[Finding]:
    """Which codecs give back the frames that were put in; mp4v is needed, the others are not."""
    from forcelab.video import CODECS, try_codec

    for codec in CODECS:
        works = try_codec(codec)
        needed = codec.fourcc == "mp4v"
        yield Finding(
            f"video {codec.name} ({codec.fourcc})",
            "writes and reads" if works else "not available",
            works or not needed,
            "" if works or not needed else "pip install -U opencv-contrib-python-headless",
        )


def _devices() -> Iterator[Finding]:
    """Cameras and serial ports, and whether this user may use them."""
    from forcelab.capture.ports import cameras, serial_ports

    seen = cameras()
    for camera in seen:
        cure = "" if camera.usable else "sudo usermod -aG video $USER, then log in again"
        yield Finding(f"camera {camera.device}", camera.name, camera.usable, cure)
    if not seen:
        yield Finding("cameras", "none plugged in")
    ports = serial_ports()
    for port in ports:
        cure = "" if port.usable else "sudo usermod -aG dialout $USER, then log in again"
        yield Finding(f"serial port {port.device}", port.description, port.usable, cure)
    if not ports:
        yield Finding("serial ports", "none plugged in")
