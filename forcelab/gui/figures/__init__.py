"""Figures drawn with QPainter: one painting for screen, SVG, PDF and PNG."""
