"""What would be read from a bag, told by the first message of each topic."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.rosbag.aligning import Held
from forcelab.formats.rosbag.choosing import chosen
from forcelab.formats.rosbag.fields import Contents, address_of, follow
from forcelab.formats.rosbag.reader import opened, survey
from forcelab.formats.table.preview import ColumnUse, Use

__all__ = ["preview"]

_SIGNAL: Final[tuple[Use, ...]] = ("signal", "left out")
_WORD: Final[tuple[Use, ...]] = ("signal", "labels", "left out")


def preview(path: Path, options: ReadOptions) -> tuple[ColumnUse, ...]:
    """Tell what the fields of a bag's messages are read as, without reading all of them.

    Parameters
    ----------
    path : Path
        As for reading it.
    options : ReadOptions
        As for reading it.

    Returns
    -------
    tuple of ColumnUse
        A row a stamp, label or group of numbers that belong together; its cells are these.

    Raises
    ------
    InputError
        If the bag cannot be opened, or the options do not fit.
    """
    with opened(path) as bag:
        topics, _ = survey(bag)
    try:
        held = chosen(topics, options)
    except InputError:
        if options.signals or options.leave_out or options.label:
            raise
        held = []  # no forces; something may be chosen
    return tuple(row for topic in topics for row in _rows(topic, held))


def _rows(topic: Contents, held: Sequence[Held]) -> Iterator[ColumnUse]:
    """What a topic holds, and what it is read as."""
    read = {one.address for of in held for one in of.fields}
    labels = {address_of(of.topic, of.label) for of in held if of.label is not None}
    if topic.stamp is not None:
        stamp = follow(topic.first, topic.stamp)
        cell = f"{stamp.sec}.{stamp.nanosec:09}"
        name = address_of(topic.topic, topic.stamp)
        yield ColumnUse(name, "", "times", (cell,), choices=("times",))
    numbers = {one.address for one in topic.numbers}
    for address in topic.labels:
        if address not in numbers:  # a text
            use: Use = "labels" if address in labels else "left out"
            word = str(follow(topic.first, topic.words[address]))
            yield ColumnUse(address, "", use, (word,), choices=("labels", "left out"))
    for one in topic.numbers:
        use = "labels" if one.address in labels else "left out"
        cells = tuple(f"{float(follow(topic.first, leaf)):.4g}" for leaf in one.leaves[:3])
        units = ", ".join(unit for unit in dict.fromkeys(one.units) if unit)
        use = "signal" if one.address in read else use
        choices = _WORD if one.address in topic.words else _SIGNAL
        yield ColumnUse(one.address, units, use, cells, choices=choices)
