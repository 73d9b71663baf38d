"""A soft and a hard spring in one motion, ten million times apart: right, by every solver."""

import numpy as np
import pytest
from scipy.linalg import expm
from simulation.mechanisms import Mechanism

from forcelab.errors import InputError
from forcelab.simulation.solvers import Explicit, Lsoda, Radau, Rosenbrock, integrate

SOFT, HARD = 10.0, 1e8
DURATION = 0.05


class Chain(Mechanism):
    """A mass on a soft spring, and a light one that a hard and damped spring ties to it."""

    names = ("x", "y", "vx", "vy")
    positions = np.array([0, 1])
    velocities = np.array([2, 3])

    def __init__(self, m=0.05, light=1e-3, k=SOFT, hard=HARD, c=None):
        damping = 2 * np.sqrt(np.asarray(hard) * light) if c is None else c
        super().__init__(m=m, light=light, k=k, hard=hard, c=damping)

    def newton(self):
        whole = np.sqrt(self.k * self.m)
        return np.stack([1 / self.k, 1 / self.k, 1 / whole, 1 / whole])

    def rates(self, _times, states):
        x, y, vx, vy = states
        tie = self.hard * (y - x) + self.c * (vy - vx)
        return np.stack([vx, vy, (tie - self.k * x) / self.m, -tie / self.light])

    def matrix(self):
        """The same as one linear system."""
        (m,), (light,), (k,), (hard,), (c,) = (self.m, self.light, self.k, self.hard, self.c)
        return np.array(
            [
                [0, 0, 1, 0],
                [0, 0, 0, 1],
                [-(k + hard) / m, hard / m, -c / m, c / m],
                [hard / light, -hard / light, c / light, -c / light],
            ]
        )


@pytest.mark.parametrize(
    "solver",
    [Rosenbrock(1e-3), Explicit(1e-3, max_steps=300), Lsoda(1e-3), Radau(1e-3)],
    ids=lambda solver: type(solver).__name__,
)
def test_a_ratio_of_ten_million_is_right_or_refused_in_a_sentence(solver):
    chain = Chain()
    assert HARD / SOFT == 1e7
    times = np.linspace(0.0, DURATION, 51)
    start = np.array([0.1, 0.1 + 1e-9, 0.0, 0.0])[:, None]  # a newton each in both springs
    exact = np.stack([expm(chain.matrix() * t) @ start[:, 0] for t in times])
    try:
        found = integrate(chain, start, times, solver).states[:, :, 0]
    except InputError as error:
        assert str(error).endswith(".")
        assert isinstance(solver, Explicit), "a stiff solver must not refuse it"
        return
    assert np.isfinite(found).all()
    assert SOFT * np.abs(found[:, 0] - exact[:, 0]).max() < 0.02
    assert np.abs(found[:, 1] - found[:, 0]).max() < 2e-9 + 0.02 / SOFT * 1e-3
