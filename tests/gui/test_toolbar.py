"""The toolbar; done and next by one key or one click, showing nothing that was not agreed to."""

import pytest
from factories import cached_project, sine_demonstration
from PySide6.QtCore import QByteArray, QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QInputDialog, QToolTip
from window_helpers import status_messages

from forcelab.errors import ForcelabError
from forcelab.gui import settings
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.menus import BUTTONS
from forcelab.gui.shortcuts import keys
from forcelab.gui.window import LAYOUT
from forcelab.labels import Segment, Track
from forcelab.project import Project

HIS = (Segment(1.0, 2.0, "hold"),)
CTRL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
LEFT = Qt.MouseButton.LeftButton


def study(path):
    with Project.create(path) as project:
        for number, name in enumerate(("01", "02", "03", "04")):
            recording = sine_demonstration(name, "foam", 0.1 * number)
            project.demonstrations.add(recording, [Track("Ben", HIS)] if name == "01" else [])


@pytest.fixture
def another_window(window_of_file, tmp_path):
    """Windows in which Ann works on the first of four demonstrations, labelled by Ben."""
    path = cached_project(study, tmp_path / "study.forcelab")

    def make():
        window = window_of_file(LaunchOptions(project=path, demonstration="01"))
        window.activateWindow()
        assert QTest.qWaitForWindowActive(window)
        return window

    return make


@pytest.fixture
def window(another_window):
    return another_window()


def button(window, id_):
    return window._toolbar.widgetForAction(window._toolbar.buttons[id_])


def click(window, id_):
    """As a mouse does, which the system hands to the window."""
    spot = button(window, id_).mapTo(window, button(window, id_).rect().center())
    QTest.mouseClick(window.windowHandle(), LEFT, pos=spot)


def press_done_and_next(window):
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Return, CTRL)


def name_of(window):
    return window.document.demonstration.name


def done_by_ann(window):
    coding = window.document.project.coding
    ids = {item.demonstration for item in coding.assignments("Ann") if item.done is not None}
    return [info.name for info in window.document.infos if info.id in ids]


def count_in_list(window):
    return window.demonstrations._count.text


def test_a_click_does_what_the_words_say(window, until):
    document, texts = window.document, [row[1] for row in BUTTONS if row]
    assert texts == (
        ["Import", "Undo", "Redo", "Split", "Merge", "Delete", "Note", "Done and next", "Train"]
    )
    document.editor.paint(1.0, 2.0, "grab")
    document.view.seek(1.5)
    until(button(window, "split").isEnabled)
    click(window, "split")
    assert len(document.editor.segments) == 2
    click(window, "undo")
    assert len(document.editor.segments) == 1
    until(button(window, "redo").isEnabled)
    click(window, "redo")
    document.select(0)
    until(button(window, "merge").isEnabled)
    click(window, "merge")
    assert len(document.editor.segments) == 1
    document.select(0)
    until(button(window, "delete").isEnabled)
    click(window, "delete")
    assert not document.editor.segments
    assert window.focusWidget() is window.label.tracks  # keys paint as before


def test_what_cannot_be_done_is_grey_and_says_why(window, hovered, until):
    for id_, sentence in (
        ("undo", "There is nothing to undo."),
        ("split", "Move the cursor into the segment to split."),
        ("merge", "Select the first of the two segments to merge."),
        ("delete", "Select the segment to delete: click it, or go to it with K and L."),
    ):
        until(lambda id_=id_, sentence=sentence: hovered(button(window, id_)) == sentence)
        assert not button(window, id_).isEnabled()
        QToolTip.showText(QPoint(0, 0), "no reason")
        click(window, id_)
        assert QToolTip.text() == sentence
    window.show_workspace("capture")
    until(lambda: not button(window, "done_and_next").isEnabled())
    assert "go to Label or Review" in hovered(button(window, "done_and_next"))
    assert button(window, "import").isEnabled()
    # Where nothing is in the way, it says what it does, and the key that counts.
    window.show_workspace("label")
    assert button(window, "split").toolTip() == "Split the segment at the cursor (Ctrl+B)"
    keys().set_keys("split", ["F8"])
    assert button(window, "split").toolTip() == "Split the segment at the cursor (F8)"
    keys().reset("split")


def test_a_key_hides_it_and_it_stays_hidden(window, another_window):
    press = (window.label.tracks, Qt.Key.Key_T, CTRL | SHIFT)
    assert window._toolbar.isVisible()
    assert window.commands["toolbar"].isChecked()
    QTest.keyClick(*press)
    assert not window._toolbar.isVisible()
    window.close()
    again = another_window()
    assert not again._toolbar.isVisible()
    assert not again.commands["toolbar"].isChecked()
    QTest.keyClick(again.label.tracks, *press[1:])
    assert again._toolbar.isVisible()
    again.document.close()  # where a project is chosen there is nothing to be done to one
    assert not again._toolbar.isVisible()


def test_in_a_low_window_it_leaves_its_room_to_the_panels(window):
    window._dock.close()
    window.resize(1100, 540)
    assert not window._toolbar.isVisible()
    window.resize(1100, 640)
    assert window._toolbar.isVisible()
    assert not window._dock.isVisible()  # a list that was closed stays closed


def test_it_can_be_moved_and_is_put_back(window, another_window):
    window.addToolBar(Qt.ToolBarArea.LeftToolBarArea, window._toolbar)
    window.close()
    again = another_window()
    assert again.toolBarArea(again._toolbar) == Qt.ToolBarArea.LeftToolBarArea
    QTest.keyClick(again.label.tracks, Qt.Key.Key_T, CTRL | SHIFT)
    again.commands["reset_layout"].trigger()
    assert again.toolBarArea(again._toolbar) == Qt.ToolBarArea.TopToolBarArea
    assert again._toolbar.isVisible()


