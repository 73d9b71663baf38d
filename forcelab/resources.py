"""What the program carries with it, and the versions of everything a result depends on.

In a checkout the tasks, the glossary and its pictures lie in ``assets/`` beside the package, where
people read and change them; an installed forcelab has them inside the package.
"""

from __future__ import annotations

import platform
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from forcelab.errors import InputError
from forcelab.version import full_version

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


PACKAGE = Path(__file__).resolve().parent
#: Where assets may be, in order: packaging puts them inside, and only a checkout has none there.
FOLDERS = (PACKAGE / "assets_data", PACKAGE.parent / "assets")


def asset(*parts: str) -> Path:
    """Find a file that the program carries with it, such as ``"tasks", "foam.toml"``.

    `InputError` if it is not there.
    """
    folder = next((folder for folder in FOLDERS if folder.is_dir()), FOLDERS[0])
    path = folder.joinpath(*parts)
    if not path.is_file():
        raise InputError(
            f"forcelab's own file '{'/'.join(parts)}' is missing from {folder}; install forcelab "
            f"again, or take it from a complete checkout."
        )
    return path


def read_toml(*parts: str) -> dict[str, Any]:
    """Read one of the program's own TOML files; `parts` as of :func:`asset`."""
    return tomllib.loads(asset(*parts).read_text("utf-8"))


PACKAGES = ("numpy", "scipy", "scikit-learn", "skops")


def versions() -> dict[str, str]:
    """Versions of forcelab, Python and the numerical packages, by name; nothing is imported."""
    return {"forcelab": full_version(), "python": platform.python_version(), **_installed()}


@cache
def _installed() -> dict[str, str]:
    """Versions of the packages; to look for one takes milliseconds."""
    return {package: version(package) for package in PACKAGES}
