"""The jobs behind an explanation, and the recognisers that are kept for the session."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Collection, Generator
from pathlib import Path
from typing import TYPE_CHECKING

from forcelab.jobs import Progress

if TYPE_CHECKING:
    from forcelab.review.differences import Interval
    from forcelab.review.explanation import Why, Withheld
    from forcelab.review.run_result import Outcome

__all__ = ["Shelf", "explain", "withhold"]

#: Recognisers that are kept at most, and the memory that they may take in bytes.
KEPT, ROOM = 12, 128 * 2**20


class Shelf:
    """Recognisers that have not seen one demonstration each, by run and demonstration.

    The ones longest unused make room; the latest one stays in any case.
    """

    def __init__(self) -> None:
        self._kept: OrderedDict[tuple[Path, int, str], Withheld] = OrderedDict()

    def __len__(self) -> int:
        return len(self._kept)

    def get(self, path: Path, outcome: Outcome, id_: str) -> Withheld | None:
        """The one of a run and a demonstration, if it is here."""
        key = path, outcome.number, id_
        if key in self._kept:
            self._kept.move_to_end(key)
        return self._kept.get(key)

    def put(self, path: Path, outcome: Outcome, id_: str, withheld: Withheld) -> None:
        """Keep one."""
        self._kept[path, outcome.number, id_] = withheld
        while len(self._kept) > 1 and (
            len(self._kept) > KEPT or sum(one.bytes for one in self._kept.values()) > ROOM
        ):
            self._kept.popitem(last=False)

    def clear(self) -> None:
        """Forget all."""
        self._kept.clear()


def withhold(path: Path, outcome: Outcome, id_: str) -> Generator[Progress, None, Withheld]:
    """Train without a demonstration, in a process of its own."""
    from forcelab.process import elsewhere
    from forcelab.review.explanation import withholding  # takes a second to load

    return (yield from elsewhere(withholding, path, outcome, id_))


def explain(
    withheld: Withheld, outcome: Outcome, place: Interval, hidden: Collection[str]
) -> Generator[Progress, None, Why]:
    """Explain a place."""
    from forcelab.review.explanation import explaining

    return (yield from explaining(withheld, outcome, place, hidden))
