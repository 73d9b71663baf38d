"""Jobs: generators that yield progress and return a result.

To cancel a job is to stop iterating. Whoever runs one (the command line, the window's background
thread, a script) decides what to do with the progress. What scripts may call is named ``..._job``
where it gives a job; every other function gives its result.
"""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import wraps
from typing import Any, ParamSpec, TypeVar

Parameters = ParamSpec("Parameters")
ProgressT = TypeVar("ProgressT", bound="Progress")
ResultT = TypeVar("ResultT")
YieldT = TypeVar("YieldT")
StepT = TypeVar("StepT")


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a job is."""

    done: int
    total: int  # steps in all; a job may be finished in fewer
    text: str  # what the steps are, or what is done next, such as "reading JPen_sig.pdl"


def finish(
    job: Generator[YieldT, None, ResultT], watch: Callable[[YieldT], object] | None = None
) -> ResultT:
    """Run a job to its end and give its result.

    Parameters
    ----------
    job : generator
        Yields progress, returns the result.
    watch : callable, optional
        Called with each progress.

    Examples
    --------
    >>> job = forcelab.leave_one_out_job(labelled, settings)
    >>> job
    <leave_one_out_job, not started: forcelab.finish(job) runs it and gives its result>
    >>> steps = []
    >>> evaluation = forcelab.finish(job, steps.append)
    >>> steps[0].text
    'features'
    """
    result: list[ResultT] = []

    def relayed() -> Iterator[YieldT]:
        result.append((yield from job))

    for progress in relayed():
        if watch is not None:
            watch(progress)
    return result[0]


def map_progress(
    job: Generator[YieldT, None, ResultT], change: Callable[[YieldT], StepT]
) -> Generator[StepT, None, ResultT]:
    """Run a job as a part of another one, with its progress changed to that of the other."""
    with closing(job):
        while True:
            try:
                progress = next(job)
            except StopIteration as end:
                result: ResultT = end.value
                return result
            yield change(progress)


def run_through(
    result: ResultT | Generator[Progress, None, ResultT],
) -> Generator[Progress, None, ResultT]:
    """Run what is a job where it takes long, and a result already where it does not."""
    return (yield from result) if isinstance(result, Generator) else result


class Job(Generator[ProgressT, None, ResultT]):
    """A job that says so where it is never run; what functions marked by :func:`job` give."""

    def __init__(self, steps: Generator[ProgressT, None, ResultT], name: str) -> None:
        self._steps, self._name, self._used = steps, name, False

    def __iter__(self) -> Generator[ProgressT, None, ResultT]:
        self._used = True
        return self._steps  # so that what goes on from here costs nothing more

    def send(self, value: None) -> ProgressT:
        self._used = True
        return self._steps.send(value)

    def throw(self, typ: Any, *rest: Any) -> ProgressT:
        self._used = True
        return self._steps.throw(typ, *rest)

    def close(self) -> None:
        self._used = True
        self._steps.close()

    def __repr__(self) -> str:
        state = {
            inspect.GEN_CREATED: "not started: forcelab.finish(job) runs it and gives its result",
            inspect.GEN_CLOSED: "over",
        }.get(inspect.getgeneratorstate(self._steps), "started, not finished")
        return f"<{self._name}, {state}>"

    def __del__(self) -> None:
        if not self._used:
            warnings.warn(
                f"{self._name} was called and never run, so nothing was done; "
                f"forcelab.finish({self._name}(...)) runs it and gives its result.",
                RuntimeWarning,
                stacklevel=2,
            )


def job(
    function: Callable[Parameters, Generator[ProgressT, None, ResultT]],
) -> Callable[Parameters, Job[ProgressT, ResultT]]:
    """Make a generator function that scripts may call give a :class:`Job`."""

    @wraps(function)
    def start(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Job[ProgressT, ResultT]:
        return Job(function(*args, **kwargs), function.__name__)

    return start
