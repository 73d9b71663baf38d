"""Opening a project, until its list and the first demonstration's track are painted."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial
from pathlib import Path

from forcelab.gui.measuring.stage import Painted, settle, shown
from forcelab.jobs import Progress
from forcelab.measure.latency import Latency

__all__ = ["measuring_opening"]

NAME = "open a project"


def measuring_opening(
    projects: dict[str, Path], *, times: int, size: tuple[int, int]
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Open projects in a window that is there already; see :mod:`forcelab.gui.measuring`.

    Parameters
    ----------
    projects : dict of str to Path
        What is opened, by what there is much of in it.
    times : int
        Of each.
    size : tuple of int
        Of the window, in pixels.
    """
    rows = []
    with shown(size=size) as window:
        shows = [
            window.demonstrations.view.viewport(),
            window.label.tracks,
            window.label.segments.table.viewport(),
        ]
        for i, (name, project) in enumerate(projects.items()):
            taken = []
            with Painted(shows) as painted:
                for number in range(times):
                    yield Progress(times * i + number, times * len(projects), f"{NAME}, {name}")
                    taken.append(painted.seconds(partial(window.opening.open, project)))
                    settle(window)
                    window.document.close()
                    settle(window)
            rows.append(Latency(NAME, name, tuple(taken)))
    return tuple(rows)
