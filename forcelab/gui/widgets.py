"""Widgets that Qt lacks: elided labels and combo boxes, tabs that fit, labels of calm width."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent, QPalette, QResizeEvent
from PySide6.QtWidgets import (
    QComboBox,
    QLabel,
    QMenu,
    QSizePolicy,
    QStyle,
    QStyleOptionComboBox,
    QStylePainter,
    QTabBar,
    QTabWidget,
    QToolButton,
    QWidget,
)

from forcelab.gui.icons import icon


class CalmLabel(QLabel):
    """A text of several lines whose changes leave the width alone."""

    def __init__(self) -> None:
        super().__init__()
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)

    def say(self, text: str, ink: str) -> None:
        """Show a text in a colour of the theme; hide the label if it is empty."""
        palette = self.palette()
        if palette.color(QPalette.ColorRole.WindowText) != QColor(ink):
            palette.setColor(QPalette.ColorRole.WindowText, QColor(ink))
            self.setPalette(palette)
        show_text(self, text)


def show_text(label: QLabel | QToolButton, text: str) -> None:
    """Show a text; hide its label or button if it is empty."""
    if label.text() != text:
        label.setText(text)
        label.setAccessibleName(text)
    if label.isHidden() == bool(text):
        label.setVisible(bool(text))


#: The arrows with their steps of rows and columns, and what opens what they have come to.
ARROW_STEPS = {
    Qt.Key.Key_Left: (0, -1),
    Qt.Key.Key_Right: (0, 1),
    Qt.Key.Key_Up: (-1, 0),
    Qt.Key.Key_Down: (1, 0),
}
ENTER_KEYS = (Qt.Key.Key_Return, Qt.Key.Key_Enter)


def is_plain(event: QKeyEvent) -> bool:
    """Whether a key is pressed without Ctrl, Alt or Shift; arrows may be the keypad's."""
    return not event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier


class ElidedLabel(QWidget):
    """Shows the whole text, or the short one, or what fits of that; the tooltip has the whole."""

    def __init__(self) -> None:
        super().__init__()
        self.text = self.short = ""
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)

    def set_text(self, text: str, short: str = "") -> None:
        short = short or text
        if (text, short) == (self.text, self.short):
            return
        self.text, self.short = text, short
        self.setToolTip(text)
        self.setAccessibleDescription(text)
        self.updateGeometry()
        self.update()

    @property
    def long_width(self) -> int:
        """Pixels that the whole text needs."""
        return self.fontMetrics().horizontalAdvance(self.text) + 4

    @property
    def short_width(self) -> int:
        """Pixels that the short text needs."""
        return self.fontMetrics().horizontalAdvance(self.short) + 4

    def sizeHint(self) -> QSize:
        """The whole text."""
        return QSize(self.long_width, self.fontMetrics().height() + 4)

    def minimumSizeHint(self) -> QSize:
        """The short text, or less."""
        line = self.fontMetrics().height()
        return QSize(min(self.short_width, 4 * line), line + 4)

    def paintEvent(self, event: QPaintEvent) -> None:
        with QPainter(self) as painter:
            painter.setPen(self.palette().color(self.foregroundRole()))
            shown = self.text if self.long_width <= self.width() else self.short
            shown = self.fontMetrics().elidedText(shown, Qt.TextElideMode.ElideRight, self.width())
            painter.drawText(
                self.rect(), Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, shown
            )


#: Characters that are always seen.
NAME_CHARACTERS = 12


