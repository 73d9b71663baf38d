"""Check this machine and say what is missing.

Versions, Qt and its fonts, video codecs (each is tried), cameras and serial ports, with
the remedy for whatever is wrong.

for example:
  forcelab doctor
"""

from __future__ import annotations

import argparse
import platform
import re
import sqlite3
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version

from forcelab.cli.options import add_json
from forcelab.cli.output import json_text
from forcelab.errors import InputError
from forcelab.extras import PACKAGES
from forcelab.resources import asset
from forcelab.version import full_version

#: Packages without which a part of the program does not run.
NEEDED = (
    "numpy",
    "scipy",
    "scikit-learn",
    "skops",
    "joblib",
    "threadpoolctl",
    "psutil",
    "PySide6-Essentials",
    "pyqtgraph",
    "opencv-contrib-python-headless",
    "pyserial",
    "shtab",
)
#: Seconds of a step from which a clock is too coarse to tell when samples came.
COARSE = 1e-3


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was checked."""

    what: str
    found: str
    well: bool = True  #: what is merely absent, such as a camera, is well
    cure: str = ""  #: empty where there is nothing to do


def add_options(parser: argparse.ArgumentParser) -> None:
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print every finding; exit status 1 if something needed is missing."""
    findings = []
    for finding in _checks():
        findings.append(finding)
        if not arguments.json:
            mark = "ok  " if finding.well else "FAIL"
            cure = f"  ->  {finding.cure}" if finding.cure else ""
            print(f"{mark} {finding.what:<32} {finding.found}{cure}", flush=True)
    if arguments.json:
        print(json_text([asdict(finding) for finding in findings]))
    return 0 if all(finding.well for finding in findings) else 1


def _checks() -> Iterator[Check]:
    """Look at one thing after the other; a package that is missing stops none of them."""
    yield Check("forcelab", full_version())
    yield Check("python", platform.python_version())
    yield Check("sqlite", sqlite3.sqlite_version)
    for name in NEEDED:
        version = _version(name)
        yield Check(name, version or "missing", version is not None, "" if version else _cure(name))
    for name, extra in PACKAGES.items():
        version = _version(name)
        yield Check(name, version or f"not installed (only the extra {extra} needs it)")
    yield from _run_check("versions", _constraints)
    yield from _run_check("Qt", _qt)
    yield from _run_check("video", _codecs)
    yield from _run_check("devices", _devices)
    yield from _run_check("system", _limits)


def _run_check(subject: str, check: Callable[[], Iterator[Check]]) -> Iterator[Check]:
    """The findings of a check, or why it cannot be made."""
    try:
        yield from check()
    except (ImportError, InputError) as error:
        yield Check(subject, f"cannot be tried: {error}", well=False, cure=_cure("."))


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _cure(name: str) -> str:
    """How to install a package into the environment that runs this."""
    return (
        f"{sys.executable} -m pip install {'--force-reinstall .' if name == 'forcelab' else name}"
    )


def _constraints() -> Iterator[Check]:
    """Which file names the versions that make the guide's figures, and what differs from them."""
    path = asset("constraints.txt")
    pins = set(re.findall(r"^(\S+)==([^;\s]+)", path.read_text("utf-8"), re.MULTILINE))
    others = [name for name in NEEDED if (name.lower(), _version(name)) not in pins]
    here = f"those of {', '.join(others)} differ" if others else "as installed"
    yield Check("versions of the guide's figures", f"{path} ({here})")


def _qt() -> Iterator[Check]:
    """Whether Qt starts and finds fonts."""
    from forcelab.gui.qt_check import probe

    qt = probe()
    if qt.trouble:
        yield Check("Qt", qt.trouble, well=False, cure=qt.cure)
        return
    yield Check("Qt platform", f"{qt.platform} (Qt {qt.version})")
    yield Check("fonts", f"{qt.fonts} families", well=qt.fonts > 0, cure=qt.cure)
    from forcelab.gui.exception_hook import log_file  # with Qt, which knows the platform's folders

    log = log_file()
    yield Check("log file", f"{log}" if log.exists() else f"{log} (nothing was logged yet)")


def _codecs() -> Iterator[Check]:
    """Which codecs give back the frames that were put in; mp4v is needed, the others are not."""
    from forcelab.video.codecs import CODECS, try_codec

    for codec in CODECS:
        works = try_codec(codec)
        needed = codec.fourcc == "mp4v"
        yield Check(
            f"video {codec.name} ({codec.fourcc})",
            "writes and reads" if works else "not available",
            works or not needed,
            "" if works or not needed else _cure("--upgrade opencv-contrib-python-headless"),
        )


def _devices() -> Iterator[Check]:
    """Cameras and serial ports, and whether this user may use them."""
    from forcelab.capture.discovery import LISTS_CAMERAS, find_cameras, find_ports

    cameras = find_cameras()
    for camera in cameras:
        cure = "" if camera.usable else "sudo usermod -aG video $USER, then log in again"
        yield Check(f"camera {camera.device}", camera.name, camera.usable, cure)
    if not cameras:
        cure = "" if LISTS_CAMERAS else "name one by its number, such as --camera 0"
        yield Check("cameras", "none plugged in" if LISTS_CAMERAS else "not listed here", cure=cure)
    ports = find_ports()
    for port in ports:
        cure = "" if port.usable else "sudo usermod -aG dialout $USER, then log in again"
        yield Check(f"serial port {port.path}", port.description, port.usable, cure)
    if not ports:
        yield Check("serial ports", "none plugged in")


def _limits() -> Iterator[Check]:
    """What this system cannot do, and what to do instead."""
    from forcelab.capture.emulator import SUPPORTED

    step = time.get_clock_info("monotonic").resolution
    if step > COARSE:
        yield Check(
            "clock",
            f"has steps of {1e3 * step:.1f} ms, and so have the times of recorded samples",
            cure="use Python 3.13 or later to record",
        )
    if not SUPPORTED:
        yield Check(
            "replay",
            "not available; needs the pseudo-terminals of Linux",
            cure="connect to replay:PROJECT?demonstration=NAME in Capture",
        )
    if not sys.platform.startswith("linux"):
        yield Check(
            "install-launcher",
            "not available; for Linux only",
            cure="make a shortcut to the program 'forcelab'",
        )
