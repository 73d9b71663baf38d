"""Which numbers of a bag become channels, and what becomes labels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.rosbag.aligning import Held
from forcelab.formats.rosbag.fields import Contents, Field, Path, follow, with_sensors, within
from forcelab.text import listed

__all__ = ["chosen", "left_numbers", "some"]

#: So many names are told at most.
_SHOWN: Final = 8


def chosen(topics: Sequence[Contents], options: ReadOptions) -> list[Held]:
    """What to read: forces and what is asked for, without what is to be left out.

    Parameters
    ----------
    topics : sequence of Contents
    options : ReadOptions
        `signals`, `leave_out` and `label` name topics, or fields as in ``/topic.field.part``.

    Returns
    -------
    list of Held
        One a topic that is needed, empty yet.

    Raises
    ------
    InputError
        If nothing would be read, or a name means nothing.
    """
    every = [one for topic in topics for one in topic.numbers]
    known = [address for one in every for address in one.addresses]
    known += [address for topic in topics for address in topic.words]
    for wish in (*options.signals, *options.leave_out):
        if not any(within(address, wish) for address in known):
            raise _unknown(wish, "values", [one.address for one in every])
    kept = with_sensors([part for one in every if (part := _wanted(one, options)).leaves])
    if not kept:
        left = " but what is left out" if options.leave_out else ""
        raise InputError(
            f"no topic in it carries forces{left} (there are "
            f"{some([topic.topic for topic in topics])}); name what is to be read as a signal, a "
            "topic or a field of it as in --signal /topic.field."
        )
    labelled, label = _label(topics, options, {one.topic for one in kept})
    return [
        Held(
            topic.topic,
            fields := tuple(one for one in kept if one.topic == topic.topic),
            _sizes(topic.first, fields),
            topic.stamp,
            label if topic.topic == labelled else None,
        )
        for topic in topics
        if topic.topic == labelled or any(one.topic == topic.topic for one in kept)
    ]


def left_numbers(topics: Sequence[Contents], read: Sequence[Held]) -> list[str]:
    """Addresses of numbers that are not read, in topics of which others are."""
    used = {one.address for held in read for one in held.fields}
    measured = {held.topic for held in read if held.fields}
    return [
        one.address
        for topic in topics
        if topic.topic in measured
        for one in topic.numbers
        if one.address not in used and one.address not in topic.words
    ]


def some(names: Sequence[str]) -> str:
    """The first of some names, and how many more there are."""
    return listed(names, _SHOWN)


def _wanted(one: Field, options: ReadOptions) -> Field:
    """The part of a field that is read: of a force all, else what is asked for."""
    return one.part(
        [
            i
            for i, address in enumerate(one.addresses)
            if (one.force or any(within(address, wish) for wish in options.signals))
            and not any(within(address, wish) for wish in options.leave_out)
        ]
    )


def _sizes(first: object, fields: Sequence[Field]) -> dict[Path, int]:
    """How many there are in each array and list that fields are taken from."""
    ways = [leaf for one in fields for leaf in one.leaves]
    inside = [leaf[:i] for leaf in ways for i, step in enumerate(leaf) if isinstance(step, int)]
    return {path: len(follow(first, path)) for path in inside}


def _label(
    topics: Sequence[Contents], options: ReadOptions, measured: set[str]
) -> tuple[str, Path | None]:
    """Topic and path of the labels: as asked for, else the surest name, beside forces first."""
    places = {
        address: (topic.topic, path) for topic in topics for address, path in topic.words.items()
    }
    if options.label is not None:
        found = [address for address in places if within(address, options.label)]
        if len(found) != 1:
            raise _unknown(options.label, "labels", list(places))
    else:
        found = [
            address
            for topic in sorted(topics, key=lambda topic: topic.topic not in measured)
            for address in topic.labels
            if not any(within(address, wish) for wish in (*options.leave_out, *options.signals))
        ]
    return places[found[0]] if found else ("", None)


def _unknown(wish: str, what: str, names: Sequence[str]) -> InputError:
    """The error for a name that means nothing, or more than one thing."""
    cure = f"name one of {some(names)}" if names else "there are none"
    return InputError(f"it has no {what} called '{wish}'; {cure}.")
