"""A figure: a size and a way to paint itself, saved as SVG, PDF or PNG by the same painting."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from PySide6.QtCore import QBuffer, QIODevice, QMarginsF, QRectF, QSize, QSizeF
from PySide6.QtGui import (
    QColor,
    QImage,
    QImageWriter,
    QPageSize,
    QPainter,
    QPdfWriter,
)
from PySide6.QtSvg import QSvgGenerator

from forcelab.errors import InputError
from forcelab.gui.figures import text
from forcelab.io import write_atomically

#: Figures are laid out in pixels of 1/96 inch, as in CSS.
PIXELS_PER_INCH = 96
#: What is left free around a figure, in pixels.
MARGIN = 24.0
#: From one remark below the title to the next, in pixels.
REMARK_LINE = 15.0
#: Fine enough that no edge in a PDF is moved by more than a hundredth of a pixel.
PDF_DOTS_PER_INCH = 9600
#: Qt's limit for the side of an image is 32767.
LARGEST_SIDE = 32_000


@dataclass(frozen=True)
class Theme:
    """The colours of a figure apart from its data, each as ``"#rrggbb"``.

    `muted` is for remarks, `grid` for lines behind the data, `frame` for lines around it,
    `unlabelled` for time that no segment covers.
    """

    background: str
    text: str
    muted: str
    grid: str
    frame: str
    unlabelled: str


LIGHT = Theme(
    background="#ffffff",
    text="#1c1f24",
    muted="#5c636e",
    grid="#e7e9ed",
    frame="#aab0ba",
    unlabelled="#ffffff",
)


def check_suffix(path: Path) -> None:
    """Make sure that a figure can be saved under `path`, before the work of making one."""
    if path.suffix.lower() not in (".svg", ".pdf", ".png"):
        raise InputError(
            f"A figure is saved as .svg, .pdf or .png, not as '{path.name}'; change the suffix."
        )


class Figure(ABC):
    """A drawing of a fixed size, painted alike on screen, in notebooks and into files."""

    title: str
    theme: Theme = LIGHT

    @property
    @abstractmethod
    def size(self) -> QSizeF:
        """Width and height in pixels of 1/96 inch."""

    @abstractmethod
    def paint(self, painter: QPainter) -> None:
        """Draw everything but the background inside ``(0, 0, width, height)``."""

    def paint_title(self, painter: QPainter, *remarks: str) -> None:
        """Draw the title at the top and remarks below it, as much of each as there is room for."""
        large, small, room = text.font(14, bold=True), text.font(10), self.size.width() - 2 * MARGIN
        title = text.elided(self.title, large, room)
        text.draw_text(painter, MARGIN, MARGIN + 6, title, face=large, ink=self.theme.text)
        for line, remark in enumerate(remarks):
            y, fitting = MARGIN + 26 + line * REMARK_LINE, text.elided(remark, small, room)
            text.draw_text(painter, MARGIN, y, fitting, face=small, ink=self.theme.muted)

    def draw(self, painter: QPainter) -> None:
        """Draw the figure with its background, on screen or paper."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.TextAntialiasing)
        painter.fillRect(QRectF(0, 0, *_rounded_up(self.size)), QColor(self.theme.background))
        self.paint(painter)

    def image(self, scale: float = 2.0) -> QImage:
        """Draw the figure into an image of `scale` pixels for each of the figure's.

        A smaller scale is used where the image would be larger than Qt can hold.
        """
        text.ensure_application()
        wide, high = _rounded_up(self.size)
        scale = min(scale, LARGEST_SIDE / wide, LARGEST_SIDE / high)
        image = QImage(
            round(wide * scale), round(high * scale), QImage.Format.Format_ARGB32_Premultiplied
        )
        dots = round(PIXELS_PER_INCH * scale / 0.0254)
        image.setDotsPerMeterX(dots)
        image.setDotsPerMeterY(dots)
        image.fill(QColor(self.theme.background))
        with QPainter(image) as painter:
            painter.scale(scale, scale)
            self.draw(painter)
        return image

    def _repr_svg_(self) -> str:
        """The figure as notebooks show it."""
        document = self._svg().decode()
        return document[document.index("<svg") :]

    def save(self, path: str | PathLike[str]) -> None:
        """Write the figure as SVG, PDF or PNG (at twice the size), by the suffix, atomically.

        Another suffix, an unwritable file or a system without fonts is an InputError.
        """
        path = Path(path)
        check_suffix(path)
        encode = {".svg": self._svg, ".pdf": self._pdf, ".png": self._png}[path.suffix.lower()]
        text.ensure_application()
        write_atomically(path, encode())

    def _svg(self) -> bytes:
        """The figure as an SVG document; its text stays text."""
        text.ensure_application()
        wide, high = _rounded_up(self.size)
        buffer = _buffer()
        generator = QSvgGenerator()
        generator.setOutputDevice(buffer)
        generator.setResolution(PIXELS_PER_INCH)
        generator.setSize(QSize(wide, high))
        generator.setViewBox(QRectF(0, 0, wide, high))
        generator.setTitle(text.printable(self.title))
        generator.setDescription("Drawn by forcelab")
        with QPainter(generator) as painter:
            self.draw(painter)
        return bytes(buffer.data().data())

    def _pdf(self) -> bytes:
        """The figure as a PDF document of one page with embedded fonts."""
        wide, high = _rounded_up(self.size)
        buffer = _buffer()
        writer = QPdfWriter(buffer)
        writer.setTitle(text.printable(self.title))
        writer.setCreator("forcelab")
        writer.setResolution(PDF_DOTS_PER_INCH)
        points = QSizeF(wide, high) * (72 / PIXELS_PER_INCH)
        exact = QPageSize.SizeMatchPolicy.ExactMatch
        writer.setPageSize(QPageSize(points, QPageSize.Unit.Point, "", exact))
        writer.setPageMargins(QMarginsF(0, 0, 0, 0))
        with QPainter(writer) as painter:
            painter.scale(PDF_DOTS_PER_INCH / PIXELS_PER_INCH, PDF_DOTS_PER_INCH / PIXELS_PER_INCH)
            self.draw(painter)
        return bytes(buffer.data().data())

    def _png(self) -> bytes:
        return encode_png(self.image())


def encode_png(image: QImage) -> bytes:
    buffer = _buffer()
    QImageWriter(buffer, b"PNG").write(image)
    return bytes(buffer.data().data())


def _rounded_up(size: QSizeF) -> tuple[int, int]:
    """The size rounded up to multiples of 4 pixels: whole points on a PDF page."""
    return 4 * math.ceil(size.width() / 4), 4 * math.ceil(size.height() / 4)


def _buffer() -> QBuffer:
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    return buffer
