"""The guide in a window of its own: contents and search at the left, a page at the right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import (
    QByteArray,
    QEvent,
    QModelIndex,
    QPersistentModelIndex,
    QRegularExpression,
    QSignalBlocker,
    QSize,
    Qt,
    QTimer,
    QUrl,
)
from PySide6.QtGui import (
    QBrush,
    QColor,
    QDesktopServices,
    QFont,
    QFontDatabase,
    QFontMetrics,
    QFontMetricsF,
    QHideEvent,
    QImage,
    QImageReader,
    QKeySequence,
    QPainter,
    QPalette,
    QResizeEvent,
    QShortcut,
    QTextBlock,
    QTextBlockFormat,
    QTextCharFormat,
    QTextCursor,
    QTextDocument,
    QTextFormat,
    QTextFragment,
    QTextFrameFormat,
    QTextImageFormat,
    QTextLength,
    QTextListFormat,
    QTextOption,
    QTextTable,
)
from PySide6.QtWidgets import (
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QSplitter,
    QStackedWidget,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTextBrowser,
    QTextEdit,
    QToolButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from forcelab.gui import settings, theme
from forcelab.gui.layout import (
    PageOrPlaceholder,
    fill_layout,
    page_layout,
    resize_on_screen,
    search_field,
    tool_button,
)
from forcelab.guide import Page, anchors, patterns, picture_folder, read_pages, search

#: What a picture is in a paragraph's text.
PICTURE = "\N{OBJECT REPLACEMENT CHARACTER}"
#: What Qt and GitHub both make of a page.
FEATURES = QTextDocument.MarkdownFeature.MarkdownDialectGitHub
#: Sizes of headings of each level, and of code, in sizes of the text.
HEADINGS, CODE = {1: 1.7, 2: 1.3, 3: 1.1}, 0.92
#: Code is made smaller, to this at least, if its lines fit then.
SMALLEST_CODE = 0.74
#: The longest line, in average characters; and the margin around a page, in pixels.
LINE, MARGIN = 116, 24
#: Milliseconds after a change of size until pictures have the new width.
RESIZE_MS = 80


def read_markdown(document: QTextDocument, page: Page) -> None:
    """Fill a document with a page; its headings get the anchors that links use."""
    document.setMarkdown(page.text, FEATURES)
    for table in document.rootFrame().childFrames():
        if isinstance(table, QTextTable):
            _mend_table(table)
    headings = [block for block in blocks(document) if block.blockFormat().headingLevel()]
    for block, name in zip(headings, anchors(b.text() for b in headings), strict=True):
        named = QTextCharFormat()
        named.setAnchor(True)
        named.setAnchorNames([name])
        _select(block).mergeCharFormat(named)


def _mend_table(table: QTextTable) -> None:
    """Undo what Qt's reader does to a table.

    It joins empty cells to the one before them, and behind code lays an empty line into the first.
    """
    for row in range(table.rows()):
        for column in range(table.columns()):
            if table.cellAt(row, column).columnSpan() > 1:
                table.splitCell(row, column, 1, 1)
    start, end = table.cellAt(0, 0).firstCursorPosition(), table.cellAt(0, 0).lastCursorPosition()
    if start.block() != end.block() and not start.block().text():
        start.deleteChar()


def blocks(document: QTextDocument) -> Iterator[QTextBlock]:
    """The paragraphs of a document, lines of code and cells of tables among them."""
    block = document.begin()
    while block.isValid():
        yield block
        block = block.next()


def fragments(block: QTextBlock) -> Iterator[QTextFragment]:
    """The pieces of a paragraph that look alike."""
    part = block.begin()
    while not part.atEnd():
        yield part.fragment()
        part += 1


def is_code(block: QTextBlock) -> bool:
    """Whether a paragraph is a line of a block of code."""
    return block.blockFormat().hasProperty(QTextFormat.Property.BlockCodeFence)


def starts_code(block: QTextBlock) -> bool:
    """Whether a line is the first one of its block of code: Qt does not tell two blocks apart."""
    prompt = block.text().startswith("$ ")
    return is_code(block) and (prompt or not is_code(block.previous()))


def _select(first: QTextBlock, last: QTextBlock | None = None) -> QTextCursor:
    """A cursor that selects the text of paragraphs."""
    cursor = QTextCursor(first)
    end = first if last is None else last
    cursor.setPosition(end.position() + end.length() - 1, QTextCursor.MoveMode.KeepAnchor)
    return cursor


def _embolden(block: QTextBlock) -> None:
    bold = QTextCharFormat()
    bold.setFontWeight(QFont.Weight.Bold)
    _select(block).mergeCharFormat(bold)


def _select_part(fragment: QTextFragment, block: QTextBlock) -> QTextCursor:
    """A cursor that selects a piece of a paragraph."""
    cursor = QTextCursor(block)
    cursor.setPosition(fragment.position())
    end = fragment.position() + fragment.length()
    cursor.setPosition(end, QTextCursor.MoveMode.KeepAnchor)
    return cursor


def picture_path(name: str, dark: bool) -> Path:
    """The file of a picture that a page shows, in the dark theme the dark one if there is one."""
    path = picture_folder().parent / name
    other = path.with_name(f"{path.stem}-dark{path.suffix}")
    return other if dark and other.is_file() else path


class _Styler:
    """Dresses a document that was read from Markdown, to which Qt gives the plainest looks."""

    def __init__(self, document: QTextDocument, font: QFont, width: int) -> None:
        """`width` is that of the text, in pixels, which no picture exceeds."""
        self._document, self._font, self._width = document, font, width
        self._colours = theme.colours()
        self._line = max(font.pointSizeF() * 1.6, 12.0)  # about a line's height, in pixels
        self._mono = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont).families()
        self._ground = QColor(self._colours.panel)

    def style(self) -> None:
        document = self._document
        document.setDocumentMargin(MARGIN)
        document.setIndentWidth(1.5 * self._line)
        code: list[tuple[QTextBlock, QTextBlock]] = []
        tables: dict[int, QTextTable] = {}
        for block in blocks(document):
            table = QTextCursor(block).currentTable()
            if is_code(block):
                code.append((block if starts_code(block) else code.pop()[0], block))
                continue
            if table:
                tables[table.objectIndex()] = table
            else:
                self._space(block)
            if (items := block.textList()) is not None:
                list_format = items.format()
                circles = list_format.style() == QTextListFormat.Style.ListCircle
                if circles and list_format.indent() == 1:
                    list_format.setStyle(QTextListFormat.Style.ListDisc)
                    items.setFormat(list_format)
            self._style_text(block)
        for table in tables.values():
            self._style_table(table)
        for first, last in reversed(code):  # from the end: a frame moves what is behind it
            self._frame_code(first, last)

    def _space(self, block: QTextBlock) -> None:
        """Give a paragraph or a heading the room around it."""
        level = block.blockFormat().headingLevel()
        room = QTextBlockFormat()
        if PICTURE not in block.text():  # or it would be the picture's height
            room.setLineHeight(125, QTextBlockFormat.LineHeightTypes.ProportionalHeight.value)
        room.setTopMargin((0 if block.position() == 0 else 1.3 * self._line) if level else 0)
        follows = block.textList() is not None and block.next().textList() is not None
        room.setBottomMargin(self._line * (0.3 if level or follows else 0.7))
        QTextCursor(block).mergeBlockFormat(room)
        for fragment in list(fragments(block)) if level else ():
            look = fragment.charFormat()
            look.clearProperty(QTextFormat.Property.FontSizeAdjustment)
            look.setFontPointSize(self._font.pointSizeF() * HEADINGS.get(level, 1.0))
            _select_part(fragment, block).setCharFormat(look)

    def _style_text(self, block: QTextBlock) -> None:
        """Colour links and code in a paragraph, and fit its pictures."""
        for fragment in list(fragments(block)):
            given, look = fragment.charFormat(), QTextCharFormat()
            if given.isImageFormat():
                self._fit_picture(block, fragment, given.toImageFormat())
                continue
            if given.fontFixedPitch():
                look.setFontFamilies(self._mono)
                look.setFontPointSize(self._font.pointSizeF() * CODE)
                look.setBackground(self._ground)
            if given.anchorHref():
                look.setForeground(QBrush(theme.palette(self._colours).link()))
                look.setFontUnderline(True)
            if look.propertyCount():
                _select_part(fragment, block).mergeCharFormat(look)

    def _fit_picture(
        self, block: QTextBlock, fragment: QTextFragment, given: QTextImageFormat
    ) -> None:
        """Give a picture its size: no wider than the text, and not read before it is seen."""
        size = QImageReader(str(picture_path(given.name(), self._colours.dark))).size()
        if not size.isValid():
            return
        width = min(size.width(), self._width)
        given.setWidth(width)
        given.setHeight(round(size.height() * width / size.width()))
        _select_part(fragment, block).setCharFormat(given)

    def _frame_code(self, first: QTextBlock, last: QTextBlock) -> None:
        """Frame a block of code, in letters so small that its lines fit, or go on below."""
        code = _select(first, last)
        look = QTextCharFormat()
        look.setFontFamilies(self._mono)
        font = QFont(self._mono)
        font.setPointSizeF(self._font.pointSizeF())
        lines = code.selectedText().split("\u2029")
        widest = max(map(QFontMetricsF(font).horizontalAdvance, lines))
        fitting = (self._width - 2.2 * self._line) / max(widest, 1.0)
        share = min(CODE, fitting) if fitting >= SMALLEST_CODE else CODE
        look.setFontPointSize(self._font.pointSizeF() * share)
        code.mergeCharFormat(look)
        wrapping = QTextBlockFormat()
        wrapping.setNonBreakableLines(False)
        wrapping.setLeftMargin(self._line)
        wrapping.setTextIndent(-self._line)
        code.mergeBlockFormat(wrapping)
        if first.text().startswith("$ "):
            _embolden(first)
        frame = QTextFrameFormat()
        frame.setBackground(self._ground)
        self._add_border(frame)
        frame.setPadding(0.5 * self._line)
        frame.setBottomMargin(0.7 * self._line)
        framed = code.insertFrame(frame)
        flat = QTextBlockFormat()  # Qt lays an empty paragraph around it
        flat.setLineHeight(1, QTextBlockFormat.LineHeightTypes.FixedHeight.value)
        for position in (framed.firstPosition() - 1, framed.lastPosition() + 1):
            block = self._document.findBlock(position)
            if not block.text():
                QTextCursor(block).setBlockFormat(flat)

    def _style_table(self, table: QTextTable) -> None:
        table_format = table.format()
        self._add_border(table_format)
        table_format.setBorderCollapse(True)
        table_format.setCellPadding(0.35 * self._line)
        table_format.setCellSpacing(0)
        table_format.setHeaderRowCount(1)
        table_format.setTopMargin(0.2 * self._line)
        table_format.setBottomMargin(0.9 * self._line)
        table_format.setWidth(QTextLength())
        table.setFormat(table_format)
        for column in range(table.columns()):
            cell = table.cellAt(0, column)
            ground = cell.format()
            ground.setBackground(self._ground)
            cell.setFormat(ground)
            _embolden(cell.firstCursorPosition().block())

    def _add_border(self, frame: QTextFrameFormat) -> None:
        frame.setBorder(1)
        frame.setBorderStyle(QTextFrameFormat.BorderStyle.BorderStyle_Solid)
        frame.setBorderBrush(QColor(self._colours.panel_edge))


class PageView(QTextBrowser):
    """Shows a page in the theme's colours; pictures are read when they are seen."""

    def __init__(self) -> None:
        super().__init__()
        self.setOpenLinks(False)
        self.setAccessibleName("Page of the guide")
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)  # the width stays
        self.setFrameShape(QTextBrowser.Shape.NoFrame)
        self.setWordWrapMode(QTextOption.WrapMode.WordWrap)
        self._page: Page | None = None
        self._words = ""  # that are marked
        self._dressed_for: tuple[object, ...] = ()  # page, width, font and theme
        self._resized = QTimer(self, singleShot=True, interval=RESIZE_MS)
        self._resized.timeout.connect(self.dress)
        theme.themes().changed.connect(self._resized.start)

    def show_page(self, page: Page) -> None:
        self._page = page
        self.verticalScrollBar().setValue(0)
        self.dress()

    def dress(self) -> None:
        """Show the page as theme, text size and width ask for, without leaving its place."""
        wide = self.fontMetrics().averageCharWidth() * LINE
        width = min(self.viewport().width(), wide + 2 * MARGIN)
        dressed_for = (self._page, width, self.font().toString(), theme.colours())
        if self._page is None or dressed_for == self._dressed_for:
            return
        self._dressed_for = dressed_for
        top = self.cursorForPosition(self.viewport().rect().topLeft()).blockNumber()
        above = self.verticalScrollBar().value() > 0
        document = QTextDocument(self)
        document.setUndoRedoEnabled(False)
        document.setDefaultFont(self.font())
        read_markdown(document, self._page)
        _Styler(document, self.font(), width - 2 * MARGIN).style()
        self.setLineWrapMode(QTextEdit.LineWrapMode.FixedPixelWidth)
        self.setLineWrapColumnOrWidth(width)
        self.setDocument(document)  # which deletes the one before
        if above:
            block = document.findBlockByNumber(top)
            box = document.documentLayout().blockBoundingRect(block)
            self.verticalScrollBar().setValue(round(box.top()))
        self.mark_words(self._words)

    def mark_words(self, query: str) -> None:
        """Mark where the words that were searched for are."""
        self._words = query
        found: list[QTextEdit.ExtraSelection] = []
        ground = QColor(theme.colours().warning)
        ground.setAlphaF(0.3)
        for word in patterns(query):
            pattern = QRegularExpression(word)
            pattern.setPatternOptions(QRegularExpression.PatternOption.CaseInsensitiveOption)
            cursor = self.document().find(pattern)
            while not cursor.isNull():
                mark = QTextEdit.ExtraSelection()
                mark.cursor = cursor
                mark.format.setBackground(ground)
                found.append(mark)
                cursor = self.document().find(pattern, cursor)
        self.setExtraSelections(found)

    def loadResource(self, kind: int, url: QUrl | str) -> object:
        """Read a picture as large as it is drawn: Qt would not smooth it."""
        if kind != QTextDocument.ResourceType.ImageResource.value:
            return None
        path = picture_path(QUrl(url).toString(), theme.colours().dark)
        image, ratio = QImage(str(path)), self.devicePixelRatioF()
        size, width = image.size(), self.lineWrapColumnOrWidth() - 2 * MARGIN
        if width < size.width():
            height = round(size.height() * width / size.width())
            drawn = QSize(round(width * ratio), round(height * ratio)).boundedTo(size)
            smooth = Qt.TransformationMode.SmoothTransformation
            return image.scaled(drawn, mode=smooth)
        return image

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._resized.start()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._resized.start()


