"""The window's frame: menus, panels put back, keys from every list."""

from dataclasses import replace
from pathlib import Path

import pytest
from factories import FOAM_ACTIONS, make_foam_project
from PySide6.QtCore import QPoint, Qt, QTimer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu
from window_helpers import painted_once, status_messages

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.shortcuts import COMMANDS
from forcelab.gui.window import Window

CTRL, NONE = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.NoModifier


@pytest.fixture(scope="module")
def shared(app, tmp_path_factory):
    """One window for all tests here that leave it as it was."""
    folder = tmp_path_factory.mktemp("kept")
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("FORCELAB_SETTINGS", str(folder / "settings.ini"))
        window = Window("Ann", remembering=False)
    window.resize(1100, 700)
    window.show()
    make_foam_project(folder / "study.forcelab", ())
    window.begin(LaunchOptions(project=folder / "study.forcelab"))
    yield window
    window.close()


def activate(window):
    window.activateWindow()
    assert QTest.qWaitForWindowActive(window)


@pytest.fixture
def window(shared, until):
    with painted_once(shared):
        shared.commands["reset_layout"].trigger()
        # A menu or a window of another test may have come before it: keys such as Esc are not for
        # one that is behind.
        activate(shared)
        until(lambda: shared.settled)
    yield shared
    shared.show_workspace("label")
    document = shared.document
    document.cancel_stroke()
    for assignment in document.project.coding.assignments():
        document.project.coding.unassign(assignment.demonstration, assignment.author)
    document.reread()
    shared.label.tracks.setFocus()
    assert not document.editor.segments


def ticked_workspaces(window):
    names = ("label", "review", "capture")
    return [name for name in names if window.commands[f"workspace_{name}"].isChecked()]


def test_the_menu_ticks_the_workspace_that_is_shown(window):
    assert ticked_workspaces(window) == ["label"]
    window.commands["workspace_review"].trigger()
    assert ticked_workspaces(window) == ["review"]
    window.commands["workspace_review"].trigger()
    assert ticked_workspaces(window) == ["review"]
    window.show_workspace("label")
    assert ticked_workspaces(window) == ["label"]


def test_the_menus_are_where_they_are_looked_for_and_none_is_long_without_a_line(window):
    titles = [title.text().replace("&", "") for title in window.menuBar().actions()]
    assert titles == (
        ["File", "Edit", "View", "Demonstration", "Playback", "Labels", "Review", "Capture", "Help"]
    )
    mnemonics = [title.text()[1] for title in window.menuBar().actions()]
    assert len({*mnemonics}) == len(titles)
    for title in window.menuBar().actions():
        run = 0
        for entry in title.menu().actions():
            run = 0 if entry.isSeparator() else run + 1
            assert run <= 6, (title.text(), entry.text())


def answer_dialog(*presses):
    """Press keys in the dialog that the next key opens; texts are typed. Gives its titles."""
    titles = []

    def type_into_it():
        dialog = QApplication.activeModalWidget()
        titles.append(dialog.windowTitle())
        for press in presses:
            field = dialog.focusWidget()
            (QTest.keyClicks if isinstance(press, str) else QTest.keyClick)(field, press)

    QTimer.singleShot(0, type_into_it)
    return titles


def test_f2_renames_the_open_demonstration(window):
    document = window.document
    for old, new in (("01", "pencil"), ("pencil", "01")):
        assert document.demonstration.name == old
        titles = answer_dialog(new, Qt.Key.Key_Return)
        QTest.keyClick(window.label.tracks, Qt.Key.Key_F2)
        assert titles == ["Rename demonstration"]
        assert window.windowTitle().startswith(new)
        activate(window)  # again, after a dialog


def test_a_question_mark_opens_the_keys(window):
    titles = answer_dialog(Qt.Key.Key_Escape)
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Question)
    assert titles == ["Keyboard shortcuts"]


def entry_of(window, id_):
    """A command's entry and its menu, opened."""
    entry = window.commands[id_]
    (menu,) = [owner for owner in entry.associatedObjects() if isinstance(owner, QMenu)]
    menu.popup(window.mapToGlobal(QPoint(0, 0)))
    return entry, menu


def test_what_cannot_be_done_is_grey_in_its_menu_and_says_why(window, hovered):
    document, tracks = window.document, window.label.tracks
    messages = status_messages(document)
    document.view.seek(0.0)
    for id_, key, modifier, sentence in (
        ("undo", Qt.Key.Key_Z, CTRL, "There is nothing to undo."),
        ("redo", Qt.Key.Key_Y, CTRL, "There is nothing to redo."),
        ("split", Qt.Key.Key_B, CTRL, "Move the cursor into the segment to split."),
        ("merge", Qt.Key.Key_M, CTRL, "Select the first of the two segments to merge."),
        ("next_segment", Qt.Key.Key_L, NONE, "There is no segment after the cursor."),
        (
            "delete",
            Qt.Key.Key_Delete,
            NONE,
            "Select the segment to delete: click it, or go to it with K and L.",
        ),
        ("next_demonstration", Qt.Key.Key_PageDown, NONE,
         "This is the last demonstration of the list."),
        ("record", Qt.Key.Key_F9, NONE, "Connect devices in the Capture workspace first."),
    ):  # fmt: skip
        entry, menu = entry_of(window, id_)
        assert not entry.isEnabled()
        assert hovered(menu, menu.actionGeometry(entry).center()) == sentence
        menu.close()
        QTest.keyClick(tracks, key, modifier)
        assert messages[-1] == (sentence, True)
    document.editor.paint(1.0, 2.0, FOAM_ACTIONS[0])
    document.view.seek(1.5)
    QTest.keyClick(tracks, Qt.Key.Key_B, CTRL)
    assert len(document.editor.segments) == 2
    for _ in range(2):
        entry, menu = entry_of(window, "undo")
        assert entry.isEnabled()
        QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.actionGeometry(entry).center())
    assert not document.editor.segments


