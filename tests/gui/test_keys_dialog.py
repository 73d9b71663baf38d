import pytest
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QGroupBox,
    QKeySequenceEdit,
    QLabel,
    QLineEdit,
    QPushButton,
    QTreeWidget,
)

from forcelab.gui.keys_dialog import KeysDialog
from forcelab.gui.shortcuts import COMMANDS
from forcelab.vocabulary import Vocabulary


class Document(QObject):
    """The part of a document that the dialog knows."""

    vocabulary_changed = Signal()
    vocabulary = Vocabulary().with_actions("grab", "hold")

    def set_vocabulary(self, vocabulary):
        self.vocabulary = vocabulary
        self.vocabulary_changed.emit()
        return True


@pytest.fixture
def document(app):
    return Document()


@pytest.fixture
def dialog(document, keys):
    created = KeysDialog(document, keys)
    created.show()
    assert QTest.qWaitForWindowActive(created)
    yield created
    created.close()
    created.deleteLater()


def rows(dialog, hidden=False):
    table = dialog.findChild(QTreeWidget)
    found = {}
    for i in range(table.topLevelItemCount()):
        group = table.topLevelItem(i)
        for k in range(group.childCount()):
            item = group.child(k)
            if hidden or not item.isHidden():
                found[item.text(0)] = item
    return found


def choose(dialog, name):
    dialog.findChild(QTreeWidget).setCurrentItem(rows(dialog)[name])
    return dialog.findChildren(QKeySequenceEdit)


def press(edit, key, modifiers=Qt.NoModifier):
    edit.setFocus()
    QTest.keyClick(edit, key, modifiers)


def trouble(dialog):
    [label] = [
        w for w in dialog.findChildren(QLabel) if w.accessibleName() == "Why a key was refused"
    ]
    return label.text()


def buttons(dialog, text):
    return [b for b in dialog.findChildren(QPushButton) if b.text() == text]


def button(dialog, text):
    [found] = buttons(dialog, text)
    return found


def test_all_commands_and_actions_are_listed_with_their_keys(dialog):
    shown = {name: item.text(1) for name, item in rows(dialog).items()}
    assert len(shown) == len(COMMANDS) + 2
    assert shown["grab"] == "1"
    assert shown["Redo"] == "Ctrl+Shift+Z, Ctrl+Y"
    assert shown["Reset layout"] == ""


def test_the_key_that_is_pressed_counts_at_once(dialog, keys):
    first, _ = choose(dialog, "Play or pause")
    press(first, Qt.Key_F8)
    assert keys["play"] == ("F8",)
    item = rows(dialog)["Play or pause"]
    assert item.text(1) == "F8"
    assert item.font(1).bold()
    assert dialog.findChild(QTreeWidget).currentItem() is item


def test_a_second_key_can_be_added_and_taken_away(dialog, keys):
    _, second = choose(dialog, "Play or pause")
    press(second, Qt.Key_P, Qt.ControlModifier)
    assert keys["play"] == ("Space", "Ctrl+P")
    buttons(dialog, "Remove")[1].click()
    assert keys["play"] == ("Space",)
    assert second.keySequence().isEmpty()


def test_the_first_of_two_keys_can_be_taken_away(dialog, keys):
    first, second = choose(dialog, "Redo")
    buttons(dialog, "Remove")[0].click()
    assert keys["redo"] == ("Ctrl+Y",)
    assert (first.keySequence().toString(), second.keySequence().isEmpty()) == ("Ctrl+Y", True)


def test_a_modifier_alone_changes_nothing(dialog, keys):
    first, _ = choose(dialog, "Play or pause")
    press(first, Qt.Key_Control)
    first.clearFocus()
    assert keys["play"] == ("Space",)
    dialog.findChild(QLineEdit).setFocus()
    first.editingFinished.emit()
    assert first.keySequence().toString() == "Space"


def test_a_command_without_a_key_can_be_given_one(dialog, keys):
    first, _ = choose(dialog, "Dark theme")
    assert first.keySequence().isEmpty()
    press(first, Qt.Key_D, Qt.ControlModifier)
    assert keys["theme_dark"] == ("Ctrl+D",)


def test_a_key_that_is_taken_is_refused_in_place(dialog, keys):
    first, _ = choose(dialog, "Play or pause")
    press(first, Qt.Key_Z, Qt.ControlModifier)
    assert trouble(dialog) == "The key Ctrl+Z already means 'Undo'; give that another key first."
    assert keys["play"] == ("Space",)
    assert first.keySequence().toString() == "Space"
    choose(dialog, "Undo")
    assert trouble(dialog) == ""


