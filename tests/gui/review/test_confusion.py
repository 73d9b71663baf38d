"""The confusion view: what it counts, says, lists, copies and saves; by mouse and by keyboard."""

import numpy as np
import pytest
from factories import demonstration_result, random_run_result, run_result
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from window_helpers import shown_widget

from forcelab.gui import theme
from forcelab.gui.figures.confusion import ConfusionMatrix
from forcelab.gui.review.confusion import ConfusionView, fit_figure
from forcelab.gui.theme import DARK
from forcelab.recognition.probabilities import ProbabilityTrace

ACTIONS = ("grab", "hold", "release")
SURE = ProbabilityTrace(0.0, 50.0, ACTIONS, np.full((500, 3), 204, dtype=np.uint8))


@pytest.fixture
def view(app, document, jobs, until):
    with shown_widget(app, ConfusionView(document, jobs), (560, 600)) as view:
        document.review.set_run(small(document))
        until(lambda: view.cells is not None)
        yield view


def small(document):
    """In 01 a grab of 3 s is seen as hold for 2 s, in 02 one of 2 s for 0.5 s."""
    first, second = (info.id for info in document.infos)
    return run_result(
        [
            demonstration_result(
                first,
                [(1, 4, "grab"), (5, 8, "hold")],
                [(1, 2, "grab"), (2, 4, "hold"), (5, 7, "hold")],
                raw=[(1, 4, "release"), (5, 8, "hold")],
                probability_trace=SURE,
            ),
            demonstration_result(second, [(2, 4, "grab")], [(2, 3.5, "grab"), (3.5, 4, "hold")]),
        ],
        ACTIONS,
    )


def click(view, row, column):
    spot = view.canvas.figure.box(row, column).center().toPoint()
    QTest.mouseClick(view.canvas.viewport(), Qt.MouseButton.LeftButton, pos=spot)


def listed(view):
    model = view.list.model
    return [[model.index(r, c).data() for c in range(4)] for r in range(model.rowCount())]


def test_the_matrix_is_the_time_that_the_scores_count(view, document):
    stored = np.array(document.review.run.scores["filtered"]["pooled"]["confusion"]) / 1e9
    assert view.canvas.figure.counts == pytest.approx(stored)
    assert stored[0].tolist() == [2.5, 2.5, 0, 0]


def test_the_matrix_grows_with_the_text_and_a_click_still_meets_its_cell(app, view, until):
    wide = view.canvas.width() / view.canvas.figure.size.width()
    try:
        theme.use_text_size(app, 150)
        app.processEvents()
        figure = view.canvas.figure
        assert view.canvas.width() / figure.size.width() == pytest.approx(1.5 * wide, rel=0.02)
        centre = (figure.box(0, 1).center() * 1.5).toPoint()
        QTest.mouseClick(view.canvas.viewport(), Qt.MouseButton.LeftButton, pos=centre)
        assert view.canvas.chosen == (0, 1)
    finally:
        theme.use_text_size(app, 100)


def test_hovering_a_cell_says_what_it_holds(view, until):
    def hovered(row, column, sentence):
        # The matrix may yet be given its final room.
        spot = view.canvas.figure.box(row, column).center().toPoint()
        QTest.mouseMove(view.canvas.viewport(), spot)
        return view.sentence.text() == sentence

    sentence = "grab seen as hold: 2.5 s, 50 % of grab, in 2 places"
    until(lambda: hovered(0, 1, sentence))
    assert view.canvas.accessibleDescription() == sentence
    until(lambda: hovered(1, 3, "hold left unlabelled: 1.0 s, 33 % of hold, in 1 place"))


def test_a_click_lists_the_places_of_a_cell_and_one_there_shows_it(view, document):
    click(view, 0, 1)
    # The shorter one has no probability to be weighted with.
    assert listed(view) == [
        ["foam " + document.infos[0].id, "2.000", "2.000", "80"],
        ["foam " + document.infos[1].id, "3.500", "0.500", "–"],
    ]
    assert document.review.examined is None  # the window stays where it is until a place is chosen
    table = view.list.table
    spot = table.visualRect(view.list.model.index(1, 0)).center()
    QTest.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=spot)
    assert document.id == document.infos[1].id
    assert document.view.range == (3.5, 4.0)
    assert (document.review.examined.human, document.review.examined.predicted) == ("grab", "hold")


