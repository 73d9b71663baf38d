"""Tasks of a job in a few threads, step by step, so that the job can be cancelled between them."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor

from forcelab.jobs import Progress

__all__ = ["THREADS", "in_threads"]

#: Threads at most: what the window needs is left to it.
THREADS = 2


def in_threads(
    tasks: Sequence[Callable[[], None]], text: str, threads: int = THREADS
) -> Generator[Progress, None, None]:
    """Do tasks, none before its turn; a job.

    Parameters
    ----------
    tasks : sequence of callable
        Most of their time goes into numpy and scipy, which let other threads run.
    text : str
        Of the progress.
    threads : int
        At most.
    """
    together = min(threads, os.cpu_count() or 1)
    if together == 1 or len(tasks) <= 1:
        for i, task in enumerate(tasks):
            task()
            yield Progress(i + 1, len(tasks), text)
        return
    with ThreadPoolExecutor(together) as pool:
        waiting = [pool.submit(task) for task in tasks[:together]]
        for i in range(len(tasks)):
            waiting.pop(0).result()
            if i + together < len(tasks):
                waiting.append(pool.submit(tasks[i + together]))
            yield Progress(i + 1, len(tasks), text)
