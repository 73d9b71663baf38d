"""Equations of motion of the tongs, the body between their jaws and whatever holds it.

Coordinates: the distances s of the two jaws from the tongs' middle, the body's x, the places p of
tongs and body along each axis of the arm, and the angles a of wrist and cap. With N the normal
force of a jaw, f its friction on the body and c what the hand commands:

    jaw        m s'' = k (c - s) + b (c' - s') + N + touch + tap
    body       M x'' = N_left - N_right + table + socket + holder
    tongs      m p'' = k (c - p) + b (c' - p') - f_left - f_right + width
    body       M p'' = f_left + f_right - width + table + socket + holder (- M g along z)
    wrist      J a'' = k (c - a) + b (c' - a') - r (f_left + f_right)
    cap        I a'' = r (f_left + f_right) - thread

A jaw presses where ``w - s -+ x > 0``, w being the body's half width at the height of the jaws;
where w varies along z, the contact pushes along z as well ("width"), as energy demands. `Layout`
says which of these states a scene has. Contact made and lost, slip, and the ways into and out of a
socket are events: functions that cross zero when they happen (see `Mechanics`). The laws of contact
are in :mod:`forcelab.simulation.contact`, the numbers in :mod:`forcelab.simulation.scene`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from forcelab.arrays import Real
from forcelab.simulation import contact
from forcelab.simulation.hand import Trajectory, reach
from forcelab.simulation.scene import Axis, Jaws, Scene


def stack_numbers(parts: Sequence[Any]) -> SimpleNamespace:
    """The numbers of equal parts as arrays.

    `parts` length b: of one class, such as scenes, in which the same parts are ``None``. Gives each
    number as an array of shape (b,), each part as such a namespace; texts are left out.
    """
    result = SimpleNamespace()
    for field in fields(parts[0]):
        values = [getattr(part, field.name) for part in parts]
        if values[0] is None:
            setattr(result, field.name, None)
        elif is_dataclass(values[0]):
            setattr(result, field.name, stack_numbers(values))
        elif isinstance(values[0], (int, float)):
            setattr(result, field.name, np.array(values, dtype=np.float64))
    return result


@dataclass(frozen=True)
class Layout:
    """The rows of a scene's state: coordinates, their velocities, bristles, and the mode."""

    axes: tuple[Axis, ...]  # axes along which the arm moves
    #: ground, socket and thread: Whether the scene has them.
    ground: bool
    socket: bool
    thread: bool

    @classmethod
    def of(cls, scene: Scene) -> Layout:
        return cls(
            axes=scene.arm.axes if scene.arm else (),
            ground=scene.ground is not None,
            socket=scene.socket is not None,
            thread=scene.thread is not None,
        )

    @property
    def driven(self) -> tuple[str, ...]:
        """Names of the coordinates that the hand drives."""
        turning = ("wrist angle",) if self.thread else ()
        return ("left jaw", "right jaw", *(f"tongs {axis}" for axis in self.axes), *turning)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates: each has a row for itself and one for its velocity."""
        turning = ("cap angle",) if self.thread else ()
        return (*self.driven, "body x", *(f"body {axis}" for axis in self.axes), *turning)

    @property
    def rubbing(self) -> tuple[str, ...]:
        """Directions in which the jaws rub on the body."""
        return ("turn",) if self.thread else self.axes

    @property
    def sliding(self) -> tuple[str, ...]:
        """Directions in which the body slides on the table."""
        return ("x", *(axis for axis in self.axes if axis != "z")) if self.ground else ()

    @property
    def bristles(self) -> tuple[str, ...]:
        """Names of the bristles: one for each place and direction of friction."""
        jaws = [f"{side} jaw bristle {d}" for d in self.rubbing for side in ("left", "right")]
        table = [f"table bristle {direction}" for direction in self.sliding]
        socket = ["socket bristle"] if self.socket else []
        thread = ["thread bristle"] if self.thread else []
        return (*jaws, *table, *socket, *thread)

    @property
    def names(self) -> tuple[str, ...]:
        rates = tuple(f"{name} rate" for name in self.coordinates)
        mode = ("in the socket",) if self.socket else ()
        return (*self.coordinates, *rates, *self.bristles, *mode)

    @property
    def commands(self) -> tuple[str, ...]:
        """What is commanded: the driven coordinates (m, rad), and a tap on the left dome (N)."""
        return (*self.driven, "tap")


def left_out(scene: Scene) -> tuple[str, ...]:
    """What a scene does without, each with the states or forces that this saves."""
    layout = Layout.of(scene)
    missing = []
    if not layout.axes:
        missing.append("motion along y and z: 8 states")
    elif "y" not in layout.axes:
        missing.append("motion along y: 4 states, 2 jaw bristles")
    if not layout.rubbing:
        missing.append("friction of the jaws: no bristles")
    if not layout.ground:
        missing.append("table: no contact, no table bristles")
    if not layout.socket:
        missing.append("socket and snap: no bristle, no mode")
    if not layout.thread:
        missing.append("twist: 4 states, no thread bristle")
    if scene.profile is None:
        missing.append("width that varies: the body is as wide everywhere")
    if scene.holder is None:
        missing.append("holder: nothing holds the body but jaws and table")
    return tuple(missing)


class Width(NamedTuple):
    """The body where the jaws are, each array of shape (2, n) or (n,)."""

    #: half and slope: (2, n), half width (m) that the left and the right jaw see, and how it
    #: changes along z.
    half: Real
    slope: Real
    #: rest and rest_slope: (n,), how much of the body is left for the jaws to press on, from 1 to
    #: 0, and how that changes along z, 1/m.
    rest: Real
    rest_slope: Real
    #: (n,), how far the jaws are from the tip, m; beyond it, where it is negative, nothing is left.
    tip: Real


def width_at(up: Real, half_width: Real, profile: SimpleNamespace) -> Width:
    """Width at the height of the jaws.

    ``(w0 + (1 -+ lopsided) (waviness w0 sin(2 pi up / wavelength) + rim R(up))) rest(up)``, where
    R rises and `rest` falls like a minimum-jerk reach over the lengths of rim and taper.

    `up` (n,): height of the jaws over where they first gripped, m; `half_width` (b,): w0, m;
    `profile` (b,): the numbers of `Profile`.
    """
    over = up - profile.end
    rim_length = profile.rim_length
    # Both steps at once: numpy takes as long for one of them.
    (gone, rim), (gone_slope, rim_slope) = _step(
        np.stack([over, over + rim_length]), np.stack([profile.taper, rim_length])
    )
    k = 2.0 * np.pi / profile.wavelength
    wave, turns = profile.waviness * half_width, k * up
    uneven = wave * np.sin(turns) + profile.rim * rim
    uneven_slope = wave * k * np.cos(turns) + profile.rim * rim_slope
    share = np.stack([1.0 - profile.lopsided, 1.0 + profile.lopsided])
    full = half_width + share * uneven
    rest = 1.0 - gone
    slope = share * uneven_slope * rest - full * gone_slope
    return Width(full * rest, slope, rest, -gone_slope, profile.taper - over)


def _step(along: Real, length: Real) -> tuple[Real, Real]:
    """A smooth step from 0 to 1 over a length, and its slope."""
    u = np.maximum(along / length, 0.0)
    np.minimum(u, 1.0, out=u)
    rest = u * (1.0 - u)
    return reach(u), 30.0 * rest * rest / length


#: Normal force for which the scales of friction and of curved contacts are made, N.
TYPICAL_GRIP = 10.0


def hand_numbers(layout: Layout, numbers: SimpleNamespace) -> tuple[Real, Real, Real]:
    """Stiffness and damping of the driven coordinates, and the mass of all.

    `numbers`: the numbers of the scenes, from `stack_numbers`. Gives `stiffness`, `damping`
    (driven, b): N/m and N s/m; of the wrist N m/rad and N m s/rad; `mass` (coordinates, b): kg; of
    wrist and cap kg m^2.
    """
    p, a = numbers, len(layout.axes)
    stiffness = [p.jaws.stiffness, p.jaws.asymmetry * p.jaws.stiffness]
    damping = [p.jaws.damping] * 2
    mass, passive = [p.jaws.mass] * 2, [p.body.mass] * (1 + a)
    if layout.axes:
        stiffness += [p.arm.stiffness] * a
        damping += [p.arm.damping] * a
        mass += [p.arm.mass] * a
    if layout.thread:
        stiffness.append(p.thread.wrist_stiffness)
        damping.append(p.thread.wrist_damping)
        mass.append(p.thread.wrist_inertia)
        passive.append(p.thread.inertia)
    return np.stack(stiffness), np.stack(damping), np.stack([*mass, *passive])


def state_scales(layout: Layout, numbers: SimpleNamespace) -> Real:
    """The change of each state that moves a force by about one newton.

    `numbers`: the numbers of the scenes, from `stack_numbers`. Gives (s, b): ``1 / k`` for a
    coordinate that is held by the stiffness k, ``1 / sqrt(k m)`` for its velocity, as of an
    oscillator, ``1 / (N s0)`` for bristles. The mode has one: it never drifts.
    """
    p = numbers
    n = p.body.exponent
    grip = n * p.body.stiffness ** (1.0 / n) * TYPICAL_GRIP ** (1.0 - 1.0 / n)
    mass = dict(zip(layout.coordinates, hand_numbers(layout, p)[2], strict=True))
    stiff: dict[str, Real] = {"left jaw": grip, "right jaw": grip, "body x": 2.0 * grip}
    if layout.rubbing:
        pads = (p.arm or p.thread).pads.stiffness * TYPICAL_GRIP
    for axis in layout.axes:
        stiff[f"tongs {axis}"] = stiff[f"body {axis}"] = 2.0 * pads
    if layout.ground:
        stiff["body z"] = np.maximum(stiff["body z"], p.ground.stiffness)
    if layout.socket:
        stiff["body z"] = np.maximum(stiff["body z"], p.socket.bottom)
    if layout.thread:
        radius = p.thread.radius
        stiff["wrist angle"] = stiff["cap angle"] = 2.0 * pads * radius
        mass["wrist angle"] = mass["wrist angle"] / radius
        mass["cap angle"] = mass["cap angle"] / radius
    rows = [1.0 / stiff[name] for name in layout.coordinates]
    rows += [1.0 / np.sqrt(stiff[name] * mass[name]) for name in layout.coordinates]
    for name in layout.bristles:
        if name.startswith("table"):
            rows.append(1.0 / (p.ground.friction.stiffness * TYPICAL_GRIP))
        elif name.startswith("socket"):
            rows.append(1.0 / (p.socket.rubbing.stiffness * np.maximum(p.socket.friction, 1.0)))
        elif name.startswith("thread"):
            rows.append(p.thread.radius / (p.thread.stiffness * p.thread.kinetic))
        else:
            rows.append(1.0 / pads)
    if layout.socket:
        rows.append(np.ones_like(grip))
    return np.stack(rows)


#: Bristles bent to this share of what they bear slip; below it they stick.
SLIP_SHARE = 0.95
#: Below this normal force, N, nothing is said to slip, as there is nothing to be felt.
FAINTEST_GRIP = 0.05
#: A body this far above the table has left its socket, m.
CLEARANCE = 5e-4

ENTERS, LEAVES = "into the socket", "out of the socket"


def event_meanings(layout: Layout) -> tuple[tuple[str, str], ...]:
    """What it means that the event functions of a layout cross zero, as `Mechanics.events`."""
    jaws = ("left jaw", "right jaw")
    names = [(f"{jaw}: contact made", f"{jaw}: contact lost") for jaw in jaws]
    names.append(("jaws meet", "jaws part"))
    if layout.rubbing:
        names += [(f"{jaw}: slip begins", f"{jaw}: slip ends") for jaw in jaws]
    if layout.thread:
        names.append(("cap slips", "cap sticks"))
    if layout.ground:
        names.append(("body set down", "body lifted"))
    if layout.socket:
        names += [(ENTERS, ""), (LEAVES, ""), ("snap in", "snap out")]
    return tuple(names)


def friction_limit(velocity: Real, pads: SimpleNamespace) -> Real:
    """The coefficient of friction that bristles can bear, (...), at velocities (axes, ...), m/s."""
    return contact.bristle_limit(contact.length(velocity), pads.static, pads.kinetic, pads.stribeck)


def slip_margin(bristles: Real, velocity: Real, pads: SimpleNamespace, normal: Real) -> Real:
    """Above zero where a jaw slips on the body, shape (2, n).

    `bristles` (directions, 2, n); `velocity` (directions, n): m/s; `pads` (b,): the numbers of
    `Pads`; `normal` (2, n): N. The function fades with it, so that losing contact ends the slip
    without a jump.
    """
    limit = friction_limit(velocity, pads)
    fade = np.minimum(normal / FAINTEST_GRIP, 1.0)
    slips: Real = contact.length(bristles) * (pads.stiffness / limit) * fade - SLIP_SHARE
    return slips


def socket_margins(
    place: Real, depth: Real, inside: Real, socket: SimpleNamespace
) -> tuple[Real, Real, Real]:
    """Above zero where the body goes into its socket, where it leaves, and where it has snapped in.

    `place` (2, n): y and z of the body, m; `depth` (n,): by how much it is pressed into the table,
    m; `inside` (n,); `socket` (b,): the numbers of `Socket`.
    """
    y, z = place
    off, clear = np.abs(y - socket.place), -depth
    near = np.minimum(socket.tolerance - off, depth)
    # A body above the rim need not be lifted clear of it to leave sideways.
    aside = np.minimum(clear, off - 2.0 * socket.tolerance)
    return (
        np.where(inside, socket.tolerance, near),
        np.where(inside, np.maximum(clear - CLEARANCE, aside), -CLEARANCE),
        np.where(inside, -z, 0.0) - socket.snap_depth,
    )


class Surfaces:
    """The surfaces that rub on the body: numpy takes as long for one of them as for all.

    They are the left jaw, the right jaw, and the table and the walls of the socket where the scene
    has them, each with axes of its own: see `Layout`.

    `numbers`: the numbers of the scenes, from `stack_numbers`; `pads`: the numbers of `Pads`, each
    of shape (surfaces, b).
    """

    def __init__(self, layout: Layout, numbers: SimpleNamespace) -> None:
        jaws = (numbers.arm or numbers.thread).pads
        pads = [jaws, jaws]
        if layout.ground:
            pads.append(numbers.ground.friction)
        if layout.socket:
            pads.append(numbers.socket.rubbing)
        numbers_of = [vars(each) for each in pads]
        self.pads = SimpleNamespace(
            **{name: np.stack([each[name] for each in numbers_of]) for name in numbers_of[0]}
        )
        self._share = np.stack([np.ones_like(jaws.asymmetry), jaws.asymmetry])
        self._rub, self._slide = len(layout.rubbing), len(layout.sliding)
        self._alone = not layout.ground
        self._shape = max(self._rub, self._slide), len(pads)

    def normal(self, jaws: Real, table: Real | None, walls: Real | None) -> Real:
        """What presses on the surfaces, shape (surfaces, n), from (2, n), (n,) and (n,), N."""
        if self._alone:
            return jaws * self._share
        normal = np.zeros((self._shape[1], jaws.shape[1]))
        np.multiply(jaws, self._share, out=normal[:2])
        normal[2] = table
        if walls is not None:
            normal[3] = walls
        return normal

    def beside(self, jaws: Real, table: Real, walls: Real | None) -> Real:
        """Velocities or bristles of all surfaces, shape (axes, surfaces, n).

        `jaws` (axes, 2, n); `table` (axes, n): of no axes where there is none; `walls` (n,).
        """
        if self._alone:
            return jaws
        result = np.zeros((*self._shape, jaws.shape[2]))
        result[: self._rub, :2] = jaws
        result[: self._slide, 2] = table
        if walls is not None:
            result[0, 3] = walls
        return result

    def jaws(self, rows: Real) -> Real:
        """The jaws' part of such an array, shape (axes, 2, n)."""
        return rows[: self._rub, :2]

    def table(self, rows: Real) -> Real:
        """The table's part of such an array, shape (axes, n)."""
        return rows[: self._slide, 2]


