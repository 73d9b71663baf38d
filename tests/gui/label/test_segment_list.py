"""The segment table: follows the track, sorts, filters, edits and jumps."""

import time

import pytest
from factories import PAINTED_TRACK
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QComboBox, QLineEdit
from window_helpers import open_painted_document, shown_widget

from forcelab.gui.label.segment_list import (
    ACTION,
    DURATION,
    END,
    NUMBER,
    START,
    SegmentModel,
    SegmentTable,
)
from forcelab.labels import Segment


@pytest.fixture
def table(app, document):
    with shown_widget(app, SegmentTable(document)) as table:
        yield table


def text(table, row, column):
    return table.model.index(row, column).data()


def column(table, which):
    return [text(table, row, which) for row in range(table.model.rowCount())]


class Watched:
    """A view's copy of the rows, kept by what the model tells alone."""

    def __init__(self, model):
        self.model, self.rows, self.rows_signalled = model, list(model.rows), 0
        model.rowsInserted.connect(self.inserted)
        model.rowsRemoved.connect(self.removed)
        model.dataChanged.connect(self.changed)
        model.modelReset.connect(self.reset)

    def inserted(self, _, first, last):
        self.rows[first:first] = self.model.rows[first : last + 1]
        self.rows_signalled += last - first + 1

    def removed(self, _, first, last):
        del self.rows[first : last + 1]
        self.rows_signalled += 1

    def changed(self, first, last):
        here = slice(first.row(), last.row() + 1)
        self.rows[here] = self.model.rows[here]
        self.rows_signalled += last.row() - first.row() + 1

    def reset(self):
        self.rows = list(self.model.rows)
        self.rows_signalled += len(self.rows)


def test_a_row_is_number_action_start_end_and_duration(table):
    assert [text(table, 1, which) for which in range(5)] == ["2", "hold", "2.000", "4.500", "2.500"]
    assert table.model.rowCount() == 4


def test_an_edit_tells_about_the_rows_that_changed_only(document, table):
    watched = Watched(table.model)
    document.editor.paint(4.6, 4.8, "pull")
    assert watched.rows_signalled == 1
    document.editor.move_edge(0, "start", 0.5)
    assert watched.rows_signalled == 2
    document.editor.delete(0)
    assert watched.rows_signalled <= 4
    assert tuple(watched.rows) == table.model.rows == document.editor.segments


times = st.integers(0, 40).map(lambda n: n / 4)


@settings(
    deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.lists(st.tuples(times, times, st.sampled_from(["grab", "hold", "slip"])), max_size=5),
    st.sampled_from([NUMBER, ACTION, START, END, DURATION]),
    st.sampled_from([Qt.SortOrder.AscendingOrder, Qt.SortOrder.DescendingOrder]),
    st.sampled_from(["", "g", "HOLD", "x"]),
)
def test_rows_are_the_filtered_track_in_order_whatever_is_painted(
    document, table, strokes, which, order, filter_text
):
    table.table.sortByColumn(which, order)
    table.filter.setText(filter_text)
    watched = Watched(table.model)
    for start, end, action in strokes:
        if start < end:
            document.editor.paint(start, end, action)
    keys = {
        ACTION: lambda s: (s.action, s.start),
        DURATION: lambda s: (s.end - s.start, s.start),
    }
    expected = sorted(
        (s for s in document.editor.segments if filter_text.lower() in s.action),
        key=keys.get(which, lambda s: s.start),
        reverse=order == Qt.SortOrder.DescendingOrder,
    )
    assert list(table.model.rows) == expected == watched.rows
    numbers = [document.editor.segments[int(number) - 1] for number in column(table, NUMBER)]
    assert numbers == expected


def test_choosing_a_row_selects_and_jumps(document, table):
    table.table.selectRow(3)
    assert (document.selected, document.view.cursor) == (3, 6.0)
    document.view.seek(7.0)
    where = table.table.visualRect(table.model.index(3, START)).center()
    QTest.mouseClick(table.table.viewport(), Qt.MouseButton.LeftButton, pos=where)
    assert (document.selected, document.view.cursor) == (3, 6.0)
    table.table.selectRow(0)
    assert (document.selected, document.view.cursor) == (0, 1.0)


