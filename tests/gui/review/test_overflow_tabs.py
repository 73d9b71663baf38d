"""Tabs that have no room stand in a menu; none is cut."""

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QWidget

from forcelab.gui.key_events import is_reserved_key
from forcelab.gui.widgets import OverflowTabs

#: As in the review, without the longest.
TITLES = ("Queue", "Confusion", "Scores", "Why", "Proposals", "Coders", "Training")


@pytest.fixture
def tabs(app, show):
    tabs = OverflowTabs()
    for title in TITLES:
        tabs.addTab(QWidget(), title)
    show(tabs, 1000, 100)
    app.processEvents()
    return tabs


def visible_titles(tabs):
    return [tabs.tabText(at) for at in range(tabs.count()) if tabs.isTabVisible(at)]


def offered(tabs):
    tabs.overflow_button.menu().aboutToShow.emit()
    return {action.text(): action for action in tabs.overflow_button.menu().actions()}


def test_where_all_have_room_there_is_no_menu(tabs):
    assert visible_titles(tabs) == list(TITLES)
    assert tabs.overflow_button.isHidden()


@pytest.mark.parametrize("width", [260, 340, 420])
def test_where_not_all_have_room_whole_ones_are_seen_and_the_others_offered(tabs, app, width):
    tabs.resize(width, 100)
    app.processEvents()
    shown = visible_titles(tabs)
    assert shown == list(TITLES[: len(shown)])
    assert 1 < len(shown) < len(TITLES)
    assert sorted((*shown, *offered(tabs))) == sorted(TITLES)
    for at in range(len(shown)):
        box = tabs.tabBar().tabRect(at)
        assert box.left() >= 0
        assert box.right() < tabs.overflow_button.x()


def test_what_is_chosen_in_the_menu_is_in_front_and_seen_whole(tabs, app):
    tabs.resize(260, 100)
    app.processEvents()
    for title in ("Training", "Coders", "Queue", "Training"):
        if title not in visible_titles(tabs):
            offered(tabs)[title].trigger()
        else:
            tabs.setCurrentIndex(TITLES.index(title))
        app.processEvents()
        assert tabs.tabText(tabs.currentIndex()) == title
        boxes = [tabs.tabBar().tabRect(TITLES.index(name)) for name in visible_titles(tabs)]
        assert boxes[0].left() == 0
        assert boxes[-1].right() < tabs.overflow_button.x()
        assert visible_titles(tabs)[0] == "Queue"  # nothing is scrolled away
    tabs.resize(1000, 100)
    app.processEvents()
    assert visible_titles(tabs) == list(TITLES)


def test_arrows_go_to_either_end_of_the_tabs_with_and_without_room(tabs, app):
    tabs.resize(260, 100)
    app.processEvents()
    bar = tabs.tabBar()
    for key, end in ((Qt.Key.Key_Right, len(TITLES) - 1), (Qt.Key.Key_Left, 0)):
        before = tabs.currentIndex()
        event = QKeyEvent(QEvent.Type.KeyPress, key, Qt.KeyboardModifier.NoModifier)
        assert is_reserved_key(bar, event)  # else it is the window's, and moves the cursor
        reached = []
        for _ in TITLES:
            QTest.keyClick(bar, key)
            reached.append(tabs.currentIndex())
            assert tabs.isTabVisible(tabs.currentIndex())
        assert sorted({before, *reached}) == list(range(len(TITLES)))
        assert reached[-2:] == [end, end]


@pytest.mark.parametrize(("key", "step"), [(Qt.Key.Key_Tab, 1), (Qt.Key.Key_Backtab, -1)])
def test_keys_go_through_all_tabs_with_and_without_room(tabs, app, key, step):
    tabs.resize(260, 100)
    app.processEvents()
    reached = []
    for _ in TITLES:
        QTest.keyClick(tabs, key, Qt.KeyboardModifier.ControlModifier)
        reached.append(tabs.currentIndex())
        assert tabs.isTabVisible(tabs.currentIndex())
    assert reached == [(step * i) % len(TITLES) for i in range(1, len(TITLES) + 1)]
