"""The four contacts on which solvers are measured: soft, hard, sticking and slipping, snapping.

Each is a second of several lanes whose stiffness, mass and timing differ, and has the events that
make its forces hard to follow. They are scenes of their own, apart from the tasks' choreographies,
so that the table stays the same when those change.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from forcelab.simulation.hand import KNOT_STEP, Command, minimum_jerk, tremor
from forcelab.simulation.mechanics import Mechanics
from forcelab.simulation.scene import Arm, Body, Ground, Holder, Jaws, Scene, Socket
from forcelab.simulation.state_layout import Layout
from forcelab.simulation.system import Array, System

__all__ = ["Case", "Problem", "contact_cases"]

DURATION = 1.0
#: Samples a second at which forces are compared.
RATE = 4000.0
#: How far jaws stand off the body at first, and the amplitude of the hand's tremor, m.
OPEN = 3e-3
TREMOR = 5e-5


@dataclass(frozen=True)
class Problem:
    """Something to integrate.

    Parameters
    ----------
    system : System
    start : ndarray, shape (s, b)
        States at the first time.
    times : ndarray, shape (n,)
        At which the forces are compared, s, evenly spaced, n >= 2.
    forces : callable
        From `times` and states of shape (n, s, b) to forces of shape (n, c, b), N.
    """

    system: System
    start: Array
    times: Array
    forces: Callable[[Array, Array], Array]

    @property
    def simulated(self) -> float:
        """Simulated seconds, all lanes together."""
        return float(self.times[-1] - self.times[0]) * self.system.lanes


@dataclass(frozen=True)
class Case:
    """A problem with a name; it is made when it is measured.

    Parameters
    ----------
    name : str
        Such as ``"foam"``.
    make : callable
        Gives the :class:`Problem`.
    """

    name: str
    make: Callable[[], Problem]


#: Reaches of the hand, each with its start and duration in seconds and how far it goes in m.
Reaches = tuple[tuple[float, float, float], ...]


def contact_cases(lanes: int) -> tuple[Case, ...]:
    """The four cases, each with so many lanes."""
    made = (("foam", _foam), ("cartridge", _cartridge), ("stick-slip", _tugs), ("snap", _snap))
    return tuple(Case(name, partial(make, lanes)) for name, make in made)


def _problem(
    lanes: int,
    scene: Scene,
    reaches: Mapping[str, Reaches],
    start: Mapping[str, float] | None = None,
) -> Problem:
    """Lanes of a scene, moved by minimum-jerk reaches and tremor.

    Parameters
    ----------
    lanes : int
    scene : Scene
        Stiffness and mass of the body vary from lane to lane, and so does the timing.
    reaches : mapping of str to tuple
        Of what the hand drives: ``"jaw"`` (both, how far they close), ``"tongs z"`` and so on.
    start : mapping of str to float, optional
        States other than zero at the start. What the hand drives starts where it is commanded.
    """
    rng = np.random.default_rng(1)
    factors = np.geomspace(0.8, 1.25, lanes)
    delays = rng.permutation(np.linspace(0.0, 0.02, lanes))
    scenes, values = [], []
    layout = Layout.of(scene)
    for factor, late in zip(factors, delays, strict=True):
        stiffness, mass = scene.body.stiffness * factor, scene.body.mass / factor
        scenes.append(replace(scene, body=replace(scene.body, stiffness=stiffness, mass=mass)))
        values.append(_hand(layout, scene.body.half_width, reaches, late, rng))
    system = Mechanics(scenes, Command.through(values))
    states = np.zeros((len(system.names), lanes))
    for row in range(len(layout.driven)):
        states[row] = [value[0, row] for value in values]
    for name, value in (start or {}).items():
        states[system.names.index(name)] = value
    alone = [system.lane(lane) for lane in range(lanes)]

    def forces(times: Array, found: Array) -> Array:
        return np.stack(
            [lane.felt(times, found[:, :, i].T).T for i, lane in enumerate(alone)], axis=2
        )

    times = np.arange(round(DURATION * RATE) + 1) / RATE
    return Problem(system, states, times, forces)


def _hand(
    layout: Layout,
    half_width: float,
    reaches: Mapping[str, Reaches],
    late: float,
    rng: np.random.Generator,
) -> Array:
    """What the hand commands at the knots, everything `late` seconds later, without any tap."""
    knots = np.arange(0.0, DURATION + KNOT_STEP / 2, KNOT_STEP)
    columns = []
    for name in layout.driven:
        jaw = name.endswith("jaw")
        column = TREMOR * tremor(knots, rng) + (half_width + OPEN if jaw else 0.0)
        for begin, duration, far in reaches.get("jaw" if jaw else name, ()):
            # Jaws are told by their distance from the middle: to close is to come nearer.
            column += (-far if jaw else far) * minimum_jerk(knots, begin + late, duration)
        columns.append(column)
    return np.stack([*columns, np.zeros_like(knots)], axis=1)


def _foam(lanes: int) -> Problem:
    """A soft block is gripped, lifted, set down and let go."""
    body = Body("block", mass=0.012, half_width=0.02, stiffness=500.0)
    scene = Scene("foam", Jaws(), body, arm=Arm(), ground=Ground())
    jaw = ((0.03, 0.27, OPEN + 0.014), (0.78, 0.2, -OPEN - 0.014))
    return _problem(
        lanes, scene, {"jaw": jaw, "tongs z": ((0.3, 0.25, 0.03), (0.55, 0.23, -0.031))}
    )


def _cartridge(lanes: int) -> Problem:
    """A hard and heavy cartridge is gripped, lifted and set down hard; the grip stays."""
    body = Body("cartridge", mass=0.06, half_width=0.009, stiffness=1e5)
    scene = Scene("cartridge", Jaws(), body, arm=Arm(), ground=Ground())
    jaw = ((0.03, 0.2, OPEN + 0.01),)
    return _problem(lanes, scene, {"jaw": jaw, "tongs z": ((0.25, 0.25, 0.03), (0.6, 0.2, -0.034))})


def _tugs(lanes: int) -> Problem:
    """Jaws are pulled along a body that is held fast, in tugs between which they stick."""
    body = Body("stylus", mass=0.015, half_width=0.006, stiffness=3e4)
    scene = Scene("stylus", Jaws(), body, arm=Arm(stiffness=2500.0), holder=Holder())
    tugs = tuple((begin, 0.1, 0.006) for begin in (0.25, 0.42, 0.59, 0.76))
    return _problem(lanes, scene, {"jaw": ((0.03, 0.2, OPEN + 0.004),), "tongs z": tugs})


def _snap(lanes: int) -> Problem:
    """A brick is pulled out of its socket and pushed in again until it clicks."""
    body = Body("brick", mass=0.012, half_width=0.008, stiffness=6e4)
    socket = Socket(
        place=0.0, depth=2e-3, friction=3.0, snap=5.0, snap_depth=1.2e-3, snap_width=4e-4
    )
    arm = Arm(axes=("y", "z"))
    scene = Scene("LEGO", Jaws(), body, arm=arm, ground=Ground(), socket=socket)
    reaches = {
        "jaw": ((0.03, 0.17, OPEN + 0.012),),
        "tongs z": ((0.2, 0.25, 0.02), (0.5, 0.35, -0.045)),
    }
    return _problem(lanes, scene, reaches, {"body z": -socket.depth, "in the socket": 1.0})