def test_what_is_selected_elsewhere_is_chosen_here_without_a_jump(document, table):
    document.view.seek(0.25)
    document.select(2)
    assert table.table.currentIndex().row() == 2
    assert document.view.cursor == 0.25
    document.select(None)
    assert not table.table.selectionModel().hasSelection()
    document.select(2)
    document.editor.paint(0.1, 0.2, "pull")  # one row more before it
    assert document.selected == 3
    assert table.table.currentIndex().row() == 3
    assert document.view.cursor == 0.25


def test_the_segment_under_the_cursor_is_marked(document, table):
    for cursor, rows in ((0.5, []), (1.0, [0]), (2.0, [1]), (4.5, []), (7.999, [3]), (8.0, [])):
        document.view.seek(cursor)
        marked = [
            row for row in range(4) if table.model.under_cursor(document.editor.segments[row])
        ]
        assert marked == rows


def edit_cell(table, row, which, typed):
    return table.model.setData(table.model.index(row, which), typed)


def test_numbers_are_typed_over(document, table):
    assert edit_cell(table, 0, START, " 0.5 ")
    assert document.editor.segments[0] == Segment(0.5, 2.0, "grab")
    assert edit_cell(table, 3, END, "7.25 s")
    assert edit_cell(table, 2, DURATION, "0.5")
    assert document.editor.segments[2:] == (
        Segment(5.0, 5.5, "grab"),
        Segment(6.0, 7.25, "release"),
    )
    assert len(document.editor.history()) == 4


@pytest.mark.parametrize(
    ("row", "which", "typed", "sentence"),
    [
        (0, START, "soon", "'soon' is no time"),
        (0, START, "nan", "outside"),
        (0, START, "-1", "outside"),
        (3, END, "1e9", "outside"),
        (0, START, "3", "cannot move"),
        (0, DURATION, "0", "cannot move"),
    ],
)
def test_what_is_no_time_for_it_is_refused_in_a_sentence(
    document, table, row, which, typed, sentence, messages
):
    assert not edit_cell(table, row, which, typed)
    assert document.editor.segments == PAINTED_TRACK
    (message, trouble) = messages[-1]
    assert trouble
    assert sentence in message


def test_what_was_not_changed_is_no_edit(document, table):
    index = table.model.index(1, START)
    assert not table.model.setData(index, index.data(Qt.ItemDataRole.EditRole))
    assert len(document.editor.history()) == 1


def test_a_time_is_edited_with_all_its_digits(app, tmp_path):
    track = (Segment(1.23456789, 2.5, "grab"),)
    with (
        open_painted_document(tmp_path, track) as document,
        shown_widget(app, SegmentTable(document)) as table,
    ):
        role = Qt.ItemDataRole.EditRole
        assert table.model.index(0, START).data(role) == "1.234568"
        assert table.model.index(0, END).data(role) == "2.5"


def test_enter_edits_from_the_keyboard(app, document, table):
    table.table.selectRow(0)
    QTest.keyClick(table.table, Qt.Key.Key_Return)
    editor = table.table.findChild(QLineEdit)
    editor.setText("0.75")
    QTest.keyClick(editor, Qt.Key.Key_Return)
    app.processEvents()
    assert document.editor.segments[0].start == 0.75


def test_an_action_is_chosen_from_a_list(app, document, table):
    table.table.edit(table.model.index(0, ACTION))
    editor = table.table.findChild(QComboBox)
    assert [editor.itemText(i) for i in range(editor.count())] == list(document.vocabulary.names)
    assert editor.currentText() == "grab"
    editor.hidePopup()
    editor.setCurrentText("release")
    editor.activated.emit(editor.currentIndex())
    app.processEvents()
    assert document.editor.segments[0].action == "release"


def test_delete_takes_the_chosen_segment_away_and_undo_brings_it_back(document, table):
    table.table.selectRow(1)
    QTest.keyClick(table.table, Qt.Key.Key_Delete)
    assert len(document.editor.segments) == 3
    assert document.editor.undo_everywhere()
    assert column(table, ACTION) == ["grab", "hold", "grab", "release"]


