"""A demonstration as a device: what it recorded comes again in real time, on its own clock."""

import time

import numpy as np
import pytest

from forcelab.capture.device import UnpluggedError
from forcelab.capture.device_names import parse_device, parse_devices
from forcelab.capture.recorder import Recorder
from forcelab.capture.replay import RecordedDevice
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.project import Project
from tests.capture.helpers import eventually

RATE = 400.0
CHANNELS = (Channel("fz1", "N"), Channel("opening", "mm"))


def store(project, times, name="pull & go", task="pull"):
    """Store a recording whose first channel counts its samples; gives its signals."""
    signals = np.column_stack([np.arange(len(times)), np.sin(np.arange(len(times)))])
    with Project.open(project) as opened:
        opened.demonstrations.add(Demonstration(name, task, times, signals, CHANNELS))
    return signals


def collect(device, seconds):
    """Ticks and values of what comes within so many seconds."""
    blocks, until = [], time.monotonic() + seconds
    while time.monotonic() < until:
        block = device.read(0.1)
        blocks += [] if block is None else [block]
    ticks = np.concatenate([block.ticks for block in blocks])
    return ticks, np.concatenate([block.values for block in blocks])


def test_it_plays_in_real_time_what_was_recorded_and_begins_again(project):
    signals = store(project, np.arange(40) / RATE)
    device = parse_device(f"replay:{project}?demonstration=pull %26 go")
    device.open()
    begun = time.monotonic()
    ticks, values = collect(device, 0.25)
    passed = time.monotonic() - begun
    assert device.channels == CHANNELS
    assert device.rate == pytest.approx(RATE)
    assert device.name == f"replay:{project.name}/pull & go"
    assert ticks.tolist() == list(range(len(ticks)))
    assert len(ticks) > 80  # more than twice round
    assert len(ticks) <= passed * RATE + 2
    assert np.array_equal(values, signals[ticks % 40])


def test_played_once_it_is_gone_at_its_end_and_does_not_come_back(project):
    signals = store(project, np.arange(40) / RATE)
    device = parse_device(f"replay:{project}?demonstration=pull %26 go&loop=no")
    device.open()
    values = []
    while len(values) < 40:
        block = device.read(0.1)
        values += [] if block is None else block.values.tolist()
    with pytest.raises(UnpluggedError, match="'pull & go' has been played to its end"):
        device.read(0.1)
    assert np.array_equal(values, signals)
    with pytest.raises(UnpluggedError):
        device.reopen()
    device.open()  # connected again, it plays from its start
    assert device.read(0.1).values[0].tolist() == signals[0].tolist()


def test_it_is_as_fast_as_it_was_recorded_whatever_grid_its_features_are_on(project):
    times = np.arange(80) / RATE
    coarse = Demonstration("coarse", "pull", times, np.ones((80, 2)), CHANNELS, grid_rate=50.0)
    with Project.open(project) as opened:
        opened.demonstrations.add(coarse)
        other = Demonstration("coarse", "push", times, np.zeros((80, 2)), CHANNELS)
        id_ = opened.demonstrations.add(other).id  # of the same name
    device = RecordedDevice(project, id_)
    for _ in range(2):
        device.open()
        assert device.rate == pytest.approx(RATE)
        assert device.name == f"replay:{project.name}/coarse"
        assert not device.read(0.1).values.any()
    device = parse_device(f"replay:{project}?demonstration={coarse.id}")
    device.open()
    assert device.rate == pytest.approx(RATE)


def test_a_gap_of_the_recording_is_one_again(project):
    times = np.r_[0:20, 60:80] / RATE
    store(project, times)
    device = RecordedDevice(project, "pull & go")
    device.open()
    ticks, values = collect(device, 0.25)
    assert ticks[:18].tolist() == list(range(18))
    assert np.max(np.diff(ticks)) > 30
    assert set(values[:, 0]) == set(range(40))


def test_zeroed_it_reads_zero_from_then_on(project):
    store(project, np.arange(4000) / RATE)
    device = RecordedDevice(project, "pull & go")
    device.open()
    device.zero()  # of which nothing was read yet
    _, before = collect(device, 0.05)
    assert before[0, 0] == 0
    device.zero()
    _, after = collect(device, 0.05)
    assert after[0, 0] == pytest.approx(1.0)
    assert before[-1, 0] > 10


def test_it_is_recorded_as_any_device(project):
    signals = store(project, np.arange(2000) / RATE)
    with Recorder(project, parse_devices([f"replay:{project}?demonstration=pull %26 go"])) as r:
        r.start("again")
        eventually(lambda: r.state().devices[0].samples > 200)
        assert r.state().devices[0].lost == 0
        r.stop()
    with Project.open(project) as opened:
        recorded = opened.demonstrations.load("again 01")
        [info] = opened.demonstrations.infos("again")
        assert recorded.channels == CHANNELS
        first = int(recorded.signals[0, 0])
        played = signals[first : first + len(recorded.times)]
        assert np.array_equal(recorded.signals, played)
        assert recorded.rate == pytest.approx(RATE, rel=0.01)
        assert "replay:lab.forcelab/pull & go" in info.source


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("replay:", "does not say what to play; write a project and one"),
        ("replay:?demonstration=a", "does not say what to play"),
        ("replay:lab.forcelab", "does not say what to play"),
        ("replay:lab.forcelab?demonstration=a&loop=perhaps", "write yes or no"),
        ("replay:lab.forcelab?speed=2", "replay takes demonstration=..., loop=..."),
    ],
)
def test_a_name_that_does_not_say_what_to_play_is_refused(name, words):
    with pytest.raises(InputError, match=words):
        parse_device(name)