def test_the_status_line_is_there_before_it_says_something(window):
    height = window.label.height()
    window.document.show_message("something")
    QTest.qWait(10)
    assert window.label.height() == height


def test_panels_that_are_put_back_are_as_at_first(window, until):
    tracks, scalogram = window.label.tracks, window.label.scalogram
    until(lambda: tracks.height() == tracks.sizeHint().height())
    first = scalogram.height()
    window.label.toggles["scalogram"].setChecked(False)
    window.label.toggles["actions"].setChecked(False)
    window.commands["reset_layout"].trigger()
    until(lambda: scalogram.isVisible() and abs(scalogram.height() - first) <= 2)
    assert tracks.height() == tracks.sizeHint().height()


def test_a_key_paints_from_the_demonstrations_only_where_the_track_is_seen(window):
    document, view = window.document, window.demonstrations.view
    view.setFocus()
    QTest.keyClick(view, Qt.Key.Key_1)
    assert document.stroke.action == FOAM_ACTIONS[0]
    document.cancel_stroke()
    window.show_workspace("capture")
    QTest.keyClick(view, Qt.Key.Key_1)
    assert document.stroke is None


def test_tab_reaches_the_track(window):
    window.label.transport.speed.setFocus()
    for _ in range(60):
        if window.focusWidget() is window.label.tracks:
            return
        QTest.keyClick(window.focusWidget(), Qt.Key.Key_Tab)
    raise AssertionError("Tab never came to the track")


def test_the_lists_stay_as_wide_when_there_is_no_video(window, until):
    lists, document = window.label._docks, window.document
    until(lambda: not lists["video"].isVisible())
    wide = lists["actions"].width()
    assert wide >= 230
    videos = (VideoReference(Path("no.mp4"), ClockMap()),)
    with_video = replace(document.demonstration, videos=videos)
    for other in (with_video, document.demonstration):
        document.view.demonstration = other
        document.demonstration_changed.emit()
        filmed = other.video is not None
        until(lambda filmed=filmed: lists["video"].isVisible() == filmed)
        until(lambda: window.settled)
        assert lists["actions"].width() == wide


def test_what_is_not_done_yet_is_said_in_blind_coding(window, answers):
    document, messages = window.document, status_messages(window.document)
    document.project.coding.assign(document.id, "Ann")
    document.reread()
    window.commands["copy_from"].trigger()
    assert "hidden until you are done" in messages[-1][0]
    answers("Mark as done")
    window.commands["done"].trigger()
    assert "others are shown" in messages[-1][0]
    assert not document.coding_blind


def test_saving_says_that_everything_is_saved_and_no_dialog_asks_for_gaps_of_nothing(window):
    messages = status_messages(window.document)
    QTest.keyClick(window.label.tracks, Qt.Key.Key_S, CTRL)
    sentence = "Everything is saved already: each change is, as it is made."
    assert messages == [(sentence, False)]
    window.commands["fill_gaps"].trigger()  # a dialog would wait here for ever
    assert "You have no segments" in messages[-1][0]


def test_what_is_not_assigned_is_marked_as_done_without_a_question(window, answers):
    document, messages = window.document, status_messages(window.document)
    document.set_author("Nora")
    questions = answers("Mark as done")
    window.commands["done"].trigger()
    assert questions == []
    assert messages[-1] == ("Marked as done.", False)
    assert [item.done is not None for item in document.project.coding.assignments("Nora")] == [True]
    document.set_author("Ann")


def test_keys_paint_again_after_a_field_was_left_by_enter_or_escape(window):
    label, document = window.label, window.document
    for field, key in (
        (label.transport.reaction, Qt.Key.Key_Return),
        (label.transport.reaction, Qt.Key.Key_Escape),
        (label.segments.filter, Qt.Key.Key_Escape),
        (label.vocabulary.entry, Qt.Key.Key_Escape),
    ):
        field.setFocus()
        QTest.keyClick(field, Qt.Key.Key_1)
        assert document.stroke is None
        QTest.keyClick(field, key)
        QTest.keyClick(window.focusWidget() or window, Qt.Key.Key_1)
        assert document.stroke is not None
        document.cancel_stroke()


def test_each_command_that_help_menus_and_keys_tell_of_does_something(window):
    assert sorted(window.commands) == sorted(command.id for command in COMMANDS)


def test_keys_hide_the_scalogram_and_the_segments_behind_the_signals(window, until):
    label, commands = window.label, window.commands
    assert label.scalogram.isVisible()
    for key, command, panel in (
        (Qt.Key.Key_F6, "show_scalogram", "scalogram"),
        (Qt.Key.Key_F4, "segments_behind", "segments_behind"),
    ):
        for shown in (False, True):
            QTest.keyClick(label.tracks, key)
            assert label.toggles[panel].isChecked() == shown
            assert commands[command].isChecked() == shown
            if panel == "scalogram":
                assert label.scalogram.isVisible() == shown
