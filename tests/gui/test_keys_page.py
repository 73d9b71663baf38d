import pytest
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QGroupBox,
    QKeySequenceEdit,
    QLabel,
    QPushButton,
    QTreeWidget,
)

from forcelab.gui.preferences_dialog import KeysPage
from forcelab.gui.shortcuts import COMMANDS
from forcelab.vocabulary import Vocabulary


class Document(QObject):
    """The part of a document that the page knows."""

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
def page(document, keys):
    created = KeysPage(document, keys)
    created.show()
    assert QTest.qWaitForWindowActive(created)
    yield created
    created.close()
    created.deleteLater()


def rows(page, hidden=False):
    table = page.findChild(QTreeWidget)
    found = {}
    for i in range(table.topLevelItemCount()):
        group = table.topLevelItem(i)
        for k in range(group.childCount()):
            item = group.child(k)
            if hidden or not item.isHidden():
                found[item.text(0)] = item
    return found


def choose(page, name):
    page.findChild(QTreeWidget).setCurrentItem(rows(page)[name])
    return page.findChildren(QKeySequenceEdit)


def press(edit, key, modifiers=Qt.NoModifier):
    edit.setFocus()
    QTest.keyClick(edit, key, modifiers)


def test_a_key_that_the_command_has_already_is_not_shown_twice(page, keys):
    first, second = choose(page, "Delete the segment")
    press(second, Qt.Key_Delete)
    second.editingFinished.emit()
    assert keys["delete"] == ("Del",)
    assert second.keySequence().isEmpty()
    assert first.keySequence().toString() == "Del"


def trouble(page):
    [label] = [
        w for w in page.findChildren(QLabel) if w.accessibleName() == "Why a key was refused"
    ]
    return label.text()


def buttons(page, text):
    return [b for b in page.findChildren(QPushButton) if b.text() == text]


def button(page, text):
    [found] = buttons(page, text)
    return found


def test_all_commands_and_actions_are_listed_with_their_keys(page):
    shown = {name: item.text(1) for name, item in rows(page).items()}
    assert len(shown) == len(COMMANDS) + 2
    assert shown["grab"] == "1"
    assert shown["Redo"] == "Ctrl+Shift+Z, Ctrl+Y"
    assert shown["Reset layout"] == ""


def test_the_key_that_is_pressed_counts_at_once(page, keys):
    first, _ = choose(page, "Play or pause")
    press(first, Qt.Key_F8)
    assert keys["play"] == ("F8",)
    item = rows(page)["Play or pause"]
    assert item.text(1) == "F8"
    assert item.font(1).bold()
    assert page.findChild(QTreeWidget).currentItem() is item


def test_either_of_two_keys_can_be_taken_away(page, keys):
    _, second = choose(page, "Play or pause")
    press(second, Qt.Key_P, Qt.ControlModifier)
    assert keys["play"] == ("Space", "Ctrl+P")
    buttons(page, "Remove")[1].click()
    assert keys["play"] == ("Space",)
    assert second.keySequence().isEmpty()
    first, second = choose(page, "Redo")
    buttons(page, "Remove")[0].click()
    assert keys["redo"] == ("Ctrl+Y",)
    assert (first.keySequence().toString(), second.keySequence().isEmpty()) == ("Ctrl+Y", True)


def test_a_modifier_alone_changes_nothing(page, keys):
    first, _ = choose(page, "Play or pause")
    press(first, Qt.Key_Control)
    first.clearFocus()
    assert keys["play"] == ("Space",)
    page.findChild(QTreeWidget).setFocus()
    first.editingFinished.emit()
    assert first.keySequence().toString() == "Space"


def test_a_command_without_a_key_can_be_given_one(page, keys):
    first, _ = choose(page, "Dark theme")
    assert first.keySequence().isEmpty()
    press(first, Qt.Key_D, Qt.ControlModifier)
    assert keys["theme_dark"] == ("Ctrl+D",)


def test_a_key_that_is_taken_is_refused_in_place(page, keys):
    first, _ = choose(page, "Play or pause")
    press(first, Qt.Key_Z, Qt.ControlModifier)
    assert trouble(page) == "The key Ctrl+Z already means 'Undo'; give that another key first."
    assert keys["play"] == ("Space",)
    assert first.keySequence().toString() == "Space"
    choose(page, "Undo")
    assert trouble(page) == ""


def test_the_key_of_an_action_can_be_changed(page, document):
    first, second = choose(page, "grab")
    assert second.isHidden()
    press(first, Qt.Key_X)
    assert document.vocabulary["grab"].key == "x"
    assert rows(page)["grab"].text(1) == "X"
    assert page.findChild(QTreeWidget).currentItem() is rows(page)["grab"]


@pytest.mark.parametrize(
    ("key", "says"), [(Qt.Key_2, "paints 'hold'"), (Qt.Key_K, "cannot paint 'grab'")]
)
def test_an_actions_key_that_cannot_be_is_refused(page, document, key, says):
    first, _ = choose(page, "grab")
    press(first, key)
    assert says in trouble(page)
    assert document.vocabulary["grab"].key == "1"


def test_an_action_can_do_without_a_key(page, document):
    choose(page, "grab")
    buttons(page, "Remove")[0].click()
    assert document.vocabulary["grab"].key == ""


def test_one_command_gets_its_default_back(page, keys):
    keys.set_keys("play", ["F8"])
    choose(page, "Play or pause")
    assert button(page, "Reset").isEnabled()
    button(page, "Reset").click()
    assert keys["play"] == ("Space",)
    assert not button(page, "Reset").isEnabled()


def test_searching_leaves_what_matches_in_name_or_key(page):
    assert page.show_matching("ctrl+y")
    assert list(rows(page)) == ["Redo"]
    assert page.show_matching("THEME ")
    assert list(rows(page)) == ["Light theme", "Dark theme", "Same theme as system"]
    assert page.show_matching("segment delete")
    assert list(rows(page)) == ["Delete the segment"]
    assert not page.show_matching("make tea")
    assert rows(page) == {}
    assert not page.findChild(QGroupBox).isEnabled()  # no keys of a row that is not seen
    page.show_matching("")
    assert len(rows(page)) == len(COMMANDS) + 2


def test_everything_is_done_from_the_keyboard(page, keys):
    table = page.findChild(QTreeWidget)
    page.show_matching("Full")
    page.focus_first()
    QTest.keyClick(table, Qt.Key_Down)
    assert table.currentItem().text(0) == "Full screen"
    QTest.keyClick(table, Qt.Key_Tab)
    first = page.findChildren(QKeySequenceEdit)[0]
    assert first.hasFocus() or first.isAncestorOf(page.focusWidget())
    QTest.keyClick(page.focusWidget(), Qt.Key_F12)
    assert keys["full_screen"] == ("F12",)


def test_everything_has_a_name_for_screen_readers(page):
    for kind in (QTreeWidget, QKeySequenceEdit, QPushButton):
        for widget in page.findChildren(kind):
            if not isinstance(widget.parent(), QKeySequenceEdit):
                assert widget.accessibleName(), widget
