"""The options that change a preset, as settings."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from forcelab.cli.options import UsageError
from forcelab.errors import InputError
from forcelab.label_map import MergeMap
from forcelab.recognition.presets import preset
from forcelab.recognition.settings import Settings, obstacle

if TYPE_CHECKING:
    from forcelab.recognition.dataset import Choice

__all__ = ["choice_from", "settings_from"]

#: Settings whose option gives the value itself, and those that may be ``off``.
_AS_GIVEN = (
    *("classifier", "features", "amplitude", "decoder", "choreography", "wavelet", "parameter"),
    *("rate", "min_scale", "max_scale", "spacing", "stride", "seed"),
    *("circular", "peaks", "balanced", "calibrated", "trimmed", "changes"),
)
_SWITCHABLE: dict[str, type[float] | type[int]]
_SWITCHABLE = {"threshold": float, "median": int, "drop": float, "step": float}


def settings_from(arguments: argparse.Namespace) -> Settings:
    """A preset's settings with what the command line changes; what counts for nothing is told.

    Raises
    ------
    UsageError
        If a value is out of its range.
    InputError
        If the file of spellings cannot be used.
    """
    changes: dict[str, Any] = {
        name: getattr(arguments, name) for name in _AS_GIVEN if getattr(arguments, name) is not None
    }
    if arguments.windows is not None:
        changes["windows"] = _windows(arguments.windows)
    if arguments.no_phase:
        changes["phase"] = False
    if arguments.channels is not None:
        changes["channels"] = tuple(name.strip() for name in arguments.channels.split(","))
    for name, kind in _SWITCHABLE.items():
        if (text := getattr(arguments, name)) is not None:
            changes[name] = _switchable(name, text, kind)
    if arguments.merge is not None:
        changes["merge"] = MergeMap.read(arguments.merge)
    try:
        settings = preset(arguments.preset).replace(**changes)
    except InputError as error:
        raise UsageError(str(error)) from error
    for name, value in changes.items():
        # That something is switched off which is not used anyway misleads nobody.
        used = value is not None and value is not False
        if used and (why := obstacle(name, vars(settings))):
            print(f"forcelab: --{name.replace('_', '-')} has no effect {why}.", file=sys.stderr)
    return settings


def _switchable(name: str, text: str, kind: type[float] | type[int]) -> float | int | None:
    """A value that can be switched off, or None for ``off``."""
    if text == "off":
        return None
    try:
        return kind(text)
    except ValueError as error:
        what = "a whole number" if kind is int else "a number"
        raise UsageError(f"--{name} takes {what} or 'off', not '{text}'.") from error


def _windows(text: str) -> tuple[float, ...]:
    """Windows in seconds, as they are written with commas between them."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise UsageError(f"--windows takes seconds such as 0.01,0.1, not '{text}'.") from error


def choice_from(arguments: argparse.Namespace) -> Choice:
    """Which demonstrations the command line means."""
    # Loads what trains and evaluates; the settings alone, which plan reads, need none of that.
    from forcelab.recognition.dataset import Choice

    return Choice(
        tasks=tuple(arguments.task or ()),
        author=arguments.author,
        apart=arguments.apart,
        test_task=getattr(arguments, "test_task", None),  # these are of evaluate alone
        test_names=getattr(arguments, "test_names", None),
        adapt=getattr(arguments, "adapt", False),
        folds=getattr(arguments, "folds", None),
    )
