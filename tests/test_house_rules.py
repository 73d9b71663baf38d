"""The rules that machines can keep: imports, style, types."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
CHECKS = {
    "imports point downwards only": ["lint-imports"],
    "lint": ["ruff", "check", "."],
    "format": ["ruff", "format", "--check", "."],
    "types": ["mypy"],
}


@pytest.mark.parametrize("command", CHECKS.values(), ids=CHECKS)
def test_the_house_rules_hold(command):
    program = Path(sys.executable).with_name(command[0])
    done = subprocess.run(
        [program, *command[1:]],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("command", "never"),
    [
        ("forcelab.cli", {"numpy", "PySide6", "sklearn", "cv2", "serial"}),
        ("forcelab.cli.listing", {"PySide6", "sklearn", "scipy", "cv2", "serial"}),
        ("forcelab.cli.importing", {"PySide6", "sklearn", "cv2", "serial"}),
        ("forcelab.cli.evaluating", {"PySide6", "cv2", "serial"}),
        ("forcelab.signals.cwt", {"PySide6", "sklearn", "cv2", "serial"}),
        ("forcelab.gui.figures", {"sklearn", "cv2", "serial"}),
    ],
)
def test_what_a_command_does_not_need_is_not_loaded(command, never):
    script = f"import sys, {command}; print(*{{name.split('.')[0] for name in sys.modules}})"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert not never & set(done.stdout.split())
