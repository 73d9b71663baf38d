"""The camera's clock: when a frame was really taken; frame n of the file is stamped n / 30 s."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from forcelab.clock import ClockMap
from forcelab.errors import InputError

__all__ = ["RATE", "Camera"]

Array = NDArray[np.float64]

#: Nominal frames a second, as the file states them.
RATE = 30.0


@dataclass(frozen=True, slots=True)
class Camera:
    """A camera with a clock of its own.

    Parameters
    ----------
    offset : float
        Force time at which the video begins, s; negative when the camera ran before the sensors.
    drift : float
        By what share the camera's second is longer than the sensors', such as 30e-6. At most 1e-3
        either way.
    jitter : float
        Standard deviation of the instants at which the shutter opens, s; at most 1 ms.
    late : int
        Number of frames that come late: by 0.3 to 0.8 of a frame's time.
    tail : float
        Seconds for which the camera goes on after the force recording's end.
    seed : int
        Of jitter and late frames.

    Raises
    ------
    InputError
        If a number is out of its range.
    """

    offset: float = 0.0
    drift: float = 0.0
    jitter: float = 0.0
    late: int = 0
    tail: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for name, low, high in (
            ("offset", -60.0, 60.0),
            ("drift", -1e-3, 1e-3),
            ("jitter", 0.0, 1e-3),
            ("late", 0, 1000),
            ("tail", 0.0, 60.0),
            ("seed", 0, 2**63 - 1),
        ):
            if not low <= getattr(self, name) <= high:
                raise InputError(
                    f"A camera's {name} must lie between {low:g} and {high:g}, "
                    f"not {getattr(self, name)}."
                )

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Camera:
        """A camera as people have them: tens of ppm wrong, a few frames late.

        It starts at most 0.4 s before and 0.15 s after the sensors, and ends after them, so that
        it sees every tap that is not at the very edge.
        """
        return cls(
            offset=float(rng.uniform(-0.4, 0.15)),
            drift=float(rng.choice([-1.0, 1.0]) * rng.uniform(15e-6, 60e-6)),
            jitter=float(rng.uniform(2e-4, 6e-4)),
            late=int(rng.integers(2, 6)),
            tail=float(rng.uniform(0.0, 0.4)),
            seed=int(rng.integers(2**63)),
        )

    @property
    def clock(self) -> ClockMap:
        """From the file's timestamps to force time; true but for jitter and late frames."""
        return ClockMap(offset=self.offset, rate=1.0 + self.drift)

    def shots(self, duration: float) -> tuple[Array, NDArray[np.intp]]:
        """The frames of a force recording.

        Parameters
        ----------
        duration : float
            Of the force recording, s.

        Returns
        -------
        force : ndarray, shape (n,)
            The force time of the instant that each frame shows, rising.
        late : ndarray of int, shape (m,)
            Which frames are late.

        Raises
        ------
        InputError
            If the camera starts after the recording's end.
        """
        length = float(self.clock.to_device(duration + self.tail))
        count = int(np.ceil(length * RATE))
        if count < 1:
            raise InputError(
                f"The camera starts at {self.offset:g} s, after the recording's end at "
                f"{duration:g} s; let it start earlier."
            )
        rng = np.random.default_rng(self.seed)
        # Bounded, so that a frame is never taken before the one that is shown before it: one that
        # is 0.8 of a frame late, and 2.5 ms more, still comes 1.7 ms before one 2.5 ms early.
        shaken = self.jitter * np.clip(rng.standard_normal(count), -2.5, 2.5)
        late = np.sort(rng.permutation(count)[: self.late])
        shaken[late] += rng.uniform(0.3, 0.8, late.size) / RATE
        return self.clock.to_force(np.arange(count) / RATE) + shaken, late