#: Bristles that bear nothing straighten with this time constant, s.
STRAIGHTENING = 5e-3
#: Share of the socket's depth over which its walls and its friction set in.
RIM_SHARE = 0.25
#: The bumps around a socket fade over this many pitches.
BUMP_REACH = 3.0


class Table(NamedTuple):
    """The table under the body: how deep it is pressed in, how fast, and the slope there."""

    depth: Real
    rate: Real
    slope: Real | None


def table_under(place: Real, speed: Real, socket: SimpleNamespace | None) -> Table:
    """Where the body stands relative to the table's surface.

    The surface is flat at z = 0 but for the bumps around a socket, between which it lies:
    ``h/2 (1 - cos(2 pi e / pitch)) exp(-(e / (3 pitch))^4)`` at e from its place.

    `place`, `speed` (axes, n): of the body along y, where it moves so, and z: m and m/s; `socket`
    (b,): the numbers of `Socket`.
    """
    if socket is None:
        return Table(-place[-1], -speed[-1], None)
    e = place[0] - socket.place
    k = 2.0 * np.pi / socket.pitch
    reach = BUMP_REACH * socket.pitch
    far = e / reach
    cube = far * far * far  # numpy's own powers cost more than all the rest
    fade = 0.5 * socket.studs * np.exp(-far * cube)
    turns = k * e
    bump = 1.0 - np.cos(turns)
    slope = fade * (k * np.sin(turns) - bump * (4.0 / reach) * cube)
    return Table(fade * bump - place[-1], slope * speed[0] - speed[-1], slope)


