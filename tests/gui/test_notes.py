"""Notes in the window: written by a key or the menu, signed and found in the list, kept blind."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import pytest
from factories import PAINTED_TRACK, cached_project, make_painted_project
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QMenu
from window_helpers import status_messages

from forcelab.gui import theme
from forcelab.gui.demonstration_menu import NoteDialog
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.removal_dialog import Removal, removal_of
from forcelab.project import Project

TIP, ALOUD = Qt.ItemDataRole.ToolTipRole, Qt.ItemDataRole.AccessibleTextRole
CTRL = Qt.KeyboardModifier.ControlModifier
CTRL_SHIFT = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def path(tmp_path):
    return cached_project(make_painted_project, tmp_path / "study.forcelab", PAINTED_TRACK, 10.0)


@pytest.fixture
def window(window_of_file, path):
    """Ada's window, with the first of two demonstrations open."""
    window = window_of_file(LaunchOptions(project=path), "Ada", (960, 540))
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window)
    assert window.document.demonstration.name == "01"
    yield window
    for dialog in window.findChildren(NoteDialog):
        dialog.close()


def index_of(window, name):
    id_ = next(info.id for info in window.document.infos if info.name == name)
    return window.demonstrations.model.index_of(id_)


def found(window):
    """The names that the list shows."""
    return [row.info.name for row in window.demonstrations.model.rows]


def asking(window):
    """The dialogs that ask for a note now."""
    return [dialog for dialog in window.findChildren(NoteDialog) if dialog.isVisible()]


def the_dialog(window, until):
    """The dialog that asks for a note, and its text."""
    until(lambda: asking(window))
    [dialog] = asking(window)
    return dialog, dialog.text


def type_lines(edit, text):
    """Type a text; Return begins each further line."""
    first, *further = text.split("\n")
    QTest.keyClicks(edit, first)
    for line in further:
        QTest.keyClick(edit, Qt.Key.Key_Return)
        QTest.keyClicks(edit, line)


def note(window, until, text):
    """Write a note on the open demonstration, by keys alone."""
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    _, edit = the_dialog(window, until)
    type_lines(edit, text)
    QTest.keyClick(edit, Qt.Key.Key_Return, CTRL)
    until(lambda: not asking(window))


def test_a_note_is_written_by_the_keyboard_and_shown_in_the_list(window, path, until):
    before = window.demonstrations.view.grab().toImage()
    note(window, until, "slipped at <b>3.2 s")
    with Project.open(path) as other:
        assert [(n.author, n.text) for n in other.coding.notes()] == [
            ("Ada", "slipped at <b>3.2 s")
        ]
    assert "Note by Ada: slipped at <b>3.2 s" in index_of(window, "01").data(ALOUD)
    assert "Note by Ada: slipped at &lt;b&gt;3.2 s" in index_of(window, "01").data(TIP)
    assert "Note" not in index_of(window, "02").data(TIP)
    assert window.demonstrations.view.grab().toImage() != before  # the sign in the row
    note(window, until, ", twice")  # what is typed goes on, and does not replace
    assert "slipped at <b>3.2 s, twice" in index_of(window, "01").data(ALOUD)
    assert window.document.stroke is None  # no key of it has painted
    assert not any(row.done for row in window.demonstrations.model.rows)  # Ctrl+Return's command
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    _, edit = the_dialog(window, until)
    QTest.keyClick(edit, Qt.Key.Key_A, CTRL)
    QTest.keyClick(edit, Qt.Key.Key_Delete)
    QTest.keyClick(edit, Qt.Key.Key_Return, CTRL)
    until(lambda: "Note" not in index_of(window, "01").data(ALOUD))
    assert len(window.document.project.coding.note_events()) == 3


