"""Scenes: what is on the table and how it is held; and what a simulated demonstration did there.

A scene holds only the parts it has. A part that is ``None`` has no state, no force and no cost:
without an arm nothing moves tangentially and there is no friction; without a socket nothing snaps.

Axes: x is the grip axis (left jaw to right jaw), y lateral along the table, z upwards; metres,
newtons, kilograms, seconds and radians throughout. The middle between the jaws of the resting
tongs is x = 0, the table's top is z = 0 where the body's lower face touches it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from forcelab.arrays import Real
from forcelab.labels import Segments

Axis = Literal["y", "z"]
Shape = Literal["brick", "cartridge", "stylus", "marker", "block"]


@dataclass(frozen=True)
class Jaws:
    """Two jaws, each pulled towards its commanded place by a finger."""

    mass: float = 0.05  # of one jaw with its sensor and its share of the hand, kg
    #: stiffness and damping: Of a finger: N/m and N s/m. Closing the command beyond the surface by
    #: d gives a grip of about ``stiffness * d``.
    stiffness: float = 1200.0
    damping: float = 12.0
    asymmetry: float = 1.0  # stiffness of the right finger over that of the left one
    touch: float = 2e4  # stiffness in N/m with which the jaws meet when nothing is between them
    dome: float = 0.004  # mass in front of each sensor, kg: the sensor feels its inertia
    #: tilt_left and tilt_right: Angle between each sensor's normal and the grip axis, rad: fingers
    #: squeeze obliquely, so that part of the grip is felt as a tangential force.
    tilt_left: float = 0.0
    tilt_right: float = 0.0
    #: azimuth_left and azimuth_right: Direction towards which each is tilted, rad, 0 along y and a
    #: right angle along z.
    azimuth_left: float = 0.0
    azimuth_right: float = 0.0


@dataclass(frozen=True)
class Body:
    """What lies between the jaws."""

    shape: Shape  # how it is drawn
    mass: float  # kg
    half_width: float  # from its middle to the surface that a jaw touches, m
    stiffness: float  # of the contact with one jaw, N/m^exponent
    #: Hunt and Crossley's, s/m: the force is ``stiffness * depth**exponent * (1 + damping * rate)``
    #: and never negative. Against a socket's bottom it is the same.
    damping: float = 1.0
    exponent: float = 1.0  # 1 for a linear spring, 1.5 for Hertz's sphere on a plane
    height: float = 0.02  # m; drawn only


@dataclass(frozen=True)
class Pads:
    """Friction between the jaws' silicone domes and the body (LuGre)."""

    #: static and kinetic: Coefficients of friction at rest and in steady motion; ``static >=
    #: kinetic``.
    static: float = 1.1
    kinetic: float = 0.8
    stribeck: float = 0.01  # speed at which the one passes into the other, m/s
    #: stiffness, damping and viscous: Of the bristles, per newton of normal force: 1/m, s/m and
    #: s/m.
    stiffness: float = 4000.0
    damping: float = 3.0
    viscous: float = 0.4
    asymmetry: float = 1.0  # friction of the right jaw over that of the left one


@dataclass(frozen=True)
class Arm:
    """The arm that carries the tongs tangentially, and the axes along which it moves."""

    axes: tuple[Axis, ...] = ("z",)  # those of the scene; ``("z",)`` or ``("y", "z")``
    mass: float = 0.35  # of tongs, hand and forearm as they feel at the tip, kg
    #: stiffness and damping: N/m and N s/m.
    stiffness: float = 700.0
    damping: float = 18.0
    pads: Pads = Pads()  # how the jaws rub


@dataclass(frozen=True)
class Ground:
    #: stiffness and damping: Kelvin and Voigt's: N/m and N s/m. The table never pulls.
    stiffness: float = 4e4
    damping: float = 4.0
    friction: Pads = Pads(static=0.45, kinetic=0.35)  # between table and body


@dataclass(frozen=True)
class Holder:
    """The other hand, or a vice, that holds the body in place along x and along the arm's axes."""

    #: stiffness and damping: N/m and N s/m.
    stiffness: float = 6000.0
    damping: float = 6.0


