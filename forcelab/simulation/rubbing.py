"""Where the body is rubbed: the jaws, the table and the walls of the socket, side by side."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from forcelab.simulation.contact import Array
from forcelab.simulation.layout import Layout
from forcelab.simulation.stacking import beside

__all__ = ["Surfaces"]


class Surfaces:
    """The surfaces that rub on the body: numpy takes as long for one of them as for all.

    They are the left jaw, the right jaw, and the table and the walls of the socket where the scene
    has them, each with axes of its own: see `Layout`.

    Parameters
    ----------
    layout : Layout
        One whose jaws rub.
    numbers : namespace of ndarray, shape (b,)
        The numbers of the scenes, from `stacked`.

    Attributes
    ----------
    pads : namespace of ndarray, shape (surfaces, b)
        The numbers of `Pads`.
    """

    def __init__(self, layout: Layout, numbers: SimpleNamespace) -> None:
        jaws = (numbers.arm or numbers.thread).pads
        pads = [jaws, jaws]
        if layout.ground:
            pads.append(numbers.ground.friction)
        if layout.socket:
            pads.append(numbers.socket.rubbing)
        self.pads = beside(pads)
        self._share = np.stack([np.ones_like(jaws.asymmetry), jaws.asymmetry])
        self._rub, self._slide = len(layout.rubbing), len(layout.sliding)
        self._alone = not layout.ground
        self._shape = max(self._rub, self._slide), len(pads)

    def normal(self, jaws: Array, table: Array | None, walls: Array | None) -> Array:
        """What presses on the surfaces, shape (surfaces, n), from (2, n), (n,) and (n,), N."""
        if self._alone:
            return jaws * self._share
        normal = np.zeros((self._shape[1], jaws.shape[1]))
        np.multiply(jaws, self._share, out=normal[:2])
        normal[2] = table
        if walls is not None:
            normal[3] = walls
        return normal

    def beside(self, jaws: Array, table: Array, walls: Array | None) -> Array:
        """Velocities or bristles of all surfaces, shape (axes, surfaces, n).

        Parameters
        ----------
        jaws : ndarray, shape (axes, 2, n) or (axes, 1, n)
        table : ndarray, shape (axes, n)
            Of no axes where there is none.
        walls : ndarray, shape (n,), optional
        """
        if self._alone:
            return jaws
        result = np.zeros((*self._shape, jaws.shape[2]))
        result[: self._rub, :2] = jaws
        result[: self._slide, 2] = table
        if walls is not None:
            result[0, 3] = walls
        return result

    def jaws(self, beside: Array) -> Array:
        """The jaws' part of such an array, shape (axes, 2, n)."""
        return beside[: self._rub, :2]

    def table(self, beside: Array) -> Array:
        """The table's part of such an array, shape (axes, n)."""
        return beside[: self._slide, 2]