def test_a_layout_from_before_it_is_restored_with_it(window, another_window):
    window.removeToolBar(window._toolbar)
    window._dock.setFloating(True)
    before = bytes(window.saveState(LAYOUT).data())
    window.close()
    settings.store("window/layout", before)
    again = another_window()
    assert again._toolbar.isVisible()
    assert again._dock.isFloating()
    assert again.restoreState(QByteArray(before), LAYOUT)


def test_one_key_marks_it_as_done_and_opens_the_next_that_is_not(window, answers):
    messages, questions = status_messages(window.document), answers("Cancel")
    assert count_in_list(window) == "0 of 4 done"
    third = window.document.infos[2].id
    window.document.project.coding.set_done(third, "Ann")
    press_done_and_next(window)
    assert name_of(window) == "02"
    assert messages[-1] == ("'01' is marked as done; 2 of 4 are done.", False)
    assert count_in_list(window) == "2 of 4 done"
    press_done_and_next(window)
    assert name_of(window) == "04"  # the third is done already
    press_done_and_next(window)
    assert name_of(window) == "04"
    assert messages[-1][0] == (
        "'04' is marked as done; no other demonstration in the list is left; F5 trains."
    )
    assert done_by_ann(window) == ["01", "02", "03", "04"]
    assert questions == []
    assert window.focusWidget() is window.label.tracks


@pytest.mark.parametrize(
    ("starts", "told"),
    [
        ((1.0, 1.55, 2.5), "'01' is marked as done; 1 of 4 are done."),
        (
            (1.0, 1.513, 2.5),
            "'01' is marked as done, with 1 gap below 50 ms (Ctrl+G there fills it); "
            "1 of 4 are done.",
        ),
        (
            (1.0, 1.513, 2.013),
            "'01' is marked as done, with 2 gaps below 50 ms (Ctrl+G there fills them); "
            "1 of 4 are done.",
        ),
    ],
)
def test_gaps_that_look_like_slips_are_told_when_it_is_done(window, starts, told):
    messages, ends = status_messages(window.document), (1.5, 2.0, 3.0)
    for start, end, action in zip(starts, ends, ("grab", "hold", "release"), strict=True):
        window.document.editor.paint(start, end, action)
    press_done_and_next(window)
    assert messages[-1] == (told, False)


def test_a_blind_coder_is_asked_and_sees_nothing_on_the_way(window, answers):
    document = window.document
    for info in document.infos:
        document.project.coding.assign(info.id, "Ann")
    document.reread()
    seen = []
    document.tracks_changed.connect(lambda: seen.append(dict(document.other_tracks)))
    questions = answers("Cancel")
    press_done_and_next(window)
    assert len(questions) == 1
    assert questions[0].startswith("Mark '01' as done and end blind coding?")
    assert "labels and notes of others" in questions[0]
    assert name_of(window) == "01"
    assert document.coding_blind
    assert done_by_ann(window) == []
    assert "Ben" not in str(window.demonstrations._rows[0].others)
    questions = answers("Mark as done")
    press_done_and_next(window)
    assert len(questions) == 1
    assert name_of(window) == "02"
    assert document.coding_blind
    assert done_by_ann(window) == ["01"]
    assert count_in_list(window) == "1 of 4 done"
    assert not any("Ben" in others for others in seen)
    assert document.open_demonstration(document.infos[0].id)
    assert document.other_tracks == {"Ben": HIS}


def test_where_the_next_cannot_be_opened_or_nothing_be_stored_that_is_said(window, monkeypatch):
    document, messages = window.document, status_messages(window.document)
    with monkeypatch.context() as reading:
        reading.setattr(document.project._db, "_refusal", "It may only be read here.")
        press_done_and_next(window)
    assert name_of(window) == "01"
    assert "may only be read here" in messages[-1][0]

    def fail(_):
        raise ForcelabError("'02' is damaged.")

    monkeypatch.setattr(document.project.demonstrations, "load", fail)
    press_done_and_next(window)
    assert document.demonstration.name == "01"
    assert ("'02' is damaged.", True) in messages
    assert "is marked" not in messages[-1][0]


def test_what_is_assigned_counts_as_done_once_it_is_marked(window, until):
    document = window.document
    low, high = document.view.bounds
    document.editor.paint(low, high, "grab")
    until(lambda: count_in_list(window) == "1 of 4 done")
    document.project.coding.assign(document.id, "Ann")
    document.reread()
    assert count_in_list(window) == "0 of 4 done"


def test_in_the_list_commands_act_on_its_row(window, monkeypatch):
    view, asked = window.demonstrations.view, []
    monkeypatch.setattr(QInputDialog, "getText", lambda *what: asked.append(what[-1]) or ("", 0))
    offered = []
    monkeypatch.setattr(
        QInputDialog, "getItem", lambda *what: offered.append(what[3]) or ("Ben", True)
    )
    QTest.keyClick(window.label.tracks, Qt.Key.Key_F2)
    view.setFocus()
    QTest.keyClick(view, Qt.Key.Key_Down)
    QTest.keyClick(view, Qt.Key.Key_Down, SHIFT)
    QTest.keyClick(view, Qt.Key.Key_F2)
    assert asked == ["01", "03"]
    assert name_of(window) == "01"
    window.commands["assign"].trigger()
    assigned = window.document.project.coding.assignments("Ben")
    ids = [info.id for info in window.document.infos]
    assert [ids.index(item.demonstration) for item in assigned] == [1, 2]
    assert offered == [["Ben", "Ann"]]  # mostly to somebody else