@dataclass(frozen=True)
class Socket:
    """A socket in the table that the body snaps into: LEGO studs, or a cartridge's connector."""

    place: float  # where it is along y, m
    depth: float  # from the rim to the bottom, m
    friction: float  # force of the walls when the body is in, N
    #: snap, snap_depth and snap_width: The click: force of the barrier in N, the depth at which it
    #: is crossed and its width, m. Less than three widths below the rim, getting that far takes
    #: more than this force.
    snap: float
    snap_depth: float
    snap_width: float
    #: bottom, walls and ends: Stiffness of the bottom, of the walls (along y) and of the ends
    #: (along x), N/m.
    bottom: float = 1e5
    walls: float = 2e4
    ends: float = 2e3
    wall_damping: float = 10.0  # of walls and ends, N s/m
    #: How the walls rub, as a share of `friction`.
    rubbing: Pads = Pads(static=1.35, kinetic=1.0, stiffness=3000.0, damping=1.0, viscous=1.0)
    tolerance: float = 3e-4  # how far off the place along y the body may be and still go in, m
    #: studs and pitch: Height and distance of the bumps around the socket, m; they are what
    #: searching feels.
    studs: float = 3e-4
    pitch: float = 8e-3


@dataclass(frozen=True)
class Profile:
    """A width that varies along z, measured from where the jaws first grip."""

    end: float  # where the taper to the tip begins, m
    taper: float  # length of the taper, m; beyond it there is nothing between the jaws
    waviness: float  # share of the half width by which it swells and shrinks before the end
    wavelength: float  # m
    #: rim and rim_length: How much thicker the body gets towards its end, and over which length
    #: before it, m.
    rim: float = 0.0
    rim_length: float = 2e-3
    #: How unevenly the jaws see all this: the right one ``1 + lopsided`` times, the left one ``1 -
    #: lopsided`` times; below 1.
    lopsided: float = 0.0


@dataclass(frozen=True)
class Thread:
    """A cap that turns on the body with stick-slip, and the wrist that turns it.

    They turn about z, positive anticlockwise as seen from above.
    """

    radius: float  # from the axis to the jaws, m
    inertia: float  # of the cap, kg m^2
    #: static and kinetic: Torques at rest and in motion, N m.
    static: float
    kinetic: float
    stribeck: float = 0.3  # rad/s
    #: stiffness, damping and viscous: Of the bristles in the thread, per newton metre: 1/rad, s/rad
    #: and s/rad.
    stiffness: float = 40.0
    damping: float = 0.05
    viscous: float = 0.01
    #: wrist_inertia, wrist_stiffness and wrist_damping: kg m^2, N m/rad and N m s/rad.
    wrist_inertia: float = 6e-4
    wrist_stiffness: float = 0.9
    wrist_damping: float = 0.02
    pads: Pads = Pads()  # how the jaws rub on the cap


Task = Literal["LEGO", "cartridge", "stylus", "marker", "foam"]

#: The tasks of the paper, in the order in which they are listed.
TASKS: tuple[Task, ...] = get_args(Task)


@dataclass(frozen=True)
class Scene:
    """The parts of a scene, of which jaws and body are always there.

    A table, and a width that varies, need an arm that moves along z; a socket needs a table and an
    arm that moves along y as well. A thread is not combined with an arm.
    """

    task: str  # such as ``"LEGO"``
    jaws: Jaws
    body: Body
    arm: Arm | None = None
    ground: Ground | None = None
    holder: Holder | None = None
    socket: Socket | None = None
    profile: Profile | None = None
    thread: Thread | None = None
    gravity: float = 9.81  # m/s^2


@dataclass(frozen=True)
class Motion:
    """Where jaws, tongs and body are; what a scene does not have stays zero."""

    times: Real  # (n,), seconds on the force clock, evenly spaced
    jaws: Real  # (n, 2), distance of the left and the right jaw from the tongs' middle, m
    tongs: Real  # (n, 3), y (m), z (m) and angle (rad) of the tongs
    #: (n, 4), x, y, z (m) and angle (rad) of the body; z is that of its lower face above the table.
    body: Real
    normal: Real  # (n, 2), force that presses on the left and on the right jaw, N, not negative


@dataclass(frozen=True, slots=True, order=True)
class Event:
    """Something that happened at an instant, located to less than a microsecond."""

    time: float  # seconds from the start of the force recording
    kind: str  # such as ``"left jaw: contact made"``, ``"left jaw: slip begins"`` or ``"snap in"``


@dataclass(frozen=True)
class Performance:
    """One simulated demonstration, before sensors, coders and camera had a look at it."""

    scene: Scene  # with the numbers of this demonstration
    motion: Motion
    #: (n, 6), what the two sensors' domes feel, N: fx, fy, fz of the left one, then of the right
    #: one; fz is normal and negative in compression, fx along y, fy along z.
    forces: Real
    rate: float  # of `forces` and `motion`, Hz; several times that of the recording
    actions: Segments  # what was done when, without gaps
    events: tuple[Event, ...]  # in order of time
    #: Times at which a fingertip taps the left dome, so that force and video can be synchronised,
    #: s.
    taps: tuple[float, ...] = ()