def sliding_friction(
    normal: Real, velocity: Real, bristles: Real, pads: SimpleNamespace
) -> tuple[Real, Real]:
    """Friction against a motion along one or more axes that share their bristles' limit.

    `normal` (..., n): N; `velocity`, `bristles` (axes, ..., n): m/s and m; `pads` (b,): the numbers
    of `Pads`. Gives `force`, `bristle_rate` (axes, ..., n): the force along `velocity` that drives
    the other side, N; and m/s.
    """
    limit = friction_limit(velocity, pads)
    rate = contact.bristle_rate(velocity, bristles, pads.stiffness, limit)
    force = contact.lugre(
        normal, velocity, bristles, rate, pads.stiffness, pads.damping, pads.viscous
    )
    rate -= bristles * ((normal <= 0.0) * (1.0 / STRAIGHTENING))
    return force, rate


def socket_push(
    place: Real, speed: Real, inside: Real, socket: SimpleNamespace, damping: Real
) -> tuple[Real, Real]:
    """Forces of the socket on a body that is in it, but for the friction of its walls.

    `place`, `speed` (3, n): x, y and z of the body, m, and their rates, m/s; `inside` (n,): 1 where
    the body is in the socket, else 0: there it feels nothing of it; `socket` (b,): the numbers of
    `Socket`; `damping` (b,): Hunt and Crossley's, of the body on the bottom, s/m. Gives `force` (3,
    n): along x, y and z, N; `hold` (n,): how hard the walls press on the body, which rubs along z,
    N.

    Walls, ends, snap and friction set in over the first quarter of the depth as
    ``e = 3 u^2 - 2 u^3``, so that a body enters without a jump. The force is minus the slope of the
    energy ``e (walls askew^2 / 2 + ends x^2 / 2 + snap)``: a body that is askew at the rim is
    pushed out again, as by a chamfer.
    """
    depth, x, askew = -place[2], place[0], place[1] - socket.place
    rim = RIM_SHARE * socket.depth
    u = np.maximum(depth / rim, 0.0)
    np.minimum(u, 1.0, out=u)
    entered = u * u * (3.0 - 2.0 * u) * inside
    click = socket.snap, socket.snap_depth, socket.snap_width
    wall, end = socket.walls * askew, socket.ends * x
    stored = 0.5 * (wall * askew + end * x) + contact.snap_energy(depth, *click)
    chamfer = 6.0 * u * (1.0 - u) / rim * stored
    bottom = contact.hunt_crossley(depth - socket.depth, -speed[2], socket.bottom, damping)
    force = np.empty(place.shape)
    np.multiply(-entered, end + socket.wall_damping * speed[0], out=force[0])
    np.multiply(-entered, wall + socket.wall_damping * speed[1], out=force[1])
    np.multiply(inside, chamfer + bottom, out=force[2])
    force[2] -= entered * contact.snap(depth, *click)
    return force, socket.friction * entered


