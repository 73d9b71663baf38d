"""The guide's window, and which page F1 opens where."""

import re
from pathlib import Path

import pytest
from factories import cached_project, make_painted_project
from PySide6.QtCore import QPoint, Qt, QUrl
from PySide6.QtGui import QDesktopServices, QTextDocument
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from window_helpers import answer_dialog, pixels

import forcelab.gui
from forcelab.gui import guide as guide_module
from forcelab.gui import theme
from forcelab.gui.export_dialog import ExportDialog
from forcelab.gui.guide import GuideWindow, blocks, fragments, read_markdown
from forcelab.gui.guide_pages import PAGES
from forcelab.gui.preferences_dialog import PreferencesDialog
from forcelab.guide import CONTENTS, Page, read_pages

WORDS = "Words that fill the page.\n\n" * 60
LABEL = f"""# Label
![the window](pictures/window.png)

```console
$ forcelab list
{"wide " * 30}
```

| key | does |
|---|---|
| F7 | shows a video |

{WORDS}## The keys
A late video.

{WORDS}"""
PAGES_SHOWN = (
    Page(
        "index", "# The guide\nTo [a key](label.md#the-keys) or [the web](https://example.org).\n"
    ),
    Page("label", LABEL),
)


@pytest.fixture
def guide(app, monkeypatch):
    monkeypatch.setattr(guide_module, "read_pages", lambda: PAGES_SHOWN)
    window = GuideWindow()
    window.resize(800, 500)
    window.show()
    window.open("index")
    assert QTest.qWaitForWindowActive(window)
    yield window
    window.close()
    window.deleteLater()


def click(guide, text):
    """Click a link of the page."""
    cursor = guide.view.document().find(text)
    guide.view.setFocus()
    spot = guide.view.cursorRect(cursor).center() - QPoint(4, 0)
    QTest.mouseClick(guide.view.viewport(), Qt.MouseButton.LeftButton, pos=spot)


def test_links_lead_to_headings_and_back_leads_to_where_one_was(guide):
    assert guide.windowTitle() == "The guide – User guide"
    click(guide, "key")
    assert guide.place == "label#the-keys"
    assert guide.contents.currentItem().text(0) == "The keys"
    scrolled = guide.view.verticalScrollBar().value()
    heading = guide.view.cursorRect(guide.view.document().find("The keys"))
    assert scrolled > 500
    assert 0 <= heading.top() < 60
    QTest.keyClick(guide, Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier)
    assert guide.place == "index"
    assert not guide.back.isEnabled()
    guide.forward.click()
    assert (guide.place, guide.view.verticalScrollBar().value()) == ("label#the-keys", scrolled)


def test_an_address_in_the_web_is_opened_by_the_system(guide, monkeypatch):
    opened = []
    monkeypatch.setattr(QDesktopServices, "openUrl", opened.append)
    click(guide, "web")
    assert opened == [QUrl("https://example.org")]
    assert guide.place == "index"


def test_the_contents_name_pages_and_their_headings(guide):
    (chosen,) = guide.contents.selectedItems()
    assert chosen.text(0) == "The guide"
    label = guide.contents.topLevelItem(1)
    assert [label.text(0), label.child(0).text(0)] == ["Label", "The keys"]
    guide.contents.setCurrentItem(label)
    assert guide.place == "label"
    assert label.isExpanded()


def test_the_search_finds_sections_and_marks_the_words(guide):
    QTest.keyClick(guide, Qt.Key.Key_F, Qt.KeyboardModifier.ControlModifier)
    assert guide.search.hasFocus()
    QTest.keyClicks(guide.search, "is a late video")
    first = guide.results.item(0)
    assert (first.text(), first.data(guide_module.EXCERPT)) == ("The keys · Label", "A late video.")
    QTest.keyClick(guide.search, Qt.Key.Key_Return)
    assert guide.place == "label#the-keys"
    marked = sorted(mark.cursor.selectedText() for mark in guide.view.extraSelections())
    assert marked == ["late", "video", "video"]
    guide.search.setText("tea")
    assert "The guide says nothing about 'tea'." in guide._found.note.text()
    QTest.keyClick(guide, Qt.Key.Key_Escape)
    assert guide.search.text() == ""
    assert guide.contents.isVisible()
    assert guide.view.extraSelections() == []
    QTest.keyClick(guide, Qt.Key.Key_Escape)
    assert not guide.isVisible()


def pictures(guide):
    for block in blocks(guide.view.document()):
        for fragment in fragments(block):
            if fragment.charFormat().isImageFormat():
                yield fragment.charFormat().toImageFormat()


def test_nothing_is_wider_than_the_page(guide, until):
    guide.open("label")
    guide.resize(500, 500)
    until(lambda: not guide.view._resized.isActive())
    (picture,) = pictures(guide)
    width = guide.view.viewport().width()
    assert 0 < picture.width() < width
    assert picture.height() == pytest.approx(picture.width() * 800 / 1280, abs=1)
    assert guide.view.horizontalScrollBar().maximum() == 0
    image = guide.view.loadResource(QTextDocument.ResourceType.ImageResource.value, picture.name())
    assert image.width() == round(picture.width() * guide.view.devicePixelRatioF())


