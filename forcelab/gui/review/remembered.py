"""How a task was trained last, as the coder's settings keep it."""

from __future__ import annotations

import json
import logging
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forcelab.errors import InputError
from forcelab.gui import settings

if TYPE_CHECKING:
    from forcelab.recognition.dataset import Choice
    from forcelab.recognition.settings import Settings

__all__ = [
    "FIRST",
    "FIRST_CLASSIFIER",
    "recall_automatic",
    "recall_called",
    "recall_choice",
    "recall_parts",
    "recall_settings",
    "recall_values",
    "remember",
    "settings_of",
]

log = logging.getLogger(__name__)

#: What a task is trained with until somebody chooses otherwise: who presses Train for the first
#: time waits for seconds, and sees the best that there is. Scripts begin with preset ``paper``.
FIRST = "best"
#: Its classifier, written out: to look presets up loads much.
FIRST_CLASSIFIER = "extra-trees"


def recall_settings(project: Path, task: str) -> Settings:
    """The settings that a task of a project was trained with last; at first preset `FIRST`."""
    return settings_of(recall_values(project, task), task)


def recall_values(project: Path, task: str) -> dict[str, Any] | None:
    """The same as plain values, or None where nothing was ever changed; loads next to nothing."""
    return _read(project, task, "settings")


def settings_of(values: dict[str, Any] | None, task: str) -> Settings:
    """Settings out of plain values; preset `FIRST` where there are none or they are broken."""
    from forcelab.recognition.presets import preset
    from forcelab.recognition.settings import Settings

    if values is not None:
        try:
            return Settings.from_json(values)
        except InputError as error:  # such as of a newer forcelab
            log.warning("The settings kept for '%s' are not used: %s", task, error)
    return preset(FIRST)


def recall_called(project: Path, task: str) -> tuple[str, bool]:
    """The name of the preset that a task was trained with last, and whether it was changed."""
    name = settings.text(_key(project, task, "preset"), FIRST)
    return name, settings.flag(_key(project, task, "changed"))


def recall_choice(project: Path, task: str) -> Choice:
    """What was trained on for a task; at first the task by itself."""
    from forcelab.recognition.dataset import Choice

    tasks, test, author, apart, folds = recall_parts(project, task)
    return Choice(tasks, test, author, apart, folds=folds)


def recall_parts(
    project: Path, task: str
) -> tuple[tuple[str, ...], str | None, str | None, bool, int | None]:
    """The parts of a :class:`~forcelab.recognition.dataset.Choice`, without loading that.

    Tasks, the one tested on, author, whether actions stay apart, and groups that are left out.
    """
    values = _read(project, task, "choice") or {}
    try:
        tasks = tuple(str(name) for name in values["tasks"])
        test, author = values["test_task"], values["author"]
        sound = task in tasks and all(isinstance(v, (str, type(None))) for v in (test, author))
        if sound:
            folds = values.get("folds")
            known = isinstance(folds, int) and (folds == 0 or folds > 1)
            return tasks, test, author, values["apart"] is True, folds if known else None
    except (KeyError, TypeError):
        pass  # never remembered, or broken: the task by itself will do
    return (task,), None, None, False, None


def recall_automatic(project: Path) -> bool:
    """Whether a project is trained by itself."""
    return settings.flag(f"{_section(project)}/automatic")


def remember(project: Path, task: str, given: Settings | Choice | bool) -> None:
    """Keep one of them for the next time."""
    if isinstance(given, bool):
        settings.put(f"{_section(project)}/automatic", given)
        return
    from forcelab.recognition.presets import PRESETS
    from forcelab.recognition.settings import Settings

    if isinstance(given, Settings):
        settings.put(_key(project, task, "settings"), json.dumps(given.to_json()))
        settings.put(_key(project, task, "preset"), given.preset)
        settings.put(_key(project, task, "changed"), given != PRESETS.get(given.preset))
    else:
        settings.put(_key(project, task, "choice"), json.dumps(asdict(given)))


def _read(project: Path, task: str, name: str) -> dict[str, Any] | None:
    """A remembered object; None where there is none or it is broken."""
    text = settings.text(_key(project, task, name))
    try:
        values = json.loads(text) if text else None
    except ValueError:
        values = None
    return values if isinstance(values, dict) else None


def _section(project: Path) -> str:
    """Where the settings keep what belongs to a project."""
    return "training/" + _plain(str(project.resolve()))


def _key(project: Path, task: str, name: str) -> str:
    """Where the settings keep what belongs to a task; a task may be called anything."""
    return f"{_section(project)}/task {_plain(task)}/{name}"


def _plain(text: str) -> str:
    """A text without what separates the parts of a key."""
    return text.replace("/", "|").replace("\\", "|")
