"""A check that goes on beside the tests: it takes of the processors what they leave idle."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
#: Where the check leaves what it said: one place for all processes of a run of the tests.
RUN = os.environ.get("PYTEST_XDIST_TESTRUNUID", str(os.getpid()))
SAID = Path(tempfile.gettempdir()) / f"forcelab-types-{RUN}"
#: It is no child of a test's process, which may look at its own. What it said appears as a whole.
SCRIPT = '(nice "$@" >"$0.part" 2>&1; echo $? >>"$0.part"; mv "$0.part" "$0") >/dev/null 2>&1 &'


def begin() -> None:
    """Begin to check the types; of the processes that share the tests the first one does."""
    if os.environ.get("PYTEST_XDIST_WORKER", "gw0") == "gw0":
        SAID.unlink(missing_ok=True)  # of a run that was cut short, whose number came again
        subprocess.run(
            ["bash", "-c", SCRIPT, SAID, Path(sys.executable).with_name("mypy")],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"},
            check=True,
        )


def outcome() -> tuple[int, str]:
    """Wait for the check; gives its status and what it said."""
    while not SAID.exists():
        time.sleep(0.05)
    *said, status = SAID.read_text("utf-8").splitlines()
    SAID.unlink()
    return int(status), "\n".join(said)
