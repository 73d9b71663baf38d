"""From the labels to the first mistake by three keys, in the real window on a real screen."""

import os
import signal
import time
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from factories import synthetic_set, write_opencv_video
from window_helpers import PATIENCE

from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.gui.review import training_preferences
from forcelab.labels import Track
from forcelab.project import Project
from forcelab.recognition.presets import preset
from tests.e2e.program import stored_segments, wait_for_stored_segments

#: With these it is trained within a second, and longer than it takes to hold it.
SETTINGS = preset("paper").replace(max_scale=32.0, stride=8)
FRAMES = 30


@pytest.fixture
def project(tmp_path):
    """Three filmed demonstrations that Ada labelled, in one of them `hold` as `release`."""
    path = tmp_path / "study.forcelab"
    film = write_opencv_video(tmp_path / "film.avi", "MJPG", 200)
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(3, 100.0)):
            track = [
                replace(s, action="release") if number == 1 and s.action == "hold" else s
                for s in segments
            ]
            filmed = replace(demonstration, videos=(VideoReference(film, ClockMap()),))
            project.demonstrations.add(filmed, [Track("Ada", tuple(track))])
    return path


@pytest.fixture
def cheap(home, monkeypatch, project):
    """The settings file remembers how the task was trained last."""
    monkeypatch.setenv("FORCELAB_SETTINGS", str(home / "settings.ini"))
    training_preferences.remember_settings(project, "foam", SETTINGS)


def tracks(path):
    """What is stored of every demonstration, by name."""
    with Project.open(path) as project:
        names = [info.name for info in project.demonstrations.infos()]
    return {name: stored_segments(path, name) for name in names}


def painted(track, start=0.0, end=0.0, action=""):
    """What painting makes of a track, worked out tick by tick of 0.1 ms; touching ones joined."""
    times = np.arange(0, 70_000)
    codes = np.full(times.shape, "", dtype=object)
    for left, right, of in track:
        codes[round(left * 1e4) : round(right * 1e4)] = of
    codes[round(start * 1e4) : round(end * 1e4)] = action or ""
    edges = np.flatnonzero(np.r_[True, codes[1:] != codes[:-1], True])
    return {(a / 1e4, b / 1e4, codes[a]) for a, b in pairwise(edges) if codes[a]}


def children(pid):
    """The processes that a process has started, and those that these have started."""
    found = set()
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(status.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue  # it has ended meanwhile
        if parent == pid:
            child = int(status.parent.name)
            found |= {child} | children(child)
    return found


def alive(pids):
    """Those that have not ended; a zombie has."""
    states = {}
    for pid in pids:
        try:
            states[pid] = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
    return {pid for pid, state in states.items() if state not in "ZX"}


@contextmanager
def held(program):
    """While something is trained: its processes, which go no further before this is left."""
    program.until(lambda state: state["fold"] >= 1, "the first fold")
    started = children(program.process.pid)
    for pid in started:
        os.kill(pid, signal.SIGSTOP)
    try:
        assert program.ask("state")["training"], "it was to be held while it trains"
        yield started
    finally:
        for pid in started:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)


def test_from_training_to_verdicts_and_through_a_crash(screen, start, project, cheap):
    program = start(project, "--author", "Ada", "--demo", "foam 01", display=screen)
    program.focus()
    train_and_go_on_labelling(program, project)
    three_keys_lead_to_the_first_mistake(program, project)
    killed_while_it_trains(program, project)


def train_and_go_on_labelling(program, project):
    """Nothing is lost that is painted while it trains, and it is counted."""
    before = tracks(project)
    program.press("F5")
    with held(program):
        program.press("ctrl+0", "4", "ctrl+Right", "4")
        now = wait_for_stored_segments(project, "foam 01", lambda found: found != before["foam 01"])
        assert program.ask("state")["training"], "it was to be painted while it trains"
    assert [now[0][0], now[0][2]] == [0.0, "release"]
    program.until(lambda state: state["run"] == 1, "training")
    assert tracks(project) == {**before, "foam 01": now}
    program.until(lambda state: state["edits"] == 1, "counting")


def three_keys_lead_to_the_first_mistake(program, project):
    """After F5 that are Ctrl+2 and N. A verdict changes that stretch, and Ctrl+Z takes it back."""
    before = tracks(project)
    program.press("ctrl+2", "n")
    state = program.until(lambda state: state["examined"] and state["settled"], "the first mistake")
    begin, end, human, predicted = state["examined"]
    assert state["title"].startswith("foam 02")
    assert (human, predicted) == ("release", "hold")
    assert state["reviewing"]
    assert state["span"][0] < begin < end < state["span"][1]
    assert state["frame"] == int(begin * FRAMES + 1e-6)

    program.press("shift+m")
    expected = painted(before["foam 02"], begin, end, predicted)
    now = wait_for_stored_segments(project, "foam 02", lambda found: painted(found) == expected)
    assert tracks(project) == {**before, "foam 02": now}
    # It has gone on to another demonstration, where there is something to undo as well.
    program.until(lambda state: state["title"].startswith("foam 01"), "the next mistake")
    program.press("ctrl+z")
    wait_for_stored_segments(project, "foam 02", lambda found: found == before["foam 02"])
    assert tracks(project) == before

    # In the other workspace, and with a verdict that paints nothing, it is the same.
    program.until(lambda state: state["examined"] == [begin, end, human, predicted])
    program.press("ctrl+1", "shift+h")
    program.until(lambda state: state["title"].startswith("foam 01"), "the next mistake")
    with Project.open(project) as opened:
        assert [verdict.verdict for verdict in opened.coding.verdicts()] == ["human"]
    program.press("ctrl+z")
    program.until(lambda state: state["title"].startswith("foam 02"), "where the verdict was")
    with Project.open(project) as opened:
        assert opened.coding.verdicts() == ()
    assert tracks(project) == before


def killed_while_it_trains(program, project):
    """The old run stands, there is no half one, and no process is left."""
    before = tracks(project)
    program.press("F5")
    with held(program) as started:
        assert started
        program.process.send_signal(signal.SIGKILL)
        program.process.wait()
    deadline = time.monotonic() + PATIENCE
    while left := alive(started):
        assert time.monotonic() < deadline, left
        time.sleep(0.02)
    with Project.open(project) as opened:
        assert [run.id for run in opened.runs.all()] == [1]
        assert len(opened.runs.recognisers()) == 1
    assert tracks(project) == before
