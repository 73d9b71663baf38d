"""The real program on a real (virtual) screen, driven by real keys and a real mouse."""

from __future__ import annotations

import os
import select
import shutil
import subprocess

import numpy as np
import pytest
from window_helpers import PATIENCE

from forcelab.demonstration import Channel, Demonstration
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary
from tests.e2e.program import Program


@pytest.fixture(scope="session")
def screen():
    """A virtual screen; gives the name of the display."""
    if shutil.which("Xvfb") is None or shutil.which("xdotool") is None:
        pytest.skip("Xvfb and xdotool are needed; .ci/setup test installs them")
    reading, writing = os.pipe()
    command = ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1400x900x24", "-noreset"]
    server = subprocess.Popen(command, pass_fds=[writing], stderr=subprocess.DEVNULL)
    os.close(writing)
    with os.fdopen(reading) as numbers:
        ready, _, _ = select.select([reading], [], [], PATIENCE)
        # To the end of the line: a server that cannot write all of it gives up.
        number = numbers.readline().strip() if ready else ""
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait()


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Where the program finds its settings."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def project(home):
    """Quiet demonstrations of ten seconds at 100 Hz, with five actions on the keys 1 to 5."""
    path = home / "study.forcelab"
    times = np.arange(1000) / 100
    channels = (Channel("fx1", "N"), Channel("fz1", "N"))
    with Project.create(path) as project:
        for number in range(1, 7):
            signals = np.full((1000, 2), 0.1 * number)
            project.demonstrations.add(
                Demonstration(f"pen {number}", "stylus", times, signals, channels)
            )
        names = ("still", "grab", "hold", "pull", "release")
        project.actions.set_vocabulary("stylus", Vocabulary().with_actions(*names))
    return path


@pytest.fixture(scope="module")
def start(home):
    """Start the program; on a virtual screen where the test asks for one."""
    running = []

    def begin(*arguments, display=None):
        environment = {
            **os.environ,
            "FORCELAB_SETTINGS": str(home / "settings.ini"),
            "QT_QPA_PLATFORM": "xcb" if display else "offscreen",
            "HOME": str(home),
            **({"DISPLAY": display} if display else {}),
        }
        program = Program(arguments, environment, display)
        running.append(program)
        return program

    yield begin
    for program in running:
        program.close()
