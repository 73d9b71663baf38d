import numpy as np
import pytest
from PySide6.QtGui import QColor
from window_helpers import pixels

from forcelab.gui.figures.colormap import colormap_colour, colormap_colours
from forcelab.gui.figures.confusion import ConfusionMatrix
from forcelab.gui.figures.text import ink_on

COUNTS = [[80, 10, 0, 10], [0, 1, 0, 0], [0, 0, 0, 0]]


def figure(counts=COUNTS, names=("still", "grab", "hold"), title="Stylus"):
    return ConfusionMatrix(title, tuple(names), np.array(counts, dtype=np.int64))


def ground(picture, drawn, row, column, scale=2.0):
    """The colour in the corner of a cell, where no text stands."""
    box = drawn.box(row, column)
    return tuple(picture[int((box.top() + 3) * scale), int((box.left() + 3) * scale)])


def luminance(colours):
    linear = np.where(colours <= 10, colours / 3294.6, ((colours / 255 + 0.055) / 1.055) ** 2.4)
    return linear @ [0.2126, 0.7152, 0.0722]


def test_a_cell_has_the_colour_of_its_share_of_the_row():
    drawn = figure()
    picture = pixels(drawn.image())
    expected = [[0.8, 0.1, 0.0, 0.1], [0.0, 1.0, 0.0, 0.0], [0.0] * 4]
    for row in range(3):
        for column in range(4):
            colour = colormap_colour(expected[row][column]).getRgb()[:3]
            assert ground(picture, drawn, row, column) == colour, (row, column)


def test_the_unlabelled_column_stands_apart_at_the_right():
    drawn = figure()
    gaps = [drawn.box(0, c + 1).left() - drawn.box(0, c).right() for c in range(3)]
    assert gaps[2] > gaps[1] + 4
    assert gaps[0] == pytest.approx(gaps[1])


def test_shares_of_a_row_without_samples_are_zero():
    assert figure().shares[2].tolist() == [0, 0, 0, 0]
    assert figure().shares[:2].sum(axis=1) == pytest.approx([1, 1])


def test_darker_means_more_in_grey_print_too():
    grey = luminance(colormap_colours(np.linspace(0, 1, 101)).astype(float))
    assert (np.diff(grey) < 0).all()
    # In equal steps to the eye: CIE lightness is nearly straight.
    lightness = 116 * np.cbrt(grey) - 16
    straight = np.linspace(lightness[0], lightness[-1], 101)
    assert np.abs(lightness - straight).max() < 4


@pytest.mark.parametrize("share", np.linspace(0, 1, 21))
def test_text_in_a_cell_has_the_contrast_that_reading_needs(share):
    colour = colormap_colour(float(share))
    text, cell = (
        luminance(np.array(c.getRgb()[:3], dtype=float)) for c in (colour, ink_on(colour))
    )
    assert (max(text, cell) + 0.05) / (min(text, cell) + 0.05) >= 4.5  # WCAG 2.2 AA


def test_text_changes_with_its_ground():
    assert ink_on(QColor("#f0e442")) == QColor("black")
    assert ink_on(QColor("#0072b2")) == QColor("white")


@pytest.mark.parametrize("k", [1, 2, 8, 20, 40])
@pytest.mark.parametrize("largest", [9, 10_000_000])
def test_texts_stay_inside_their_cells(k, largest):
    drawn = figure(np.full((k, k + 1), largest), [f"action {i}" for i in range(k)])
    picture = pixels(drawn.image())
    for row, column in ((0, 0), (k - 1, k), (k // 2, k // 2)):
        box = drawn.box(row, column)
        left, right, top, bottom = (
            int(side * 2) for side in (box.left(), box.right(), box.top(), box.bottom())
        )
        cell = picture[top + 1 : bottom - 1, left + 1 : right - 1]
        colour = np.array(colormap_colour(1 / (k + 1)).getRgb()[:3])
        rim = np.concatenate([cell[:2].reshape(-1, 3), cell[-2:].reshape(-1, 3), cell[:, 0]])
        assert np.abs(rim - colour).max() <= 8
        assert np.abs(cell - colour).max() > 90  # and there is a text


def test_counts_change_the_picture_of_large_cells_only():
    names = [f"a{i}" for i in range(30)]
    small, large = np.eye(30, 31, dtype=int), 7 * np.eye(30, 31, dtype=int)
    inside = []
    for n in (3, 30):
        bare, full = (figure(c[:n, : n + 1], names[:n]) for c in (small, large))
        box = bare.box(1, 1)
        window = (
            slice(int(box.top() * 2), int(box.bottom() * 2)),
            slice(int(box.left() * 2), int(box.right() * 2)),
        )
        inside.append(bool((pixels(bare.image())[window] != pixels(full.image())[window]).any()))
    assert inside == [True, False]


def test_long_names_stand_upright_and_push_the_matrix_down():
    short = figure(names=("a", "b", "c"), counts=COUNTS)
    long = figure(names=("a" * 30, "b", "c"))
    longest = figure(names=("a" * 300, "b", "c"))
    assert long.box(0, 0).top() > short.box(0, 0).top() + 40
    assert longest.box(0, 0).top() - long.box(0, 0).top() < 80


def test_cells_shrink_but_forty_actions_still_fit_on_a_page():
    sides = []
    for k in (3, 12, 40):
        drawn = figure(np.ones((k, k + 1)), [f"action {i}" for i in range(k)])
        sides.append(drawn.box(0, 0).width())
        assert drawn.size.width() < 1300
        assert drawn.box(k - 1, k).bottom() < drawn.size.height()
    assert sides == sorted(sides, reverse=True)
