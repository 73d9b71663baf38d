"""How often the Capture workspace paints what comes, and what a frame costs the window's thread."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import numpy as np
from PySide6.QtCore import QEvent, QObject
from PySide6.QtWidgets import QWidget

from forcelab.capture.virtual import VirtualOptoForce
from forcelab.capture.virtual_streams import rows
from forcelab.gui.capture.phase import Phase
from forcelab.gui.capture.recognising import Choice
from forcelab.gui.capture.workspace import CaptureWorkspace
from forcelab.gui.measuring.stage import rest, shown, until
from forcelab.jobs import Progress
from forcelab.measure.latency import Bound, Latency
from forcelab.measure.streams import performed
from forcelab.project import Project
from forcelab.recognition.examples import Labelled
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import save
from forcelab.recognition.training import train

__all__ = ["measuring_capture"]

#: Frames are 33 ms apart; a painter that is late for one in twenty is not yet seen.
PACED, COST = Bound("median", 0.037), Bound("p95", 0.033)
FRAMES, WORK = "from one live frame to the next", "window's CPU time a live frame"
RATE, SECONDS = 1000.0, 20.0
#: Counts of a newton, and the latency of the labels in milliseconds.
COUNTS, LATENCY = 200.0, 100
#: Seconds that everything runs before frames count.
SETTLED = 2.0


class _Frames(QObject):
    """When a view was painted, and how much CPU time its thread had taken by then."""

    def __init__(self, view: QWidget) -> None:
        super().__init__()
        self.painted: list[tuple[float, float]] = []
        view.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note each paint."""
        if event.type() == QEvent.Type.Paint:
            self.painted.append((time.monotonic(), time.thread_time()))
        return False


def measuring_capture(
    folder: Path, *, frames: int, size: tuple[int, int]
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Watch two virtual DAQs at 1 kHz, scalogram and recognition off and on.

    Parameters
    ----------
    folder : Path
        Where project and recogniser are made.
    frames : int
        Of each setting.
    size : tuple of int
        Of the window in pixels.
    """
    yield Progress(0, 1, "training a recogniser")
    performances = [performed(SECONDS, RATE, seed) for seed in (1, 2)]
    recogniser = folder / "measured.skops"
    save(train([Labelled(*one) for one in performances], preset("fast")), recogniser)
    project = folder / "captured.forcelab"
    Project.create(project).close()
    counts = np.round(COUNTS * np.asarray(performances[0][0].signals)).astype(np.int64)
    found: list[Latency] = []
    with ExitStack() as stack:
        daqs = [VirtualOptoForce(rows(counts[:, i : i + 3], RATE)) for i in (0, 3)]
        for daq in daqs:
            stack.enter_context(daq)
        window = stack.enter_context(shown(project, size))
        window.show_workspace("capture")
        page = window.capture.workspace
        for daq in daqs:
            page.sources.add(f"optoforce:{daq.port}")
        page.connect_button.click()
        until(lambda: page.session.phase is Phase.READY)
        watched = _Frames(page.live)
        for recognised in (False, True):
            for channel in ("", "tangential 1"):
                yield Progress(len(found) // 2, 4, "live frames")
                _choose(page, channel, recogniser if recognised else None)
                rest(SETTLED)
                watched.painted.clear()
                until(lambda: len(watched.painted) > frames)
                found += _told(watched.painted, channel != "", recognised)
    return tuple(found)


def _choose(page: CaptureWorkspace, channel: str, recogniser: Path | None) -> None:
    """Show a scalogram or none, recognise or not, and wait until it does."""
    page.scalogram.choose(channel)
    until(lambda: bool(page.scalogram.strip) == bool(channel))
    recognising = page.session.recognising
    if (recogniser is None) == (recognising.choice is None):
        return
    recognising.set_latency(LATENCY)
    recognising.choose(None if recogniser is None else Choice("measured", recogniser))
    until(lambda: recogniser is None or recognising.glimpse is not None)


def _told(
    painted: list[tuple[float, float]], scalogram: bool, recognised: bool
) -> tuple[Latency, Latency]:
    """How far frames are apart, and what each takes of the window's thread."""
    parts = ["2 DAQs at 1 kHz", *(["scalogram"] * scalogram), *(["recognition"] * recognised)]
    setting = ", ".join(parts)
    apart, work = zip(*((b[0] - a[0], b[1] - a[1]) for a, b in pairwise(painted)), strict=True)
    return (
        Latency(FRAMES, setting, apart, PACED),
        Latency(WORK, setting, work, COST),
    )
