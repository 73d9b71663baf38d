"""Whether Qt starts on this machine, and which shared libraries it lacks.

Qt aborts where it cannot start, so that is found out before it is asked, or in another process.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from forcelab.errors import InputError

#: The modules of PySide6 that the program uses.
MODULES = ("QtCore", "QtGui", "QtWidgets", "QtSvg")
#: Debian packages of the libraries that Qt looks for.
PACKAGES = {
    "libEGL": "libegl1",
    "libGL": "libgl1",
    "libGLX": "libglx0",
    "libOpenGL": "libopengl0",
    "libX11": "libx11-6",
    "libX11-xcb": "libx11-xcb1",
    "libdbus-1": "libdbus-1-3",
    "libfontconfig": "libfontconfig1",
    "libfreetype": "libfreetype6",
    "libglib-2.0": "libglib2.0-0",
    "libgthread-2.0": "libglib2.0-0",
    "libstdc++": "libstdc++6",
    "libwayland-client": "libwayland-client0",
    "libwayland-cursor": "libwayland-cursor0",
    "libwayland-egl": "libwayland-egl1",
    "libxcb": "libxcb1",
    "libxcb-cursor": "libxcb-cursor0",
    "libxcb-icccm": "libxcb-icccm4",
    "libxcb-image": "libxcb-image0",
    "libxcb-keysyms": "libxcb-keysyms1",
    "libxcb-randr": "libxcb-randr0",
    "libxcb-render": "libxcb-render0",
    "libxcb-render-util": "libxcb-render-util0",
    "libxcb-shape": "libxcb-shape0",
    "libxcb-shm": "libxcb-shm0",
    "libxcb-sync": "libxcb-sync1",
    "libxcb-util": "libxcb-util1",
    "libxcb-xfixes": "libxcb-xfixes0",
    "libxcb-xkb": "libxcb-xkb1",
    "libxkbcommon": "libxkbcommon0",
    "libxkbcommon-x11": "libxkbcommon-x11-0",
    "libz": "zlib1g",
    "libzstd": "libzstd1",
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
    """How Qt started: its version, platform plugin and number of font families.

    `trouble` is why it did not start, and `cure` what to do about it; both empty if all is well.
    """

    version: str = ""
    platform: str = ""
    fonts: int = 0
    trouble: str = ""
    cure: str = ""


def require_qt() -> None:
    """Make sure that Qt can start, as it would abort the program otherwise.

    Raises InputError naming all that is missing of PySide6 and shared libraries.
    """
    try:
        import PySide6.QtWidgets  # noqa: F401 - whether it can be

        plugins = _plugins()
        for plugin in plugins:
            try:
                ctypes.CDLL(str(plugin))
                break  # Qt takes the first one that it can load
            except OSError:
                if plugin == plugins[-1]:
                    raise
    except (ImportError, OSError) as error:
        diagnosis = failure(str(error))
        cure = f"; {diagnosis.cure}" if diagnosis.cure else ""
        raise InputError(f"Qt cannot start: {diagnosis.trouble}{cure}.") from error


def has_display() -> bool:
    """Whether a window can be shown on this machine."""
    if not sys.platform.startswith("linux") or os.environ.get("QT_QPA_PLATFORM"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def missing_libraries() -> list[str]:
    """The shared libraries that Qt and its platform plugin need here and lack."""
    folder = _folder()
    if folder is None or not sys.platform.startswith("linux"):
        return []
    modules = [folder / f"{module}.abi3.so" for module in MODULES]
    try:
        listed = subprocess.run(
            ["ldd", *modules, *_plugins()[-1:]], capture_output=True, text=True, check=False
        )
    except FileNotFoundError:
        return []
    return sorted(set(re.findall(r"^\s*(\S+) => not found", listed.stdout, re.MULTILINE)))


def _folder() -> Path | None:
    """Where PySide6 is installed."""
    spec = find_spec("PySide6")
    return Path(spec.origin).parent if spec is not None and spec.origin else None


def _plugins() -> list[Path]:
    """The platform plugins that Qt will try, in order, as far as it has them."""
    folder = _folder()
    setting = os.environ.get("QT_QPA_PLATFORM", "")
    names = [part.partition(":")[0] for part in setting.split(";") if part]
    if not names:
        names += ["wayland"] if os.environ.get("WAYLAND_DISPLAY") else []
        names += ["xcb"] if os.environ.get("DISPLAY") else []
    if folder is None:
        return []
    plugins = folder / "Qt" / "plugins" / "platforms"
    files = [plugins / f"libq{name}.so" for name in names or ["offscreen"]]
    return [file for file in files if file.exists()]


def probe(timeout: float = 60.0) -> QtPlatform:
    """Start Qt once in a process of its own; offscreen if there is no display."""
    if missing := missing_libraries():
        return _lacking(missing)
    environment = dict(os.environ)
    if not has_display():
        environment["QT_QPA_PLATFORM"] = "offscreen"
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
    return failure(child.stderr)


def failure(words: str) -> QtPlatform:
    """What the last output of Python or Qt means: the text of an error, or a process's stderr."""
    if "No module named 'PySide6" in words:
        return QtPlatform(
            trouble="PySide6 is not installed", cure='pip install "PySide6-Essentials<6.12"'
        )
    lacking = re.search(r"(lib[\w.+-]+\.so[\w.]*): cannot open shared object", words)
    if lacking:
        return _lacking(missing_libraries() or [lacking[1]])
    if "xcb" in words and "plugin" in words:
        return QtPlatform(
            trouble=f"Qt cannot draw on the display {os.environ.get('DISPLAY', '')}",
            cure="set DISPLAY to one that runs and that you may use",
        )
    last = [line for line in words.splitlines() if line.strip()]
    return QtPlatform(trouble=last[-1] if last else "Qt ended without a word")


def _lacking(libraries: list[str]) -> QtPlatform:
    """All missing libraries, and the one command that installs them."""
    known = {library: PACKAGES.get(library.partition(".so")[0]) for library in libraries}
    packages = sorted({package for package in known.values() if package})
    others = [library for library, package in known.items() if not package]
    cures = [f"apt-get install {' '.join(packages)}"] if packages else []
    cures += [f"install the package with {' and '.join(others)}"] if others else []
    subject, are = ("library", "is") if len(libraries) == 1 else ("libraries", "are")
    trouble = f"the {subject} {', '.join(libraries)} {are} missing"
    return QtPlatform(trouble=trouble, cure="; ".join(cures))
