"""What is worth a look in the signals of a table, said in one sentence each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from forcelab.demonstration import LARGEST, Channel
from forcelab.text import counted

__all__ = ["missing", "switches"]


def missing(signals: NDArray[np.float64], channels: Sequence[Channel]) -> list[str]:
    """A remark on samples that are missing or cannot have been measured, if there are any.

    Parameters
    ----------
    signals : ndarray, shape (n, n_channels)
        NaN where a cell was empty.
    channels : sequence of Channel
    """
    counts = (~(np.abs(signals) <= LARGEST)).sum(axis=0).tolist()  # nor is NaN
    total = sum(counts)
    if not total:
        return []
    each = ", ".join(
        f"{channel.name} {count:,}"
        for channel, count in zip(channels, counts, strict=True)
        if count
    )
    return [f"{counted(total, 'sample')} {'is' if total == 1 else 'are'} missing ({each})."]


def switches(
    signals: NDArray[np.float64], channels: Sequence[Channel], unasked: Sequence[int]
) -> list[str]:
    """A remark on columns that tell on and off, and no quantity, if there are any.

    Parameters
    ----------
    signals : ndarray, shape (n, n_channels)
    channels : sequence of Channel
    unasked : sequence of int
        The columns of `signals` that nobody has called signals.
    """
    names = [channels[i].name for i in unasked if _on_and_off(signals[:, i])]
    if not names:
        return []
    one = len(names) == 1
    columns = f"Column {names[0]} holds" if one else f"Columns {', '.join(names)} hold"
    return [
        f"{columns} nothing but 0 and 1, as of a button, and became "
        f"{'a signal' if one else 'signals'}; leave out what measures nothing."
    ]


def _on_and_off(values: NDArray[np.float64]) -> bool:
    """Whether all values are 0 or 1, and both occur."""
    return bool(((values == 0) | (values == 1)).all() and np.ptp(values) == 1)
