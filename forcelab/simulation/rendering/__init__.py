"""The video of a simulated demonstration: a clean front view, drawn from the motion.

It is a drawing, not a measurement. So that a stranger recognises what is done, some of it is larger
or smaller than life:

* What moves by less than a millimetre is exaggerated: a dome under pressure is flattened by up to
  a third of its radius, and leans by 0.7 mm for each newton that drags at it, at most by as much
  as its radius. A stylus rises in its vice four times as far as it does, and the hand turns ahead
  of the tongs by 0.05 rad for each newton with which their domes twist.
* Domes that slide along a body leave short streaks behind.
* A stylus's thick end is stretched 14 times where the domes climb it, and its tip is shortened.
* A body that stands on the rim beside its socket leans by up to 8 degrees, and strokes along y
  there are 2.5 times as long as they are.
* Depths in a socket are stretched to at least 4.5 mm, and a console's front is cut away.
* Lengths along y far from the socket, and heights above the table or beyond a stylus's tip, are
  shortened: they grow as the inverse hyperbolic sine does.
* Bricks and cartridges are drawn no taller, and blocks less deep, than makes them recognised.
* A tap has rays that fade for a tenth of a second.

Jaws, tongs and body are otherwise where the motion has them, at the true instant of each frame.
Nothing in the picture names the action.
"""

from __future__ import annotations

from forcelab.simulation.rendering.camera import Camera
from forcelab.simulation.rendering.filming import render

__all__ = ["Camera", "render"]
