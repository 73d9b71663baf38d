"""Draw what the wavelets see.

wavelets: Morlets of several p and what they make of two tones. clusters: four k-means
clusters of a trapezoidal force; only magnitude and phase tell rising from falling.

for example:
  forcelab figures figures --format png
"""

from __future__ import annotations

import argparse
from pathlib import Path

from forcelab.cli.options import add_json, path_of
from forcelab.cli.output import print_result
from forcelab.formats.output_folder import output_folder


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("folder", metavar="DIR", type=path_of, help="folder to write into")
    parser.add_argument(
        "--format", choices=("svg", "pdf", "png"), default="svg", help="of both figures (svg)"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> None:
    from forcelab.gui.figures.clusters import cluster_figure
    from forcelab.gui.figures.wavelets import wavelet_figure

    folder: Path = arguments.folder
    written = []
    with output_folder(folder):
        for name, figure in (("wavelets", wavelet_figure()), ("clusters", cluster_figure())):
            path = folder / f"{name}.{arguments.format}"
            figure.save(path)
            written.append(str(path))
    print_result(arguments.json, {"written": written}, "\n".join(written))
