"""Solvers of the equations of motion behind one interface."""

from __future__ import annotations

from collections.abc import Generator

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.simulation.solvers.library import integrating_with_scipy
from forcelab.simulation.solvers.rosenbrock import RosenbrockBatch
from forcelab.simulation.solvers.solution import (
    Course,
    Explicit,
    Lsoda,
    Radau,
    Rosenbrock,
    Solution,
    Solver,
)
from forcelab.simulation.system import Array, System

__all__ = [
    "Explicit",
    "Lsoda",
    "Radau",
    "Rosenbrock",
    "Solution",
    "Solver",
    "integrate",
    "integrating",
]


def integrate(system: System, start: Array, times: Array, solver: Solver) -> Solution:
    """Follow the motion of every lane and locate its events.

    Parameters
    ----------
    system : System
    start : ndarray, shape (s, b)
        States at the first sample time.
    times : ndarray, shape (n,)
        Sample times, evenly spaced, s.
    solver : Rosenbrock, Explicit, Lsoda or Radau
        What to integrate with.

    Raises
    ------
    InputError
        If the motion cannot be resolved: it would need steps below the resolution of time or more
        steps than allowed, or it is not finite.
    """
    return finish(integrating(system, start, times, solver))


def integrating(
    system: System, start: Array, times: Array, solver: Solver
) -> Generator[Progress, None, Solution]:
    """As :func:`integrate`, as a job whose progress counts the samples of all lanes."""
    expected = (len(system.names), system.lanes)
    if start.shape != expected or not np.isfinite(start).all():
        raise InputError(
            f"The start of a motion must be finite numbers of shape {expected}, "
            f"not of shape {start.shape}."
            if start.shape != expected
            else f"The start of demonstration {np.argwhere(~np.isfinite(start))[0, 1] + 1} "
            "is not finite; look at the scene's numbers."
        )
    gaps = np.diff(times)
    if len(times) < 2 or not gaps.min() > 0 or gaps.max() - gaps.min() > 1e-6 * gaps.mean():
        raise InputError("The sample times of a motion must be two or more, evenly spaced.")
    course = Course(start, times)
    if isinstance(solver, Rosenbrock):
        yield from RosenbrockBatch(system, solver, course).run()
    else:
        yield from integrating_with_scipy(system, solver, course)
    return course.solution()
