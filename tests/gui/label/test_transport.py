"""The transport: its buttons move the cursor, its readouts follow it."""

import sqlite3

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from window_helpers import shown_widget

from forcelab.errors import InputError
from forcelab.gui import theme
from forcelab.gui.label.playback import SPEEDS, Player
from forcelab.gui.label.transport import Transport
from forcelab.gui.preferences import REACTION_TIME
from forcelab.gui.shortcuts import keys
from forcelab.project import Project
from forcelab.project.tracks import TrackStore


@pytest.fixture
def bar(app, document):
    player = Player(document, clock=lambda: 0.0)
    with shown_widget(app, Transport(document, player), size=(1300, 40)) as bar:
        yield bar
    player.stop()


def type_time(bar, text):
    bar.time.setFocus()
    bar.time.selectAll()
    QTest.keyClicks(bar.time, text)
    QTest.keyClick(bar.time, Qt.Key.Key_Return)


def test_buttons_move_the_cursor(bar, document):
    document.view.set_frame_times(np.arange(10) / 2)
    bar.buttons["step-forward"].click()
    assert document.view.cursor == 0.5
    bar.buttons["end"].click()
    assert document.view.cursor == document.view.bounds[1]
    bar.buttons["step-back"].click()
    assert document.view.cursor == 4.5
    bar.buttons["start"].click()
    assert document.view.cursor == 0.0


def test_play_turns_into_pause(bar, document):
    play = bar.buttons["play"]
    play.click()
    assert document.view.playing
    assert play.accessibleName() == "Pause"
    play.click()
    assert not document.view.playing
    assert play.accessibleName() == "Play"


