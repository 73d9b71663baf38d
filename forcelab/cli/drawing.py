"""``forcelab figures``."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.output import json_text
from forcelab.errors import InputError


def run(arguments: argparse.Namespace) -> None:
    """Draw the wavelet figure and the cluster figure into a folder."""
    from forcelab.gui.figures import cluster_figure, wavelet_figure

    folder: Path = arguments.folder
    if folder.exists() and not folder.is_dir():
        raise InputError(f"'{folder}' is a file; name a folder to draw into.")
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, figure in (("wavelets", wavelet_figure()), ("clusters", cluster_figure())):
        path = folder / f"{name}.{arguments.format}"
        figure.save(path)
        written.append(str(path))
    print(json_text({"written": written}) if arguments.json else "\n".join(written))