def test_a_key_that_paints_is_refused(dialog, keys):
    first, _ = choose(dialog, "Play or pause")
    press(first, Qt.Key_1)
    assert "paints 'grab'" in trouble(dialog)
    press(first, Qt.Key_X)
    assert "kept for painting" in trouble(dialog)


def test_the_key_of_an_action_can_be_changed(dialog, document):
    first, second = choose(dialog, "grab")
    assert second.isHidden()
    press(first, Qt.Key_X)
    assert document.vocabulary["grab"].key == "x"
    assert rows(dialog)["grab"].text(1) == "X"
    assert dialog.findChild(QTreeWidget).currentItem() is rows(dialog)["grab"]


@pytest.mark.parametrize(
    ("key", "says"), [(Qt.Key_2, "paints 'hold'"), (Qt.Key_K, "cannot paint 'grab'")]
)
def test_an_actions_key_that_cannot_be_is_refused(dialog, document, key, says):
    first, _ = choose(dialog, "grab")
    press(first, key)
    assert says in trouble(dialog)
    assert document.vocabulary["grab"].key == "1"


def test_an_action_can_do_without_a_key(dialog, document):
    choose(dialog, "grab")
    buttons(dialog, "Remove")[0].click()
    assert document.vocabulary["grab"].key == ""


def test_one_command_gets_its_default_back(dialog, keys):
    keys.set_keys("play", ["F8"])
    choose(dialog, "Play or pause")
    assert button(dialog, "Default").isEnabled()
    button(dialog, "Default").click()
    assert keys["play"] == ("Space",)
    assert not button(dialog, "Default").isEnabled()


def test_a_default_that_another_command_has_is_refused(dialog, keys):
    keys.set_keys("play", ["F8"])
    keys.set_keys("quit", ["Space"])
    choose(dialog, "Play or pause")
    button(dialog, "Default").click()
    assert "already means 'Quit'" in trouble(dialog)


def test_all_commands_get_their_defaults_back(dialog, keys):
    keys.set_keys("play", ["F8"])
    keys.set_keys("quit", [])
    button(dialog, "All defaults").click()
    assert (keys["play"], keys["quit"]) == (("Space",), ("Ctrl+Q",))
    assert rows(dialog)["Quit"].text(1) == "Ctrl+Q"


def test_searching_leaves_what_matches_in_name_or_key(dialog):
    search = dialog.findChild(QLineEdit)
    search.setText("ctrl+y")
    assert list(rows(dialog)) == ["Redo"]
    search.setText("THEME")
    assert list(rows(dialog)) == ["Light theme", "Dark theme", "Same theme as system"]
    search.setText("make tea")
    assert rows(dialog) == {}
    assert not dialog.findChild(QGroupBox).isEnabled()  # no keys of a row that is not seen
    search.setText("")
    assert len(rows(dialog)) == len(COMMANDS) + 2


def test_everything_is_done_from_the_keyboard(dialog, keys):
    search = dialog.findChild(QLineEdit)
    table = dialog.findChild(QTreeWidget)
    assert dialog.focusWidget() is search
    QTest.keyClicks(search, "Full")
    QTest.keyClick(search, Qt.Key_Tab)
    assert dialog.focusWidget() is table
    QTest.keyClick(table, Qt.Key_Down)
    assert table.currentItem().text(0) == "Full screen"
    QTest.keyClick(table, Qt.Key_Tab)
    first = dialog.findChildren(QKeySequenceEdit)[0]
    assert first.hasFocus() or first.isAncestorOf(dialog.focusWidget())
    QTest.keyClick(dialog.focusWidget(), Qt.Key_F12)
    assert keys["full_screen"] == ("F12",)


def test_enter_leads_from_the_search_to_what_was_found_and_on_to_its_key(dialog, keys):
    search = dialog.findChild(QLineEdit)
    QTest.keyClicks(search, "split")
    QTest.keyClick(search, Qt.Key_Return)
    table = dialog.focusWidget()
    assert table.currentItem().text(0) == "Split the segment at the cursor"
    QTest.keyClick(table, Qt.Key_Return)
    assert dialog.isVisible()
    QTest.keyClick(dialog.focusWidget(), Qt.Key_F12)
    assert keys["split"] == ("F12",)


def test_everything_has_a_name_for_screen_readers(dialog):
    for kind in (QLineEdit, QTreeWidget, QKeySequenceEdit, QPushButton):
        for widget in dialog.findChildren(kind):
            if not isinstance(widget.parent(), QKeySequenceEdit):
                assert widget.accessibleName(), widget
