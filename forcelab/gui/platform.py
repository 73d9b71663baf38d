"""Whether Qt starts on this machine; tried in a process of its own, since Qt aborts on failure."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass

__all__ = ["QtPlatform", "probe"]

#: Debian packages of the libraries that Qt looks for, by the start of the library's name.
PACKAGES = {
    "libGL": "libgl1",
    "libEGL": "libegl1",
    "libxkbcommon-x11": "libxkbcommon-x11-0",
    "libxkbcommon": "libxkbcommon0",
    "libfontconfig": "libfontconfig1",
    "libdbus": "libdbus-1-3",
    "libglib": "libglib2.0-0",
    "libgthread": "libglib2.0-0",
    "libxcb-cursor": "libxcb-cursor0",
    "libxcb-icccm": "libxcb-icccm4",
    "libxcb-keysyms": "libxcb-keysyms1",
    "libxcb-shape": "libxcb-shape0",
}

_CHILD = """
import json
from PySide6.QtCore import qVersion
from PySide6.QtGui import QFontDatabase
from PySide6.QtWidgets import QApplication
app = QApplication([])
print(json.dumps([qVersion(), app.platformName(), len(QFontDatabase.families())]))
"""


@dataclass(frozen=True, slots=True)
class QtPlatform:
    """How Qt came up.

    Parameters
    ----------
    version, platform : str
        Such as ``"6.11.3"`` and ``"xcb"``; empty where Qt did not start.
    fonts : int
        Number of font families it found.
    trouble : str
        Why it did not start; empty where it did.
    cure : str
        What to do about it; empty where nothing is wrong.
    """

    version: str = ""
    platform: str = ""
    fonts: int = 0
    trouble: str = ""
    cure: str = ""


def probe(timeout: float = 60.0) -> QtPlatform:
    """Start Qt once and tell how it went.

    Without a display it is tried offscreen, as pictures are made there.
    """
    environment = dict(os.environ)
    if not environment.get("DISPLAY") and not environment.get("WAYLAND_DISPLAY"):
        environment.setdefault("QT_QPA_PLATFORM", "offscreen")
    try:
        child = subprocess.run(
            [sys.executable, "-c", _CHILD],
            env=environment,
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return QtPlatform(trouble=f"Qt did not start within {timeout:.0f} s")
    if child.returncode == 0:
        version, platform, fonts = json.loads(child.stdout.splitlines()[-1])
        cure = "" if fonts else "apt-get install fonts-dejavu-core"
        return QtPlatform(version, platform, fonts, cure=cure)
    return _failure(child.stderr)


def _failure(stderr: str) -> QtPlatform:
    """What Qt's last words mean."""
    if "No module named 'PySide6" in stderr:
        return QtPlatform(
            trouble="PySide6 is not installed", cure='pip install "PySide6-Essentials<6.12"'
        )
    missing = re.search(r"(lib[\w.+-]+?)\.so[\w.]*: cannot open shared object", stderr)
    if missing:
        library = missing[1]
        package = next((p for name, p in PACKAGES.items() if library.startswith(name)), "")
        cure = f"apt-get install {package}" if package else f"install the package with {library}"
        return QtPlatform(trouble=f"the library {library} is missing", cure=cure)
    if "xcb" in stderr and "plugin" in stderr:
        return QtPlatform(
            trouble="Qt cannot draw on this X display",
            cure="apt-get install libxcb-cursor0 libxkbcommon-x11-0 libxcb-icccm4 "
            "libxcb-keysyms1 libxcb-shape0",
        )
    last = [line for line in stderr.splitlines() if line.strip()]
    return QtPlatform(trouble=last[-1] if last else "Qt ended without a word")
