"""BLAS on one thread while something runs: products are small and many."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

__all__ = ["one_blas_thread"]

_lock = threading.Lock()
_inside = 0
#: Libraries that were found with more than one thread, with how many.
_before: list[tuple[Any, int]] = []


@cache
def _libraries(_scipy: bool) -> list[Any]:
    """What tells each BLAS how many threads to use; looking for them takes milliseconds."""
    from threadpoolctl import ThreadpoolController

    return list(ThreadpoolController().select(user_api="blas").lib_controllers)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS on one thread until the last of all that run at once has ended.

    The setting is the process's: were each to restore what it found, the last one might restore
    what another had set. Quick enough to be entered a thousand times a second.
    """
    global _inside  # noqa: PLW0603 - so is the setting
    with _lock:
        # SciPy brings a BLAS of its own, perhaps while others are inside.
        for library in _libraries("scipy.linalg._fblas" in sys.modules):
            if (count := library.get_num_threads()) != 1:
                _before.append((library, count))
                library.set_num_threads(1)
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            while _inside == 0 and _before:
                library, count = _before.pop()  # the first found is the last restored
                library.set_num_threads(count)