def test_arrows_and_enter_lead_from_the_matrix_to_a_mistake(view, document, app):
    view.activateWindow()
    view.canvas.setFocus()
    QTest.keyClick(view.canvas, Qt.Key.Key_Right)
    assert view.sentence.text().startswith("grab seen as hold: 2.5 s")
    QTest.keyClick(view.canvas, Qt.Key.Key_Up)  # there is nothing above
    QTest.keyClick(view.canvas, Qt.Key.Key_Return)
    assert len(view.list.places) == 2
    assert document.review.examined is view.list.places[0]
    QTest.keyClick(view.list.table, Qt.Key.Key_Down)
    assert document.review.examined is view.list.places[1]
    QTest.keyClick(view.list.table, Qt.Key.Key_Up)
    assert document.view.range == (2.0, 4.0)


def test_enter_on_a_row_goes_back_to_a_place_that_was_left(view, document):
    click(view, 0, 1)
    table = view.list.table
    table.setCurrentIndex(view.list.model.index(0, 0))
    document.view.seek(9.0)
    QTest.keyClick(table, Qt.Key.Key_Return)
    assert document.view.cursor == 2.0


def test_the_arrows_end_at_the_last_cell_of_the_unlabelled_column(view):
    for key, times in ((Qt.Key.Key_Right, 9), (Qt.Key.Key_Down, 9)):
        for _ in range(times):
            QTest.keyClick(view.canvas, key)
    assert view.canvas.focus == (2, 3)
    assert view.sentence.text() == "release left unlabelled: never"


def test_switches_change_what_is_counted_and_listed(view, until):
    click(view, 0, 1)
    view.switches.unit_box.setCurrentIndex(1)
    assert view.canvas.figure.counts.tolist() == [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]
    assert [row[2] for row in listed(view)] == ["3.000"]  # the whole segment
    assert view.sentence.text() == "grab seen as hold: 1 segment, 50 % of grab"
    view.switches.share_box.setCurrentIndex(1)
    assert view.canvas.figure.shares[:, 1].tolist() == [0.5, 0.5, 0]
    assert "50 % of all that was seen as hold" in view.sentence.text()
    view.switches.stage_box.setCurrentIndex(1)
    until(lambda: view.cells is not None)
    # Only one of them kept raw predictions: the other is left out.
    assert view.canvas.figure.counts.tolist() == [[0, 0, 1, 0], [0, 1, 0, 0], [0, 0, 0, 0]]


def test_copied_text_is_what_is_shown(view):
    view.switches.copy.click()
    lines = [line.split("\t") for line in QGuiApplication.clipboard().text().splitlines()]
    assert lines[0] == ["", *ACTIONS, "unlabelled"]
    assert lines[1] == ["grab", "0.5000", "0.5000", "0.0000", "0.0000"]
    view.switches.share_box.setCurrentIndex(2)
    view.switches.copy.click()
    lines = [line.split("\t") for line in QGuiApplication.clipboard().text().splitlines()]
    assert lines[2] == ["hold", "0.000", "2.000", "0.000", "1.000"]


def test_the_menu_of_the_matrix_copies_it_with_its_title(view):
    menu = view.canvas.plot_menu()
    copy = next(action for action in menu.actions() if action.text() == "Copy as picture")
    copy.trigger()
    assert QGuiApplication.clipboard().image() == view.figure.image()


def test_the_matrix_is_saved_as_a_figure_and_a_wrong_suffix_is_told(
    view, document, until, tmp_path, messages, chosen_picture
):
    chosen_picture(tmp_path / "matrix.pdf")
    view.ask_save()
    until(lambda: messages)
    assert messages == [("Saved 'matrix.pdf'.", False)]
    assert (tmp_path / "matrix.pdf").read_bytes().startswith(b"%PDF")
    chosen_picture(tmp_path / "matrix.doc")
    view.ask_save()
    until(lambda: len(messages) > 1)
    assert messages[-1] == (
        "A figure is saved as .svg, .pdf or .png, not as 'matrix.doc'; change the suffix.",
        True,
    )


def test_blind_demonstrations_are_neither_counted_nor_listed(view, document, until):
    two = document.infos[1].id
    document.project.coding.assign(two, "Ada", blind=True)
    document.refresh_listing()
    until(lambda: view.cells is not None and len(view.cells.demonstrations) == 1)
    assert view.canvas.figure.counts[0].tolist() == [1, 2, 0, 0]
    click(view, 0, 1)
    assert {place.demonstration for place in view.list.places} == {document.infos[0].id}


def test_nothing_is_counted_while_it_is_hidden(view, document, app, until):
    view.hide()
    before = view.cells
    document.review.set_run(random_run_result([document.infos[0].id], ACTIONS))
    app.processEvents()
    assert view.cells is before
    view.show()
    until(lambda: view.cells is not None and view.cells is not before)
    assert len(view.cells.demonstrations) == 1


