"""Types of arrays, by what their numbers are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Floats = NDArray[np.floating[Any]]  # of one precision or the other
Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]
#: Of actions: their places in a list of names, or :data:`forcelab.labels.UNLABELLED`.
Codes = Whole