def test_return_begins_a_line_and_the_dialog_shows_all_of_them(window, until):
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    dialog, edit = the_dialog(window, until)
    assert "Note for other coders" in dialog.findChild(QLabel).text().replace("&", "")
    type_lines(edit, "slipped at 3.2 s\n\nleft hand")
    assert dialog.isVisible()
    assert edit.toPlainText() == "slipped at 3.2 s\n\nleft hand"
    top, bottom = (edit.cursorRect(cursor) for cursor in (cursor_at(edit, 0), edit.textCursor()))
    assert edit.viewport().rect().contains(top)
    assert edit.viewport().rect().contains(bottom)
    QTest.keyClick(edit, Qt.Key.Key_Enter, CTRL)
    until(lambda: not asking(window))
    written = "slipped at 3.2 s\n\nleft hand"
    assert [note.text for note in window.document.project.coding.notes()] == [written]
    assert f"Note by Ada: {written}" in index_of(window, "01").data(TIP)
    removal = removal_of([*window.demonstrations.model.rows][:1], "Ada").text.text()
    assert "the note of Ada: “slipped at 3.2 s…”" in removal
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    assert the_dialog(window, until)[1].toPlainText() == written


def cursor_at(edit, position):
    cursor = edit.textCursor()
    cursor.setPosition(position)
    return cursor


def test_escape_leaves_the_note_as_it_was(window, until):
    note(window, until, "leave out")
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    dialog, edit = the_dialog(window, until)
    assert edit.toPlainText() == "leave out"
    QTest.keyClicks(edit, "not")
    QTest.keyClick(dialog, Qt.Key.Key_Escape)
    until(lambda: not asking(window))
    assert [event.text for event in window.document.project.coding.note_events()] == ["leave out"]


def test_a_right_click_writes_on_another_one_than_the_open_one(window, until):
    view = window.demonstrations.view
    where = view.visualRect(index_of(window, "02")).center()
    view.customContextMenuRequested.emit(where)
    until(lambda: any(menu.isVisible() for menu in window.demonstrations.findChildren(QMenu)))
    [menu] = [menu for menu in window.demonstrations.findChildren(QMenu) if menu.isVisible()]
    [entry] = [action for action in menu.actions() if action.text() == "Note…"]
    at = menu.actionGeometry(entry).center()
    QTest.mouseMove(menu, at)
    QTest.mouseClick(menu, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, at)
    dialog, edit = the_dialog(window, until)
    assert dialog.windowTitle() == "Note on 02"
    QTest.keyClicks(edit, "second try")
    QTest.keyClick(edit, Qt.Key.Key_Return, CTRL)
    until(lambda: "second try" in index_of(window, "02").data(ALOUD))
    assert window.document.demonstration.name == "01"
    rows = [*window.demonstrations.model.rows]
    assert "the note of Ada: “second try”" in removal_of(rows[1:], "Ada").text.text()
    assert "notes (1)" in removal_of(rows, "Ada").text.text()
    assert "note" not in removal_of(rows[:1], "Ada").text.text()


def test_a_long_note_leaves_room_for_what_else_is_said_of_removing(window):
    document = window.document
    document.project.coding.set_note(document.id, "Ada", "a long story " * 1000)
    document.refresh_listing()
    dialog = removal_of([*window.demonstrations.model.rows][:1], "Ada", window)
    dialog.show()
    reported = dialog.text
    assert "a long story a long" in reported.text()
    assert "This cannot be undone." in reported.text()
    assert reported.height() >= reported.heightForWidth(reported.width())


@pytest.mark.parametrize("count", [1, 2])
def test_a_note_written_while_removing_is_asked_about_is_not_lost_unseen(
    window, path, until, monkeypatch, count
):
    rows = [*window.demonstrations.model.rows][-count:]
    reported = []

    def answer(dialog):
        reported.append(dialog.text.text())
        if len(reported) == 1:
            with Project.open(path) as other:
                other.coding.set_note(rows[-1].info.id, "Ben", "keep this one")
        return len(reported) == 1

    monkeypatch.setattr(Removal, "exec", answer)
    before = len(window.document.infos)
    window.demonstrations.menu._ask_remove(rows)
    assert len(reported) == 2
    assert "note" not in reported[0]
    assert reported[1].startswith("Notes have changed meanwhile.")
    assert ("notes (1)" if count > 1 else "the note of Ben: “keep this one”") in reported[1]
    assert len(window.document.infos) == before
    monkeypatch.setattr(Removal, "exec", lambda _: True)
    window.demonstrations.menu._ask_remove([*window.demonstrations.model.rows][-count:])
    assert len(window.document.infos) == before - count


