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
BLOCK = re.compile(r"```console(?P<slow> slow)?\n(?P<content>.*?)```", re.S)


def run_blocks(text: str, folder: Path, *, slow: bool) -> str:
    """The text with every console block's output made anew, commands running in `folder`."""
    (folder / "assets").symlink_to(ROOT / "assets")
    (folder / "README.md").symlink_to(README)
    scripts = Path(sys.executable).parent
    environment = {**os.environ, "PATH": f"{scripts}{os.pathsep}{os.environ['PATH']}"}

    def renewed(block: re.Match[str]) -> str:
        if block["slow"] and not slow:
            return block[0]
        command = block["content"].splitlines()[0]
        done = subprocess.run(
            ["bash", "-c", command.removeprefix("$ ")],
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        return f"```console{block['slow'] or ''}\n{command}\n{done.stdout.rstrip()}\n```"

    return BLOCK.sub(renewed, text)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        README.write_text(run_blocks(README.read_text("utf-8"), Path(name), slow=True), "utf-8")
        drawn = ("window.png", "window-dark.png", "review.png", "capture.png")
        draw = [sys.executable, "tests/capture_picture.py", f"{name}/sample.forcelab"]
        subprocess.run([*draw, f"{name}/capture.png"], cwd=ROOT, check=True)
        for picture in (*drawn, "sample.png", "pairs.png", "confusion.png", "figures/clusters.png"):
            shutil.copy(Path(name) / picture, ROOT / "assets")