def test_keys_that_label_are_left_to_the_window(app, table):
    for key, letter in ((Qt.Key.Key_1, "1"), (Qt.Key.Key_Space, " "), (Qt.Key.Key_G, "g")):
        event = QKeyEvent(QEvent.Type.KeyPress, key, Qt.KeyboardModifier.NoModifier, letter)
        app.sendEvent(table.table, event)
        assert not event.isAccepted()


def test_the_menu_relabels_marks_filters_and_deletes(document, table):
    assert table.menu() is None
    document.add_actions("cut & lift")
    table.table.selectRow(2)
    menu = table.menu()
    by_text = {action.text(): action for action in menu.actions()}
    by_text["Mark as range"].trigger()
    assert document.view.range == (5.0, 5.25)
    by_text["Show only 'grab'"].trigger()
    assert column(table, NUMBER) == ["1", "3"]
    relabel = {action.text(): action for action in by_text["Relabel with"].menu().actions()}
    assert set(relabel) == {"&2  hold", "&3  release", "&4  cut && lift"}
    relabel["&2  hold"].trigger()
    assert document.editor.segments[2].action == "hold"
    by_text["Delete"].trigger()
    assert len(document.editor.segments) == 4, "the segment of that menu has another action now"
    table.filter.clear()
    table.table.selectRow(2)
    next(entry for entry in table.menu().actions() if entry.text() == "Delete").trigger()
    assert len(document.editor.segments) == 3


