"""Numbers of many scenes side by side, so that a batch is computed at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

__all__ = ["beside", "stacked"]


def stacked(parts: Sequence[Any]) -> SimpleNamespace:
    """The numbers of equal parts as arrays.

    Parameters
    ----------
    parts : sequence of dataclasses, length b
        Of one class, such as scenes, in which the same parts are ``None``.

    Returns
    -------
    SimpleNamespace
        Each number as an array of shape (b,), each part as such a namespace; texts are left out.
    """
    result = SimpleNamespace()
    for field in fields(parts[0]):
        values = [getattr(part, field.name) for part in parts]
        if values[0] is None:
            setattr(result, field.name, None)
        elif is_dataclass(values[0]):
            setattr(result, field.name, stacked(values))
        elif isinstance(values[0], (int, float)):
            setattr(result, field.name, np.array(values, dtype=np.float64))
    return result


def beside(parts: Sequence[SimpleNamespace]) -> SimpleNamespace:
    """The numbers of equal parts of one scene, such as its surfaces, from `stacked`.

    Returns
    -------
    SimpleNamespace
        Each number as an array of shape (parts, b).
    """
    names = vars(parts[0])
    return SimpleNamespace(**{name: np.stack([vars(one)[name] for one in parts]) for name in names})
