"""Runs the README's commands and puts their real output below them.

Start it as ``python tests/make_readme.py``.
Also renews its pictures.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
#: Blocks; what takes long is marked "slow", and is left out where that is not asked for.
#: A command goes on behind a line that ends with a backslash.
BLOCK = re.compile(
    r"```console(?P<slow> slow)?\n\$ (?P<command>(?:[^\n]*\\\n)*[^\n]*)\n(?P<shown>.*?)```", re.S
)
#: Pictures of the window, by name, of the sample project after all commands have run.
WINDOWS = {
    "window.png": "--demo stylus-1-02 --at 3 --theme light",
    "window-dark.png": "--demo stylus-1-02 --at 3.2 --span 0.4 --theme dark",
    "review.png": "--workspace review --demo stylus-1-01 --at 1.9 --span 2 --theme light "
    "--size 1440x900",
}
#: Pictures that the commands draw.
FIGURES = ("sample.png", "confusion.png")


def run_blocks(text: str, folder: Path, *, slow: bool) -> str:
    """The text with every console block's output made anew, commands running in `folder`."""
    (folder / "assets").symlink_to(ROOT / "assets")
    (folder / "README.md").symlink_to(README)
    scripts = Path(sys.executable).parent
    environment = {**os.environ, "PATH": f"{scripts}{os.pathsep}{os.environ['PATH']}"}

    def renewed(block: re.Match[str]) -> str:
        if block["slow"] and not slow:
            return block[0]
        done = subprocess.run(
            ["bash", "-c", block["command"]],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        shown = done.stdout.rstrip()
        return f"```console{block['slow'] or ''}\n$ {block['command']}\n{shown}\n```"

    return BLOCK.sub(renewed, text)


def draw_windows(folder: Path) -> None:
    """Draw the window, as :data:`WINDOWS` says, and the Capture workspace into `folder`."""
    project = folder / "sample.forcelab"
    for name, options in WINDOWS.items():
        words = ["gui", str(project), "--author", "Ines", *options.split()]
        draw = [sys.executable, "-m", "forcelab", *words, "--screenshot", str(folder / name)]
        subprocess.run(draw, check=True)
    draw = [
        sys.executable,
        "-m",
        "tests.make_capture_picture",
        str(project),
        str(folder / "capture.png"),
    ]
    subprocess.run(draw, cwd=ROOT, check=True)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        README.write_text(run_blocks(README.read_text("utf-8"), folder, slow=True), "utf-8")
        draw_windows(folder)
        for picture in (*WINDOWS, "capture.png", *FIGURES):
            shutil.copy(folder / picture, ROOT / "assets")
