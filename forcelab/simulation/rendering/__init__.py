"""The video of a simulated demonstration: a clean front view, drawn from the motion.

It is a drawing, not a measurement. So that a stranger recognises what is done, some of it is larger
or smaller than life:

* What moves by less than a millimetre is exaggerated: a dome under pressure is flattened by up to
  a third of its radius, and leans by 0.2 mm for each newton that drags at it.
* Depths in a socket are stretched to at least 4.5 mm, and a console's front is cut away.
* Lengths along y far from the socket, and heights above the table, are shortened: beyond 10 mm
  they grow as the inverse hyperbolic sine does.
* Bricks and cartridges are drawn no taller than makes them recognised.

Jaws, tongs and body are otherwise where the motion has them, at the true instant of each frame.
Nothing in the picture names the action.
"""

from __future__ import annotations

from forcelab.simulation.rendering.camera import Camera, Filmed
from forcelab.simulation.rendering.filming import picture, render, rendering

__all__ = ["Camera", "Filmed", "picture", "render", "rendering"]
