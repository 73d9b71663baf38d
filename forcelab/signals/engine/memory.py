"""Memory of temporary arrays, which the process keeps from one transform to the next."""

from __future__ import annotations

import numpy as np

__all__ = ["keep_freed_memory"]

#: Bytes. The temporary arrays of a transform take less, one by one; up to twice as much is kept.
LARGEST = 1 << 24


def keep_freed_memory() -> None:
    """Have the C library keep what is freed, rather than hand it back to the system at once.

    Getting the pages again took up to a fifth of a transform. glibc keeps more once it has seen a
    large block freed; other libraries take no notice. None of the block's pages is ever touched.
    """
    np.empty(LARGEST, dtype=np.uint8)
