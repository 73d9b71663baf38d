"""Units of what is recognised: a channel in counts does not compare with one in newtons."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from forcelab.demonstration import Channel, Demonstration
from forcelab.recognition.settings import Settings
from forcelab.signals.channels import channel_map

__all__ = ["mixed_units", "other_units", "units_of"]

#: Names that are told before it is only said how many more there are.
NAMED = 3
#: What can be done where units differ.
CURE = "readings without a unit may be raw counts, which become newtons by a calibration"


def units_of(channels: Sequence[Channel], wanted: Sequence[str] | None = None) -> tuple[str, ...]:
    """The unit of each recognition channel; empty where it has none.

    Parameters
    ----------
    channels : sequence of Channel
        As they were recorded.
    wanted : sequence of str, optional
        As of :func:`~forcelab.signals.channels.channel_map`.

    Raises
    ------
    InputError
        If a wanted channel is not there, or is wanted twice.
    """
    found = channel_map(channels, wanted)
    return tuple(channels[found.recorded[columns[0]]].unit for columns in found.columns)


def mixed_units(demonstrations: Sequence[Demonstration], settings: Settings) -> tuple[str, ...]:
    """A remark where demonstrations that are recognised together have channels in unlike units.

    Parameters
    ----------
    demonstrations : sequence of Demonstration
        They all have the settings' channels.
    settings : Settings

    Raises
    ------
    InputError
        If a wanted channel is not there.
    """
    wanted = settings.channels
    for name in channel_map(demonstrations[0].channels, wanted).names if demonstrations else ():
        of = [(units_of(d.channels, [name])[0], d.name) for d in demonstrations]
        of.sort(key=lambda pair: pair[0])
        parts = [
            f"{_said(unit)} in {_named([name for _, name in pairs])}"
            for unit, pairs in groupby(of, key=lambda pair: pair[0])
        ]
        if len(parts) > 1:
            return (
                f"The channel '{name}' is {', and '.join(parts)}, which does not compare: {CURE}; "
                f"give all the same unit, or leave some out.",
            )
    return ()


def other_units(
    learnt: Sequence[str], names: Sequence[str], channels: Sequence[Channel]
) -> tuple[str, ...]:
    """A remark where channels have other units than those that a recogniser has learnt.

    Parameters
    ----------
    learnt : sequence of str
        The recogniser's units; empty where it does not know them.
    names : sequence of str
        Of its recognition channels.
    channels : sequence of Channel
        That it is to recognise.

    Raises
    ------
    InputError
        If the recogniser looks at a channel that is not there.
    """
    for name, known, unit in zip(names, learnt, units_of(channels, names), strict=False):
        if known != unit:
            return (
                f"The channel '{name}' is {_said(unit)}, but the recogniser learnt it "
                f"{_said(known)}, which does not compare: {CURE}.",
            )
    return ()


def _said(unit: str) -> str:
    return f"in {unit}" if unit else "without a unit"


def _named(names: Sequence[str]) -> str:
    """The first names, and how many more there are."""
    told = ", ".join(f"'{name}'" for name in names[:NAMED])
    more = len(names) - NAMED
    return f"{told} and {more} more" if more > 0 else told
