"""The window with virtual tongs, for all tests of the Capture workspace."""

from contextlib import contextmanager

import numpy as np
import pytest
from factories import cached_project
from window_helpers import painted_once

from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import Window
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary
from tests.capture.virtual_devices import VirtualOptoForce


def source(times):
    """Counts of three axes, with noise so that nothing stands still."""
    phase = 2 * np.pi * np.asarray(times)
    axes = [2000 * np.sin(phase), 1000 * np.cos(phase), 3000 * np.sin(0.5 * phase)]
    return np.stack(axes, axis=1).astype(np.int64)


def make_study(path):
    with Project.create(path) as project:
        project.actions.set_vocabulary("LEGO", Vocabulary().with_actions("grab", "pull"))
    return path


@contextmanager
def open_window(study, until):
    """The window with the Capture workspace in front."""
    window = Window("Ann", remembering=False)
    with painted_once(window):
        window.resize(1100, 700)
        window.show()
        window.begin(LaunchOptions(project=study, workspace="capture"))
        until(lambda: window.settled)
    yield window
    window.close()


def connect(window, tongs, until):
    """The workspace with the tongs connected, and samples coming."""
    page = window.capture.workspace
    page.next_recording.task.setCurrentText("LEGO")
    page.device_list.add(f"optoforce:{tongs.port}")
    page.connect_button.click()
    until(lambda: page.controller.phase is CaptureState.READY)
    until(
        lambda: page.controller.state is not None and page.controller.state.devices[0].samples > 50
    )
    return page


@pytest.fixture(scope="module", autouse=True)
def _nothing_else_is_plugged_in():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("forcelab.capture.discovery.find_ports", lambda: ())
        patch.setattr("forcelab.capture.discovery.find_cameras", lambda: ())
        patch.setattr("forcelab.capture.lsl.search_streams", lambda: iter(()))
        yield


@pytest.fixture
def study(tmp_path):
    return cached_project(make_study, tmp_path / "study.forcelab")


@pytest.fixture
def tongs():
    with VirtualOptoForce(source) as device:
        yield device


@pytest.fixture
def window(app, study, until):
    with open_window(study, until) as window:
        yield window


@pytest.fixture
def connected(window, tongs, until):
    return connect(window, tongs, until)