@dataclass
class _Visit:
    """A place that was read, to come back to."""

    page: str
    anchor: str = ""
    scrolled: int = -1  # pixels; below 0 the anchor counts


#: What items of contents and search lead to, and the line in which something was found.
PLACE, EXCERPT = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1


class _ResultPainter(QStyledItemDelegate):
    """Paints what was found: the heading, and below it two lines of the text."""

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        self.initStyleOption(option, index)
        style = option.widget.style()
        style.drawPrimitive(QStyle.PrimitiveElement.PE_PanelItemViewItem, option, painter)
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        ink, muted = QPalette.ColorRole.Text, QPalette.ColorRole.PlaceholderText
        if chosen:
            ink = muted = QPalette.ColorRole.HighlightedText
        room = option.rect.adjusted(8, 4, -8, -4)
        bold = QFont(option.font)
        bold.setBold(True)
        metrics = QFontMetrics(bold)
        title = metrics.elidedText(option.text, Qt.TextElideMode.ElideRight, room.width())
        painter.save()
        painter.setFont(bold)
        painter.setPen(option.palette.color(ink))
        painter.drawText(room, Qt.AlignmentFlag.AlignTop, title)
        painter.setFont(option.font)
        painter.setPen(option.palette.color(muted))
        below = room.adjusted(0, metrics.height(), 0, 0)
        below.setHeight(2 * option.fontMetrics.height())
        # The rest of the first line stays empty where its next word does not fit.
        two_lines = 2 * room.width() - option.fontMetrics.averageCharWidth() * 8
        excerpt = option.fontMetrics.elidedText(
            index.data(EXCERPT), Qt.TextElideMode.ElideRight, two_lines
        )
        painter.drawText(below, Qt.TextFlag.TextWordWrap, excerpt)
        painter.restore()

    def sizeHint(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> QSize:
        return QSize(0, 3 * option.fontMetrics.height() + 10)


class _EntryPainter(QStyledItemDelegate):
    """Paints the contents, with some room between the lines."""

    def sizeHint(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> QSize:
        return QSize(0, round(1.5 * option.fontMetrics.height()))


class GuideWindow(QWidget):
    """The guide, which stays open beside the window.

    Unless `remembering`, size and place are neither used nor stored.
    """

    def __init__(self, parent: QWidget | None = None, *, remembering: bool = True) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.setObjectName("guide")
        self._remembering = remembering
        self._pages = {page.name: page for page in read_pages()}
        self._entries: dict[str, QTreeWidgetItem] = {}  # of the contents, by what they lead to
        self._visits: list[_Visit] = []
        self._at = -1
        self.view = PageView()
        self.view.anchorClicked.connect(self._follow)
        self.search = search_field("Search the guide", "Search the guide")
        self.search.textChanged.connect(self._search)
        self.search.returnPressed.connect(self._open_first)
        down = QShortcut(QKeySequence(Qt.Key.Key_Down), self.search, self._open_first)
        down.setContext(Qt.ShortcutContext.WidgetShortcut)
        self.contents, self.results = QTreeWidget(), QListWidget()
        self.back, self.forward = (
            self._step_button("back", "Back", QKeySequence.StandardKey.Back, -1),
            self._step_button("forward", "Forward", QKeySequence.StandardKey.Forward, 1),
        )
        self._lists = QStackedWidget()
        self._found = PageOrPlaceholder(self.results)
        self._lists.addWidget(self._fill_contents())
        self._lists.addWidget(self._found)
        self._make_results()
        self._splitter = QSplitter()
        self._splitter.addWidget(self._side())
        self._splitter.addWidget(self.view)
        self._splitter.setStretchFactor(1, 1)
        self._splitter.setCollapsible(1, False)
        page_layout(self, self._splitter)
        for keys, act in (
            (QKeySequence.StandardKey.Find, self._focus_search),
            (QKeySequence.StandardKey.Cancel, self._leave),
        ):
            QShortcut(QKeySequence(keys), self, act)
        theme.themes().changed.connect(self._dress)
        self._restore()
        self.view.setFocus()

    def sizeHint(self) -> QSize:
        metrics = self.fontMetrics()
        return QSize(metrics.averageCharWidth() * 150, metrics.lineSpacing() * 46)

    def open(self, place: str) -> None:
        """Show a page, such as ``"label"``, or a heading of it, such as ``"label#keys"``."""
        name, _, anchor = place.partition("#")
        if self._at >= 0:
            self._visits[self._at].scrolled = self.view.verticalScrollBar().value()
            if (self._visits[self._at].page, self._visits[self._at].anchor) == (name, anchor):
                self._at -= 1
        del self._visits[self._at + 1 :]
        self._visits.append(_Visit(name, anchor))
        self._go(len(self._visits) - 1)

    def belong_to(self, window: QWidget, *_: object) -> None:
        """Stay above this window, and usable while it is modal."""
        own = self.windowHandle()
        if own is not None and window.windowHandle() is not None:
            own.setTransientParent(window.windowHandle())

    @property
    def place(self) -> str:
        """The page that is shown, with the heading that was asked for."""
        visit = self._visits[self._at]
        return f"{visit.page}#{visit.anchor}" if visit.anchor else visit.page

    # What it is made of

    def _step_button(
        self, name: str, text: str, keys: QKeySequence.StandardKey, step: int
    ) -> QToolButton:
        def press() -> None:
            self._step(step)

        key = QKeySequence(keys)
        QShortcut(key, self, press)
        tip = f"{text} ({key.toString(QKeySequence.SequenceFormat.NativeText)})"
        return tool_button(name, text, press, tip)

    def _side(self) -> QWidget:
        """Back, forward, the search, and below them the contents or what was found."""
        side = QWidget()
        across = fill_layout(QHBoxLayout(), self.back, self.forward, self.search, spacing=2)
        fill_layout(QVBoxLayout(side), across, (self._lists, 1), margins=(8, 8, 4, 8))
        return side

    def _fill_contents(self) -> QTreeWidget:
        """List the pages and their headings."""
        tree = self.contents
        tree.setHeaderHidden(True)
        tree.setIndentation(14)
        tree.setItemDelegate(_EntryPainter(tree))
        tree.setAccessibleName("Contents")
        tree.setFrameShape(QTreeWidget.Shape.NoFrame)
        _make_clear(tree)

        def entry(title: str, place: str) -> QTreeWidgetItem:
            item = self._entries[place] = QTreeWidgetItem([title])
            item.setData(0, PLACE, place)
            item.setToolTip(0, title)
            return item

        for page in self._pages.values():
            item = entry(page.title, page.name)
            for section in page.sections[1:]:
                if section.level == 2:
                    item.addChild(entry(section.title, f"{page.name}#{section.anchor}"))
            tree.addTopLevelItem(item)
        tree.currentItemChanged.connect(self._open_entry)
        return tree

    def _make_results(self) -> None:
        self.results.setAccessibleName("Found in the guide")
        self.results.setItemDelegate(_ResultPainter(self.results))
        self.results.setUniformItemSizes(True)
        self.results.setFrameShape(QListWidget.Shape.NoFrame)
        self.results.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        _make_clear(self.results)
        self.results.currentItemChanged.connect(self._open_result)

    # What it does

    def _go(self, index: int) -> None:
        """Show a visited place."""
        self._at = index
        visit = self._visits[index]
        page = self._pages[visit.page]
        self.view.show_page(page)
        self.view.mark_words(self.search.text())
        if visit.scrolled >= 0:
            self.view.verticalScrollBar().setValue(visit.scrolled)
        elif visit.anchor:
            self.view.scrollToAnchor(visit.anchor)
        self.setWindowTitle(f"{page.title} – User guide")
        self.back.setEnabled(index > 0)
        self.forward.setEnabled(index + 1 < len(self._visits))
        self._choose_in_contents(self.place)

    def _step(self, step: int) -> None:
        """Go back or forward."""
        if 0 <= self._at + step < len(self._visits):
            self._visits[self._at].scrolled = self.view.verticalScrollBar().value()
            self._go(self._at + step)

    def _follow(self, link: QUrl) -> None:
        """Go where a link of the page leads; an address in the web is opened by the system."""
        if link.scheme():
            QDesktopServices.openUrl(link)
            return
        name = link.path().removesuffix(".md") or self._visits[self._at].page
        self.open(f"{name}#{link.fragment()}" if link.fragment() else name)

    def _choose_in_contents(self, place: str) -> None:
        """Select the page in the contents, and unfold its headings only."""
        name = place.partition("#")[0]
        with QSignalBlocker(self.contents):
            for page in self._pages:
                self._entries[page].setExpanded(page == name)
            if chosen := self._entries.get(place) or self._entries.get(name):
                self.contents.setCurrentItem(chosen)

    def _open_entry(self, item: QTreeWidgetItem | None) -> None:
        if item is not None:
            self.open(item.data(0, PLACE))

    def _search(self, query: str) -> None:
        """List the sections that contain the words; without any, the contents again."""
        self._lists.setCurrentIndex(1 if query.strip() else 0)
        with QSignalBlocker(self.results):
            self.results.clear()
            for match in search(tuple(self._pages.values()), query):
                section = match.section
                page = self._pages[section.page].title
                title = page if section.level == 1 else f"{section.title} · {page}"
                item = QListWidgetItem(title)
                item.setData(EXCERPT, match.excerpt)
                item.setData(Qt.ItemDataRole.AccessibleTextRole, f"{title}: {match.excerpt}")
                anchor = "" if section.level == 1 else f"#{section.anchor}"
                item.setData(PLACE, f"{section.page}{anchor}")
                self.results.addItem(item)
        found = self.results.count() > 0
        self._found.say("" if found else f"The guide says nothing about '{query.strip()}'.")
        self.view.mark_words(query)

    def _open_result(self, item: QListWidgetItem | None) -> None:
        if item is not None:
            self.open(item.data(PLACE))

    def _open_first(self) -> None:
        """Open what was found first, and go on in the list with the keys."""
        if self.results.count() and self._lists.currentIndex() == 1:
            self.results.setCurrentRow(0)
            self.results.setFocus()

    def _focus_search(self) -> None:
        self.search.setFocus()
        self.search.selectAll()

    def _leave(self) -> None:
        """Leave the search, else close."""
        if self.search.text():
            self.search.clear()
            self.contents.setFocus()
        else:
            self.close()

    def _dress(self) -> None:
        if self.parentWidget() is None:
            theme.apply_to_application(self)

    def _restore(self) -> None:
        """Have size and place of the last time, else what suits the text."""
        resize_on_screen(self, self.sizeHint())
        side = self.fontMetrics().averageCharWidth() * 40
        self._splitter.setSizes([side, self.width() - side])
        if not self._remembering:
            return
        if geometry := settings.data("guide/geometry"):
            self.restoreGeometry(QByteArray(geometry))
        if state := settings.data("guide/splitter"):
            self._splitter.restoreState(QByteArray(state))

    def hideEvent(self, event: QHideEvent) -> None:
        """Remember size and place; a window that belongs to another one is hidden with it."""
        super().hideEvent(event)
        if self._remembering and not event.spontaneous():
            settings.store("guide/geometry", bytes(self.saveGeometry().data()))
            settings.store("guide/splitter", bytes(self._splitter.saveState().data()))


def _make_clear(view: QTreeWidget | QListWidget) -> None:
    """Let a list stand on the window's ground."""
    palette = view.palette()
    palette.setBrush(QPalette.ColorRole.Base, palette.brush(QPalette.ColorRole.Window))
    view.setPalette(palette)
