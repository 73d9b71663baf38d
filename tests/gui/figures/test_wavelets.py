from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtGui import QColor
from window_helpers import pixels

from forcelab.gui.figures.colormap import colormap_colour
from forcelab.gui.figures.wavelets import WaveletFigure, WaveletView, wavelet_figure

RATE = 200.0
TIMES = np.arange(0, 5, 1 / RATE)
TONES = (10.0, 16.0)
SIGNAL = sum(np.sin(2 * np.pi * tone * TIMES) for tone in TONES)


def view(magnitudes=None, **changes):
    t = np.linspace(-4, 4, 801)
    hertz = np.geomspace(4, 64, 9)
    if magnitudes is None:
        magnitudes = np.zeros((9, len(TIMES)))
    default = WaveletView("p = 5", t, np.exp(5j * t - t**2 / 2), hertz, magnitudes)
    return replace(default, **changes)


def test_magnitudes_are_drawn_at_their_time_and_frequency():
    magnitudes = np.zeros((9, len(TIMES)))
    # Around 32 Hz, at a quarter of the time.
    magnitudes[5:8, len(TIMES) // 4 - 8 : len(TIMES) // 4 + 9] = 1.0
    drawn = WaveletFigure("W", (view(magnitudes),), TIMES, SIGNAL)
    picture, box = pixels(drawn.image()), drawn.box(0)

    def colour(hertz, share):
        up = np.log(hertz / 4) / np.log(16)
        y, x = box.bottom() - up * box.height(), box.left() + share * box.width()
        return tuple(picture[round(2 * y), round(2 * x)])

    assert colour(32, 0.25) == colormap_colour(1.0).getRgb()[:3]
    assert colour(8, 0.25) == colormap_colour(0.0).getRgb()[:3]
    assert colour(32, 0.75) == colormap_colour(0.0).getRgb()[:3]


def test_real_and_imaginary_part_have_their_colours_at_their_values():
    drawn = WaveletFigure("W", (view(),), TIMES, SIGNAL)
    picture, box = pixels(drawn.image(4.0)), drawn.box(0)
    column = picture[: int(box.top() * 4) - 300, round(box.center().x() * 4)]

    def rows(colour):
        return np.flatnonzero(np.abs(column - QColor(colour).getRgb()[:3]).sum(axis=1) < 60)

    # At t = 0 the real part is at its top, the imaginary part passes zero.
    assert rows("#0072b2").mean() < rows("#d55e00").mean() - 4 * 40


def test_a_signal_and_magnitudes_of_nothing_are_drawn():
    drawn = WaveletFigure("W", (view(psi=np.zeros(801)),), TIMES, np.zeros(len(TIMES)))
    box = drawn.box(0)
    middle = pixels(drawn.image())[round(box.center().y() * 2), round(box.center().x() * 2)]
    assert tuple(middle) == colormap_colour(0.0).getRgb()[:3]


def test_the_figure_of_the_paper_has_a_column_for_each_p():
    drawn = wavelet_figure((5.0, 10.0))
    assert [view.title for view in drawn.views] == ["p = 5", "p = 10"]
    assert drawn.box(1).left() > drawn.box(0).right()
    assert drawn.box(1).right() < drawn.size.width()
    # Between the tones' times, only one of them sounds.
    at = np.searchsorted(drawn.times, [1.5, 3.5])
    early, late = drawn.views[1].magnitudes[:, at].T
    hertz = drawn.views[1].hertz
    assert hertz[np.argmax(early)] == pytest.approx(10, rel=0.05)
    assert hertz[np.argmax(late)] == pytest.approx(16, rel=0.05)
