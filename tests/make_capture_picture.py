"""Draws the Capture workspace while virtual tongs are recorded, for the guide.

Start it as ``python -m tests.make_capture_picture PROJECT FILE.png THEME`` with the sample project.
Forces and film of a demonstration are played in real time, and its simulated truth presses keys.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import cv2

from forcelab.capture import camera
from forcelab.capture.replay import Replay, extract_sensors
from forcelab.formats.calibration import read_calibrations
from forcelab.project import Project
from forcelab.resources import asset
from tests.capture.virtual_devices import VirtualCamera

DEMONSTRATION, TASK = "LEGO-1-06", "LEGO"
#: Seconds: before the demonstration begins, between an action and its key, of it when it is drawn.
LEAD, REACTION, DRAWN = 5.0, 0.2, 8.3


class Film(VirtualCamera):
    """Sees what the video of a demonstration shows, from the second `begun` on."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        film = cv2.VideoCapture(str(path))
        self.frames = []
        while (read := film.read())[0]:
            self.frames.append(read[1])
        self.begun = float("inf")

    def read(self):
        read, _ = super().read()
        number = int(max(time.monotonic() - self.begun, 0.0) * self.rate)
        return read, self.frames[min(number, len(self.frames) - 1)] if read else None

    def get(self, _what):
        return 0.0  # it does not tell when a frame was taken


def draw(path: Path, picture: Path, colours: str) -> None:
    """Record the demonstration again and draw the window shortly before it ends."""
    from PySide6.QtWidgets import QApplication

    from forcelab.gui import theme
    from forcelab.gui.capture.controller import CaptureState
    from forcelab.gui.launch_options import LaunchOptions
    from forcelab.gui.window import Window

    calibration = asset("calibrations", "3-axis-40N.toml")
    with Project.open(path) as project:
        info = next(info for info in project.demonstrations.infos() if info.name == DEMONSTRATION)
        demonstration, truth = (
            project.demonstrations.load(info.id),
            project.demonstrations.truth(info.id),
        )
    sensors = extract_sensors(demonstration, read_calibrations(calibration))
    film = Film(demonstration.video.path)
    camera.open_camera = lambda _: film
    application = QApplication([])
    theme.use_theme(application, colours)
    window = Window("Ines", remembering=False)
    window.resize(1280, 800)
    window.show()
    window.begin(LaunchOptions(project=path, demonstration=DEMONSTRATION, workspace="capture"))
    page = window.capture.workspace

    def until(condition) -> None:
        while not condition():
            application.processEvents()
            time.sleep(0.005)

    def at(second: float) -> None:
        until(lambda: time.monotonic() - film.begun >= second)

    with Replay(demonstration, sensors, lead=LEAD) as replay:
        for port in replay.ports:
            page.device_list.add(f"optoforce:{port}?calibration={calibration}")
        page.device_list.add("camera:0")
        page.next_recording.task.setCurrentText(TASK)
        which = page.recogniser.which
        which.activated.emit(which.findText(TASK))  # the sample's own is called as its task
        page.scalogram.choose("tangential 1")
        until(lambda: page.controller.recognition.loaded is not None)
        page.connect_button.click()
        until(lambda: replay.ended(0.0) or replay.begun)
        film.begun = time.monotonic() + LEAD
        until(lambda: page.controller.phase is CaptureState.READY)
        at(0.2)
        page.record()
        for start, end, action in truth["actions"]:
            at(min(start + REACTION, DRAWN))
            page.controller.mark(action, True, time.monotonic())
            at(min(end + REACTION, DRAWN))
            if end + REACTION < DRAWN:
                page.controller.mark(action, False, time.monotonic())
        at(DRAWN)
        until(lambda: page.controller.recognition.track.snapshot.action)
        window.grab().save(str(picture))
        page.controller.discard()
        until(lambda: page.controller.phase is CaptureState.READY)
        window.close()


if __name__ == "__main__":
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    with tempfile.TemporaryDirectory() as folder:
        os.environ["FORCELAB_SETTINGS"] = str(Path(folder) / "settings.ini")
        draw(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3])
