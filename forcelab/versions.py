"""Versions of everything a result depends on."""

from __future__ import annotations

import platform
from functools import cache
from importlib.metadata import version

from forcelab import __version__

__all__ = ["versions"]

PACKAGES = ("numpy", "scipy", "scikit-learn", "skops")


def versions() -> dict[str, str]:
    """Versions of forcelab, Python and the numerical packages, by name; nothing is imported."""
    return {"forcelab": __version__, "python": platform.python_version(), **_installed()}


@cache
def _installed() -> dict[str, str]:
    """Versions of the packages; to look for one takes milliseconds."""
    return {package: version(package) for package in PACKAGES}
