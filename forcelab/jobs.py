"""Jobs: generators that yield progress and return a result.

To cancel a job is to stop iterating. Whoever runs one (the command line, the window's background
thread, a script) decides what to do with the progress.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import TypeVar

__all__ = ["Progress", "finish"]

ProgressT = TypeVar("ProgressT", bound="Progress")
ResultT = TypeVar("ResultT")


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a job is.

    Parameters
    ----------
    done, total : int
        Steps done, and steps in all; a job may be finished in fewer.
    text : str
        What the steps are, or what is done next, such as ``"reading JPen_sig.pdl"``.
    """

    done: int
    total: int
    text: str


def finish(
    job: Generator[ProgressT, None, ResultT], watch: Callable[[ProgressT], object] | None = None
) -> ResultT:
    """Run a job to its end and give its result.

    Parameters
    ----------
    job : generator
        Yields progress, returns the result.
    watch : callable, optional
        Called with each progress.
    """
    result: list[ResultT] = []

    def relayed() -> Iterator[ProgressT]:
        result.append((yield from job))

    for progress in relayed():
        if watch is not None:
            watch(progress)
    return result[0]
