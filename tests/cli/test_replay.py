"""``forcelab replay``, read by the devices that capture reads with."""

import json
import os
import signal
import subprocess
import sys
from contextlib import contextmanager, suppress

import numpy as np
import pytest

from forcelab.capture.device import UnpluggedError
from forcelab.capture.device_names import parse_device
from forcelab.demonstration import Channel, Demonstration
from forcelab.project import Project

N = 400
NAMES = ("fx1", "fy1", "fz1", "fx2", "fy2", "fz2")


def recording(**changes):
    t = np.arange(N) / 1000.0
    signals = np.column_stack([(1 + i) * np.sin(2 * np.pi * (3 + i) * t) for i in range(6)])
    signals[:, 0] = np.linspace(-5.0, 5.0, N)
    parts = {"times": t, "signals": signals, "channels": tuple(Channel(n, "N") for n in NAMES)}
    return Demonstration(name="tongs 01", task="tongs", **(parts | changes))


@pytest.fixture
def stored(tmp_path):
    def store(demonstration):
        path = tmp_path / "lab.forcelab"
        with Project.create(path) as project:
            project.demonstrations.add(demonstration)
        return path

    return store


@contextmanager
def replaying(path, *words):
    command = [sys.executable, "-m", "forcelab", "replay", str(path), "tongs 01", "--json", *words]
    child = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=restore_hangup,  # noqa: PLW1509 - no thread of the tests holds what it needs
    )
    try:
        output = ""
        while not output.endswith("}\n") or not complete(output):
            line = child.stdout.readline()
            assert line, output
            output += line
        yield child, json.loads(output)
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
        child.stderr.close()


def restore_hangup():
    """A closed terminal ends what is started here also under nohup, which ignores that."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def complete(text):
    try:
        json.loads(text)
    except ValueError:
        return False
    return True


def test_both_sensors_are_played_as_they_were_recorded(stored):
    demonstration = recording()
    with replaying(stored(demonstration), "--lead", "0.3") as (child, output):
        assert [port["channels"] for port in output["ports"]] == [list(NAMES[:3]), list(NAMES[3:])]
        devices = [parse_device(port["device"]) for port in output["ports"]]
        sensor = 1
        for device in devices:
            device.open()
            sensor = device.number_sensors(sensor)
        assert [c.name for d in devices for c in d.channels] == list(NAMES)
        blocks = [[] for _ in devices]
        with suppress(UnpluggedError):  # when all has been played, the ports go
            while True:
                for device, played_blocks in zip(devices, blocks, strict=True):
                    block = device.read(0.02)
                    if block is not None:
                        played_blocks.append(block.values)
        for device in devices:
            device.close()
        assert child.wait(30) == 0
    for number, played_blocks in enumerate(blocks):
        played = np.concatenate(played_blocks)
        truth = demonstration.signals[:, 3 * number : 3 * number + 3]
        # It stands at the first sample, then plays; a count is 2.5 mN.
        begins = np.flatnonzero((np.abs(played - truth[0]) > 0.003).any(axis=1))[0]
        whole = played[begins : begins + N - 10]
        offsets = [np.abs(whole - truth[i : i + len(whole)]).max() for i in range(6)]
        assert min(offsets) < 0.05
    assert not any(os.path.lexists(port["port"]) for port in output["ports"])


@pytest.mark.parametrize(("rate", "said"), [(200.0, "&rate=200"), (1000.0, ""), (1300.0, "")])
def test_a_daq_is_named_with_the_rate_that_it_plays_at(stored, rate, said):
    path = stored(recording(times=np.arange(N) / rate))
    with replaying(path) as (_, output):
        for port in output["ports"]:
            assert port["device"].partition(".toml")[2] == said
            assert parse_device(port["device"]).rate == (200.0 if said else 1000.0)


def test_channels_of_any_kind_are_played_as_lines_of_text(stored):
    t = np.arange(N) / 400.0
    channels = (Channel("opening", "mm"), Channel("grip force", "N"), Channel("thumb"))
    signals = np.column_stack([40 * t, np.sin(9 * t), 7.0 - t])
    signals[100:104, 2] = np.nan
    demonstration = recording(
        times=np.delete(t, np.s_[200:240]),
        signals=np.delete(signals, np.s_[200:240], axis=0),
        channels=channels,
    )
    with replaying(stored(demonstration), "--as", "text", "--lead", "0.3") as (child, output):
        (port,) = output["ports"]
        assert port["channels"] == [channel.name for channel in channels]
        device = parse_device(port["device"])
        device.open()
        assert device.channels == channels
        blocks = []
        with suppress(UnpluggedError):
            while True:
                block = device.read(0.02)
                if block is not None:
                    blocks.append(block)
        device.close()
        assert child.wait(30) == 0
    assert device.rate == pytest.approx(400, rel=0.01)
    played = np.concatenate([block.values for block in blocks])
    ticks = np.concatenate([block.ticks for block in blocks])
    begins = np.flatnonzero(played[:, 0] > 0.05)[0]
    off = played[begins:-5, 0] - 0.1 * (ticks[begins:-5] - ticks[begins])
    off -= np.median(off)
    assert np.abs(off).max() < 0.5  # beside a gap the nearest sample holds for some periods
    assert np.mean(np.abs(off) < 1e-6) > 0.97
    assert 30 < np.diff(ticks[begins:]).max() < 45  # the gap is one, and counted
    assert 3 <= np.isnan(played[:, 2]).sum() <= 5


def test_a_closed_terminal_ends_it_with_a_sentence_and_takes_the_ports_away(stored):
    with replaying(stored(recording())) as (child, output):
        assert all(os.path.lexists(port["port"]) for port in output["ports"])
        child.send_signal(signal.SIGHUP)
        assert child.wait(30) == 128 + signal.SIGHUP
        assert child.stderr.read() == "forcelab: stopped; nothing was left half done.\n"
    assert not any(os.path.lexists(port["port"]) for port in output["ports"])


def test_a_recording_without_a_3_axis_sensor_is_refused_in_a_sentence(stored, forcelab):
    names = [Channel(name) for name in "abcdef"]
    path = stored(recording(channels=tuple(names)))
    result = forcelab("replay", path, "tongs 01").sentence
    assert "no 3-axis force sensor" in result
    assert "a, b, c, d, e, f" in result


def test_a_calibration_is_refused_where_it_would_change_nothing(stored, forcelab):
    words = ["--as", "text", "--calibration", "mine.toml"]
    result = forcelab("replay", stored(recording()), "tongs 01", *words)
    assert "leave --calibration away" in result.wrong_word


@pytest.mark.parametrize("words", [["--speed", "0"], ["--lead", "-1"]])
def test_what_cannot_be_played_is_refused(stored, forcelab, words):
    result = forcelab("replay", stored(recording()), "tongs 01", *words)
    assert "Replaying needs a speed above 0" in result.sentence
