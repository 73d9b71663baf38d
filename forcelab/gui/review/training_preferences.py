"""How each task was trained last, kept in the coder's settings."""

from __future__ import annotations

import json
import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forcelab.errors import InputError
from forcelab.gui import settings
from forcelab.gui.preferences import Preference, choice, paths
from forcelab.recognition import plugins
from forcelab.setting_field import SettingField

if TYPE_CHECKING:
    from forcelab.recognition.dataset import DataSelection
    from forcelab.recognition.settings import Settings


log = logging.getLogger(__name__)

#: Each preset in one sentence.
PRESET_TEXTS = {
    "paper": "The published method, unchanged: to compare with what was published.",
    "released": (
        "What the authors' published code does where it differs from their text: slower movements "
        "and stronger filters."
    ),
    "fast": (
        "As best, but without peaks, trained on every fifth decision, contradicted or not, and not "
        "calibrated."
    ),
    "best": "Extra trees that look at windows and peaks, with calibrated probabilities.",
    "mlp": "As best, but with the paper's classifier, whose loss is drawn while it trains.",
    "ensemble": "The mean of best and mlp: about as accurate as the better of the two.",
}

#: By default an MLP, as in the paper. Averaged with the trees of `best` it is about as accurate as
#: the better of the two; by itself it is behind on some tasks. Scripts begin with preset ``paper``.
PRESET = choice(
    "training/preset",
    "ensemble",
    "Preset of new tasks",
    "A task is trained with it until you choose other settings for the task; there each preset is "
    "explained.",
    {name: name for name in PRESET_TEXTS},
)
#: It belongs to a project; see `recall_automatic`.
AUTOMATIC = SettingField(
    "automatic",
    "flag",
    "Train automatically",
    "This project is trained again five seconds after the last edit.",
)


@dataclass(frozen=True)
class TrainingChoice:
    """What a task's recogniser learns from, and how it is tested.

    As of :class:`~forcelab.recognition.dataset.DataSelection`, which loads much.
    """

    tasks: tuple[str, ...]
    test_task: str | None = None
    author: str | None = None
    apart: bool = False
    folds: int | None = None
    also_from: str | None = None

    def selection(self) -> DataSelection:
        from forcelab.recognition.dataset import DataSelection

        return DataSelection(**asdict(self))


#: Code of one's own, by its kind.
OWN_CODE: dict[plugins.Kind, Preference[tuple[str, ...]]] = {
    "classifier": paths(
        "training/classifiers",
        "Your own classifiers",
        "Import paths such as mylab.models:make_forest, with commas between. The settings of a "
        "task offer them, and forcelab runs their code.",
    ),
    "features": paths(
        "training/features",
        "Your own features",
        "Import paths such as mylab.signals:band_energy, with commas between.",
    ),
}


def name_own_code() -> None:
    """Let settings use what the preferences name; nothing is imported before it is used."""
    for kind, preference in OWN_CODE.items():
        plugins.prefer(kind, preference.value)


def own_code_trouble(kind: plugins.Kind) -> str:
    """What is wrong with what the preferences name, which is imported; empty if nothing is."""
    for path in OWN_CODE[kind].value:
        if not plugins.is_import_path(path):
            return f"'{path}' is no import path; write it as MODULE:FUNCTION."
        try:
            plugins.load_plugin(kind, path)
        except InputError as error:
            return str(error)
    return ""


def recall_values(project: Path, task: str) -> dict[str, Any] | None:
    """The settings of a task as plain values, which load next to nothing; None without any."""
    return _recall_json(project, task, "settings")


def settings_of(values: dict[str, Any] | None, task: str) -> Settings:
    """Settings from plain values; those of `PRESET` where there are none or they are broken."""
    from forcelab.recognition.presets import preset
    from forcelab.recognition.settings import Settings

    if values is not None:
        try:
            return Settings.from_json(values)
        except InputError as error:  # such as of a newer forcelab
            log.warning("The settings kept for '%s' are not used: %s", task, error)
    return preset(PRESET.value)


def recall_preset(project: Path, task: str) -> tuple[str, bool]:
    """The name of the preset that a task was trained with last, and whether it was changed."""
    name = settings.text(_task_key(project, task, "preset"), PRESET.value)
    return name, settings.flag(_task_key(project, task, "changed"))


def recall_choice(project: Path, task: str) -> TrainingChoice:
    """What was trained on for a task; at first the task by itself."""
    values = _recall_json(project, task, "choice") or {}
    try:
        tasks = tuple(str(name) for name in values["tasks"])
        test, author, also = values["test_task"], values["author"], values.get("also_from")
        sound = task in tasks and all(
            isinstance(value, (str, type(None))) for value in (test, author, also)
        )
        if sound:
            folds = values.get("folds")
            valid = isinstance(folds, int) and (folds == 0 or folds > 1)
            apart, folds = values["apart"] is True, folds if valid else None
            return TrainingChoice(tasks, test, author, apart, folds, also)
    except (KeyError, TypeError):
        pass  # never remembered, or broken: the task by itself will do
    return TrainingChoice((task,))


def recall_automatic(project: Path) -> bool:
    return settings.flag(settings.key_of("training", project, "automatic"))


def remember_automatic(project: Path, automatic: bool) -> None:
    settings.store(settings.key_of("training", project, "automatic"), automatic)


def remember_choice(project: Path, task: str, training: TrainingChoice) -> None:
    settings.store(_task_key(project, task, "choice"), json.dumps(asdict(training)))


def remember_settings(project: Path, task: str, used: Settings) -> None:
    from forcelab.recognition.presets import PRESETS

    settings.store(_task_key(project, task, "settings"), json.dumps(used.to_json()))
    settings.store(_task_key(project, task, "preset"), used.preset)
    settings.store(_task_key(project, task, "changed"), used != PRESETS.get(used.preset))


def _recall_json(project: Path, task: str, name: str) -> dict[str, Any] | None:
    """A stored object; None where there is none or it is broken."""
    text = settings.text(_task_key(project, task, name))
    try:
        values = json.loads(text) if text else None
    except ValueError:
        values = None
    return values if isinstance(values, dict) else None


def _task_key(project: Path, task: str, name: str) -> str:
    return settings.key_of("training", project, f"task {task}", name)
