"""Keys: the table of all commands, what keys they have, and the actions that carry them out.

One table makes the menus, binds the keys, fills the help page and the dialog that changes keys, so
that none of them can say something that is not so.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import cache

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QWidget

from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.commands import COMMANDS, Command
from forcelab.gui.key_events import guard_typing, held_shortcuts
from forcelab.vocabulary import KEYS, Vocabulary

log = logging.getLogger(__name__)
_BY_ID = {command.id: command for command in COMMANDS}


def key_name(key: str) -> str:
    """A key as this platform prints it, such as ``"⌘Z"`` where others say ``"Ctrl+Z"``."""
    return _sequence(key).toString(QKeySequence.SequenceFormat.NativeText)


def collision(keys: Mapping[str, Sequence[str]], vocabulary: Vocabulary | None = None) -> str:
    """What is wrong with the keys of each command, as one sentence; empty if nothing is.

    Characters that can paint an action (:data:`forcelab.vocabulary.KEYS`) belong to the actions,
    whatever the open task uses of them: the next one may use others. `vocabulary` names the action
    that a key paints.
    """
    painting = {action.key: action.name for action in vocabulary or () if action.key}
    owners: dict[str, str] = {}
    for id_, bound in keys.items():
        command = _BY_ID[id_]
        for key in bound:
            normal = _normalised(key)
            if not normal:
                return f"'{key}' is no key; press another one."
            plain = normal.lower()
            if plain in painting:
                return (
                    f"The key {key_name(key)} paints '{painting[plain]}'; choose another one "
                    f"for '{command.text}'."
                )
            if len(plain) == 1 and plain in KEYS:
                return (
                    f"The key {key_name(key)} is kept for painting actions; choose another one for "
                    f"'{command.text}', such as {key_name(key)} together with Ctrl."
                )
            owner = owners.setdefault(normal, id_)
            if owner != id_:
                return (
                    f"The key {key_name(key)} already means '{_BY_ID[owner].text}'; give that "
                    "another key first."
                )
    return ""


class Keys(QObject):
    """The keys of each command: the defaults, and the coder's own. Emits `changed`."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._bound: dict[str, tuple[str, ...]] = {}
        self.reload()

    def __getitem__(self, command: str) -> tuple[str, ...]:
        return self._bound[command]

    def all(self) -> dict[str, tuple[str, ...]]:
        """The keys of each command."""
        return dict(self._bound)

    def shown(self, command: str) -> str:
        """The keys of a command as this platform prints them, or ``""``."""
        return ", ".join(key_name(key) for key in self._bound[command])

    def changed_by_coder(self, command: str) -> bool:
        """Whether a command has other keys than by default."""
        return self._bound[command] != _defaults()[command]

    def set_keys(
        self, command: str, keys: Sequence[str], vocabulary: Vocabulary | None = None
    ) -> None:
        """Give a command other keys, or none, and store them.

        Raises InputError if a key is none, or paints actions, or belongs to another command.
        """
        # The one that changes comes last, so that the sentence names the one that has the key.
        others = {other: bound for other, bound in self._bound.items() if other != command}
        if sentence := collision(others | {command: tuple(keys)}, vocabulary):
            raise InputError(sentence)
        self._bound[command] = tuple(dict.fromkeys(_normalised(key) for key in keys))
        self._remember(command)
        self.reload()

    def reset(self, command: str) -> None:
        """Give a command its default keys back; InputError if another one has taken one of them."""
        self.set_keys(command, _defaults()[command])

    def reset_all(self) -> None:
        for id_ in self._bound:
            settings.forget(f"keys/{id_}")
        self.reload()

    def reload(self) -> None:
        """Read the coder's keys; if they collide, the defaults count.

        A key that the coder has chosen is no other command's default, as one that is newer may be.
        """
        stored = settings.settings()
        own = {
            id_: settings.strings(f"keys/{id_}", default)
            for id_, default in _defaults().items()
            if stored.contains(f"keys/{id_}")
        }
        if sentence := collision(own):
            log.warning("The keys in the settings are not used: %s", sentence)
            own = {}
        own = {id_: tuple(map(_normalised, bound)) for id_, bound in own.items()}
        taken = {key for bound in own.values() for key in bound}
        self._bound = {
            id_: own.get(id_, tuple(key for key in default if key not in taken))
            for id_, default in _defaults().items()
        }
        self.changed.emit()

    def _remember(self, command: str) -> None:
        """Store what differs from the defaults, so that better defaults reach everybody."""
        if self.changed_by_coder(command):
            settings.store(f"keys/{command}", self._bound[command])
        else:
            settings.forget(f"keys/{command}")


@cache
def keys() -> Keys:
    """The keys of this coder on this machine."""
    return Keys()


def bind(
    widget: QWidget, handlers: Mapping[str, Callable[[], object]], bound: Keys | None = None
) -> dict[str, QAction]:
    """Make the actions of some commands, for keys and menus; they follow when keys change.

    The keys count wherever the focus is in the widget's window, except those that a text field
    needs (:mod:`forcelab.gui.key_events`).
    """
    bound = bound or keys()
    guard_typing()
    actions = {id_: _action(widget, _BY_ID[id_], handler) for id_, handler in handlers.items()}
    _ShortcutUpdater(actions, bound, widget)
    return actions


class _ShortcutUpdater(QObject):
    """Keeps actions at their keys, for as long as their widget lives."""

    def __init__(self, actions: Mapping[str, QAction], bound: Keys, widget: QWidget) -> None:
        super().__init__(widget)
        self._actions, self._bound = actions, bound
        bound.changed.connect(self._follow)
        self._follow()

    def _follow(self) -> None:
        """Set shortcuts, and name them in tooltips."""
        for id_, action in self._actions.items():
            action.setShortcuts([_sequence(key) for key in self._bound[id_]])
            tip = action.text().rstrip("…")
            if keys_text := self._bound.shown(id_):
                tip = f"{tip} ({keys_text})"
            action.setToolTip(tip)
            action.setStatusTip(tip)


def _action(widget: QWidget, command: Command, handler: Callable[[], object]) -> QAction:
    """The action of one command, without keys."""
    action = QAction(command.text, widget, checkable=command.checkable)
    action.setObjectName(command.id)
    action.setAutoRepeat(command.repeats)
    if not command.repeats:
        held_shortcuts().watch(action)
    action.setShortcutContext(Qt.ShortcutContext.WindowShortcut)
    action.triggered.connect(lambda _checked=False: handler())
    widget.addAction(action)
    return action


def _sequence(key: str) -> QKeySequence:
    """A key as Qt holds it; empty if the text is none."""
    return QKeySequence(key, QKeySequence.SequenceFormat.PortableText)


def _normalised(key: str) -> str:
    """The normal spelling of a key; empty if the text is no single key."""
    sequence = _sequence(key)
    portable = sequence.toString(QKeySequence.SequenceFormat.PortableText)
    return portable if sequence.count() == 1 else ""


@cache
def _defaults() -> Mapping[str, tuple[str, ...]]:
    """The default keys of each command."""
    return {command.id: tuple(map(_normalised, command.keys)) for command in COMMANDS}
