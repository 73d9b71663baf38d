"""The status of devices and cameras: a line each, and a line for each alarm."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QPalette, QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from forcelab.capture.camera import CameraState
from forcelab.capture.optoforce import sends_raw_counts, uncalibrated_warning
from forcelab.capture.reader import DeviceState
from forcelab.capture.recorder import RecorderState
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.text import thousands
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import CalmLabel, show_text
from forcelab.text import amount

#: Letters of a device's name that are shown: those of two devices stand beside each other.
LONGEST = 29


class StatusPanel(QWidget):
    """Lines of text, told anew five times a second.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: CaptureController) -> None:
        super().__init__()
        self._session = session
        self.setAccessibleName("Devices and alarms")
        self.alarms, self.facts, self.sentences = CalmLabel(), CalmLabel(), _Sentences()
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 4, 8, 4)
        column.setSpacing(4)
        for line in (self.alarms, self.facts, self.sentences):
            column.addWidget(line)
        self._shown_state: RecorderState | None = None
        session.ticked.connect(self._ticked)
        session.changed.connect(self.refresh)
        session.said.connect(self.refresh)
        session.recognising.changed.connect(self.refresh)
        themes().changed.connect(self._colour)
        self._colour()
        self.refresh()

    def refresh(self) -> None:
        """Say how it is now, where that can be seen."""
        state = self._shown_state = self._session.state
        remarks = [f"\N{WARNING SIGN} {one}" for one in self._session.recognising.remarks]
        alarms = [] if state is None else [*device_alarms(state), *remarks]
        show_text(self.alarms, "\n".join(alarms))
        show_text(self.facts, "" if state is None else "\n".join(_status_facts(state)))
        told = [sentence for sentence, _ in self._session.sentences]
        self.sentences.tell(told)

    def _ticked(self) -> None:
        """Most frames bring samples and no news."""
        if self._session.state is not self._shown_state:
            self.refresh()

    def _colour(self) -> None:
        for line, colour in (
            (self.alarms, colours().trouble),
            (self.facts, colours().muted),
            (self.sentences, colours().text),
        ):
            palette = QPalette(self.palette())
            palette.setColor(QPalette.ColorRole.WindowText, QColor(colour))
            line.setPalette(palette)


class _Sentences(CalmLabel):
    """What was said last, whole; of what was said before it a line each: curves need the room."""

    def __init__(self) -> None:
        super().__init__()
        self._sentences: list[str] = []

    def tell(self, told: list[str]) -> None:
        """Show sentences, the oldest first."""
        self._sentences = told
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much of the older ones as there is room for."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Cut the older ones; all are found under the pointer."""
        whole = "\n".join(self._sentences)
        width = max(self.contentsRect().width(), 0)
        metrics, cut = self.fontMetrics(), Qt.TextElideMode.ElideRight
        older = [metrics.elidedText(told, cut, width) for told in self._sentences[:-1]]
        shown = "\n".join([*older, *self._sentences[-1:]])
        show_text(self, shown)
        self.setToolTip(whole if shown != whole else "")
        self.setAccessibleName(whole)


def device_alarms(state: RecorderState) -> list[str]:
    """What is wrong, a sentence each.

    Parameters
    ----------
    state : RecorderState
    """
    words = {
        "unplugged": "{0} is unplugged; plug it in again.",
        "stalled": "{0} sends nothing; look at its cable.",
        "saturation": "{0} is saturated: the force is beyond its range.",
        "lost samples": "{0} loses samples; they are gaps.",
        "drift": "{0}: its clock and the computer's do not fit.",
        "no picture": "{0} gives no picture; look at its cable.",
        "not written": "{0}: its frames cannot be written to the disk.",
    }
    ones = [(device.name, device.alarms) for device in state.devices]
    ones += [(camera.name, camera.alarms) for camera in state.cameras]
    found = [
        "\N{WARNING SIGN} " + words.get(alarm, "{0}").format(_short(name))
        for name, alarms in ones
        for alarm in alarms
        if alarm != "zero"
    ]
    cure = "disconnect it and choose its calibration file"
    found += [
        "\N{WARNING SIGN} " + uncalibrated_warning(_short(device.name), cure)
        for device in state.devices
        if sends_raw_counts(device)
    ]
    found += [_drift_text(device, state.recording) for device in state.devices if device.drifted]
    if state.in_memory:
        found.append(
            "\N{WARNING SIGN} "
            + f"The disk refuses {amount(state.in_memory)}; it is kept in memory."
        )
    return found


def _drift_text(device: DeviceState, recording: bool) -> str:
    """What is said of a zero that wanders; in a recording zeroing would make a step."""
    cure = "let go of everything and press Zero"
    if recording:
        cure = "press Zero before the next recording"
    parts = [f"{channel.name} {by:+.2g} {channel.unit}" for channel, by in device.drifted]
    text = "{0}: its zero has wandered ({1}); {2}."
    wandered = ", ".join(parts).replace("-", "\N{MINUS SIGN}")
    return "\N{WARNING SIGN} " + text.format(_short(device.name), wandered, cure)


def _status_facts(state: RecorderState) -> list[str]:
    """How each device and camera does, in a line."""
    return [*map(_device, state.devices), *map(_camera, state.cameras)]


def _device(device: DeviceState) -> str:
    """Rate, samples and clock."""
    parts = [_short(device.name)]
    if device.rate > 0:
        parts.append(f"{device.rate:.1f} Hz")
    parts.append(f"{thousands(device.samples)} samples, {thousands(device.lost)} lost")
    if math.isfinite(device.residual):
        # Its offset says nothing but when it was switched on; the rate says how fast it changes.
        text = "clock {ppm:+d} ppm ±{ms:.2f} ms"
        ppm = round(1e6 * (device.clock_rate - 1)) if math.isfinite(device.clock_rate) else 0
        told = text.format(ppm=ppm, ms=1000 * device.residual)
        parts.append(told.replace("-", "\N{MINUS SIGN}"))
    return " · ".join(parts)


def _camera(camera: CameraState) -> str:
    """Rate and frames."""
    counts = f"{thousands(camera.frames)} frames, {thousands(camera.dropped)} dropped"
    return " · ".join([camera.name, f"{camera.rate:.1f} Hz", counts])


def _short(name: str) -> str:
    """A device's name without its options, the middle left out where it is long."""
    short = name.partition("?")[0]
    if len(short) <= LONGEST:
        return short
    half = (LONGEST - 1) // 2
    return f"{short[:half]}…{short[-half:]}"
