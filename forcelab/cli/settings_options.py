"""The options that change a preset, made from the table of settings, and the settings they mean."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from forcelab.cli.options import UsageError, add_author, add_task
from forcelab.cli.output import print_remark
from forcelab.errors import InputError
from forcelab.label_map import MergeMap
from forcelab.recognition.plugins import VARIABLES, Kind, is_import_path, load_plugin, name_path
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import (
    FIELD_GROUPS,
    FIELDS,
    WINDOWS_FIELD,
    Settings,
    why_not_applied,
)
from forcelab.setting_field import SettingField

if TYPE_CHECKING:
    from forcelab.recognition.dataset import DataSelection

_PRESETS = (
    "paper: the published method (default); released: what its authors' code does; fast; best: "
    "windows and extra trees; mlp: the same with the paper's classifier; ensemble: the mean of both"
)
_NUMBERS: dict[str, type[float] | type[int]] = {"number": float, "whole": int}
#: The settings that have an option of this table; merging has one of its own.
_FIELDS = (*(field for field in FIELDS if field.kind != "merge"), WINDOWS_FIELD)
_METAVARS = {"choice": "NAME", "channels": "A,B,...", "windows": "S,S,...", "whole": "N"}
_UNITS = {"Hz": "HZ", "s": "SECONDS", "samples": "SAMPLES", "of the shortest": "SHARE"}


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Options that choose demonstrations and change a preset, for training and evaluating alike."""
    demonstrations = parser.add_argument_group("which demonstrations")
    add_task(
        demonstrations, "task to use; given several times, the tasks are joined", action="append"
    )
    add_author(demonstrations, "the coder whose labels to use, where there are several")
    demonstrations.add_argument(
        "--also-from",
        metavar="NAME",
        help="another coder, whose labels to learn from where the first one has none; they are "
        "never tested",
    )
    demonstrations.add_argument(
        "--apart",
        action="store_true",
        help="joined tasks keep their actions apart: grab becomes grab_TASK",
    )
    demonstrations.add_argument(
        "--merge",
        metavar="MAP.json",
        type=Path,
        help='spellings to take as one action, such as {"grap_pen": "grab"}; stored labels stay',
    )
    add_changes(parser)


def add_changes(parser: argparse.ArgumentParser) -> None:
    """Options that change a preset's features, classifier and filters."""
    group = parser.add_argument_group(
        "settings",
        "What is not chosen below is the preset's; in brackets is that of preset paper.",
    )
    group.add_argument("--preset", metavar="NAME", default="paper", help=_PRESETS)
    paper = Settings()
    for title, fields in FIELD_GROUPS.items():
        group = parser.add_argument_group(f"settings: {title.lower()}")
        for field in (*fields, WINDOWS_FIELD) if title == "Features" else fields:
            if field in _FIELDS:
                _add_option(group, field, getattr(paper, field.name))


def _add_option(group: argparse._ArgumentGroup, field: SettingField, default: object) -> None:
    option = f"--{field.name.replace('_', '-')}"
    text = f"{field.tip[0].lower()}{field.tip[1:].rstrip('.')}"
    if not field.label.lower().startswith(field.name):
        text = f"{field.label[0].lower()}{field.label[1:]}: {text}"
    if field.options:
        text += f"; {', '.join(value for value, _ in field.options)}"
    if field.name in VARIABLES:
        text += "; or your own as MODULE:FUNCTION"
    if field.default is not None and "off:" not in text:
        text += "; or off"
    if isinstance(default, tuple):
        text += f" ({','.join(f'{value:g}' for value in default)})"
    elif isinstance(default, bool):
        text += f" ({'on' if default else 'off'})"
    elif default is not None:
        text += f" ({default:g})" if isinstance(default, float) else f" ({default})"
    text = text.replace("%", "%%")
    if field.kind == "flag":
        group.add_argument(option, action=argparse.BooleanOptionalAction, help=text)
    else:
        metavar = _METAVARS.get(field.kind) or _UNITS.get(field.unit, "X")
        number = str if field.default is not None else _NUMBERS.get(field.kind, str)
        group.add_argument(option, metavar=metavar, type=number, help=text)


def settings_from(arguments: argparse.Namespace) -> Settings:
    """The settings that the command line means; warns of those that have no effect."""
    changes: dict[str, Any] = {
        field.name: _value(field, value)
        for field in _FIELDS
        if (value := getattr(arguments, field.name)) is not None
    }
    if arguments.merge is not None:
        changes["merge"] = MergeMap.read(arguments.merge)
    try:
        settings = preset(arguments.preset).replace(**changes)
    except InputError as error:
        raise UsageError(str(error)) from error
    for name, value in changes.items():
        # That something is switched off which is not used anyway misleads nobody.
        used = value is not None and value is not False
        if used and (why := why_not_applied(name, vars(settings))):
            print_remark(f"forcelab: --{name.replace('_', '-')} has no effect {why}.")
    return settings


def _value(field: SettingField, text: Any) -> Any:
    if field.kind == "windows":
        try:
            return tuple(float(part) for part in text.split(","))
        except ValueError as error:
            raise UsageError(f"--windows takes seconds such as 0.01,0.1, not '{text}'.") from error
    if field.kind == "channels":
        return tuple(name.strip() for name in text.split(","))
    for kind in VARIABLES:
        if field.name == kind:
            known = dict(field.options)  # which no package can take the place of
            parts = text.split("+")
            return "+".join(part if part in known else _named(kind, part) for part in parts)
    if field.default is None:
        return text
    if text == "off":
        return None
    try:
        return _NUMBERS[field.kind](text)
    except ValueError as error:
        expected = "a whole number" if field.kind == "whole" else "a number"
        raise UsageError(f"--{field.name} takes {expected} or 'off', not '{text}'.") from error


def _named(kind: Kind, text: str) -> str:
    """A name as it is, or a path of one's own, which this names."""
    name = name_path(kind, text)
    if is_import_path(name):
        load_plugin(kind, name)  # what is wrong with it is said before the work
    return name


def choice_from(arguments: argparse.Namespace) -> DataSelection:
    """The demonstrations that the command line means."""
    # Loads what trains and evaluates; the settings alone, which plan reads, need none of that.
    from forcelab.recognition.dataset import DataSelection

    return DataSelection(
        tasks=tuple(arguments.task or ()),
        author=arguments.author,
        apart=arguments.apart,
        also_from=arguments.also_from,
        test_task=getattr(arguments, "test_task", None),  # these are of evaluate alone
        test_names=getattr(arguments, "test_names", None),
        adapt=getattr(arguments, "adapt", False),
        folds=getattr(arguments, "folds", None),
    )
