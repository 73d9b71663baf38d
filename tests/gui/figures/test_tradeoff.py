import xml.etree.ElementTree as ET
from itertools import combinations

import numpy as np
import pytest
from PySide6.QtGui import QColor
from window_helpers import pixels

from forcelab.errors import InputError
from forcelab.gui.figures.axes import CURVE_COLOURS
from forcelab.gui.figures.tradeoff import Tradeoff
from forcelab.measure.rows import Row, Table, with_front

SOLVERS = ("explicit", "semi-implicit", "LSODA", "Radau")


def row(error, seconds, name="explicit", size="foam", setting="tolerance 1 mN"):
    return Row(
        name, setting, size, "a finer solution",
        error=error, seconds=seconds, spread=0.0, peak_bytes=1,
    )  # fmt: skip


def refused_row(name="Radau", size="foam", setting="step 1 ms"):
    return Row(name, setting, size, "a finer solution", refusal="It takes too many steps.")


def figure(*rows, title="Contact mechanics"):
    marked = with_front(rows)
    return Tradeoff(Table(title, "error (N rms)", "CPU s per simulated s", marked))


def many(sizes=("foam", "cartridge", "stick-slip", "snap"), names=SOLVERS, crowd=1.0):
    rng = np.random.default_rng(5)
    return figure(
        *(
            row(*(10 ** (crowd * rng.uniform(-2, 0, 2))), name, size, f"tolerance {i} mN")
            for size in sizes
            for name in names
            for i in range(4)
        )
    )


def texts(drawn, folder):
    """All texts of the figure, with their places (x, y)."""
    drawn.save(folder / "f.svg")
    for node in ET.parse(folder / "f.svg").getroot().iter("{http://www.w3.org/2000/svg}text"):
        yield "".join(node.itertext()).strip(), float(node.get("x")), float(node.get("y"))


def colour_at(picture, spot):
    return picture[round(spot.y() * 4), round(spot.x() * 4)]


@pytest.mark.parametrize("name", SOLVERS)
def test_a_row_is_marked_at_its_seconds_and_error_in_the_colour_of_its_name(name):
    # A decade apart in each direction, so the places on the page are known.
    rows = [row(10.0 ** -(i + 1), 10.0**i, solver) for i, solver in enumerate(SOLVERS)]
    drawn = figure(*rows)
    picture, box = pixels(drawn.image(4.0)), drawn.box(0)
    i = SOLVERS.index(name)
    # The axes go from the decade below to the decade above: 5 decades each.
    x = box.left() + (1 + i) / 5 * box.width()
    y = box.top() + (1 + i) / 5 * box.height()
    colour = np.array(QColor(CURVE_COLOURS[i]).getRgb()[:3])
    assert np.abs(picture[round(4 * y), round(4 * x)] - colour).max() <= 2


def test_rows_of_the_front_are_filled_and_joined_and_others_hollow():
    drawn = figure(row(1e-1, 0.1), row(1e-3, 1.0), row(1e-2, 1.5), row(0.3, 0.3))
    picture = pixels(drawn.image(4.0))
    marks = drawn.marks(0)
    assert [m.row.pareto for m in marks] == [True, True, False, False]
    colour = np.array(QColor(CURVE_COLOURS[0]).getRgb()[:3])
    for mark in marks:
        centre = colour_at(picture, mark.spot)
        assert np.abs(centre - (colour if mark.row.pareto else 255)).max() <= 2
    between = (marks[0].spot + marks[1].spot) / 2
    assert colour_at(picture, between).max() < 200  # the line of the front
    off = (marks[0].spot + marks[3].spot) / 2
    assert colour_at(picture, off).min() > 220


def test_the_front_is_joined_from_fast_to_exact_whatever_the_order_of_the_rows():
    rows = [row(1e-3, 1.0), row(1e-1, 0.1), row(0.9e-1, 0.9)]
    for order in (rows, rows[::-1]):
        drawn = figure(*order)
        picture = pixels(drawn.image(4.0))
        exact, fast, middle = sorted((m.spot for m in drawn.marks(0)), key=lambda s: -s.y())
        fast, middle = sorted((fast, middle), key=lambda s: s.x())
        for start, end, joined in ((fast, middle, 1), (middle, exact, 1), (fast, exact, 0)):
            spot = start + (end - start) * 0.45
            assert (colour_at(picture, spot).max() < 200) == joined