def test_edits_elsewhere_leave_the_list_as_it_is(view, document, app):
    click(view, 0, 1)
    view.list.table.setCurrentIndex(view.list.model.index(1, 0))
    document.refresh_info()
    app.processEvents()
    assert view.list.table.currentIndex().row() == 1


def test_without_a_run_it_says_what_to_do(view, document):
    document.review.set_run(None)
    assert "Train" in view.pages.note.text()
    assert view.pages.note.isVisible()
    assert not view.switches.isVisible()
    document.review.set_run(run_result([], ACTIONS))
    assert "at least two" in view.pages.note.text()


def test_a_run_without_raw_predictions_says_so_and_lets_one_go_back(view, document, until):
    result = demonstration_result(document.infos[0].id, [(1, 2, "grab")], [(1, 2, "grab")])
    view.switches.stage_box.setCurrentIndex(1)
    document.review.set_run(run_result([result], ACTIONS))
    until(lambda: "no raw" in view.pages.note.text())
    view.switches.stage_box.setCurrentIndex(0)
    until(lambda: view.cells is not None and view.canvas.isVisible())


@pytest.mark.parametrize(("k", "room"), [(3, (480, 330)), (18, (780, 640))])
def test_the_matrix_fits_its_room(app, k, room):
    from PySide6.QtCore import QSize

    names = tuple(f"action {i}" for i in range(k))
    figure = ConfusionMatrix("t", names, np.ones((k, k + 1)), headed=False, theme=DARK)
    size = fit_figure(figure, QSize(*room)).size
    assert size.width() <= room[0]
    assert size.height() <= room[1]
    assert max(size.width() / room[0], size.height() / room[1]) > 0.6


def test_every_point_of_a_cell_is_that_cells_and_none_is_beside(app):
    figure = ConfusionMatrix("t", ("a", "b", "c"), np.ones((3, 4)))
    for row in range(3):
        for column in range(4):
            box = figure.box(row, column)
            for spot in (box.topLeft(), box.center(), box.bottomRight()):
                assert figure.cell_at(spot) == (row, column)
    first, last = figure.box(0, 0), figure.box(0, 3)
    assert figure.cell_at(first.topLeft() - QPoint(2, 0)) is None
    assert figure.cell_at(last.topLeft() - QPoint(3, 0)) is None  # between actions and unlabelled
    assert figure.cell_at(last.topRight() + QPoint(3, 0)) is None


def test_in_a_narrow_list_no_switch_is_cut_off(view, app):
    switches = view.switches
    boxes = (switches.stage_box, switches.unit_box, switches.share_box)
    for width in (290, 560):
        switches.resize(width, 80)
        app.processEvents()
        assert all(box.width() >= box.sizeHint().width() for box in boxes), width
    assert switches.copy.y() == switches.stage_box.y()


def test_where_there_is_little_room_the_matrix_is_seen_and_a_click_shows_its_places(view, app):
    view.resize(290, 200)
    app.processEvents()
    assert view.canvas.viewport().visibleRegion().boundingRect().height() > 70
    assert not view.list.table.visibleRegion().boundingRect().height()
    click(view, 0, 0)
    app.processEvents()
    assert view.list.places
    assert view.list.visibleRegion().boundingRect().height() > 60


def test_the_list_of_places_is_small_until_a_cell_is_chosen_and_keeps_its_share(view, app):
    view.resize(420, 600)

    def sizes():
        for _ in range(3):
            app.processEvents()
        return view._split.sizes()

    matrix, places = sizes()
    assert places < 60
    click(view, 0, 0)
    chosen = sizes()
    assert chosen[1] > 90
    assert sum(chosen) == matrix + places
    view._split.setSizes([sum(chosen) - 200, 200])  # as the mouse drags it
    dragged = sizes()
    view.canvas.show_figure(None)
    view.switches.changed.emit()
    assert sizes()[1] == places
    click(view, 0, 0)
    assert sizes() == dragged


def test_the_matrix_grows_into_the_room_that_the_list_of_places_leaves(view, app):
    view.resize(480, 420)
    click(view, 0, 0)  # its places have a list then
    cells = []
    for places in (220, 80):
        view._split.setSizes([420 - places, places])
        app.processEvents()
        figure, room = view.canvas.figure, view._area.maximumViewportSize()
        assert figure.size.height() <= room.height()
        cells.append(figure.box(0, 0).width())
    assert cells[1] > cells[0]
