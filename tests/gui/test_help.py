from contextlib import contextmanager

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QLineEdit, QScrollArea

from forcelab.gui import theme
from forcelab.gui.document import Document
from forcelab.gui.help import MOUSE_HELP, HelpPage
from forcelab.gui.shortcuts import COMMANDS, Keys
from forcelab.vocabulary import Vocabulary

VOCABULARY = Vocabulary().with_actions("grab", "a < b & c")


@pytest.fixture
def document(app):
    created = Document("Ada")
    created.vocabulary = VOCABULARY
    return created


@contextmanager
def shown(document, keys):
    created = HelpPage(document, keys)
    created.resize(1200, 860)
    created.show()
    assert QTest.qWaitForWindowActive(created)
    yield created
    created.close()
    created.deleteLater()


@pytest.fixture
def page(document, keys):
    with shown(document, keys) as created:
        yield created


@pytest.fixture(scope="module")
def shared_page(app, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("FORCELAB_SETTINGS", str(tmp_path_factory.mktemp("help") / "settings.ini"))
        document, keys = Document("Ada"), Keys()
    document.vocabulary = VOCABULARY
    with shown(document, keys) as created:
        yield created


@pytest.fixture
def unchanged(shared_page):
    """One page for all tests that only look at it, search in it and change its size."""
    yield shared_page
    shared_page.findChild(QLineEdit).clear()
    shared_page.resize(1200, 860)


def texts(page):
    return [label.text() for label in page.findChild(QScrollArea).widget().findChildren(QLabel)]


def search(page, text):
    page.findChild(QLineEdit).setText(text)
    return texts(page)


def test_every_action_key_and_gesture_is_on_the_page(unchanged, keys):
    found = texts(unchanged)
    for command in COMMANDS:
        if keys[command.id]:
            assert command.text.rstrip("…") in found
            for key in keys[command.id]:
                assert key in found, command.id
    for gesture, what in MOUSE_HELP:
        assert gesture in found
        assert what in found
    assert found[:5] == ["Actions of this task", "1", "grab", "2", "a < b & c"]
    for widget in (unchanged.findChild(QLineEdit), unchanged.findChild(QScrollArea)):
        assert widget.accessibleName()


def test_without_actions_there_is_no_section_of_them(keys, app):
    assert "Actions of this task" not in texts(HelpPage(Document("Ada"), keys))


def test_changed_keys_and_actions_are_shown_at_once(page, document, keys):
    keys.set_keys("play", ["F8"])
    found = texts(page)
    assert "F8" in found
    assert "Space" not in found
    document.vocabulary = Vocabulary().with_actions("slip")
    document.vocabulary_changed.emit()
    assert texts(page)[:3] == ["Actions of this task", "1", "slip"]


def test_searching_leaves_what_matches_in_name_key_or_heading(unchanged):
    assert search(unchanged, "undo") == ["Edit", "Ctrl+Z", "Undo"]
    assert search(unchanged, "ctrl+y") == ["Edit", "Ctrl+Shift+Z", "Ctrl+Y", "Redo"]
    assert search(unchanged, "overview") == [
        "Mouse",
        "Drag on the overview",
        "Show that stretch of time",
    ]
    assert "Play or pause" in search(unchanged, "playback")
    assert search(unchanged, "coder") == ["Labels", "Ctrl+L", "Label as another coder"]


def test_a_search_in_vain_says_so_in_plain_text(unchanged):
    assert search(unchanged, "<b>tea") == ["Nothing is called '<b>tea'."]
    QTest.qWait(1)
    inside = unchanged.findChild(QScrollArea).widget()
    (messages,) = inside.findChildren(QLabel)
    assert abs(messages.geometry().center().x() - inside.rect().center().x()) < 20
    assert len(search(unchanged, "")) > 100


def columns(page):
    page.grab()
    labels = page.findChild(QScrollArea).widget().findChildren(QLabel)
    headings = [label for label in labels if label.font().bold()]
    return len({label.mapTo(page, label.rect().topLeft()).x() for label in headings})


def test_there_are_as_many_columns_as_there_is_room(unchanged, app):
    widest = columns(unchanged)
    unchanged.resize(420, 600)
    app.processEvents()
    assert (widest, columns(unchanged)) == (3, 1)
    unchanged.resize(1200, 860)
    app.processEvents()
    assert columns(unchanged) == 3


@pytest.mark.parametrize("width", [420, 800, 1024, 1200])
def test_no_text_is_cut(unchanged, app, width):
    unchanged.resize(width, 700)
    app.processEvents()
    unchanged.grab()
    inside = unchanged.findChild(QScrollArea).widget()
    assert inside.width() <= unchanged.findChild(QScrollArea).viewport().width()
    for label in inside.findChildren(QLabel):
        needed = label.heightForWidth(label.width()) if label.wordWrap() else 0
        assert label.height() >= needed, label.text()
        assert label.wordWrap() or label.width() >= label.sizeHint().width(), label.text()


def test_one_scrolls_with_the_keys_while_searching(page):
    page.resize(600, 400)
    page.grab()
    bar = page.findChild(QScrollArea).verticalScrollBar()
    line = page.findChild(QLineEdit)
    QTest.keyClick(line, Qt.Key_PageDown)
    assert bar.value() == bar.pageStep() > 0
    QTest.keyClick(line, Qt.Key_Up)
    assert bar.value() < bar.pageStep()


def test_it_follows_the_theme(page, app):
    theme.use_theme(app, "dark")
    theme.apply_to_application(page)
    picture = page.grab().toImage()
    colours = {picture.pixelColor(20, y).name() for y in range(picture.height())}
    assert {theme.DARK.panel, theme.DARK.frame} <= colours
    theme.use_theme(app, "light")


def test_keys_that_desktops_take_stand_after_others():
    taken = {"Alt+Shift", "Ctrl+Alt"}
    commands = [row for row in COMMANDS if any(key.rsplit("+", 1)[0] in taken for key in row.keys)]
    assert len(commands) == 4
    for command in commands:
        assert command.keys[0].rsplit("+", 1)[0] == "Ctrl+Shift"
