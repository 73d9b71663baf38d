"""The glossary: what each action is, so that every coder decides the same way.

It is written in ``assets/actions.toml``; each action also has a picture in ``assets/actions/``.
"""

from __future__ import annotations

from dataclasses import dataclass

from forcelab.resources import read_toml

FILE = "actions.toml"


@dataclass(frozen=True, slots=True)
class Entry:
    """One action, told to a coder in plain sentences."""

    action: str
    sentence: str
    starts: str  # how a coder decides where it starts
    ends: str  # how a coder decides where it ends
    unlike: str  # what it is not to be mistaken for
    picture: str  # the asset that shows it, such as "actions/grab.png"


def glossary() -> tuple[Entry, ...]:
    """What each action is, in the order of ``assets/actions.toml``.

    Returns
    -------
    tuple of Entry
        Each with its ``action``, what it is (``sentence``), how a coder decides where it ``starts``
        and ``ends``, what it is ``unlike``, and the name of its ``picture``.

    Examples
    --------
    >>> [entry.action for entry in forcelab.glossary()][:3]
    ['still', 'grab', 'hold']
    """
    return tuple(Entry(action, **table) for action, table in read_toml(FILE).items())