def test_loop_and_speed_go_both_ways(bar, document):
    bar.buttons["loop"].click()
    assert bar.player.loop
    bar.player.set_loop(False)
    assert not bar.buttons["loop"].isChecked()
    assert bar.speed.itemText(len(SPEEDS) // 2) == "1×"
    bar.speed.activated.emit(1)
    assert document.view.speed == 0.25
    bar.player.faster()
    assert bar.speed.currentText() == "0.5×"
    document.view.set_speed(0.33)
    assert bar.speed.currentIndex() == -1


@pytest.mark.parametrize(
    ("text", "cursor"), [("3.25", 3.25), ("2 s", 2.0), ("0:04.5", 4.5), ("99", 10.0), ("-1", 0.0)]
)
def test_a_time_is_typed_to_jump(bar, document, text, cursor):
    document.view.seek(1.0)
    type_time(bar, text)
    assert document.view.cursor == pytest.approx(min(cursor, document.view.bounds[1]))
    assert bar.time.text() == f"{document.view.cursor:.3f}"


def test_what_is_no_time_is_said_and_taken_back(bar, document, messages):
    document.view.seek(1.0)
    for text in ("soon", "nan", "inf"):
        type_time(bar, text)
        assert "is no time" in messages[-1][0]
        assert (document.view.cursor, bar.time.text()) == (1.0, "1.000")


def test_readouts_follow(bar, document):
    document.view.seek(1.2345)
    assert bar.time.text() == "1.234"
    assert bar.length.text() == "/ 10.000 s"
    assert bar.frame.text() == ""
    document.view.set_frame_times(np.arange(10) / 2 + 0.25)
    assert bar.frame.text() == "frame 2"
    document.view.seek(0.0)
    assert bar.frame.text() == "frame –"
    document.view.set_range(1.2, 1.73)
    assert bar.range.text == "range 1.200–1.730 s (0.530 s)"
    document.view.clear_range()
    assert bar.range.text == ""
    document.view.seek(3.0)
    document.view.mark_in()
    bar.resize(bar.sizeHint().width() + 400, bar.height())
    assert bar.range.text == "range from 3.00 s: press ] to end"
    document.begin_stroke("grab", 0.834)
    assert bar.range.text == "grab from 0.83 s: press 1 again to end"
    document.set_vocabulary(document.vocabulary.rebound("grab", "q"))
    assert bar.range.toolTip() == "grab from 0.83 s: press Q again to end"
    document.cancel_stroke()
    document.view.clear_range()
    assert bar.range.text == ""


def test_a_time_being_typed_is_not_overwritten_by_playback(bar, document):
    bar.time.setFocus()
    bar.time.selectAll()
    QTest.keyClicks(bar.time, "7.5")
    document.view.seek(2.0)
    assert bar.time.text() == "7.5"
    QTest.keyClick(bar.time, Qt.Key.Key_Escape)
    bar.time.editingFinished.emit()
    assert bar.time.text() == "2.000"


def test_snapping_goes_both_ways_and_the_reaction_time_is_remembered(bar, document):
    assert bar.buttons["magnet"].isChecked() == document.view.snapping
    bar.buttons["magnet"].click()
    assert not document.view.snapping
    document.view.set_snapping(True)
    assert bar.buttons["magnet"].isChecked()
    bar.reaction.setValue(180)
    assert REACTION_TIME.value == 180


def test_a_time_typed_after_a_click_replaces_the_one_shown(bar, document):
    document.view.seek(2.5)
    QTest.mouseClick(bar.time, Qt.MouseButton.LeftButton)
    document.view.seek(2.75)  # as in playback
    QTest.keyClicks(bar.time, "7")
    QTest.keyClick(bar.time, Qt.Key.Key_Return)
    assert document.view.cursor == 7.0
    QTest.mouseClick(bar.time, Qt.MouseButton.LeftButton)
    QTest.mouseClick(bar.time, Qt.MouseButton.LeftButton)  # a second one places the caret
    assert not bar.time.hasSelectedText()


def test_it_says_since_when_all_is_stored(bar, document, until):
    document.editor.paint(9.0, 9.5, "grab")
    when = document.editor.history()[-1].time.astimezone()
    until(lambda: bar.saved.text == f"Stored {when:%H:%M:%S}")
    document.open_demonstration("02")
    until(lambda: bar.saved.text == "All stored")
    document.close()
    until(lambda: bar.saved.text == "")


def test_an_edit_that_the_disk_refused_is_told_until_one_is_stored(
    bar, document, until, monkeypatch
):
    def full(*_, **__):
        raise InputError("The disk is full.") from sqlite3.OperationalError("full")

    with monkeypatch.context() as patched:
        patched.setattr(TrackStore, "edit", full)
        assert not document.editor.paint(9.0, 9.5, "grab")
    assert (bar.saved.text, bar.saved.trouble) == ("Not stored", "The disk is full.")
    assert bar.saved.toolTip() == "The disk is full."
    assert not document.editor.paint(5.0, 4.0, "grab")  # wrong, but no trouble with the store
    assert document.editor.paint(9.0, 9.5, "grab")
    until(lambda: bar.saved.text.startswith("Stored "))
    assert bar.saved.trouble == ""


def test_trouble_stays_when_others_paint_and_not_the_coder(app, bar, document, until, monkeypatch):
    until(lambda: bar.saved.text.startswith("Stored "))
    document.store_failed.emit("The disk is full.")
    with Project.open(document.project.path) as other:
        other.tracks.edit(document.id, "Ben", (), document.editor.segments, "painted")
    document.refresh()
    bar.saved.refresh()
    assert bar.saved.trouble == "The disk is full."
    document.editor.paint(9.0, 9.5, "grab")
    until(lambda: bar.saved.text.startswith("Stored "))


def test_a_mistake_is_no_trouble_of_the_store(bar, document, messages):
    assert not document.editor.move_edge(0, "start", 3.0)
    assert messages[-1][1]
    assert bar.saved.trouble == ""


def test_narrow_it_stands_in_two_rows_and_cuts_nothing(app, bar, document):
    document.view.set_range(1.2, 1.73)
    high = bar.sizeHint().height()
    bar.resize(500, 80)
    app.processEvents()
    assert bar.sizeHint().height() > 1.5 * high
    assert bar.minimumSizeHint().width() <= 500
    inside = [bar.speed, bar.time, bar.length, bar.reaction, *bar.buttons.values()]
    for widget in inside:
        assert bar.rect().contains(widget.geometry())
        assert widget.width() >= widget.minimumSizeHint().width()
    bar.resize(1300, 40)
    app.processEvents()
    assert bar.sizeHint().height() == high


def test_without_a_demonstration_nothing_can_be_moved(bar, document):
    document.close()
    assert not any(bar.buttons[name].isEnabled() for name in ("play", "start", "step-back"))
    assert not bar.time.isEnabled()
    assert bar.length.text() == ""


def test_everything_has_a_name_for_screen_readers(bar):
    widgets = [*bar.buttons.values(), bar.speed, bar.time, bar.reaction, bar.saved]
    assert all(widget.accessibleName() for widget in widgets)


def test_icons_that_are_there_already_follow_the_theme(app, bar):
    try:
        for choice, colours in (("dark", theme.DARK), ("light", theme.LIGHT)):
            theme.use_theme(app, choice)
            app.processEvents()
            image = bar.buttons["play"].grab().toImage()
            centre = image.pixelColor(image.rect().center())
            assert centre.name() == colours.text
    finally:
        theme.use_theme(app, "light")


def test_a_click_leaves_the_keyboard_where_it_is(bar):
    for button in bar.buttons.values():
        assert button.focusPolicy() == Qt.FocusPolicy.TabFocus


def test_tooltips_name_the_keys_that_count(app, bar):
    assert bar.buttons["start"].toolTip() == "To the start (Home, Ctrl+Home)"
    assert bar.buttons["play"].toolTip() == "Play (Space)"
    assert bar.buttons["loop"].toolTip() == "Loop"
    keys().set_keys("play", ["F8"])
    try:
        assert bar.buttons["play"].toolTip() == "Play (F8)"
        bar.document.view.set_playing(True)
        assert bar.buttons["play"].toolTip() == "Pause (F8)"
    finally:
        bar.document.view.set_playing(False)
        keys().reset("play")
