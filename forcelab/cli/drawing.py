"""``forcelab figures``."""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.files import output_folder
from forcelab.cli.output import json_text


def run(arguments: argparse.Namespace) -> None:
    """Draw the wavelet figure and the cluster figure into a folder."""
    from forcelab.gui.figures.clusters import cluster_figure
    from forcelab.gui.figures.wavelets import wavelet_figure

    folder: Path = arguments.folder
    written = []
    with output_folder(folder):
        for name, figure in (("wavelets", wavelet_figure()), ("clusters", cluster_figure())):
            path = folder / f"{name}.{arguments.format}"
            figure.save(path)
            written.append(str(path))
    print(json_text({"written": written}) if arguments.json else "\n".join(written))
