"""Key and wheel events: keys of a whole window, held keys, guards for text fields.

Qt asks the widget in focus first whether it wants a key (``ShortcutOverride``). Line edits say yes
for most of what they need; buttons, sliders and trees do not ask for theirs.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import shiboken6
from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QAction, QGuiApplication, QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QKeySequenceEdit,
    QLineEdit,
    QPlainTextEdit,
    QTextEdit,
    QTreeView,
    QWidget,
)


def application() -> QApplication:
    """The running application; RuntimeError if there is none."""
    running = QApplication.instance()
    if not isinstance(running, QApplication):
        raise RuntimeError("keys are bound after the application was made")
    return running


class KeyEventFilter(QObject):
    """Filters the events of the widget that gets the keys, and of that only.

    That is the one in focus, or else the window: it gets what is typed once a field has been left
    with Esc. A filter on the application would see every event.
    """

    _filtered: QWidget | None = None

    def follow_keys(self) -> None:
        """Start filtering."""
        application().focusChanged.connect(self._follow)
        self._follow(None, QApplication.focusWidget())

    def _follow(self, _: QWidget | None, now: QWidget | None) -> None:
        """Filter the widget that gets the keys now."""
        if self._filtered is not None and shiboken6.isValid(self._filtered):
            self._filtered.removeEventFilter(self)
        self._filtered = QApplication.activeWindow() if now is None else now
        if self._filtered is not None:
            self._filtered.installEventFilter(self)


#: A release and a press of one key that are less than this apart, in ms, are one repetition and of
#: no finger: the X server makes both at the same time, 30 ms after the one before.
REPEAT_GAP_MS = 5
#: How long a press that makes a release untrue is waited for, in ms.
RELEASE_WAIT_MS = 10


def _repeats_unmarked() -> bool:
    """Whether a held key sends releases and presses that Qt often does not mark: on X11.

    Qt marks them only if both have come when it looks, and often the press has not.
    """
    return QGuiApplication.platformName() == "xcb"


class _Release(NamedTuple):
    """The release of a key, with the time in ms of the window system."""

    key: int
    time: int

    def is_undone_by(self, press: QKeyEvent) -> bool:
        """Whether a press shows that the key was held all along."""
        fast = abs(press.timestamp() - self.time) < REPEAT_GAP_MS
        return Qt.Key(self.key) == press.key() and (press.isAutoRepeat() or fast)


class HeldShortcuts(KeyEventFilter):
    """Keeps actions that do not repeat from the repetitions of a held key.

    Qt does so where it knows a press for a repetition. On X11 it often does not, and a held Space
    would start and stop playback thirty times a second. `unmarked` is by default for X11.
    """

    def __init__(self, app: QApplication, unmarked: bool | None = None) -> None:
        super().__init__(app)
        self._unmarked = _repeats_unmarked() if unmarked is None else unmarked
        self._release: _Release | None = None
        self._repeated = False
        if self._unmarked:
            self.follow_keys()

    def watch(self, action: QAction) -> None:
        """Keep an action from repetitions."""
        if self._unmarked:
            action.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note when keys go down and up; drop the shortcut of a repetition."""
        kind = event.type()
        if kind == QEvent.Type.Shortcut:
            return self._repeated and isinstance(watched, QAction)
        if kind == QEvent.Type.KeyRelease and isinstance(event, QKeyEvent):
            self._release = _Release(event.key(), event.timestamp())
            self._repeated = False
        elif kind == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            undone = self._release is not None and self._release.is_undone_by(event)
            self._repeated = event.isAutoRepeat() or undone
        return False


@cache
def held_shortcuts() -> HeldShortcuts:
    """The one of this application, which must exist."""
    return HeldShortcuts(application())


class AutoRepeatFilter(QObject):
    """Postpones releases until it is sure that the key is up; `unmarked` is by default for X11."""

    def __init__(self, parent: QObject, unmarked: bool | None = None) -> None:
        super().__init__(parent)
        self._unmarked = _repeats_unmarked() if unmarked is None else unmarked
        self._pending: tuple[_Release, Callable[[], object]] | None = None
        self._timer = QTimer(self, singleShot=True, interval=RELEASE_WAIT_MS)
        self._timer.timeout.connect(self.settle)

    def released(self, event: QKeyEvent, act: Callable[[], object]) -> None:
        """A key seems to be up: act on it as soon as that is sure."""
        self.settle()
        if not self._unmarked:
            act()
            return
        self._pending = _Release(event.key(), event.timestamp()), act
        self._timer.start()

    def repeats(self, event: QKeyEvent) -> bool:
        """Whether a press is a repetition: its key is still down."""
        if self._pending is not None and self._pending[0].is_undone_by(event):
            self._timer.stop()
            self._pending = None
            return True
        self.settle()
        return event.isAutoRepeat()

    def settle(self) -> None:
        """Act on the postponed release."""
        self._timer.stop()
        pending, self._pending = self._pending, None
        if pending is not None:
            pending[1]()


