"""The status of devices and cameras: a line each, and a line for each alarm."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QVBoxLayout, QWidget

from forcelab.capture.camera import CameraState
from forcelab.capture.optoforce import sends_raw_counts, uncalibrated_warning
from forcelab.capture.reader import DeviceState
from forcelab.capture.recorder import RecorderState
from forcelab.gui.capture.controller import CaptureController
from forcelab.gui.layout import fill_layout
from forcelab.gui.theme import colours, themes
from forcelab.gui.widgets import CalmLabel
from forcelab.text import amount, counted

#: Letters of a device's name that are shown: those of two devices stand beside each other.
LONGEST = 29


class StatusPanel(QWidget):
    """Lines of text, written anew five times a second."""

    def __init__(self, controller: CaptureController) -> None:
        super().__init__()
        self._controller = controller
        self.setAccessibleName("Devices and alarms")
        self.alarms, self.facts, self.messages = CalmLabel(), CalmLabel(), MessageList()
        parts = self.alarms, self.facts, self.messages
        fill_layout(QVBoxLayout(self), *parts, margins=(8, 4, 8, 4), spacing=4)
        self._shown_state: RecorderState | None = None
        controller.ticked.connect(self._ticked)
        controller.changed.connect(self.refresh)
        controller.messages_changed.connect(self.refresh)
        controller.recognition.changed.connect(self.refresh)
        themes().changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        state = self._shown_state = self._controller.state
        remarks = [f"\N{WARNING SIGN} {remark}" for remark in self._controller.recognition.remarks]
        alarms = [] if state is None else [*device_alarms(state), *remarks]
        self.alarms.say("\n".join(alarms), colours().trouble)
        facts = []
        if state is not None:
            facts = [*map(_device_facts, state.devices), *map(_camera_facts, state.cameras)]
        self.facts.say("\n".join(facts), colours().muted)
        self.messages.show_messages([message for message, _ in self._controller.messages])

    def _ticked(self) -> None:
        """Most frames bring samples and no news."""
        if self._controller.state is not self._shown_state:
            self.refresh()


class MessageList(CalmLabel):
    """The last message whole; of those before it a line each: curves need the room."""

    def __init__(self) -> None:
        super().__init__()
        self._messages: list[str] = []

    def show_messages(self, messages: list[str]) -> None:
        """Show messages, the oldest first."""
        self._messages = messages
        self._fit()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much of the older ones as there is room for."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        """Cut the older ones; all are in the tool tip."""
        full_text = "\n".join(self._messages)
        width = max(self.contentsRect().width(), 0)
        metrics, cut = self.fontMetrics(), Qt.TextElideMode.ElideRight
        older = [metrics.elidedText(message, cut, width) for message in self._messages[:-1]]
        shown = "\n".join([*older, *self._messages[-1:]])
        self.say(shown, colours().text)
        self.setToolTip(full_text if shown != full_text else "")
        self.setAccessibleName(full_text)


def device_alarms(state: RecorderState) -> list[str]:
    """What is wrong, a sentence each."""
    texts = {
        "unplugged": "{0} is unplugged; plug it in again.",
        "stalled": "{0} sends nothing; look at its cable.",
        "saturation": "{0} is saturated: the force is beyond its range.",
        "lost samples": "{0} loses samples; they are gaps.",
        "drift": "{0}: its clock and the computer's do not fit.",
        "no picture": "{0} gives no picture; look at its cable.",
        "not written": "{0}: its frames cannot be written to the disk.",
    }
    cure = "disconnect it and choose its calibration file"
    sources: list[DeviceState | CameraState] = [*state.devices, *state.cameras]
    alarms = [
        texts[alarm].format(_short(source.name))
        for source in sources
        for alarm in source.alarms
        if alarm != "zero"
    ]
    alarms += [
        uncalibrated_warning(_short(device.name), cure)
        for device in state.devices
        if sends_raw_counts(device)
    ]
    alarms += [_drift_text(device, state.recording) for device in state.devices if device.drifted]
    if state.in_memory:
        alarms.append(f"The disk refuses {amount(state.in_memory)}; it is kept in memory.")
    return [f"\N{WARNING SIGN} {alarm}" for alarm in alarms]


def _drift_text(device: DeviceState, recording: bool) -> str:
    """The alarm of a zero that drifts; in a recording zeroing would make a step."""
    cure = "let go of everything and press Zero"
    if recording:
        cure = "press Zero before the next recording"
    drifts = ", ".join(f"{channel.name} {by:+.2g} {channel.unit}" for channel, by in device.drifted)
    drifts = drifts.replace("-", "\N{MINUS SIGN}")
    return f"{_short(device.name)}: its zero has drifted ({drifts}); {cure}."


def _device_facts(device: DeviceState) -> str:
    """Rate, samples and clock."""
    parts = [_short(device.name)]
    if not device.channels:  # of a stream of texts
        return " · ".join([*parts, counted(device.samples, "marker")])
    if device.rate > 0:
        parts.append(f"{device.rate:.1f} Hz")
    parts.append(f"{device.samples:,} samples, {device.lost:,} lost")
    if math.isfinite(device.residual):
        # Its offset says nothing but when it was switched on; the rate says how fast it changes.
        ppm = round(1e6 * (device.clock_rate - 1)) if math.isfinite(device.clock_rate) else 0
        clock = f"clock {ppm:+d} ppm ±{1000 * device.residual:.2f} ms"
        parts.append(clock.replace("-", "\N{MINUS SIGN}"))
    return " · ".join(parts)


def _camera_facts(camera: CameraState) -> str:
    """Rate and frames."""
    counts = f"{camera.frames:,} frames, {camera.dropped:,} dropped"
    return " · ".join([camera.name, f"{camera.rate:.1f} Hz", counts])


def _short(name: str) -> str:
    """A device's name without its options, the middle left out where it is long."""
    short = name.partition("?")[0]
    if len(short) <= LONGEST:
        return short
    half = (LONGEST - 1) // 2
    return f"{short[:half]}…{short[-half:]}"
