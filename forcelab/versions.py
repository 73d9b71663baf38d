"""Versions of everything a result depends on."""

from __future__ import annotations

import platform
from importlib.metadata import version

from forcelab import __version__

__all__ = ["versions"]

PACKAGES = ("numpy", "scipy", "scikit-learn", "skops")


def versions() -> dict[str, str]:
    """Versions of forcelab, Python and the numerical packages, by name; nothing is imported."""
    found = {"forcelab": __version__, "python": platform.python_version()}
    return found | {package: version(package) for package in PACKAGES}
