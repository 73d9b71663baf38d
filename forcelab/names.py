"""Names of coders and tasks: as they are kept, and which of them are nearly the same."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["name_alike", "tidy_name"]


def tidy_name(name: str) -> str:
    """A name as it is kept, wherever it was typed: no spaces around it."""
    return name.strip()


def name_alike(name: str, known: Iterable[str]) -> str | None:
    """The known name that differs from a new one only by case or spaces.

    Returns
    -------
    str or None
        None where `name` itself is known, or nothing is like it.
    """
    names = list(known)
    if name in names:
        return None
    wanted = name.casefold().split()
    return next((one for one in names if one.casefold().split() == wanted), None)
