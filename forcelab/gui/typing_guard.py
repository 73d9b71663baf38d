"""Keeps the window's plain keys out of fields in which one types, and Space on a button.

Qt asks the widget in focus first whether it wants a key (``ShortcutOverride``). Line edits say yes
for most of what they need; buttons, sliders and trees do not ask for theirs.
"""

from __future__ import annotations

from functools import cache
from typing import Protocol, runtime_checkable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QComboBox,
    QKeySequenceEdit,
    QLineEdit,
    QPlainTextEdit,
    QTextEdit,
    QTreeView,
    QWidget,
)

from forcelab.gui.key_follower import KeyFollower, application

__all__ = ["KeyKeeper", "guard", "kept", "typing", "wants"]

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
_THEIRS: tuple[tuple[type[QWidget], set[Qt.Key]], ...] = (
    (QAbstractButton, {_K.Key_Space}),
    (QComboBox, _ARROWS | {_K.Key_Space}),
    (QAbstractSlider, _ARROWS | _PAGING),
    (QTreeView, _ARROWS),
    (QAbstractItemView, {_K.Key_Up, _K.Key_Down}),
)


def typing(widget: QWidget | None) -> bool:
    """Whether keys typed into a widget are text."""
    if isinstance(widget, (QLineEdit, QTextEdit, QPlainTextEdit)):
        return not widget.isReadOnly()
    if isinstance(widget, QComboBox):
        return widget.isEditable()
    return isinstance(widget, (QAbstractSpinBox, QKeySequenceEdit))


@runtime_checkable
class KeyKeeper(Protocol):
    """A part of the window with keys of its own, which hold while the keyboard is in it."""

    def keeps(self, event: QKeyEvent) -> bool:
        """Whether a key is one of them; then it is no command, and no action is painted with it."""


def kept(widget: QWidget | None, event: QKeyEvent) -> bool:
    """Whether a key belongs to a part of the window that a widget is in."""
    while widget is not None:
        # To compare with a protocol takes long, and this is asked for each key.
        named = hasattr(type(widget), "keeps")
        if named and isinstance(widget, KeyKeeper) and widget.keeps(event):
            return True
        if widget.isWindow():
            return False
        widget = widget.parentWidget()
    return False


def wants(widget: QWidget | None, event: QKeyEvent) -> bool:
    """Whether a key belongs to the widget in focus and not to the window."""
    key = Qt.Key(event.key())
    modifiers = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
    if widget is not None and typing(widget):
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
    return any(isinstance(widget, kind) and key in theirs for kind, theirs in _THEIRS)


def _deletes(view: QAbstractItemView) -> bool:
    """Whether a shortcut of Delete is meant for a list: its own, or the window's of segments."""
    delete = QKeySequence(QKeySequence.StandardKey.Delete)
    own = any(action.shortcut() == delete for action in view.actions())
    return own or getattr(view, "lists_segments", False)


def _checkable(view: QAbstractItemView) -> bool:
    """Whether Space would tick the current row."""
    # Not the flag: items have it even where there is nothing to tick.
    return view.currentIndex().data(Qt.ItemDataRole.CheckStateRole) is not None


class _Guard(KeyFollower):
    """Asks of each key whether the widget in focus needs it."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Accept a key for the widget that needs it; the window's shortcut is then not tried."""
        if (
            event.type() == QEvent.Type.ShortcutOverride
            and isinstance(event, QKeyEvent)
            and isinstance(watched, QWidget)
            and (wants(watched, event) or kept(watched, event))
        ):
            event.accept()
            return True
        return False


@cache
def guard() -> QObject:
    """Start guarding; once per application, which must exist."""
    made = _Guard(application())
    made.follow_keys()
    return made
