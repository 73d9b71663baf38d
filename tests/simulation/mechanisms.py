"""Small mechanisms whose motion is known in closed form."""

from functools import partial

import numpy as np

from forcelab.simulation.solvers import Solver, integrate

rosenbrock, rk45, lsoda, radau = (
    partial(Solver, method) for method in ("Rosenbrock", "RK45", "LSODA", "Radau")
)


class Mechanism:
    """A mass with place x and speed v in each lane; `numbers` hold one value for each lane."""

    names = ("x", "v")
    dof = 1
    events = ()

    def __init__(self, **numbers):
        values = np.broadcast_arrays(*(np.atleast_1d(value) for value in numbers.values()))
        self.numbers = dict(zip(numbers, (np.array(v, float) for v in values), strict=True))
        vars(self).update(self.numbers)
        self.lanes = len(values[0])
        self.scales = self.newton()

    def newton(self):
        """The change of each state that makes one newton."""
        return np.stack([1 / self.k, 1 / np.sqrt(self.k * self.m)])

    def rates(self, times, states):
        return np.stack([states[1], self.force(times, states) / self.m])

    def watched(self, _times, states):
        return np.empty((0, states.shape[1]))

    def jump(self, _event, _rising, state):
        return state

    def lane(self, number):
        return self.subset(np.array([number]))

    def subset(self, lanes):
        return type(self)(**{name: values[lanes] for name, values in self.numbers.items()})


class Oscillator(Mechanism):
    """A mass m on a spring k with a dashpot c, pushed by `push` newtons at w rad/s."""

    def __init__(self, m=1.0, k=1.0, c=0.0, push=0.0, w=1.0):
        super().__init__(m=m, k=k, c=c, push=push, w=w)

    def force(self, times, states):
        push = self.push * np.cos(self.w * times)
        return push - self.k * states[0] - self.c * states[1]

    def exactly(self, times, start):
        """Places and speeds, shape (n, 2, b): the steady motion and a free one that fades."""
        t = np.asarray(times)[:, None]
        steady = self.push / (self.k - self.m * self.w**2 + 1j * self.c * self.w)
        x0, v0 = start[0] - steady.real, start[1] - (1j * self.w * steady).real
        root = -self.c / 2 / self.m + 1j * np.sqrt(self.k / self.m - (self.c / 2 / self.m) ** 2)
        free = x0 + 1j * (root.real * x0 - v0) / root.imag
        driven, fading = steady * np.exp(1j * self.w * t), free * np.exp(root * t)
        return np.stack(
            [(driven + fading).real, (1j * self.w * driven + root * fading).real], axis=1
        )


class Ball(Mechanism):
    """A ball that falls on a spring k with a dashpot c at height 0; they touch while x < 0."""

    events = (("contact lost", "contact made"),)

    def __init__(self, m=0.05, k=1e4, c=1.0, g=9.81):
        super().__init__(m=m, k=k, c=c, g=g)

    def force(self, _times, states):
        return (
            np.where(states[0] < 0, -self.k * states[0] - self.c * states[1], 0) - self.m * self.g
        )

    def watched(self, _times, states):
        return states[:1]

    def touching(self, speed):
        """The motion in contact of a single lane that hits at `speed`: an oscillator's."""
        sag = self.m * self.g / self.k
        free = Oscillator(self.m, self.k, self.c)
        return lambda t: free.exactly(np.atleast_1d(t), np.array([sag, [-speed]]))[:, 0, 0] - sag[0]


class Bouncer(Mechanism):
    """A ball that leaves the floor with a share e of the speed with which it hits."""

    events = (("", "bounce"),)

    def __init__(self, e=0.8, g=9.81):
        super().__init__(e=e, g=g)

    def newton(self):
        return np.full((2, self.lanes), 1e-3)

    def rates(self, _times, states):
        return np.stack([states[1], np.broadcast_to(-self.g, states[1].shape)])

    def watched(self, _times, states):
        return states[:1]

    def jump(self, _event, _rising, state):
        return np.array([0.0, -self.e[0] * state[1]])


class Thrown(Mechanism):
    """Constant acceleration a, and whatever is said to be watched."""

    events = (("up", "down"),)

    def __init__(self, a=0.0):
        super().__init__(a=a)

    def newton(self):
        return np.ones((2, self.lanes))

    def rates(self, _times, states):
        return np.stack([states[1], np.broadcast_to(self.a, states[1].shape)])

    def watched(self, _times, states):
        return states[:1]


def errors(system, start, times, solver):
    """Error of the spring's force at each sample, N."""
    found = integrate(system, start, times, solver).states
    return np.abs(found - system.exactly(times, start))[:, 0] * system.k


def order(system, start, times, solvers):
    """By how many powers of two the largest error falls from one solver to the next."""
    found = [errors(system, start, times, solver).max() for solver in solvers]
    return -np.diff(np.log2(found))


def driven():
    """Two lanes of an oscillator, and where they start."""
    system = Oscillator(m=[0.05, 2.0], k=[1e3, 3e4], c=[0.5, 40.0], push=[2.0, 5.0], w=[60.0, 9.0])
    return system, np.array([[3e-3, -1e-4], [0.1, 0.05]])
