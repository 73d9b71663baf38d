"""The version of forcelab."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

__version__ = "0.2.0"

#: The folder that holds the package; a checkout has its history there.
ROOT = Path(__file__).resolve().parents[1]
#: How long git may take to look at the checkout's files, s.
PATIENCE = 3.0


@cache
def full_version() -> str:
    """The version, as ``0.2.0 (checkout d23dd5ae, changed)`` in a checkout.

    That is its commit, and whether files were changed since.
    """
    if not (ROOT / ".git").exists():
        return __version__
    return f"{__version__} (checkout{_commit()})"


def _commit() -> str:
    """The commit's short name, and "changed" if files differ from it; empty where git fails."""
    import subprocess  # only a checkout needs it

    # A hook of git, too, may start the program: what it then says is of another repository.
    environment = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")}
    describe = ["describe", "--always", "--exclude=*", "--abbrev=8", "--dirty=, changed"]
    try:
        done = subprocess.run(
            ["git", "-C", ROOT, *describe],
            env={**environment, "GIT_OPTIONAL_LOCKS": "0"},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=True,
        )
    except (OSError, subprocess.SubprocessError, UnicodeDecodeError):
        return ""
    return f" {done.stdout.strip()}"