def test_every_name_stands_in_every_panel(tmp_path):
    drawn = many()
    drawn_texts = list(texts(drawn, tmp_path))
    for panel in range(4):
        box = drawn.box(panel)
        inside = [t for t, x, y in drawn_texts if box.contains(x, y)]
        assert set(inside) >= set(SOLVERS), panel


@pytest.mark.parametrize("crowd", [1.0, 0.3, 0.02])
def test_labels_of_settings_never_cover_each_other_however_crowded(tmp_path, crowd):
    drawn = many(sizes=("foam",), crowd=crowd)
    settings = [(x, y) for t, x, y in texts(drawn, tmp_path) if t.startswith("tolerance")]
    assert settings or crowd < 0.1  # in a heap only the names remain
    for (x1, y1), (x2, y2) in combinations(settings, 2):
        assert abs(y1 - y2) >= 9 or abs(x1 - x2) >= 40
    box = drawn.box(0)
    assert all(box.contains(x, y) for x, y in settings)


def test_labels_keep_off_the_marks(tmp_path):
    drawn = many(sizes=("foam",))
    picture, marks = pixels(drawn.image(4.0)), drawn.marks(0)
    hollow = 0
    for mark in marks:
        near = [m for m in marks if (m.spot - mark.spot).manhattanLength() < 14]
        if len(near) == 1 and not mark.row.pareto:
            x, y = round(4 * mark.spot.x()), round(4 * mark.spot.y())
            assert (picture[y - 4 : y + 5, x - 4 : x + 5] == 255).all()
            hollow += 1
    assert hollow > 5


def test_more_names_than_colours_differ_by_shape():
    names = [f"preset {i}" for i in range(25)]
    drawn = figure(*(row(0.01, 1.0, name) for name in names))
    looks = {(mark.colour.name(), mark.shape) for mark in drawn.marks(0)}
    assert len(looks) == 25


def test_a_name_looks_the_same_in_every_panel():
    drawn = figure(
        row(0.1, 1.0, "LSODA", "a"), row(0.1, 2.0, "Radau", "a"), row(0.1, 1.0, "Radau", "b")
    )
    first, second = drawn.marks(0)[1], drawn.marks(1)[0]
    assert (first.colour, first.shape) == (second.colour, second.shape)
    assert (first.colour, first.shape) != (drawn.marks(0)[0].colour, drawn.marks(0)[0].shape)


def test_panels_share_their_axes_so_that_they_compare():
    drawn = figure(row(1e-6, 0.01, size="a"), row(1.0, 10.0, size="b"))
    for panel in (0, 1):
        across, up = drawn.axes(panel)
        assert (across.start < 0.01, across.end > 10.0) == (True, True)
        assert (up.start < 1e-6, up.end > 1.0) == (True, True)
    assert drawn.box(1).left() > drawn.box(0).right()


def test_an_error_of_nothing_is_at_the_lower_edge_and_said(tmp_path):
    drawn = figure(row(0.0, 1.0), row(1e-3, 0.1))
    assert drawn.marks(0)[0].spot.y() == pytest.approx(drawn.box(0).bottom())
    assert any("no error at all" in t for t, _, _ in texts(drawn, tmp_path))
    alone = figure(row(0.0, 1.0))
    assert alone.marks(0)[0].spot.y() == pytest.approx(alone.box(0).bottom())


def test_refused_rows_are_named_below_their_panel(tmp_path):
    drawn = figure(row(0.1, 1.0, size="a"), row(0.1, 1.0, size="b"), refused_row(size="b"))
    (where,) = [(x, y) for t, x, y in texts(drawn, tmp_path) if t == "Refused: Radau, step 1 ms."]
    assert where[0] >= drawn.box(1).left()
    assert where[1] > drawn.box(1).bottom()


def test_a_size_where_everything_was_refused_has_an_empty_panel():
    drawn = figure(row(0.1, 1.0, size="a"), refused_row(size="b"))
    assert drawn.marks(1) == ()
    assert (pixels(drawn.image(1.0)) != 255).any()


def test_a_table_of_refusals_only_is_refused():
    with pytest.raises(InputError, match="'Contact mechanics' has nothing to draw"):
        figure(refused_row())


@pytest.mark.parametrize("number", [1, 2, 3, 5])
def test_the_page_grows_with_the_sizes_and_holds_all_panels(number):
    drawn = many(sizes=tuple(f"size {i}" for i in range(number)))
    last = drawn.box(number - 1)
    assert last.right() < drawn.size.width()
    assert last.bottom() + 40 < drawn.size.height()
