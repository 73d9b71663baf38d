"""What was computed from labels, and how, as a project keeps it: frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

__all__ = ["LabelsUsed", "Made", "RunSummary", "StoredRecogniser", "StoredRun"]


@dataclass(frozen=True, slots=True)
class LabelsUsed:
    """Which labels of a demonstration something was computed from.

    Parameters
    ----------
    demonstration : str
        Its id.
    author : str
        Whose labels were used.
    edit : int
        The latest edit of that track at the time; 0 where there was none.
    """

    demonstration: str
    author: str
    edit: int


@dataclass(frozen=True, slots=True)
class Made:
    """How something was made: everything needed to make it again.

    Parameters
    ----------
    time : datetime
        When it was added, in UTC.
    settings : dict
        Everything that was asked for, as JSON has it.
    seed : int or None
        The random seed, if there was one.
    labels : tuple of LabelsUsed
        What it was computed from.
    versions : dict of str to str
        Of the program and the libraries.
    """

    time: datetime
    settings: dict[str, Any]
    seed: int | None
    labels: tuple[LabelsUsed, ...]
    versions: dict[str, str]

    @property
    def demonstrations(self) -> tuple[str, ...]:
        """Ids of the demonstrations used, each once."""
        return tuple(dict.fromkeys(used.demonstration for used in self.labels))


@dataclass(frozen=True, slots=True)
class StoredRecogniser(Made):
    """A trained recogniser's record; its file is opaque to the store.

    Parameters
    ----------
    time, settings, seed, labels, versions
        As of :class:`Made`.
    id : str
        32 hex digits of the SHA-256 of its file.
    name : str
        For people; need not be unique.
    """

    id: str
    name: str


@dataclass(frozen=True, slots=True)
class RunSummary(Made):
    """A run without its result, which may be long.

    Parameters
    ----------
    time, settings, seed, labels, versions
        As of :class:`Made`.
    id : int
        Number in the project.
    kind : str
        Such as ``"evaluate"``.
    digest : dict
        What stands under ``"digest"`` in its result, if that comes first there; otherwise empty.
    """

    id: int
    kind: str
    digest: dict[str, Any]


@dataclass(frozen=True, slots=True)
class StoredRun(Made):
    """An evaluation or another computation, with everything needed to repeat it.

    Parameters
    ----------
    time, settings, seed, labels, versions
        As of :class:`Made`.
    id : int
        Number in the project.
    kind : str
        Such as ``"evaluate"``.
    result : dict
        What came out, as JSON has it.
    """

    id: int
    kind: str
    result: dict[str, Any]
