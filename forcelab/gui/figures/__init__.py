"""Figures drawn with QPainter: one painting for screen, SVG, PDF and PNG.

The names below are loaded when they are first used: the window draws with the modules beneath, and
starts without what only figures need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from forcelab.gui.figures.canvas import LIGHT as LIGHT
    from forcelab.gui.figures.canvas import Figure as Figure
    from forcelab.gui.figures.canvas import Theme as Theme
    from forcelab.gui.figures.clusters import ClusterFigure as ClusterFigure
    from forcelab.gui.figures.clusters import cluster_figure as cluster_figure
    from forcelab.gui.figures.confusion import ConfusionMatrix as ConfusionMatrix
    from forcelab.gui.figures.timelines import Pair as Pair
    from forcelab.gui.figures.timelines import TimelinePairs as TimelinePairs
    from forcelab.gui.figures.wavelets import WaveletFigure as WaveletFigure
    from forcelab.gui.figures.wavelets import wavelet_figure as wavelet_figure

#: The module in which each name lives.
_HOMES = {
    "LIGHT": "canvas",
    "ClusterFigure": "clusters",
    "ConfusionMatrix": "confusion",
    "Figure": "canvas",
    "Pair": "timelines",
    "Theme": "canvas",
    "TimelinePairs": "timelines",
    "WaveletFigure": "wavelets",
    "cluster_figure": "clusters",
    "wavelet_figure": "wavelets",
}

__all__ = [*_HOMES]  # noqa: PLE0604 - all of them are strings


def __getattr__(name: str) -> Any:
    """Load a name when it is first used."""
    if name not in _HOMES:
        raise AttributeError(f"module 'forcelab.gui.figures' has no attribute '{name}'")
    return getattr(import_module(f"forcelab.gui.figures.{_HOMES[name]}"), name)