_K = Qt.Key
_S = QKeySequence.StandardKey
_ARROWS = {_K.Key_Left, _K.Key_Right, _K.Key_Up, _K.Key_Down}
_PAGING = {_K.Key_Home, _K.Key_End, _K.Key_PageUp, _K.Key_PageDown}
#: What one edits text with, beside plain characters.
_EDITING = (
    _S.Undo,
    _S.Redo,
    _S.Copy,
    _S.Cut,
    _S.Paste,
    _S.SelectAll,
    _S.MoveToPreviousWord,
    _S.MoveToNextWord,
    _S.SelectPreviousWord,
    _S.SelectNextWord,
    _S.MoveToStartOfLine,
    _S.MoveToEndOfLine,
    _S.DeleteStartOfWord,
    _S.DeleteEndOfWord,
)


#: What moves and deletes in text, with Shift or without.
_TYPING = _ARROWS | _PAGING | {_K.Key_Backspace, _K.Key_Delete}
#: What other widgets need. A table leaves left and right to the time axis; Tab walks its cells.
_WIDGET_KEYS: tuple[tuple[type[QWidget], set[Qt.Key]], ...] = (
    (QAbstractButton, {_K.Key_Space}),
    (QComboBox, _ARROWS | {_K.Key_Space}),
    (QAbstractSlider, _ARROWS | _PAGING),
    (QTreeView, _ARROWS),
    (QAbstractItemView, {_K.Key_Up, _K.Key_Down}),
)


def action_key(event: QKeyEvent) -> str:
    """The key as actions name it: not the text, which a release does not carry everywhere."""
    code = event.key()
    return chr(code).lower() if 0x20 < code < 0x7F else ""


def is_typing(widget: QWidget | None) -> bool:
    """Whether keys typed into a widget are text."""
    if isinstance(widget, (QLineEdit, QTextEdit, QPlainTextEdit)):
        return not widget.isReadOnly()
    if isinstance(widget, QComboBox):
        return widget.isEditable()
    return isinstance(widget, (QAbstractSpinBox, QKeySequenceEdit))


def is_reserved_key(widget: QWidget | None, event: QKeyEvent) -> bool:
    """Whether a key belongs to a part of the window that a widget is in, and that says so.

    Such a part has keys of its own, which hold while it has the keyboard: its method `keeps` tells
    whether a key is one of them. Then it is no command and paints no action.
    """
    while widget is not None:
        keeps = getattr(widget, "keeps", None)
        if keeps is not None and keeps(event):
            return True
        if widget.isWindow():
            return False
        widget = widget.parentWidget()
    return False


def wants_key(widget: QWidget | None, event: QKeyEvent) -> bool:
    """Whether a key belongs to the widget in focus and not to the window."""
    key = Qt.Key(event.key())
    modifiers = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
    if widget is not None and is_typing(widget):
        plain = modifiers in (Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier)
        if not plain:
            return any(event.matches(standard) for standard in _EDITING)
        return key in _TYPING or (bool(event.text()) and event.text().isprintable())
    if isinstance(widget, QAbstractItemView) and event.matches(_S.SelectAll):
        # All of this list, if anything; where one row is chosen at most, not all of another list.
        return widget.selectionMode() is not QAbstractItemView.SelectionMode.ExtendedSelection
    if modifiers != Qt.KeyboardModifier.NoModifier:
        return False
    if isinstance(widget, QAbstractItemView) and key in (_K.Key_Space, _K.Key_Delete):
        # In a list of other things Delete must not erase labels, which nobody is looking at.
        return _checkable(widget) if key == _K.Key_Space else not _deletes(widget)
    return any(isinstance(widget, kind) and key in keys for kind, keys in _WIDGET_KEYS)


def _deletes(view: QAbstractItemView) -> bool:
    """Whether Delete is for a list: by its own shortcut, or as it lists segments."""
    delete = QKeySequence(QKeySequence.StandardKey.Delete)
    has_shortcut = any(action.shortcut() == delete for action in view.actions())
    return has_shortcut or getattr(view, "lists_segments", False)


def _checkable(view: QAbstractItemView) -> bool:
    """Whether Space would tick the current row."""
    # Not the flag: items have it even where there is nothing to tick.
    return view.currentIndex().data(Qt.ItemDataRole.CheckStateRole) is not None


class _Guard(KeyEventFilter):
    """Gives keys to the widget in focus if it needs them."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Accept a key for the widget that needs it; the window's shortcut is then not tried."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and isinstance(watched, QWidget)
            and (wants_key(watched, event) or is_reserved_key(watched, event))
        ):
            event.accept()
            return True
        return False


@cache
def guard_typing() -> QObject:
    """Start guarding, once per application, which must exist."""
    guard = _Guard(application())
    guard.follow_keys()
    return guard


class _WheelGuard(QObject):
    """Leaves the wheel to what surrounds a field, unless the field has the keyboard."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if (
            event.type() == QEvent.Type.Wheel
            and isinstance(watched, QWidget)
            and not watched.hasFocus()
        ):
            event.ignore()
            return True
        return False


@cache
def _guard() -> _WheelGuard:
    return _WheelGuard(QApplication.instance())


def ignore_wheel(*fields: QWidget) -> None:
    """Let the wheel change fields only while they have the keyboard, which it does not bring."""
    for field in fields:
        field.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        field.installEventFilter(_guard())
