"""Live recognition without its view: which recogniser, which latency, and what it predicts.

Nothing is loaded before a recogniser is chosen, and nothing computed while no device is connected,
or nobody looks and nothing is recorded.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError, InputError
from forcelab.gui import settings
from forcelab.gui.capture.connection import Connection
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs

if TYPE_CHECKING:
    from forcelab.capture.device import Device
    from forcelab.capture.recorder import Recorder
    from forcelab.live.recognition import LatencyBudget, LiveRecognition, LiveSnapshot
    from forcelab.recognition.recogniser import Recogniser


#: Keys of its jobs: the one that reads a recogniser, and the one that goes on for ever.
LOADING, RECOGNISING = "capture: recogniser", "capture: live recognition"
#: Least, usual and greatest latency in milliseconds.
LATENCIES = (0, 300, 10_000)
#: Where the latency that was chosen last is remembered.
LATENCY = "capture/latency"
#: Frames over which the delay to the screen is told.
FRAMES = 900


@dataclass(frozen=True, slots=True)
class RecogniserSelection:
    """A recogniser that can be chosen.

    Parameters
    ----------
    name : str
        What it is called; the author of its tracks is called after it.
    path : Path
        Its file.
    about : str
        When and of what it was trained; empty of a file.
    """

    name: str
    path: Path
    about: str = ""


@dataclass(frozen=True, slots=True)
class LoadedRecogniser:
    """A recogniser that is ready, and what it can promise."""

    choice: RecogniserSelection
    recogniser: Recogniser
    promise: LatencyBudget


class LiveModelController(QObject):
    """A recogniser on whatever devices are connected.

    Parameters
    ----------
    connection : Connection
    document : Document
    jobs : Jobs
    parent : QObject, optional

    Attributes
    ----------
    choice : Choice or None
        Chosen; None for no recognition.
    latency : int
        Milliseconds.
    loaded : Loaded or None
        The chosen one, once it is read.
    trouble : str
        Why there is nothing to be seen; empty where there is.
    watched : bool
        Whether anybody looks.
    """

    changed = Signal()

    def __init__(
        self, connection: Connection, document: Document, jobs: Jobs, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._connection, self._document, self._jobs = connection, document, jobs
        self.choice: RecogniserSelection | None = None
        least, usual, most = LATENCIES
        self.latency = round(settings.number(LATENCY, usual, lowest=least, highest=most))
        self.loaded: LoadedRecogniser | None = None
        self.trouble = ""
        self.watched = False
        self._connected = self._running = False
        self._painted_until = 0.0
        self._delays: deque[float] = deque(maxlen=FRAMES)

    @property
    def glimpse(self) -> LiveSnapshot | None:
        """What was recognised last; None while nothing is."""
        return self._connection.track.glimpse if self.choice is not None else None

    @property
    def delays(self) -> Sequence[float]:
        """Seconds from the force to its label on the screen, of the last frames."""
        return tuple(self._delays)

    def choices(self) -> tuple[RecogniserSelection, ...]:
        """The recognisers of the project, the newest first, and a chosen one from elsewhere."""
        project = self._document.project
        found = []
        if project is not None:
            for one in reversed(project.runs.recognisers()):
                when = one.time.astimezone().strftime("%Y-%m-%d %H:%M")
                tasks = one.settings.get("choice", {}).get("tasks", [])
                about = " · ".join([*map(str, tasks), when])
                with suppress(InputError):  # its file is missing: it is not offered
                    found.append(
                        RecogniserSelection(one.name, project.runs.recogniser_path(one.id), about)
                    )
        if self.choice is not None and self.choice.path not in [one.path for one in found]:
            found.append(self.choice)
        return tuple(found)

    def choose(self, choice: RecogniserSelection | None) -> None:
        """Recognise with another one, or with none."""
        self.choice, self.loaded, self.trouble = choice, None, ""
        self._stop()
        if choice is None:
            self._jobs.cancel(LOADING)
            self.changed.emit()
        else:
            self._load(None)

    def set_latency(self, milliseconds: int) -> None:
        """Let labels rest on so much of what follows."""
        if milliseconds == self.latency:
            return
        self.latency = milliseconds
        settings.store(LATENCY, milliseconds)
        if self.choice is not None:
            known, self.loaded = self.loaded, None
            self._stop()
            self._load(None if known is None else known.recogniser)

    def follow(self, connected: bool) -> None:
        """Devices were connected or let go of."""
        if connected != self._connected:
            self._connected = connected
            self._delays.clear()
            self._painted_until = 0.0
            if not connected and self.loaded is not None:
                self.trouble = ""  # other devices may have what it looks at
            self._begin()

    def painted(self, until: float) -> None:
        """Labels up to a time (s) stand on the screen now."""
        if self._painted_until and until > self._painted_until:
            self._delays.append(time.monotonic() - self._painted_until)
        # Where nothing is decided yet it begins anew: what lies between is late for nobody.
        self._painted_until = 0.0 if math.isnan(until) else until

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is to be said of the channels that it recognises; nothing while there are none."""
        if self.loaded is None or self.trouble or not self._connected:
            return ()
        try:
            return self.loaded.recogniser.remarks_on(self._connection.channels)
        except InputError:  # it lacks a channel, and that is told as its trouble
            return ()

    # Inside

    def _load(self, known: Recogniser | None) -> None:
        """Read the chosen one, and ask what it can promise."""
        assert self.choice is not None
        work = _loading_job(self.choice, self.latency / 1000, known)
        self._jobs.run(work, self._take, self._failed, key=LOADING)
        self.changed.emit()

    def _take(self, loaded: LoadedRecogniser) -> None:
        self.loaded, self.trouble = loaded, ""
        self._begin()
        self.changed.emit()

    def _begin(self) -> None:
        """Recognise, where there is something to recognise and something to do it with."""
        if not self._connected or self.loaded is None or self._running:
            return
        self._running = True
        self._delays.clear()
        self._painted_until = 0.0
        work = self._connection.recognising(
            partial(_load_recogniser, self.loaded), lambda: self.watched
        )
        self._jobs.run(work, self._ended, self._failed_live, key=RECOGNISING)

    def _stop(self) -> None:
        self._jobs.cancel(RECOGNISING)
        self._running = False

    def _ended(self, _: None) -> None:
        """The devices were let go of."""
        self._running = False
        self._begin()  # if others were connected meanwhile

    def _failed(self, error: Exception) -> None:
        self.trouble = _sentence(error)
        self.changed.emit()

    def _failed_live(self, error: Exception) -> None:
        # Not tried again before something else is chosen or connected.
        self._running = False
        self._failed(error)


def _load_recogniser(
    loaded: LoadedRecogniser, recorder: Recorder, devices: Sequence[Device]
) -> LiveRecognition:
    """What recognises the devices of a recorder."""
    from forcelab.live.recognition import LiveRecognition

    latency = loaded.promise.latency
    return LiveRecognition(loaded.recogniser, loaded.choice.name, latency, recorder, devices)


def _loading_job(
    choice: RecogniserSelection, latency: float, known: Recogniser | None
) -> Generator[None, None, LoadedRecogniser]:
    """Read a recogniser that is not known yet, and ask what it can promise."""
    from forcelab.live.recognition import promised
    from forcelab.recognition.storage import load

    yield
    recogniser = load(choice.path) if known is None else known
    yield
    return LoadedRecogniser(choice, recogniser, promised(recogniser, latency))


def _sentence(error: Exception) -> str:
    """What went wrong; a fault of the program is reported elsewhere besides."""
    return str(error) if isinstance(error, ForcelabError) else f"{type(error).__name__}: {error}"
