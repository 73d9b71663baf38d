"""The BLAS on one thread, entered and left often."""

from __future__ import annotations

__all__ = ["OneThread"]


class OneThread:
    """A context in which the BLAS has one thread.

    On matrices as small as those of a block a second thread only waits for the first. This is
    :func:`threadpoolctl.threadpool_limits` for a thousand times a second: it knows its libraries
    from the start, and leaves alone those that have one thread anyway.
    """

    def __init__(self) -> None:
        from threadpoolctl import ThreadpoolController

        # Looking for them takes milliseconds.
        self._libraries = ThreadpoolController().select(user_api="blas").lib_controllers
        self._before: list[int] = []

    def __enter__(self) -> None:
        self._before = [library.get_num_threads() for library in self._libraries]
        self._set([1] * len(self._before))

    def __exit__(self, *_: object) -> None:
        self._set(self._before)

    def _set(self, threads: list[int]) -> None:
        for library, before, count in zip(self._libraries, self._before, threads, strict=True):
            if before != 1:
                library.set_num_threads(count)
