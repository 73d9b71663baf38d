"""The tasks of the paper: each has a recipe, a choreography and a true course of actions."""

from __future__ import annotations

from collections.abc import Generator, Sequence

import numpy as np

from forcelab.arrays import Real
from forcelab.jobs import Progress, job
from forcelab.simulation.hand import Trajectory
from forcelab.simulation.mechanics import Layout, Mechanics
from forcelab.simulation.scene import TASKS, Event, Motion, Performance, Scene, Task
from forcelab.simulation.solvers import Solver, integrating
from forcelab.simulation.tasks.choreography import AFTERWARDS, Choreography
from forcelab.simulation.tasks.ground_truth import Course, true_actions
from forcelab.simulation.tasks.plays import PLAYS
from forcelab.simulation.tasks.recipe import recipe
from forcelab.vocabulary import Action, Vocabulary

#: At which forces and motion are sampled, Hz: above twice what the sensors' filters let through.
RATE = 4000.0
#: Chosen from the table of `forcelab measure contact`: the largest of its tolerances that leaves
#: less than a millinewton of error, root mean square, in every task.
SOLVER = Solver("Rosenbrock", tolerance=3e-4)


def vocabulary(task: Task) -> Vocabulary:
    """The vocabulary of a task; an action has the same colour in all tasks."""
    words, elsewhere = Vocabulary(), list[Action]()
    for play in TASKS[: TASKS.index(task) + 1]:
        words = Vocabulary().with_actions(*recipe(play).actions, like=elsewhere)
        elsewhere += words
    return words


def _choreograph(task: Task, seed: int, number: int, *, taps: bool) -> Choreography:
    """One demonstration's scene and what the hand does in it."""
    # One stream for each demonstration: the others change nothing about it.
    stream = np.random.SeedSequence([seed, number, TASKS.index(task)])
    rng = np.random.default_rng(stream)
    scene = recipe(task).drawn_scene(rng)
    hand = recipe(task).drawn_hand(rng)
    played = Choreography(scene, hand, rng, taps=taps)
    PLAYS[task](played)
    played.end()
    return played


def scene_of(task: Task, seed: int, number: int) -> Scene:
    return _choreograph(task, seed, number, taps=False).scene


@job
def perform_job(
    task: Task, seed: int, numbers: Sequence[int], *, taps: bool
) -> Generator[Progress, None, tuple[Performance, ...]]:
    """Perform demonstrations of a task, all at once.

    Parameters
    ----------
    task : str
    seed : int
        Of everything random, together with task and number.
    numbers : sequence of int
        Which demonstrations. None depends on the others but in its last digits, which rounding
        leaves to what is computed beside it.
    taps : bool
        Whether a finger taps the left sensor before and after the task.

    Returns
    -------
    tuple of Performance
        In the order of `numbers`.

    Raises
    ------
    InputError
        If a motion cannot be resolved.

    Examples
    --------
    >>> job = forcelab.perform_job("foam", seed=1, numbers=[1], taps=False)
    >>> (performance,) = forcelab.finish(job)  # doctest: +SKIP
    >>> job.close()  # not performed after all: it takes seconds
    """
    played = [_choreograph(task, seed, number, taps=taps) for number in numbers]
    system = Mechanics(
        [play.scene for play in played], Trajectory.through([play.values() for play in played])
    )
    start = np.zeros((len(system.names), len(played)))
    for lane, play in enumerate(played):
        start[: system.dof, lane] = [play.start[name] for name in system.layout.coordinates]
    # The last step of a lane is cut short only after its end, whether it is the longest or not.
    times = np.arange(0.0, max(play.t for play in played) + AFTERWARDS, 1.0 / RATE)
    solution = yield from integrating(system, start, times, SOLVER)
    performances = []
    for lane, play in enumerate(played):
        span = slice(0, int(np.searchsorted(times, play.t)))
        performances.append(
            _performance(
                play,
                system.lane(lane),
                times[span],
                solution.states[span, :, lane].T,
                tuple(event for event in solution.events[lane] if event.time < play.t),
            )
        )
    return tuple(performances)


def _performance(
    played: Choreography, system: Mechanics, times: Real, states: Real, events: tuple[Event, ...]
) -> Performance:
    """One demonstration from its states, of shape (s, n)."""
    rows = {name: states[row] for row, name in enumerate(Layout.of(played.scene).names)}
    still = np.zeros(len(times))

    def columns(*names: str) -> Real:
        return np.stack([rows.get(name, still) for name in names], axis=1)

    motion = Motion(
        times=times,
        jaws=columns("left jaw", "right jaw"),
        tongs=columns("tongs y", "tongs z", "wrist angle"),
        body=columns("body x", "body y", "body z", "cap angle"),
        normal=system.evaluate(times, states).normal.T,
    )
    return Performance(
        scene=played.scene,
        motion=motion,
        forces=system.sensor_forces(times, states).T,
        rate=RATE,
        actions=true_actions(played.phases, Course(motion, events)),
        events=events,
        taps=played.taps,
    )