def test_in_the_dark_theme_ground_and_pictures_are_dark(app, guide, until):
    guide.open("label")
    theme.use_theme(app, "light")
    until(lambda: not guide.view._resized.isActive())
    light = guide.grab().toImage()
    theme.use_theme(app, "dark")
    until(lambda: not guide.view._resized.isActive())
    dark = guide.grab().toImage()
    theme.use_theme(app, "light")
    assert pixels(light)[:, 300:].mean() > 180
    assert pixels(dark)[:, 300:].mean() < 75


def test_the_text_grows_with_the_text_size_and_keeps_its_place_and_marks(app, guide, until):
    theme.apply_to_application(guide)
    guide.search.setText("late")
    guide.open("label#the-keys")
    before = guide.view.document().defaultFont().pointSizeF()
    theme.use_text_size(app, 150)
    until(lambda: guide.view.document().defaultFont().pointSizeF() > 1.4 * before)
    theme.use_text_size(app, 100)
    heading = guide.view.cursorRect(guide.view.document().find("The keys"))
    assert 0 <= heading.top() < 60
    assert [mark.cursor.selectedText() for mark in guide.view.extraSelections()] == ["late"]


def test_the_cells_of_a_table_are_those_of_the_page(app):
    text = "```\nx\n```\n\n| key | does | more |\n|---|---|---|\n| a | b | c |\n| d | | |\n"
    document = QTextDocument()
    read_markdown(document, Page("label", text))
    cells = [block.text() for block in blocks(document)][1:10]
    assert cells == ["key", "does", "more", "a", "b", "c", "d", "", ""]


def test_size_and_place_are_remembered(app, guide):
    guide.resize(640, 480)
    guide.close()
    again = GuideWindow()
    assert (again.width(), again.height()) == (640, 480)
    again.deleteLater()


@pytest.mark.parametrize("page", read_pages(), ids=lambda page: page.name)
def test_qt_reads_the_headings_that_links_name(app, page):
    document = QTextDocument()
    read_markdown(document, page)
    named = [
        name
        for block in blocks(document)
        if block.blockFormat().headingLevel()
        for name in {n for part in fragments(block) for n in part.charFormat().anchorNames()}
    ]
    assert named == [section.anchor for section in page.sections]


def test_every_view_with_a_page_exists_and_its_page_does():
    room = Path(forcelab.gui.__file__).parent
    source = "\n".join(path.read_text("utf-8") for path in room.rglob("*.py"))
    known = {page.name: [s.anchor for s in page.sections] for page in read_pages()}
    for view, place in PAGES.items():
        assert re.search(rf"^class {view}\(", source, re.M), view
        name, _, anchor = place.partition("#")
        assert name in CONTENTS
        assert not anchor or anchor in known[name], place


def test_f1_opens_the_page_of_what_is_in_front(windows, until, tmp_path):
    """In the workspaces, in dialogs beside the window, and in those it waits for."""

    def f1(window, owner=None):
        """Press F1 where the keyboard is in a window; gives the place that the guide shows."""
        window.activateWindow()
        until(lambda: QApplication.activeWindow() is window)
        QTest.keyClick(window.focusWidget() or window, Qt.Key.Key_F1)
        return (owner or window).findChild(GuideWindow).place

    window = windows()
    assert f1(window) == "index"
    window.opening.open(cached_project(make_painted_project, tmp_path / "a.forcelab", (), 2.0))
    assert f1(window) == PAGES["LabelWorkspace"]
    window.show_workspace("review")
    assert f1(window) == PAGES["ReviewTab"]
    window.show_workspace("tradeoff")
    window.review.workspace.lists.tabBar().setFocus()
    assert f1(window) == PAGES["TradeoffView"]
    window.show_workspace("capture")
    assert f1(window) == PAGES["CaptureTab"]
    window.commands["preferences"].trigger()
    dialog = window.findChild(PreferencesDialog)
    assert f1(dialog, window) == PAGES["PreferencesDialog"]
    dialog.close()
    window.activateWindow()

    def use(dialog):
        assert f1(dialog, window) == PAGES["ExportDialog"]
        guide = window.findChild(GuideWindow)
        guide.open("index")
        # As the platform sends it: what a modal dialog shuts out never gets it.
        QTest.mouseClick(
            guide.windowHandle(),
            Qt.MouseButton.LeftButton,
            pos=guide.back.mapTo(guide, guide.back.rect().center()),
        )
        assert guide.place == PAGES["ExportDialog"]

    answer_dialog(window, ExportDialog, window.commands["export_labels"].trigger, use)
    guide = window.findChild(GuideWindow)
    assert guide.isVisible()
    assert guide.windowHandle().transientParent() is window.windowHandle()
    window.close()
    assert not guide.isVisible()
