"""Live recognition without its view: which recogniser, which latency, and what it predicts.

Nothing is loaded before a recogniser is chosen, and nothing computed while no device is connected,
or the page is hidden and nothing is recorded.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Generator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from forcelab.errors import ForcelabError, InputError
from forcelab.gui import settings
from forcelab.gui.capture.connection import Connection
from forcelab.gui.document import Document
from forcelab.gui.jobs import Jobs

if TYPE_CHECKING:
    from forcelab.capture.recorder import Recorder
    from forcelab.live.recognition import LatencyBudget, LiveRecognition
    from forcelab.recognition.recogniser import Recogniser


#: Keys of its jobs: the one that reads a recogniser, and the one that goes on for ever.
LOADING, RECOGNISING = "capture: recogniser", "capture: live recognition"
#: Least, usual and greatest latency in milliseconds.
LATENCIES = (0, 300, 10_000)
#: Where the latency that was chosen last is remembered.
LATENCY = "capture/latency"
#: Where it is remembered whether labels are sent, and what the stream is called.
SENDING, STREAM = "capture/send labels", "forcelab"
#: Frames over which the delay to the screen is measured.
FRAMES = 900


@dataclass(frozen=True, slots=True)
class RecogniserSelection:
    """A recogniser that can be chosen."""

    #: The author of its tracks is called after it.
    name: str
    path: Path
    #: When and of what it was trained; empty of a file.
    about: str = ""


@dataclass(frozen=True, slots=True)
class LoadedRecogniser:
    """A recogniser that is ready, and what its latency means."""

    selection: RecogniserSelection
    recogniser: Recogniser
    budget: LatencyBudget


def can_send() -> bool:
    """Whether the package is installed that sends labels to the Lab Streaming Layer."""
    return find_spec("pylsl") is not None


class RecognitionController(QObject):
    """A recogniser on whatever devices are connected."""

    changed = Signal()

    def __init__(
        self, connection: Connection, document: Document, jobs: Jobs, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._connection, self._document, self._jobs = connection, document, jobs
        #: What is recognised.
        self.track = connection.track
        #: None for no recognition.
        self.selection: RecogniserSelection | None = None
        least, usual, most = LATENCIES
        #: Milliseconds.
        self.latency = round(settings.number(LATENCY, usual, lowest=least, highest=most))
        #: Whether the labels go to the Lab Streaming Layer as well.
        self.sending = settings.flag(SENDING)
        #: The selected one, once it is read.
        self.loaded: LoadedRecogniser | None = None
        #: Why nothing is recognised; empty where something is.
        self.problem = ""
        #: Whether its view is.
        self.visible = False
        self._connected = False
        self._painted_until = 0.0
        #: Seconds from the force to its label on the screen, of the last frames.
        self.delays: deque[float] = deque(maxlen=FRAMES)

    def available(self) -> tuple[RecogniserSelection, ...]:
        """The recognisers of the project, the newest first, and a selected one from elsewhere."""
        project = self._document.project
        selections = []
        if project is not None:
            for stored in reversed(project.runs.recognisers()):
                when = stored.time.astimezone().strftime("%Y-%m-%d %H:%M")
                about = " · ".join([*map(str, stored.tasks), when])
                with suppress(InputError):  # its file is missing: it is not offered
                    path = project.runs.recogniser_path(stored.id)
                    selections.append(RecogniserSelection(stored.name, path, about))
        paths = [selection.path for selection in selections]
        if self.selection is not None and self.selection.path not in paths:
            selections.append(self.selection)
        return tuple(selections)

    def select(self, selection: RecogniserSelection | None) -> None:
        """Recognise with another one, or with none."""
        self.selection, self.loaded, self.problem = selection, None, ""
        self._jobs.cancel(RECOGNISING)
        if selection is None:
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
        if self.selection is not None:
            loaded, self.loaded = self.loaded, None
            self._jobs.cancel(RECOGNISING)
            self._load(None if loaded is None else loaded.recogniser)

    def set_sending(self, sending: bool) -> None:
        """Send the labels to the Lab Streaming Layer as well, or do not."""
        if sending == self.sending:
            return
        self.sending = sending
        settings.store(SENDING, sending)
        if self.loaded is not None:
            self._jobs.cancel(RECOGNISING)
            self._begin()

    def set_connected(self, connected: bool) -> None:
        """Devices were connected or released."""
        if connected != self._connected:
            self._connected = connected
            self._reset_delays()
            if not connected and self.loaded is not None:
                self.problem = ""  # other devices may have the channels that it needs
            self._begin()

    def record_painted(self, until: float) -> None:
        """Labels up to a time (s) are on the screen now."""
        if self._painted_until and until > self._painted_until:
            self.delays.append(time.monotonic() - self._painted_until)
        # Where nothing is decided yet it begins anew: what lies between is not late.
        self._painted_until = 0.0 if math.isnan(until) else until

    @property
    def remarks(self) -> tuple[str, ...]:
        """Warnings about the channels that it recognises; none while there are no channels."""
        if self.loaded is None or self.problem or not self._connected:
            return ()
        try:
            return self.loaded.recogniser.unit_remarks(self._connection.channels)
        except InputError:  # it lacks a channel, and that is shown as its problem
            return ()

    def _reset_delays(self) -> None:
        self.delays.clear()
        self._painted_until = 0.0

    def _load(self, loaded: Recogniser | None) -> None:
        """Read the selected one, and find out what its latency means."""
        assert self.selection is not None
        job = _load_recogniser(self.selection, self.latency / 1000, loaded)
        self._jobs.run(job, self._loaded, self._failed, key=LOADING)
        self.changed.emit()

    def _loaded(self, loaded: LoadedRecogniser) -> None:
        self.loaded, self.problem = loaded, ""
        self._begin()
        self.changed.emit()

    def _begin(self) -> None:
        """Recognise, where there is something to recognise and something to do it with."""
        if not self._connected or self.loaded is None or self._jobs.awaits(RECOGNISING):
            return
        self._reset_delays()
        job = self._connection.recognise(
            partial(_follow_devices, self.loaded, self.sending), lambda: self.visible
        )
        # It ends when the devices are released: others may have been connected meanwhile. What has
        # failed is not tried again before something else is selected or connected.
        self._jobs.run(job, lambda _: self._begin(), self._failed, key=RECOGNISING)

    def _failed(self, error: Exception) -> None:
        # A fault of the program is reported elsewhere besides.
        expected = isinstance(error, ForcelabError)
        self.problem = str(error) if expected else f"{type(error).__name__}: {error}"
        self.changed.emit()


def _follow_devices(loaded: LoadedRecogniser, sending: bool, recorder: Recorder) -> LiveRecognition:
    # Only a window in which something is recognised live loads it.
    from forcelab.live.label_outlet import LabelOutlet
    from forcelab.live.recognition import LiveRecognition

    recogniser, latency = loaded.recogniser, loaded.budget.latency
    outlet = LabelOutlet(STREAM, recogniser.actions) if sending and can_send() else None
    return LiveRecognition(recogniser, loaded.selection.name, latency, recorder, outlet)


def _load_recogniser(
    selection: RecogniserSelection, latency: float, loaded: Recogniser | None
) -> Generator[None, None, LoadedRecogniser]:
    """Read a recogniser that is not known yet, and find out what a latency (s) means."""
    from forcelab.live.recognition import latency_budget  # as above
    from forcelab.recognition.storage import load_recogniser

    yield
    recogniser = load_recogniser(selection.path) if loaded is None else loaded
    yield
    return LoadedRecogniser(selection, recogniser, latency_budget(recogniser, latency))