def test_the_search_finds_a_note_of_anybody(window, path):
    with Project.open(path) as other:
        other.coding.set_note(
            other.demonstrations.id_of("02"), "Bert", "Second TRY of the same grip"
        )
    window.document.refresh()
    window.commands["search"].trigger()
    search = window.demonstrations.search
    QTest.keyClicks(search, "grip try")
    assert found(window) == ["02"]
    QTest.keyClicks(search, "s")
    assert found(window) == []
    QTest.keyClick(search, Qt.Key.Key_Escape)
    assert found(window) == ["01", "02"]


def test_who_codes_blind_learns_nothing_of_the_notes_of_others(window, path, until, answers):
    note(window, until, "mine")
    with Project.open(path) as other:
        id_ = other.demonstrations.id_of("01")
        other.coding.set_note(id_, "Bert", "slipped where I say")
        other.coding.assign(id_, "Ada")
    window.document.refresh()
    reported = index_of(window, "01").data(ALOUD) + index_of(window, "01").data(TIP)
    assert "Note by Ada: mine" in reported
    assert "Bert" not in reported
    assert "slipped" not in reported
    QTest.keyClicks(window.demonstrations.search, "slipped")
    assert found(window) == []
    window.demonstrations.search.clear()
    answers("Mark as done")
    window.commands["done"].trigger()
    assert "Note by Bert: slipped where I say" in index_of(window, "01").data(TIP)
    window.document.set_author("Cleo")  # another coder at the same desk, who is not blind
    assert "Note by Bert" in index_of(window, "01").data(TIP)


def test_what_could_not_be_stored_is_said_and_stays_typed(window, path, until, monkeypatch):
    messages = status_messages(window.document)
    window.document.project._db.execute("PRAGMA busy_timeout = 20")
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    dialog, edit = the_dialog(window, until)
    QTest.keyClicks(edit, "leave out")
    with closing(sqlite3.connect(path / "project.sqlite", isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        QTest.keyClick(edit, Qt.Key.Key_Return, CTRL)
        assert "kept busy by another program" in messages[-1][0]
        assert messages[-1][1]
        other.execute("ROLLBACK")
    again, edit = the_dialog(window, until)
    assert again is dialog
    assert edit.toPlainText() == "leave out"
    QTest.keyClick(edit, Qt.Key.Key_Return, CTRL)
    until(lambda: "leave out" in index_of(window, "01").data(ALOUD))
    monkeypatch.setattr(window.document.project._db, "_refusal", "It may only be read here.")
    QTest.keyClick(window.label.tracks, Qt.Key.Key_N, CTRL_SHIFT)
    assert "may only be read here" in messages[-1][0]
    window.document.close()
    window.commands["note"].trigger()
    assert messages[-1] == ("Open or make a project first.", True)
    assert not asking(window)


@pytest.mark.parametrize("choice", ["light", "dark"])
def test_the_sign_stands_left_of_the_others_in_its_row(app, window, until, choice):
    theme.use_theme(app, choice)
    view = window.demonstrations.view

    def inked() -> list[int]:
        """The columns of the first row's upper line, right of its name, that hold ink."""
        image = view.grab().toImage()
        box = view.visualRect(index_of(window, "01")).translated(view.viewport().pos())
        ground = image.pixelColor(QPoint(box.center().x(), box.top() + 3))
        rows = range(box.top() + 3, box.center().y())
        columns = range(box.center().x(), box.right())
        return [x for x in columns if any(image.pixelColor(x, y) != ground for y in rows)]

    bare = inked()
    note(window, until, "leave out")
    assert not bare
    assert 8 <= len(inked()) <= 20
    theme.use_theme(app, "light")
