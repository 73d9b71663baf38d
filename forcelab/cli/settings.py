"""The options that change a preset, as settings."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from forcelab.errors import InputError
from forcelab.merging import MergeMap
from forcelab.recognition.settings import Settings, preset

if TYPE_CHECKING:
    from forcelab.recognition.project_runs import Choice

__all__ = ["choice_from", "settings_from"]


def settings_from(arguments: argparse.Namespace) -> Settings:
    """A preset's settings with what the command line changes.

    Raises
    ------
    InputError
        If a value is out of its range.
    """
    changes: dict[str, Any] = {
        name: getattr(arguments, name)
        for name in (
            "classifier",
            "rate",
            "wavelet",
            "parameter",
            "min_scale",
            "max_scale",
            "spacing",
            "stride",
            "seed",
        )
        if getattr(arguments, name) is not None
    }
    if arguments.no_phase:
        changes["phase"] = False
    if arguments.channels is not None:
        changes["channels"] = tuple(name.strip() for name in arguments.channels.split(","))
    for name, kind in (("threshold", float), ("median", int), ("drop", float)):
        text = getattr(arguments, name)
        if text is not None:
            changes[name] = _switchable(name, text, kind)
    if arguments.merge is not None:
        changes["merge"] = MergeMap.read(arguments.merge)
    return preset(arguments.preset).replace(**changes)


def _switchable(name: str, text: str, kind: type[float] | type[int]) -> float | int | None:
    """A filter's value, or None for ``off``."""
    if text == "off":
        return None
    try:
        return kind(text)
    except ValueError as error:
        what = "a whole number" if kind is int else "a number"
        raise InputError(f"--{name} takes {what} or 'off', not '{text}'.") from error


def choice_from(arguments: argparse.Namespace) -> Choice:
    """Which demonstrations the command line means."""
    # Loads what trains and evaluates; the settings alone, which plan reads, need none of that.
    from forcelab.recognition.project_runs import Choice

    test_task = getattr(arguments, "test_task", None)
    return Choice(tuple(arguments.task or ()), test_task, arguments.author, arguments.apart)
