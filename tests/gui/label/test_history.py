"""The history: what was done, what of it stands, and going back to any point."""

import random

import pytest
from PySide6.QtCore import QModelIndex, Qt
from PySide6.QtTest import QTest
from window_helpers import open_painted_document, shown_widget

from forcelab.gui.label import history as history_module
from forcelab.gui.label.history import EditState, HistoryView, edit_states, time_of_edit
from forcelab.project.tracks import TrackStore

DONE, UNDONE, ABANDONED = EditState.DONE, EditState.UNDONE, EditState.ABANDONED


@pytest.fixture
def document(app, tmp_path):
    with open_painted_document(tmp_path, ()) as document:
        yield document


@pytest.fixture
def view(app, document):
    with shown_widget(app, HistoryView(document)) as view:
        yield view


def paint(document, count, first=0):
    for n in range(first, first + count):
        assert document.editor.paint(n / 10, (n + 1) / 10, f"a{n}")


def rows(view):
    view.refresh()
    model = view.model
    return [
        (model.rows[row].what.split()[0], model.state_of(row)) for row in range(model.rowCount())
    ]


def by_stacks(edits):
    """What has become of edits, as two stacks have it."""
    undo, redo, states = [], [], {}
    for edit in edits:
        if edit.kind == "undo":
            redo.append(undo.pop())
            states[redo[-1]] = UNDONE
        elif edit.kind == "redo":
            undo.append(redo.pop())
            states[undo[-1]] = DONE
        else:
            states.update(dict.fromkeys(redo, ABANDONED))
            undo.append(edit.id)
            redo.clear()
            states[edit.id] = DONE
    return states


def test_newest_first_and_what_became_of_it(document, view):
    paint(document, 3)
    assert rows(view) == [("a2", DONE), ("a1", DONE), ("a0", DONE)]
    document.editor.undo_everywhere()
    document.editor.undo_everywhere()
    assert rows(view) == [("a2", UNDONE), ("a1", UNDONE), ("a0", DONE)]
    document.editor.redo_everywhere()
    assert rows(view) == [("a2", UNDONE), ("a1", DONE), ("a0", DONE)]
    paint(document, 1, first=7)
    assert rows(view) == [("a7", DONE), ("a2", ABANDONED), ("a1", DONE), ("a0", DONE)]
    document.editor.undo_everywhere()
    document.editor.undo_everywhere()
    assert rows(view) == [("a7", UNDONE), ("a2", ABANDONED), ("a1", UNDONE), ("a0", DONE)]


@pytest.mark.parametrize("seed", range(3))
def test_standings_are_those_of_two_stacks_from_any_number_of_latest_edits(document, seed):
    chance = random.Random(seed)
    for n in range(30):
        verb = chance.choice(["paint", "undo", "undo", "redo"])
        if verb == "paint":
            paint(document, 1, first=n)
        else:
            getattr(document.editor, f"{verb}_everywhere")()
    edits = document.editor.history()
    expected = by_stacks(edits)
    newest_first = edits[::-1]
    for known in range(len(edits) + 1):
        numbers = {e.id for e in newest_first[:known]}
        assert edit_states(newest_first[:known]) == {
            number: standing for number, standing in expected.items() if number in numbers
        }


@pytest.mark.parametrize("seed", range(2))
def test_double_click_goes_to_that_point_and_back(document, view, seed):
    paint(document, 8)
    tracks = {f"a{n}": document.editor.segments[: n + 1] for n in range(8)}
    chance = random.Random(seed)
    for _ in range(6):
        row = chance.randrange(8)
        name = rows(view)[row][0]
        view.list.doubleClicked.emit(view.model.index(row))
        assert document.editor.segments == tracks[name]
        assert [standing for _, standing in rows(view)] == [UNDONE] * row + [DONE] * (8 - row)


def test_enter_is_a_double_click_and_what_was_left_behind_is_said(document, view, messages):
    paint(document, 2)
    document.editor.undo_everywhere()
    paint(document, 1, first=5)
    view.refresh()
    view.list.setCurrentIndex(view.model.index(1))
    QTest.keyClick(view.list, Qt.Key.Key_Return)
    assert "undone before a later edit" in messages[-1][0]
    assert len(document.editor.segments) == 2
    view.list.setCurrentIndex(view.model.index(2))
    QTest.keyClick(view.list, Qt.Key.Key_Return)
    assert len(document.editor.segments) == 1


