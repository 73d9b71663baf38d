"""Figures drawn with QPainter: one painting for screen, SVG, PDF and PNG."""

from __future__ import annotations

from forcelab.gui.figures.canvas import LIGHT, Figure, Theme
from forcelab.gui.figures.clusters import ClusterFigure, cluster_figure
from forcelab.gui.figures.confusion import ConfusionMatrix
from forcelab.gui.figures.timelines import Pair, TimelinePairs
from forcelab.gui.figures.wavelets import WaveletFigure, wavelet_figure

__all__ = [
    "LIGHT",
    "ClusterFigure",
    "ConfusionMatrix",
    "Figure",
    "Pair",
    "Theme",
    "TimelinePairs",
    "WaveletFigure",
    "cluster_figure",
    "wavelet_figure",
]
