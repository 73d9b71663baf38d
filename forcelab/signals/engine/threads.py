"""BLAS on one thread while transforms run: their products are small and many."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

__all__ = ["one_blas_thread"]

_lock = threading.Lock()
_inside = 0
_limit: Any = None


@cache
def _libraries() -> Any:
    """What tells BLAS how many threads to use; looking for the libraries takes a while."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS on one thread until the last of all transforms that run at once has ended.

    The setting is the process's: were each to restore what it found, the last one might restore
    what another had set.
    """
    global _inside, _limit  # noqa: PLW0603 - so is the setting
    with _lock:
        if _inside == 0:
            _limit = _libraries().limit(limits=1, user_api="blas")
        _inside += 1
    try:
        yield
    finally:
        with _lock:
            _inside -= 1
            if _inside == 0:
                _limit.restore_original_limits()