#: Left jaw, right jaw: the sign of the force with which each pushes the body along x.
SIDES = np.array([[1.0], [-1.0]])


def _tilts(jaws: Jaws) -> Real:
    """Rotations, shape (2, 3, 3), from the scene's axes to those of the tilted sensors."""
    turns = []
    for tilt, azimuth in (
        (jaws.tilt_left, jaws.azimuth_left),
        (jaws.tilt_right, jaws.azimuth_right),
    ):
        towards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        across = np.array([-towards[1], towards[0], 0.0])
        normal = np.array([0.0, 0.0, 1.0])
        tilted = np.cos(tilt) * towards - np.sin(tilt) * normal
        frame = np.array([towards, across, normal])
        turned = [tilted, across, np.sin(tilt) * towards + np.cos(tilt) * normal]
        turns.append(frame.T @ np.array(turned))
    return np.stack(turns)


class Mechanics:
    """A batch of demonstrations of scenes with the same parts, as the solvers integrate them.

    Each is a lane, a column of the state; `names` says what its s rows are: first `dof`
    coordinates, then their velocities: ``rates(t, y)[:dof] == y[dof : 2 * dof]`` exactly. `scales`
    (s, b) turns a tolerance in newtons into one for each state: how large a change of it moves a
    force of the lane by about one newton. `events` says what it means that an event function rises
    or falls through zero, as ``(rising, falling)``; an empty meaning is no event.

    `scenes`: one for each lane; they have the same parts but their own numbers; `command`: one lane
    for each scene, with the commands of :attr:`Layout.commands`; `drive`: the same commands as
    forces, where they are known already.
    """

    def __init__(
        self, scenes: Sequence[Scene], command: Trajectory, drive: Trajectory | None = None
    ) -> None:
        self.scenes = tuple(scenes)
        self.command = command
        self.layout = layout = Layout.of(self.scenes[0])
        self.lanes = len(self.scenes)
        self.names = layout.names
        self.dof = p = len(layout.coordinates)
        d, a = len(layout.driven), len(layout.axes)
        self._x, self._held, self._along = d, slice(d, d + 1 + a), slice(d + 1, d + 1 + a)
        self._rub = slice(2 * p, 2 * p + 2 * len(layout.rubbing))
        self._slide = slice(self._rub.stop, self._rub.stop + len(layout.sliding))
        self._p = numbers = stack_numbers(self.scenes)
        self._stiffness, self._damping, self._mass = hand_numbers(layout, numbers)
        self._drive = drive or command.driving(
            np.concatenate([self._stiffness, np.ones((1, self.lanes))]),
            np.concatenate([self._damping, np.zeros((1, self.lanes))]),
        )
        hertzian = any(scene.body.exponent != 1.0 for scene in self.scenes)
        self._exponent = numbers.body.exponent if hertzian else None
        self._pads = (numbers.arm or numbers.thread).pads if layout.rubbing else None
        self._surfaces = Surfaces(layout, numbers) if layout.rubbing else None
        if layout.thread:
            # Rubs as pads do that are pressed on by the torque in steady motion.
            kinetic = numbers.thread.kinetic
            self._screw = SimpleNamespace(**vars(numbers.thread))
            self._screw.static, self._screw.kinetic = numbers.thread.static / kinetic, np.ones(1)
        self.scales = state_scales(layout, numbers)
        self.events = event_meanings(layout)

    def rates(self, times: Real, states: Real) -> Real:
        """Derivatives of the states (s, b), each lane at its own time (b,): a new array."""
        rates: Real = self.evaluate(times, states).rates
        return rates

    def lane(self, number: int) -> Mechanics:
        """One lane as a system of its own.

        Its methods also take any number of columns: n times and states of shape (s, n) of that one
        lane, which is how a finished trajectory is looked at all at once.
        """
        return self.subset(np.array([number]))

    def subset(self, lanes: NDArray[np.intp]) -> Mechanics:
        """Some of the lanes, in the order given, as a system of their own."""
        scenes = [self.scenes[i] for i in lanes]
        return Mechanics(scenes, self.command.subset(lanes), self._drive.subset(lanes))

    def jump(self, event: int, rising: bool, state: Real) -> Real:
        """The state (s,) of a lane right after an event: the body enters or leaves the socket."""
        meaning = self.events[event][not rising]
        if meaning not in (ENTERS, LEAVES):
            return state
        after = state.copy()
        after[-1] = float(meaning == ENTERS)
        return after

    def watched(self, times: Real, states: Real) -> Real:
        """The event functions, shape (e, b): continuous while no jump happens."""
        instant = self._contacts(states)
        rows = [*instant.depth, instant.touch]
        if self._p.profile is not None:
            # Closed jaws overlap with the tip, which ends there, by as much as with each other.
            rows[:2] = np.minimum(instant.depth, instant.width.tip)
        pads = self._pads
        if pads is not None:
            bristles = states[self._rub].reshape(-1, 2, len(times))
            rows += list(slip_margin(bristles, self._sliding(states), pads, instant.normal))
        if self.layout.thread:
            limit = friction_limit(states[2 * self.dof - 1 : 2 * self.dof], self._screw)
            rows.append(np.abs(states[-1]) * self._screw.stiffness / limit - SLIP_SHARE)
        if self.layout.ground:
            rows.append(instant.table.depth)
        if self.layout.socket:
            place, inside = states[self._along], states[-1] > 0.5
            rows += socket_margins(place, instant.table.depth, inside, self._p.socket)
        return np.stack(rows)

    def evaluate(self, times: Real, states: Real) -> SimpleNamespace:
        """Everything at some instants: the rates of the states, and the forces behind them.

        `times` (n,): one for each lane, or any number for a system of one lane; `states` (s, n).
        Gives ``rates`` (s, n); of the jaws ``depth`` and ``normal`` (2, n), m and N, ``touch``
        (n,), by how much they overlap, ``pressed`` (2, n), all that presses on them, and ``tap``.
        Where jaws rub, ``friction`` (directions, 2, n) on the body. Where there is a table,
        ``table``, how the body stands on it.
        """
        p, count, d = self._p, self.dof, self._x
        q, v = states[:count], states[count : 2 * count]
        rates = np.empty_like(states)
        rates[:count] = v
        force = np.zeros_like(q)
        instant = self._contacts(states)
        instant.rates = rates
        drive = self._drive.at(times)
        force[:d] = drive[:-1] - self._stiffness * q[:d] - self._damping * v[:d]
        pressed = instant.normal
        if np.count_nonzero(instant.touch > 0.0):
            pressed = pressed + contact.hunt_crossley(
                instant.touch, -(v[0] + v[1]), p.jaws.touch, p.body.damping
            )
        force[0] += drive[-1]
        force[:2] += pressed
        np.subtract(instant.normal[0], instant.normal[1], out=force[d])
        if self.layout.ground:
            self._stand(instant, states, force)
        if self._surfaces is not None:
            self._rub_along(instant, states, force, self._surfaces)
        if p.profile is not None:
            self._widen(instant, force)
        if self.layout.thread:
            self._turn(instant, states, force)
        if p.holder is not None:
            held = self._held
            force[held] -= p.holder.stiffness * q[held] + p.holder.damping * v[held]
        elif self.layout.axes[-1:] == ("z",):
            force[-1] -= p.body.mass * p.gravity
        np.divide(force, self._mass, out=rates[count : 2 * count])
        if self.layout.socket:
            rates[-1] = 0.0
        instant.pressed = pressed
        instant.tap = drive[-1]
        return instant

    def sensor_forces(self, times: Real, states: Real) -> Real:
        """What the sensors' domes feel in a system of one lane.

        `times` (n,); `states` (s, n). Gives (6, n): fx, fy, fz of the left sensor, then of the
        right one: x along the scene's y, y along its z, z normal and negative in compression, as
        the tilted sensors see them. The domes' own inertia is felt too.
        """
        instant, p = self.evaluate(times, states), self._p
        acceleration = instant.rates[self.dof :]
        forces = np.zeros((2, 3, instant.tap.size))
        forces[:, 2] = p.jaws.dome * acceleration[:2] - instant.pressed
        forces[0, 2] -= instant.tap
        if self.layout.thread:
            inertia = p.jaws.dome * p.thread.radius * acceleration[2]
            forces[:, 0] = (instant.friction[0] + inertia) * SIDES
        for row, axis in enumerate(self.layout.axes):
            inertia = p.jaws.dome * acceleration[2 + row]
            forces[:, "yz".index(axis)] = -instant.friction[row] - inertia
        if p.profile is not None:
            forces[:, 1] += instant.widening
        return (_tilts(self.scenes[0].jaws) @ forces).reshape(6, -1)

    def _contacts(self, states: Real) -> SimpleNamespace:
        """How jaws, body and table meet: the first part of :meth:`evaluate`."""
        p, count, d = self._p, self.dof, self._x
        instant = SimpleNamespace()
        # Places and velocities in one: how near each jaw is to the body's middle.
        bodies = states[: 2 * count].reshape(2, count, -1)
        near, nearing = bodies[:, :2] + SIDES * bodies[:, d, None]
        half, stiffness, depth_rate = p.body.half_width, p.body.stiffness, -nearing
        if p.profile is not None:
            along, passing = bodies[:, d - 1] - bodies[:, -1]
            instant.width = width_at(along, half, p.profile)
            half, stiffness = instant.width.half, stiffness * instant.width.rest
            depth_rate += instant.width.slope * passing
        instant.depth = half - near
        instant.normal = contact.hunt_crossley(
            instant.depth, depth_rate, stiffness, p.body.damping, self._exponent
        )
        instant.touch = -(states[0] + states[1])
        if self.layout.ground:
            place, speed = bodies[:, self._held]
            instant.table = table_under(place[1:], speed[1:], p.socket)
        return instant

    def _sliding(self, states: Real) -> Real:
        """How fast jaws and body slide past each other, shape (directions, n)."""
        v, d = states[self.dof :], self._x
        if self.layout.thread:
            turning: Real = (self._p.thread.radius * (v[d - 1] - v[d + 1]))[None]
            return turning
        return v[2:d] - v[self._along]

    def _rub_along(
        self, instant: SimpleNamespace, states: Real, force: Real, surfaces: Surfaces
    ) -> None:
        """Friction of jaws, table and socket: the jaws' holds back tongs and wrist."""
        count, d = self.dof, self._x
        sliding, slides, table, walls = self._sliding(states), states[self._slide], None, None
        bristles, rubbing = states[self._rub].reshape(len(sliding), 2, -1), slides
        if self.layout.ground:
            table, rubbing = instant.load, states[count + d : count + d + len(slides)]
        if self.layout.socket:
            walls = states[-1] * states[2 * count - 1], states[-2]
        friction, rate = sliding_friction(
            surfaces.normal(instant.normal, table, instant.hold if walls else None),
            surfaces.beside(sliding[:, None], rubbing, walls[0] if walls else None),
            surfaces.beside(bristles, slides, walls[1] if walls else None),
            surfaces.pads,
        )
        instant.friction = surfaces.jaws(friction)
        instant.rates[self._rub] = surfaces.jaws(rate).reshape(2 * len(sliding), -1)
        if not self.layout.thread:
            friction_sum = instant.friction[:, 0] + instant.friction[:, 1]
            force[2:d] -= friction_sum
            force[self._along] += friction_sum
        if self.layout.ground:
            instant.rates[self._slide] = surfaces.table(rate)
            force[d : d + len(slides)] -= surfaces.table(friction)
        if walls:
            instant.rates[-2] = rate[0, 3]
            force[d + 2] -= friction[0, 3]

    def _widen(self, instant: SimpleNamespace, force: Real) -> None:
        """Push tongs and body apart along z where the body's width varies."""
        body, width = self._p.body, instant.width
        stored = contact.hunt_crossley_energy(instant.depth, body.stiffness, self._exponent)
        instant.widening = -instant.normal * width.slope - stored * width.rest_slope
        push = instant.widening.sum(axis=0)
        force[self._x - 1] += push
        force[-1] -= push

    def _turn(self, instant: SimpleNamespace, states: Real, force: Real) -> None:
        """Turn the cap: the jaws' friction turns it, the thread holds it back."""
        torque = self._p.thread.radius * instant.friction[0].sum(axis=0)
        cap_rate = states[2 * len(force) - 1]
        held, rate = sliding_friction(
            self._p.thread.kinetic, cap_rate[None], states[-1:], self._screw
        )
        instant.rates[-1] = rate[0]
        force[self._x - 1] -= torque
        force[-1] = torque - held[0]

    def _stand(self, instant: SimpleNamespace, states: Real, force: Real) -> None:
        """Table and socket press on the body."""
        p, table = self._p, instant.table
        normal = contact.kelvin_voigt(table.depth, table.rate, p.ground.stiffness, p.ground.damping)
        push = force[self._held]
        if p.socket is not None:
            inside = states[-1]
            normal = normal * (1.0 - inside)
            instant.hold = None
            if np.count_nonzero(inside > 0.0):
                place, speed = states[: 2 * len(force)].reshape(2, len(force), -1)[:, self._held]
                socket, instant.hold = socket_push(place, speed, inside, p.socket, p.body.damping)
                push += socket
        instant.load = normal
        push[-1] += normal
        if table.slope is not None:
            push[1] -= normal * table.slope
