"""Text in figures: fonts, measuring, eliding and placing.

Text is drawn at a size in pixels without hinting, so that its width is the same on screen, in
SVG, in PDF and in PNG. Every width is measured, never guessed.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from functools import cache, lru_cache
from itertools import takewhile

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import (
    QColor,
    QFont,
    QFontInfo,
    QFontMetricsF,
    QGuiApplication,
    QPainter,
)

from forcelab.errors import InputError
from forcelab.gui.qt_check import has_display, require_qt

#: First the face whose widths are the widest: where a viewer of an SVG has to fall back to one of
#: the others, text gets narrower and still fits.
FAMILIES = ("DejaVu Sans", "Verdana", "Arial", "sans-serif")
#: Where names are cut that have no room: those of one kind, such as ``stylus 07``, differ at their
#: end as often as at their beginning. Sentences lose their end.
NAMES = Qt.TextElideMode.ElideMiddle
#: Lines whose widths are kept: the numbers of an axis are measured in each frame of a pan.
MEASURED = 8192


def ensure_application() -> QGuiApplication:
    """Make sure that Qt can draw text, without a display if there is none.

    Keep the application as long as anything is drawn. Missing fonts or libraries are an InputError.
    """
    application = QGuiApplication.instance()
    if not isinstance(application, QGuiApplication):
        if not has_display():
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        application = _application()
    # QFontDatabase.families() lists generic names even where no font stands behind them.
    if not QFontInfo(QFont(list(FAMILIES))).family():
        raise InputError(
            "Figures cannot be drawn because the system has no font; install one, such as the "
            "Debian package fonts-dejavu-core."
        )
    return application


@cache
def _application() -> QGuiApplication:
    """The application for figures drawn outside the window; kept alive by the cache.

    One that can have windows, since Qt allows no second one: it costs 5 ms and 5 MB more.
    """
    require_qt()
    from PySide6.QtWidgets import QApplication

    return QApplication(["forcelab"])


@cache
def font(size: float = 11.0, *, bold: bool = False) -> QFont:
    """The figures' font at `size` pixels. Shared: not to be changed."""
    ensure_application()
    face = QFont(list(FAMILIES))
    face.setPixelSize(round(size))
    face.setBold(bold)
    face.setHintingPreference(QFont.HintingPreference.PreferNoHinting)
    return face


def printable(text: str) -> str:
    """The text on one line, without characters that cannot be printed or stored in XML."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


@lru_cache(maxsize=MEASURED)
def width(text: str, face: QFont) -> float:
    """Advance of a line of text, in pixels."""
    return QFontMetricsF(face).horizontalAdvance(text)


def signed(number: str) -> str:
    """A number with a true minus sign, which is as wide as a plus, and none at zero."""
    if not number.strip("-0."):
        return number.lstrip("-")
    return number.replace("-", "\N{MINUS SIGN}")


def widest(texts: Iterable[str], face: QFont) -> float:
    """Advance of the longest of some lines in pixels; 0 for none."""
    return max((width(text, face) for text in texts), default=0.0)


def elided(text: str, face: QFont, room: float) -> str:
    """A sentence cut to `room` pixels, with a sign where something was left out."""
    return QFontMetricsF(face).elidedText(printable(text), Qt.TextElideMode.ElideRight, room)


def elided_name(name: str, face: QFont, room: float, among: tuple[str, ...] = ()) -> str:
    """A name cut to `room` pixels, as of :data:`NAMES`.

    Where that would make it look like another one of `among`, as ``insert left peg`` may beside
    ``insert right peg``, it is cut at its end or its beginning if that helps; else the words that
    another one begins with too become initials: ``left force x, zeroed`` may be ``l f x, ze…``.
    """
    metrics, full = QFontMetricsF(face), printable(name)
    if metrics.horizontalAdvance(full) <= room:
        return full
    others = [printable(other) for other in among if other != name]
    if not any((other[:1], other[-1:]) == (full[:1], full[-1:]) for other in others):
        return metrics.elidedText(full, NAMES, room)  # as good as always, and takes no time
    for mode in (NAMES, Qt.TextElideMode.ElideRight, Qt.TextElideMode.ElideLeft):
        cut = metrics.elidedText(full, mode, room)
        if cut not in (metrics.elidedText(other, mode, room) for other in others):
            return cut
    short = _abbreviated(full, tuple(others))
    if short != full:
        return metrics.elidedText(short, Qt.TextElideMode.ElideRight, room)
    return metrics.elidedText(full, NAMES, room)


#: Between the words of a name, and one of these words.
_SEPARATED, _WORD = re.compile(r"[ _./-]+"), re.compile(r"([^ _./-])[^ _./-]*")


@lru_cache(maxsize=1024)
def _abbreviated(name: str, others: tuple[str, ...]) -> str:
    """The name with initials for the words with which another name begins too."""
    common = max((common_letters(name, other) for other in others), default=0)
    ends = [match.end() for match in _SEPARATED.finditer(name) if match.end() <= common]
    head = ends[-1] if ends else 0
    return _WORD.sub(r"\1", name[:head]) + name[head:]


def common_letters(a: str, b: str) -> int:
    """How many letters two names begin with alike."""
    return sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(a, b, strict=False)))


def draw_text(
    painter: QPainter,
    x: float,
    y: float,
    line: str,
    *,
    face: QFont,
    ink: QColor | str,
    align: float = 0.0,
) -> None:
    """Draw one line of text with the middle of its capital letters at height `y`.

    `x` is the left end of the text (`align` 0), its middle (0.5) or its right end (1).
    """
    painter.setFont(face)
    painter.setPen(ink)
    left = x - align * width(line, face) if align else x
    painter.drawText(QPointF(left, y + QFontMetricsF(face).capHeight() / 2), line)


def draw_text_upwards(
    painter: QPainter,
    x: float,
    y: float,
    line: str,
    *,
    face: QFont,
    ink: QColor | str,
    align: float = 0.0,
) -> None:
    """Draw one line of text upwards from `y`, centred on `x` (see `draw_text`)."""
    painter.save()
    painter.translate(x, y)
    painter.rotate(-90)
    draw_text(painter, 0.0, 0.0, line, face=face, ink=ink, align=align)
    painter.restore()


def ink_on(ground: QColor) -> QColor:
    """Black or white, whichever has the higher contrast on `ground` (WCAG 2.2, section 1.4.3)."""
    lightness = _luminance(ground) + 0.05  # see contrast; asked for each cell of large matrices
    return QColor("white" if 1.05 / lightness > lightness / 0.05 else "black")


def contrast(a: QColor, b: QColor) -> float:
    """Contrast of two colours, from 1 to 21 (WCAG 2.2)."""
    darker, lighter = sorted((_luminance(a), _luminance(b)))
    return (lighter + 0.05) / (darker + 0.05)


def _luminance(colour: QColor) -> float:
    """Relative luminance, from 0 to 1 (WCAG 2.2)."""
    linear = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4
        for c in (colour.redF(), colour.greenF(), colour.blueF())
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
