"""Runs the commands of the README and the guide and puts their real output below them.

Start it as ``python tests/make_guide.py``.
Also renews their pictures. ``python tests/make_guide.py PROJECT [PICTURE...]`` renews no more than
pictures of the window, of a sample project in which all commands have run and F5 trained.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from forcelab.guide import CONTENTS
from forcelab.jobs import finish
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.presets import preset
from forcelab.review.training import review_job

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
GUIDE = ROOT / "assets" / "guide"
#: The README and the pages of the guide, in the order in which their commands run.
DOCUMENTS = (README, *(GUIDE / f"{name}.md" for name in CONTENTS))
#: Runs a command or a script and gives what it prints.
Run = Callable[[str], str]
#: Blocks; what takes long is marked "slow", and is left out where that is not asked for. A script
#: may have a block of what it prints below it.
#: A command goes on behind a line that ends with a backslash.
BLOCK = re.compile(
    r"```console(?P<slow> slow)?\n\$ (?P<command>(?:[^\n]*\\\n)*[^\n]*)\n(?P<shown>.*?)```"
    r"|```python\n(?P<script>.*?)```(?P<printed>\n\nIt prints:\n\n```text\n.*?```)?",
    re.S,
)
#: Pictures of the window and its dialogs by name, each drawn in the light and the dark theme
#: (``NAME-dark.png``); of the sample project but for the first page.
WINDOWS = {
    "window.png": "PROJECT --demo stylus-1-02 --at 3",
    "zoomed.png": "PROJECT --demo stylus-1-02 --at 3.2 --span 0.4",
    "review.png": "PROJECT --workspace review --demo stylus-1-01 --at 1.9 --span 2 --size 1440x900",
    "coders.png": "PROJECT --workspace coders --demo stylus-1-01 --at 1.9 --span 2 --size 1440x900",
    "why.png": "PROJECT --workspace why --demo stylus-1-01 --at 1.9 --span 2 --size 1440x900",
    "first-page.png": "--size 900x560",
    "import.png": "PROJECT --dialog import assets/foam-01.csv assets/foam-02.csv --size 720x640",
    "export.png": "PROJECT --dialog export --size 720x220",
    "synchronise.png": "PROJECT --demo stylus-1-05 --dialog synchronise --size 760x600",
    "settings.png": "PROJECT --workspace review --demo stylus-1-01 --dialog settings",
    "keys.png": "PROJECT --demo stylus-1-02 --dialog keys --size 1200x820",
}
#: Finds the taps, and shows the first, before the picture of the dialog is drawn.
FIND_TAPS = """
import sys
from forcelab.cli import main
from forcelab.gui.label.video_sync import SynchroniseDialog as Dialog

def open_and_find(dialog, video):
    open_video(dialog, video)
    dialog.propose()

def show_found(dialog, proposal):
    show_proposal(dialog, proposal)
    dialog.table.setCurrentCell(0, 0)

