"""The text size of plots and painted tracks: that of the preferences, as of all other widgets.

Views paint with :func:`font`, and give what lies around their text :func:`pixels`. Figures that
are saved have no text size: where a view shows one, its painter is scaled.
"""

from __future__ import annotations

from typing import ClassVar

from PySide6.QtGui import QFont

from forcelab.gui.figures import text


class _TextSize:
    scale: ClassVar[float] = 1.0


def scale() -> float:
    """The text size as a share of the usual one."""
    return _TextSize.scale


def set_scale(share: float) -> None:
    """Use this text size from now on; widgets follow when they get their font."""
    _TextSize.scale = share


def pixels(length: float) -> float:
    """A length that grows with the text, from its pixels at the usual size."""
    return _TextSize.scale * length


def font(size: float = 11.0, *, bold: bool = False) -> QFont:
    """The figures' font for letters that are `size` pixels high at the usual size. Shared."""
    return text.font(pixels(size), bold=bold)