class ElidedComboBox(QComboBox):
    """A combo box for a row with little room."""

    #: Where its text is cut.
    elide_mode: ClassVar = Qt.TextElideMode.ElideRight

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(NAME_CHARACTERS)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Fixed)

    def set_name(self, name: str) -> None:
        """Name the choice, for the eye and for a screen reader."""
        self.setAccessibleName(name)
        self.setToolTip(name)

    def widen_list(self) -> None:
        """Make the list that opens wide enough for all of its texts."""
        texts = (self.itemText(i) for i in range(self.count()))
        widest = max(map(self.fontMetrics().horizontalAdvance, texts), default=0)
        self.view().setMinimumWidth(widest + 2 * self.fontMetrics().height())

    @property
    def shown_text(self) -> str:
        """The current text as far as it fits."""
        return self._style_option().currentText

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the text elided; Qt just cuts it."""
        painter, option = QStylePainter(self), self._style_option()
        painter.drawComplexControl(QStyle.ComplexControl.CC_ComboBox, option)
        painter.drawControl(QStyle.ControlElement.CE_ComboBoxLabel, option)

    def _style_option(self) -> QStyleOptionComboBox:
        option = QStyleOptionComboBox()
        self.initStyleOption(option)
        field = self.style().subControlRect(
            QStyle.ComplexControl.CC_ComboBox, option, QStyle.SubControl.SC_ComboBoxEditField, self
        )
        text = option.currentText or self.placeholderText()
        room = field.width() - 2  # which the style leaves before the text
        option.currentText = self.fontMetrics().elidedText(text, self.elide_mode, room)
        return option


class _OverflowTabBar(QTabBar):
    """While it has the keyboard, arrows go through all tabs; Qt stops at hidden ones."""

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of these arrows, which are the window's too."""
        return event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right) and is_plain(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Bring the next tab to the front."""
        tabs = self.parentWidget()
        if not self.keeps(event) or not isinstance(tabs, QTabWidget):
            super().keyPressEvent(event)
            return
        step = ARROW_STEPS[Qt.Key(event.key())][1]
        tabs.setCurrentIndex(min(max(tabs.currentIndex() + step, 0), tabs.count() - 1))


class OverflowTabs(QTabWidget):
    """Tabs in one row, as many as fit; the current one always does."""

    def __init__(self) -> None:
        super().__init__()
        self.setTabBar(_OverflowTabBar())
        self.setDocumentMode(True)
        self.overflow_button = QToolButton(popupMode=QToolButton.ToolButtonPopupMode.InstantPopup)
        self.overflow_button.setIcon(icon("more"))
        self.overflow_button.setToolTip("More")
        self.overflow_button.setAccessibleName("More tabs")
        self._menu = QMenu(self.overflow_button)
        self._menu.aboutToShow.connect(self._fill)
        self.overflow_button.setMenu(self._menu)
        self.setCornerWidget(self.overflow_button, Qt.Corner.TopRightCorner)
        self.currentChanged.connect(self._fit)

    def setCurrentIndex(self, index: int) -> None:
        """Bring a tab to the front, which Qt does with none that is hidden."""
        self.setTabVisible(index, True)
        super().setCurrentIndex(index)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Ctrl+Tab goes through all tabs; Qt passes over hidden ones."""
        step = {Qt.Key.Key_Tab: 1, Qt.Key.Key_Backtab: -1}.get(Qt.Key(event.key()))
        if step is None or not event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            super().keyPressEvent(event)
        elif self.count():
            self.setCurrentIndex((self.currentIndex() + step) % self.count())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """Lay out again: a larger font takes more room."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange):
            self._fit()

    def _fit(self) -> None:
        """Hide the tabs that do not fit, the last ones first."""
        bar, front = self.tabBar(), self.currentIndex()
        widths = [bar.tabSizeHint(index).width() for index in range(self.count())]
        room = self.width()
        crowded = sum(widths) > room
        if crowded:
            room -= self.overflow_button.sizeHint().width() + widths[front]
        for index, width in enumerate(widths):
            if index == front:
                self.setTabVisible(index, True)
                continue
            visible = not crowded or width <= room
            self.setTabVisible(index, visible)
            room = room - width if visible else -1  # what stands behind does not overtake
        self.overflow_button.setVisible(crowded)
        bar.setElideMode(bar.elideMode())  # lays them out anew from the left

    def _fill(self) -> None:
        """Offer the tabs that do not fit."""
        self._menu.clear()
        for index in range(self.count()):
            if not self.isTabVisible(index):
                action = self._menu.addAction(self.tabText(index))
                action.triggered.connect(partial(self.setCurrentIndex, index))


def combo_box(name: str, items: dict[str, str], tip: str = "") -> QComboBox:
    """A list to choose from; each item knows what it stands for."""
    box = QComboBox()
    box.setAccessibleName(name)
    box.setToolTip(tip)
    for text, value in items.items():
        box.addItem(text, value)
    return box