def test_the_chosen_segment_stays_chosen_when_the_rows_are_sorted(document, table):
    table.table.selectRow(2)
    header = table.table.horizontalHeader()
    where = QPoint(header.sectionViewportPosition(ACTION) + 20, header.height() // 2)
    QTest.mouseClick(header.viewport(), Qt.MouseButton.LeftButton, pos=where)
    assert column(table, ACTION) == sorted(column(table, ACTION))
    (chosen,) = table.table.selectionModel().selectedRows()
    assert table.model.index_in_track(chosen.row()) == document.selected == 2


def test_it_says_why_it_is_empty(app, document, table):
    table.filter.setText("nothing")
    assert "contains 'nothing'" in table.pages.note.text()
    table.filter.clear()
    document.open_demonstration("02")
    assert table.pages.note.isVisible()
    assert "No segments yet" in table.pages.note.text()
    document.close()
    assert "No demonstration" in table.pages.note.text()


def test_a_narrow_column_leaves_the_duration_away_and_never_scrolls(app, table):
    for width, hidden in ((420, False), (206, True), (320, False)):
        table.resize(width, 300)
        app.processEvents()
        assert table.table.isColumnHidden(DURATION) == hidden
        assert table.table.columnWidth(ACTION) >= 50
        assert not table.table.horizontalScrollBar().isVisible()


def test_other_columns_give_way_to_the_names_of_actions(app, document, table):
    for name in ("approach slowly", "insert the left peg into the right hole"):
        document.set_vocabulary(document.vocabulary.with_actions(name))
        measure = table.fontMetrics().horizontalAdvance
        for width in range(220, 420, 20):
            table.resize(width, 300)
            app.processEvents()
            needed = min(measure(name), measure("n" * 20)) + 24
            assert table.table.columnWidth(ACTION) >= needed or table.table.isColumnHidden(NUMBER)
    assert table.table.columnWidth(ACTION) >= needed


def test_hidden_it_does_nothing_and_catches_up_when_shown(app, document):
    table = SegmentTable(document)
    queries = []
    table.model.refresh = lambda: queries.append("refresh")
    table.model.follow = lambda _: queries.append("follow")
    document.editor.paint(0.1, 0.2, "pull")
    document.view.seek(3.0)
    document.select(0)
    assert (queries, table.model.rowCount()) == ([], 0)
    del table.model.refresh, table.model.follow
    with shown_widget(app, table):
        assert table.model.rows == document.editor.segments
        assert table.table.currentIndex().row() == 0
        table.hide()
        assert table.model.rowCount() == 0
        assert document.selected == 0


def test_ten_thousand_segments_stay_instant(app, tmp_path):
    track = tuple(Segment(n / 100, n / 100 + 0.008, f"a{n % 5}") for n in range(10_000))
    opened_document = open_painted_document(tmp_path, track, seconds=101.0)
    with opened_document as document, shown_widget(app, SegmentTable(document)) as table:
        spent = []
        for n in range(12):
            document.blockSignals(True)
            document.editor.relabel(5000 + 7 * n, "slip")
            document.blockSignals(False)
            start = time.process_time()
            table.refresh()
            table.grab()
            spent.append(time.process_time() - start)
        assert table.model.rows == document.editor.segments
        assert sorted(spent)[6] < 0.05


def test_numbers_are_drawn_anew_when_rows_that_are_filtered_away_come(
    app, document, table, monkeypatch
):
    table.filter.setText("release")
    table.grab()
    app.processEvents()
    drawn = []
    draw = SegmentModel.cell_text
    monkeypatch.setattr(SegmentModel, "cell_text", lambda *cell: drawn.append(cell) or draw(*cell))
    document.editor.paint(0.2, 0.5, "hold")
    app.processEvents()
    assert drawn
    assert column(table, NUMBER) == ["5"]


MODEL = "model paper 12"


def tips(table, row, role=Qt.ItemDataRole.ToolTipRole):
    return [table.model.index(row, column).data(role) for column in (NUMBER, ACTION, START)]


def test_a_row_tells_who_proposed_its_segment_and_whether_it_was_changed(table, document):
    proposed = (Segment(6.0, 7.0, "grab"), Segment(8.0, 9.0, "hold"))
    document.editor.erase(5.5, 10)
    assert document.editor.accept(proposed, MODEL)
    row = table.model.row_of(proposed[0])
    words = f"proposed by {MODEL}"
    assert tips(table, row) == [words, f"grab\n{words}", words]
    assert tips(table, 0) == [None, text(table, 0, ACTION), None]
    described = Qt.ItemDataRole.AccessibleDescriptionRole
    assert tips(table, row, described) == [words] * 3
    assert tips(table, 0, described) == [None] * 3
    document.editor.move_edge(document.editor.index_of(proposed[0]), "end", 7.5)
    assert tips(table, row)[0] == f"{words}, changed since"
    assert tips(table, row + 1)[0] == words
    document.editor.relabel(document.editor.index_of(proposed[1]), "grab")
    assert tips(table, row + 1)[0] is None
    document.editor.undo_everywhere()
    document.editor.undo_everywhere()
    assert [tips(table, row + i)[0] for i in (0, 1)] == [words, words]


def test_proposed_segments_are_marked_full_and_changed_ones_hollow(table, document):
    def marked():
        """Pixels that differ from those of a segment which was painted by hand."""
        pictures = []
        for verb in (
            lambda: document.editor.accept((Segment(6, 7, "grab"),), MODEL),
            lambda: document.editor.move_edge(
                document.editor.index_of(Segment(6, 7, "grab")), "end", 7.5
            ),
            lambda: document.editor.erase(5.5, 10) and document.editor.paint(6, 7.5, "grab"),
        ):
            assert verb()
            document.view.seek(0)
            row = next(i for i, s in enumerate(table.model.rows) if s.start == 6)
            box = table.table.visualRect(table.model.index(row, ACTION))
            pictures.append(table.table.viewport().grab(box).toImage())
        human = pictures.pop()
        return [
            sum(
                picture.pixel(x, y) != human.pixel(x, y)
                for x in range(human.width())
                for y in range(human.height())
            )
            for picture in pictures
        ]

    document.editor.erase(5.5, 10)
    full, hollow = marked()
    assert full > hollow > 0


def test_rows_are_told_who_proposed_them_without_asking_the_store(table, document, monkeypatch):
    document.editor.accept((Segment(6, 7, "grab"),), MODEL)
    queries = []
    database = document.project._db
    every = database.all
    monkeypatch.setattr(database, "all", lambda sql, *v: queries.append(sql) or every(sql, *v))
    table.grab()
    for row in range(table.model.rowCount()):
        tips(table, row)
    assert queries == []
