"""The coefficients of RODAS4P2: a Rosenbrock method of order 4 with six stages, L-stable.

G. Steinebach, "Improvement of Rosenbrock-Wanner method RODASP", in: Progress in
Differential-Algebraic Equations II, Springer (2020) 165-184; in the form without products of the
Jacobian of E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, section IV.7.
Its order does not fall where stiff parts follow slow forces, and falls to no less than 2 where the
Jacobian is wrong.
"""

from __future__ import annotations

import numpy as np

__all__ = ["COUPLING", "DENSE", "GAMMA", "NODES", "SLOPES", "STAGES"]

#: The one eigenvalue of the stages: the Jacobian is inverted once a step.
GAMMA = 0.25
#: When the stages are, as shares of the step.
NODES = np.array([0, 0.75, 0.321448134013046, 0.519745732277726, 1, 1])
#: How much of the step's length times the rates' derivative by time each of them sees.
SLOPES = np.array([0.25, -0.5, -0.189532918363016, 0.085612108792769, 0, 0])
#: Which mixture of the stages before leads to each of them. The last but one leads to the solution
#: of order 3, and the last stage is what that of order 4 has more.
STAGES = [
    np.array(row)
    for row in (
        [],
        [3],
        [0.906377755268814, -0.189707390391685],
        [3.758617027739064, 1.161741776019525, -0.849258085312803],
        [7.089566927282776, 4.573591406461604, -8.423496976860259, -0.959280113459775],
        [7.089566927282776, 4.573591406461604, -8.423496976860259, -0.959280113459775, 1],
    )
]
#: Which mixture of the stages before, over the step's length, is added to the rates.
COUPLING = [
    np.array(row)
    for row in (
        [],
        [-12],
        [-6.354581592719008, 0.338972550544623],
        [-8.575016317114033, -7.606483992117508, 12.22499765012482],
        [-5.888975457523102, -8.157396617841821, 24.805546872612922, 12.790401512796979],
        [
            -4.408651676063871,
            -6.692003137674639,
            24.625568527593117,
            16.627521966636085,
            -5.714285714285718,
        ],
    )
]
#: At a share u of the step, the state has grown by u times the whole growth, plus u (1 - u) times
#: (first row plus u times second row of this) @ stages, to order 3.
_WITHIN = np.array(
    [
        [
            -5.323528268423303,
            -10.042123754867493,
            17.175254928256965,
            -5.079931171878093,
            -0.016185991706112,
            0,
        ],
        [
            6.984505741529879,
            6.914061169603662,
            -0.849178943070653,
            18.104410789349338,
            -3.516963011559032,
            0,
        ],
    ]
)
_GROWTH = np.append(STAGES[-1], 1.0)
#: The same, sorted by powers of u from the first on.
DENSE = np.stack([_GROWTH + _WITHIN[0], _WITHIN[1] - _WITHIN[0], -_WITHIN[1]])
