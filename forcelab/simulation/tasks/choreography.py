"""A choreography: what the hand does one thing after another, and what that is called."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from forcelab.arrays import Real
from forcelab.simulation.hand import KNOT_STEP, minimum_jerk, tremor, wander
from forcelab.simulation.mechanics import Layout
from forcelab.simulation.scene import Scene
from forcelab.simulation.tasks.ground_truth import Cue, Phase

#: The hand goes on for this long after the end, s: longer than a solver's longest step.
AFTERWARDS = 0.02

#: A tap's force follows a squared sine of this length, s.
TAP_LENGTH = 0.03
#: Time before and after the task in which the taps lie, s.
TAP_TIME = 0.6
#: Radians by which the wrist trembles where an arm does by a metre.
WRIST = 10.0
#: Wiggles set in and fade over this time, s.
FADE = 0.08


class Choreography:
    """Collects what one hand does in one demonstration.

    `hand`: how the hand does it, from the recipe; `opening`, `tempo`, `tremor` and `tap` are used
    here, `wander` for the jaws and `sway` for arm and wrist. `t`: where the next phase starts, s;
    `hold`: the grip wanted at present, N; `phases`: one after the other without gaps; `start`:
    where each coordinate is at first, m or rad; `taps`: when the left sensor is tapped, s.
    """

    def __init__(
        self, scene: Scene, hand: Mapping[str, float], rng: np.random.Generator, *, taps: bool
    ) -> None:
        self.scene, self.hand, self.rng = scene, hand, rng
        self.layout = Layout.of(scene)
        self.hold = 0.0
        self.phases: list[Phase] = []
        self.start = dict.fromkeys(self.layout.coordinates, 0.0)
        self._targets = dict.fromkeys(self.layout.commands, 0.0)
        self._moves: list[tuple[str, float, float, float]] = []
        self._wiggles: list[tuple[str, float, float, float, float]] = []
        self.taps: tuple[float, ...] = ()
        self.t = 0.0
        for jaw in ("left jaw", "right jaw"):
            self._targets[jaw] = self.start[jaw] = scene.body.half_width + hand["opening"]
        self._tapping = taps
        if taps:
            self.taps = (TAP_TIME / 2.0,)
            self.t = TAP_TIME

    # What a hand can do

    def lasts(self, name: str) -> float:
        """How long something takes this time, s: as in the recipe, in this hand's tempo."""
        return self.hand[name] * self.hand["tempo"]

    def chance(self, share: float) -> bool:
        """Whether something happens that happens in this share of demonstrations."""
        return bool(self.rng.random() < share)

    def between(self, low: float, high: float) -> float:
        """A number out of a range, each as likely."""
        return float(self.rng.uniform(low, high))

    def phase(self, action: str, duration: float, begins: Cue | None = None) -> None:
        self.phases.append(Phase(action, self.t, self.t + duration, begins))
        self.t += duration

    def move(self, name: str, to: float, start: float, duration: float) -> None:
        self._moves.append((name, to - self._targets[name], start, max(duration, 4 * KNOT_STEP)))
        self._targets[name] = to

    def pull(self, name: str, pace: float, start: float, duration: float) -> None:
        """Go on with one coordinate at a steady pace, m/s or rad/s, with a soft start and end."""
        soft = min(0.15, duration / 2.0)
        # Reaches that overlap by half add up to a steady pace.
        count = max(1, round(duration / soft) - 1)
        for step in range(count):
            to = self._targets[name] + pace * duration / count
            self.move(name, to, start + step * soft, 2.0 * soft)

    def wiggle(self, name: str, start: float, end: float, size: float, frequency: float) -> None:
        """Swing about where it is, by `size` to both sides."""
        self._wiggles.append((name, start, end, size, frequency))

    def grip(self, force: float, start: float, duration: float, lag: float = 0.0) -> None:
        """Close or regrip to a force in N; the right jaw comes `lag` s later."""
        body, jaws = self.scene.body, self.scene.jaws
        sunk = (force / body.stiffness) ** (1.0 / body.exponent)
        for name, share, late in (("left jaw", 1.0, 0.0), ("right jaw", jaws.asymmetry, lag)):
            bent = force / (share * jaws.stiffness)
            self.move(name, body.half_width - sunk - bent, start + late, duration)
        self.hold = force

    def open(self, start: float, duration: float, lag: float = 0.0) -> None:
        """Open the jaws as far as they were in the beginning."""
        for name, late in (("left jaw", 0.0), ("right jaw", lag)):
            self.move(name, self.start[name], start + late, duration)
        self.hold = 0.0

    # What comes out

    def end(self) -> float:
        """Have the last tap and end; how long it all takes, s."""
        if self._tapping:
            self.taps += (self.t + TAP_TIME / 2.0,)
            self.t += TAP_TIME
        return self.t

    def values(self) -> Real:
        """The commands at the knots, shape (m, c), in the order of `Layout.commands`."""
        times = np.arange(0.0, self.t + AFTERWARDS + KNOT_STEP, KNOT_STEP)
        values = {
            name: np.full(len(times), self.start.get(name, 0.0)) for name in self.layout.commands
        }
        for name, way, start, duration in self._moves:
            values[name] += way * minimum_jerk(times, start, duration)
        for name, start, end, size, frequency in self._wiggles:
            fade = np.clip(np.minimum(times - start, end - times) / FADE, 0.0, 1.0)
            phase = self.rng.uniform(0.0, 2.0 * np.pi)
            swing = np.sin(2.0 * np.pi * frequency * times + phase)
            values[name] += size * fade * fade * (3.0 - 2.0 * fade) * swing
        for name in self.layout.driven:
            steady = "wander" if name.endswith("jaw") else "sway"
            size = WRIST if name == "wrist angle" else 1.0
            values[name] += size * self.hand["tremor"] * tremor(times, self.rng)
            values[name] += size * self.hand[steady] * wander(times, self.rng)
        for tap in self.taps:
            u = np.clip((times - tap) / TAP_LENGTH + 0.5, 0.0, 1.0)
            values["tap"] += self.hand["tap"] * np.sin(np.pi * u) ** 2
        return np.stack([values[name] for name in self.layout.commands], axis=1)