def test_buttons_say_what_they_would_do(document, view, until):
    assert not view.undo.isEnabled()
    assert not view.redo.isEnabled()
    assert "No edits yet" in view.pages.note.text()
    paint(document, 2)
    until(view.undo.isEnabled)
    view.undo.click()
    view.refresh()
    assert view.undo.toolTip().startswith("Undo: a0")
    assert view.redo.toolTip().startswith("Redo: a1")
    assert view.reach.text() == "1 undone"
    view.redo.click()
    view.refresh()
    assert not view.redo.isEnabled()


def test_hidden_it_reads_nothing(app, document, monkeypatch):
    queries = []
    history = TrackStore.history
    monkeypatch.setattr(
        TrackStore, "history", lambda *args, **more: queries.append(more) or history(*args, **more)
    )
    view = HistoryView(document)
    paint(document, 2)
    assert queries == []
    with shown_widget(app, view):
        assert len(rows(view)) == 2
        view.hide()
        queries.clear()
        paint(document, 1, first=5)
        assert queries == []
        assert not view._refresh_timer.isActive()
        assert view.model.rowCount() == 0


def test_a_long_history_is_read_by_pages(app, document, monkeypatch):
    monkeypatch.setattr(history_module, "PAGE", 5)
    paint(document, 23)
    with shown_widget(app, HistoryView(document), size=(300, 120)) as view:
        model = view.model
        assert model.rowCount() < 23
        paint(document, 1, first=30)
        assert rows(view)[0] == ("a30", DONE)
        for n in range(31, 40):  # more at once than a page holds
            document.blockSignals(n < 39)
            paint(document, 1, first=n)
        assert rows(view)[:3] == [("a39", DONE), ("a38", DONE), ("a37", DONE)]
        while model.canFetchMore(QModelIndex()):
            model.fetchMore(QModelIndex())
        names = [f"a{n}" for n in (*range(23), *range(30, 40))]
        assert [name for name, _ in rows(view)] == names[::-1]


def test_another_coder_has_another_history(document, view):
    paint(document, 2)
    document.set_author("Ben")
    assert rows(view) == []
    paint(document, 1, first=5)
    assert rows(view) == [("a5", DONE)]
    document.set_author("Ada")
    assert [name for name, _ in rows(view)] == ["a1", "a0"]
    document.close()
    assert rows(view) == []


def test_time_of_day_today_and_else_the_date(document):
    paint(document, 1)
    time = document.editor.history()[-1].time
    assert time_of_edit(time) == f"{time.astimezone():%H:%M:%S}"
    assert (
        time_of_edit(time.replace(year=2020))
        == f"{time.replace(year=2020).astimezone():%Y-%m-%d %H:%M}"
    )


def test_the_store_gives_the_latest_and_those_before(document):
    paint(document, 6)
    project, key = document.project, (document.id, "Ada")
    every = project.tracks.history(*key)
    assert project.tracks.history(*key, latest=2) == every[-2:]
    assert project.tracks.history(*key, latest=2, before=every[3].id) == every[1:3]
    assert project.tracks.history(*key, before=every[0].id) == ()
    assert project.tracks.history(*key, latest=0) == ()


def test_more_undos_than_a_page_holds_can_all_be_redone(document, view, monkeypatch):
    monkeypatch.setattr(history_module, "PAGE", 5)
    paint(document, 10)
    for _ in range(8):
        document.editor.undo_everywhere()
    assert rows(view) == [(f"a{n}", UNDONE) for n in range(9, 1, -1)] + [
        (f"a{n}", DONE) for n in (1, 0)
    ]
    assert view.redo.isEnabled()
    view.go_to(0)
    assert len(document.editor.segments) == 10


def test_an_edit_that_is_not_listed_any_more_is_not_gone_to(document, view, monkeypatch):
    monkeypatch.setattr(history_module, "PAGE", 5)
    # Else the list reads on by itself, as far as it has room.
    monkeypatch.setattr(history_module.HistoryModel, "canFetchMore", lambda *_: False)
    paint(document, 3)
    view.refresh()
    paint(document, 6, first=3)
    view.list.doubleClicked.emit(view.model.index(2))
    assert len(document.editor.segments) == 9
