"""The coefficients of Dormand and Prince's pair of orders 5 and 4.

J. R. Dormand and P. J. Prince, J. Comp. Appl. Math. 6 (1980) 19-26; the states within a step after
L. F. Shampine, Math. Comp. 46 (1986) 135-150. The last stage belongs to the new state and is the
first one of the next step.
"""

from __future__ import annotations

import numpy as np

__all__ = ["DENSE", "ERROR", "NODES", "STAGES"]

#: When the later six stages are, as shares of the step.
NODES = np.array([1 / 5, 3 / 10, 4 / 5, 8 / 9, 1, 1])
#: Which mixture of the stages before leads to each of them.
STAGES = [
    np.array(row)
    for row in (
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    )
]
#: The solution of order 5 less that of order 4.
ERROR = np.array([-71 / 57600, 0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40])
#: At a share of the step, the state has grown by the step's length times the sum over p = 1..4 of
#: ``share**p * DENSE[p - 1] @ stages``, to order 4.
DENSE = np.array(
    [
        [1, 0, 0, 0, 0, 0, 0],
        [
            -8048581381 / 2820520608,
            0,
            131558114200 / 32700410799,
            -1754552775 / 470086768,
            127303824393 / 49829197408,
            -282668133 / 205662961,
            40617522 / 29380423,
        ],
        [
            8663915743 / 2820520608,
            0,
            -68118460800 / 10900136933,
            14199869525 / 1410260304,
            -318862633887 / 49829197408,
            2019193451 / 616988883,
            -110615467 / 29380423,
        ],
        [
            -12715105075 / 11282082432,
            0,
            87487479700 / 32700410799,
            -10690763975 / 1880347072,
            701980252875 / 199316789632,
            -1453857185 / 822651844,
            69997945 / 29380423,
        ],
    ]
)
