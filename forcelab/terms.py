"""The glossary: what each action is, so that every coder decides the same way.

It is written in ``assets/actions.toml``; each action also has a picture in ``assets/actions/``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, fields

from forcelab.errors import InputError
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

    def __post_init__(self) -> None:
        if not re.fullmatch(r"\S+( \S+)*", self.action):
            raise InputError(f"{FILE}: an action needs a name of words, not '{self.action}'.")
        for name in ("sentence", "starts", "ends", "unlike"):
            if not re.fullmatch(r"[A-Z][^\n]*\.", getattr(self, name)):
                raise InputError(
                    f"{FILE}: '{name}' of '{self.action}' must be one line of text from a capital "
                    f"letter to a full stop."
                )
        if not re.fullmatch(r"actions/[a-z-]+\.png", self.picture):
            raise InputError(
                f"{FILE}: 'picture' of '{self.action}' must look like actions/grab.png, "
                f"not '{self.picture}'."
            )


def glossary() -> tuple[Entry, ...]:
    """What each action is, in the order of ``assets/actions.toml``.

    Raises
    ------
    InputError
        If the file is missing or anything but a list of complete entries.

    Examples
    --------
    >>> [entry.action for entry in forcelab.glossary()][:3]
    ['still', 'grab', 'hold']
    """
    return tuple(_entry(action, table) for action, table in read_toml(FILE).items())


def _entry(action: str, table: object) -> Entry:
    names = [field.name for field in fields(Entry)][1:]
    if not isinstance(table, dict) or {k: type(v) for k, v in table.items()} != dict.fromkeys(
        names, str
    ):
        raise InputError(
            f"{FILE}: '{action}' must have exactly the texts {', '.join(names[:-1])} and "
            f"{names[-1]}."
        )
    return Entry(action, **table)
