"""How the program ends: by signals, whenever they come, and with nothing left of its window."""

import os
import signal
import subprocess
import sys

import pytest
from factories import foam_demonstration

from forcelab.project import Project

SIGNALLED = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
WITH_QT = """
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication
application = QApplication(["forcelab"])
"""


@pytest.fixture
def study(tmp_path):
    """A project without a demonstration: the window on it is soon at rest."""
    path = tmp_path / "study.forcelab"
    Project.create(path).close()
    return path


@pytest.fixture
def run(study, tmp_path):
    """Run the real program after some lines of Python, and give how it ended."""

    def run_program(lines, first=WITH_QT):
        script = f"""
import atexit, os, signal, subprocess, sys, time
{first}
{lines}
from forcelab.cli import main
sys.exit(main([{str(study)!r}]))
"""
        return subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "QT_QPA_PLATFORM": "offscreen", "HOME": str(tmp_path)},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    return run_program


@SIGNALLED
def test_a_signal_closes_a_window_in_which_nothing_moves(run):
    done = run("""
soon = f"sleep 0.3; kill -TERM {os.getpid()}"
QTimer.singleShot(0, lambda: subprocess.Popen(["sh", "-c", soon]))
""")
    assert done.returncode == 128 + signal.SIGTERM, done.stderr
    assert "Traceback" not in done.stderr


@SIGNALLED
def test_a_signal_that_comes_while_the_window_is_built_ends_the_program(run):
    done = run("""
from forcelab.gui.label.workspace import LabelWorkspace
shown = LabelWorkspace.showEvent
def show(self, event):  # called by Qt, which can do nothing with an exception
    os.kill(os.getpid(), signal.SIGINT)
    shown(self, event)
LabelWorkspace.showEvent = show
QTimer.singleShot(20_000, lambda: os._exit(99))
""")
    assert done.returncode == 128 + signal.SIGINT, done.stderr
    assert "Traceback" not in done.stderr
    assert "KeyboardInterrupt" not in done.stderr


def test_nothing_of_the_window_is_left_to_the_end_of_the_interpreter(run, study):
    with Project.open(study) as project:
        project.demonstrations.add(foam_demonstration())
    done = run("""
atexit.register(lambda: print(len(QApplication.topLevelWidgets()), "widgets"))
QTimer.singleShot(300, application.closeAllWindows)
""")
    assert (done.returncode, done.stdout.split()) == (0, ["0", "widgets"]), done.stderr


def test_the_interpreter_is_not_taken_apart_below_a_thread_that_does_not_end(run):
    done = run("""
from forcelab.gui import app, jobs, window
app.SHUTDOWN_TIMEOUT = jobs.THREAD_TIMEOUT = 0.1
def stubborn():
    time.sleep(30)
    yield None
begin = window.Window.begin
def begun(self, start):
    begin(self, start)
    self.jobs.run(stubborn(), print)
window.Window.begin = begun
atexit.register(lambda: print("taken apart"))
QTimer.singleShot(300, application.closeAllWindows)
""")
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


@SIGNALLED
def test_a_signal_that_comes_while_qt_is_loaded_ends_the_program(run):
    done = run(
        """
def interrupt(event, given):
    if event == "import" and given[0].startswith("shibokensupport.signature.lib"):
        os.kill(os.getpid(), signal.SIGINT)
sys.addaudithook(interrupt)
""",
        first="",
    )
    assert done.returncode == 130, done.stderr
    assert "stopped" in done.stderr
    assert "Traceback" not in done.stderr