open_video, show_proposal = Dialog.show_video, Dialog._proposed
Dialog.show_video, Dialog._proposed = open_and_find, show_found
Dialog.settled = property(lambda dialog: dialog.preview.settled and dialog.proposal is not None)
sys.exit(main())
"""
#: Drawn while something is recorded.
CAPTURE = "capture.png"
#: Pictures that commands of the documents draw.
FIGURES = ("sample.png", "confusion.png")
#: Pictures that take long, or are made elsewhere, and how.
OTHERS = {
    "contact.png": "forcelab measure contact --quick --figure contact.png",
    "tasks.png": "python tests/make_assets.py",
}
#: The colours of a picture are reduced to so many, half of them its most frequent ones.
COLOURS = 256


def run_blocks(
    document: Path, run_command: Run, run_script: Run, *, slow: bool
) -> tuple[str, list[str]]:
    """The document with the output of its commands made anew, and what its scripts print."""
    printed = []

    def renewed(block: re.Match[str]) -> str:
        if block["script"]:
            printed.append(run_script(block["script"]))
            shown = f"\n\nIt prints:\n\n```text\n{printed[-1]}```" if block["printed"] else ""
            return f"```python\n{block['script']}```{shown}"
        if block["slow"] and not slow:
            return block[0]
        shown = run_command(block["command"]).rstrip()
        return f"```console{block['slow'] or ''}\n$ {block['command']}\n{shown}\n```"

    return BLOCK.sub(renewed, document.read_text("utf-8")), printed


def run_in(folder: Path, *words: str, check: bool = False) -> str:
    """What a process prints in a folder. Raises CalledProcessError if a checked one fails."""
    scripts = Path(sys.executable).parent
    return subprocess.run(
        words,
        cwd=folder,
        env={**os.environ, "PATH": f"{scripts}{os.pathsep}{os.environ['PATH']}"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=check,
    ).stdout


def prepare(folder: Path) -> None:
    """Lay into a folder what the commands need beside the installed program."""
    (folder / "README.md").symlink_to(README)


def dark(name: str) -> str:
    """The name of the same picture in the dark theme."""
    return name.replace(".png", "-dark.png")


def train(project: Path) -> None:
    """Train as F5 does in a new project; the pictures show this run."""
    selection = DataSelection(tasks=("stylus",), author="Ines")
    finish(review_job(project, preset("ensemble"), selection, "stylus"))


def draw_windows(project: Path, folder: Path, names: Iterable[str]) -> None:
    """Draw the named pictures of the window, as :data:`WINDOWS` says, in both themes."""
    for name in names:
        for theme, path in (("light", folder / name), ("dark", folder / dark(name))):
            words = ["-m", "tests.make_capture_picture", str(project), str(path), theme]
            if name != CAPTURE:
                options = WINDOWS[name].replace("PROJECT", f"{project} --author Ines").split()
                start = ["-c", FIND_TAPS] if name == "synchronise.png" else ["-m", "forcelab"]
                words = [*start, "gui", *options, "--theme", theme, "--screenshot", str(path)]
            # The first page names the home folder.
            home = {**os.environ, "HOME": "/home/ines"}
            subprocess.run([sys.executable, *words], cwd=ROOT, env=home, check=True)
            reduce_colours(path)


def reduce_colours(path: Path) -> None:
    """Write a picture again with few colours, which takes a third of the bytes."""
    from PySide6.QtGui import QImage

    pixels = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
    height, width, _ = pixels.shape
    colours, where, counts = np.unique(
        pixels.reshape(-1, 3), axis=0, return_inverse=True, return_counts=True
    )
    if len(colours) > COLOURS:
        order = np.argsort(-counts, kind="stable")
        frequent, rare = order[: COLOURS // 2], order[COLOURS // 2 :]
        cv2.setRNGSeed(0)
        stop = (cv2.TERM_CRITERIA_MAX_ITER, 20, 0)
        _, nearest, means = cv2.kmeans(
            colours[rare].astype(np.float32), COLOURS // 2, None, stop, 1, cv2.KMEANS_PP_CENTERS
        )
        numbers = np.empty(len(colours), np.intp)
        numbers[frequent], numbers[rare] = np.arange(len(frequent)), nearest[:, 0] + COLOURS // 2
        where, colours = numbers[where], np.vstack([colours[frequent], np.rint(means).astype(int)])
    indices = np.ascontiguousarray(where.reshape(height, width), np.uint8)
    image = QImage(indices.data, width, height, width, QImage.Format.Format_Indexed8)
    image.setColorTable([0xFF000000 | int(r) << 16 | int(g) << 8 | int(b) for r, g, b in colours])
    image.save(str(path), "PNG", 0)


def main(project: str = "", *names: str) -> None:
    """Renew everything, or only pictures of a project."""
    pictures = GUIDE / "pictures"
    if project:
        draw_windows(Path(project).resolve(), pictures, names or (*WINDOWS, CAPTURE))
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        run_command = partial(run_in, folder, "bash", "-c")
        run_script = partial(run_in, folder, sys.executable, "-c", check=True)
        for document in DOCUMENTS:
            text, _ = run_blocks(document, run_command, run_script, slow=True)
            document.write_text(text, "utf-8")
        train(folder / "sample.forcelab")
        draw_windows(folder / "sample.forcelab", pictures, (*WINDOWS, CAPTURE))
        for figure in FIGURES:
            shutil.copy(folder / figure, pictures)


if __name__ == "__main__":
    main(*sys.argv[1:])
