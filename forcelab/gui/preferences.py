"""The preferences: each is declared once, with its default, what it is called and what it does.

The window reads them here, and the dialog (:mod:`forcelab.gui.preferences_dialog`) is made of them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

from PySide6.QtCore import QObject, Signal

from forcelab.gui import settings
from forcelab.setting_field import SettingField

ValueT = TypeVar("ValueT")


class Preference(QObject, Generic[ValueT]):
    """A setting that the coder makes, and its default; `changed` also where it is made elsewhere.

    `read` gives its value, which is the default where nothing sound is stored. `write` takes
    another one; by default it is stored under the field's name.
    """

    changed = Signal()

    def __init__(
        self,
        field: SettingField,
        default: Callable[[], ValueT],
        read: Callable[[], ValueT],
        write: Callable[[ValueT], object] | None = None,
    ) -> None:
        super().__init__()
        self.field = field
        self._default, self._read, self._write = default, read, write or self._store

    @property
    def value(self) -> ValueT:
        return self._read()

    @property
    def default(self) -> ValueT:
        return self._default()

    def set_value(self, value: ValueT) -> None:
        self._write(value)
        self.changed.emit()

    def reset(self) -> None:
        self.set_value(self.default)

    def _store(self, value: Any) -> None:
        """Store a value; not the default, so that a better one reaches everybody."""
        if value == self.default:
            settings.forget(self.field.name)
        else:
            settings.store(self.field.name, str(value) if isinstance(value, Path) else value)


def _flag(key: str, default: bool, label: str, tip: str) -> Preference[bool]:
    field = SettingField(key, "flag", label, tip)
    return Preference(field, lambda: default, lambda: settings.flag(key, default))


def _whole(key: str, default: int, label: str, tip: str, **shown: Any) -> Preference[int]:
    field = SettingField(key, "whole", label, tip, **shown)

    def read() -> int:
        return round(settings.number(key, default, lowest=field.lowest, highest=field.highest))

    return Preference(field, lambda: default, read)


def choice(
    key: str, default: str, label: str, tip: str, options: dict[str, str]
) -> Preference[str]:
    """One of several words; `options` are what they are called."""

    def read() -> str:
        stored = settings.text(key)
        return stored if stored in options else default

    field = SettingField(key, "choice", label, tip, options=tuple(options.items()))
    return Preference(field, lambda: default, read)


def _folder(key: str, default: Callable[[], Path], label: str, tip: str) -> Preference[Path]:
    """A folder; one that has gone counts as none."""

    def read() -> Path:
        stored = settings.text(key)
        return Path(stored) if stored and settings.is_folder(Path(stored)) else default()

    return Preference(SettingField(key, "folder", label, tip), default, read)


def paths(key: str, label: str, tip: str) -> Preference[tuple[str, ...]]:
    """Import paths, by default none."""
    return Preference(SettingField(key, "paths", label, tip), tuple, lambda: settings.strings(key))


#: It belongs to a project, and is kept by the document and with :func:`settings.remember_coder`.
CODER = SettingField(
    "coder",
    "choice",
    "You label as",
    "Your labels, notes and verdicts in this project are kept under this name.",
)
THEME = choice(
    "window/theme",
    "system",
    "Theme",
    "The colours of the window. 'Same as system' follows the desktop between light and dark.",
    {"system": "Same as system", "light": "Light", "dark": "Dark"},
)
TEXT_SIZE = _whole(
    "window/text_size",
    100,
    "Text size",
    "Relative to the text of other programs. Rows, buttons and plots grow with it.",
    lowest=80,
    highest=200,
    step=10,
    unit="%",
)
SNAPPING = _flag(
    "labelling/snapping",
    True,
    "Snapping",
    "What you paint or drag goes to contacts, edges, video frames and samples nearby. Hold Ctrl "
    "while dragging to place an edge freely.",
)
REACTION_TIME = _whole(
    "labelling/reaction_ms",
    0,
    "Reaction time",
    "How late you press keys during playback; labels are put that much earlier.",
    highest=2000,
    step=10,
    unit="ms",
)
HOLD_TIME = _whole(
    "labelling/hold_ms",
    250,
    "Hold time",
    "An action's key that is held for longer paints from the press to the release. A shorter press "
    "starts the segment, and the next press ends it.",
    lowest=50,
    highest=2000,
    step=10,
    unit="ms",
)
SAMPLE_FOLDER = _folder(
    "files/sample_folder",
    settings.documents_folder,
    "Folder of the sample project",
    "The sample project is made in this folder, as sample.forcelab. One that exists stays where "
    "it is.",
)
