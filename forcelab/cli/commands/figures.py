"""Draw what the wavelets see.

wavelets: Morlets of several p and what they make of two tones. clusters: four k-means
clusters of a trapezoidal force; only magnitude and phase tell rising from falling.

for example:
  forcelab figures figures --format png
"""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.files import output_folder
from forcelab.cli.options import json_flag, path_of
from forcelab.cli.output import json_text


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    parser.add_argument("folder", metavar="DIR", type=path_of, help="folder to write into")
    parser.add_argument(
        "--format", choices=("svg", "pdf", "png"), default="svg", help="of both figures (svg)"
    )
    json_flag(parser)


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
