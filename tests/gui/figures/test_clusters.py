import numpy as np
import pytest
from PySide6.QtGui import QColor
from window_helpers import pixels

from forcelab.gui.figures.axes import CURVE_COLOURS
from forcelab.gui.figures.clusters import ClusterFigure, cluster_figure

TIMES = np.arange(0, 8.01, 0.01)
SIGNAL = np.interp(TIMES, [0, 2, 3, 5, 6, 8], [0, 0, 10, 10, 0, 0])
CODES = np.searchsorted([2.0, 3.0, 5.0], TIMES, side="right")


def figure(codes=CODES, signal=SIGNAL):
    return ClusterFigure("Clusters", TIMES, signal, (("Morlet", codes), ("Haar", 3 - codes)))


@pytest.mark.parametrize("row", [0, 1])
@pytest.mark.parametrize("time", [0.5, 2.3, 4.5, 7.5])
def test_bar_and_signal_have_the_colour_of_the_cluster_at_each_time(row, time):
    drawn = figure()
    picture, box = pixels(drawn.image()), drawn.box(row)
    code = CODES[np.searchsorted(TIMES, time)]
    colour = np.array(QColor(CURVE_COLOURS[code if row == 0 else 3 - code]).getRgb()[:3])
    x = round(drawn.axis.at(time) * 2)
    assert np.abs(picture[int(box.top() * 2) + 4, x] - colour).max() <= 2
    above = picture[round(box.top() * 2) - 180 : round(box.top() * 2) - 4, x]
    drawn_line = np.flatnonzero(np.abs(above - colour).max(axis=1) <= 2)
    assert len(drawn_line) >= 3
    # The higher the force, the higher on the page.
    share = 1 - (drawn_line.mean() - (180 - 12 - 2 * 76)) / (2 * 76)
    assert share == pytest.approx(np.interp(time, TIMES, SIGNAL) / 10 / 1.12 + 0.054, abs=0.06)


def test_a_signal_that_never_changes_is_drawn():
    drawn = figure(signal=np.zeros(len(TIMES)))
    assert (pixels(drawn.image()) != 255).any()


def test_in_the_figure_of_the_paper_only_the_first_row_tells_rising_from_falling():
    drawn = cluster_figure()
    picture = pixels(drawn.image())
    rise, fall = (round(drawn.axis.at(time) * 2) for time in (2.4, 5.6))
    same = []
    for row in range(4):
        y = int(drawn.box(row).top() * 2) + 4
        same.append(bool((picture[y, rise] == picture[y, fall]).all()))
    assert same == [False, True, True, True]
