"""Virtual devices, seen by what reads them with real pyserial on a real pty."""

import os
import termios
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.capture.emulator import build_packets
from forcelab.capture.optoforce import configure_command, serial_command
from forcelab.capture.replay import extract_sensors
from forcelab.capture.serial_port import Port
from forcelab.demonstration import Channel, Demonstration
from forcelab.errors import InputError
from forcelab.formats.calibration import read_calibrations
from forcelab.formats.optoforce_packets import Parser
from forcelab.resources import asset
from tests.capture.helpers import numbered
from tests.capture.virtual_devices import VirtualOptoForce, VirtualTextDevice, table_source


@contextmanager
def reading(device):
    with device:
        port = Port(device.port, 1_000_000)
        port.open()
        try:
            yield port
        finally:
            port.close()


def collect(port, parser, number, seconds=10.0):
    """Status and values until there are so many; fails if they never come."""
    pieces, until = [], time.monotonic() + seconds
    while sum(map(len, pieces)) < number:
        assert time.monotonic() < until
        pieces.append(parser.feed(port.read(0.1)[0]))
    status = np.concatenate([p.status for p in pieces if len(p)])
    return status, np.concatenate([p.values for p in pieces if len(p)])


def collect_replies(port, parser, count, seconds=10.0):
    """So many answers: what was sent before them may be much, if it was read late."""
    replies, until = [], time.monotonic() + seconds
    while len(replies) < count:
        assert time.monotonic() < until
        collect(port, parser, 1)
        replies += parser.take_replies()
    return replies


@given(
    readings=st.sampled_from([3, 6, 12]),
    counters=st.lists(st.integers(0, 200_000), min_size=1, max_size=20),
    seed=st.integers(0, 99),
)
@settings(max_examples=30, deadline=None)
def test_packets_are_those_that_are_parsed(readings, counters, seed):
    rng = np.random.default_rng(seed)
    counts = rng.integers(-32_768, 32_768, (len(counters), readings))
    status = rng.integers(0, 65_536, len(counters))
    parser = Parser()
    found = parser.feed(build_packets(np.array(counters), status, counts).tobytes())
    np.testing.assert_array_equal(found.counts, np.array(counters) % 65_536)
    np.testing.assert_array_equal(found.status, status)
    np.testing.assert_array_equal(found.values, counts)
    assert parser.statistics.skipped_bytes == 0


def test_no_device_has_five_readings():
    with pytest.raises(InputError, match="5 readings"):
        build_packets(np.zeros(1, int), np.zeros(1, int), np.zeros((1, 5), int))


def test_it_answers_between_its_data_and_does_as_told():
    device = VirtualOptoForce(numbered, serial="ISE9ZZ99")
    with reading(device) as port:
        parser = Parser()
        port.write(serial_command())
        port.write(configure_command(10, 2))
        replies = collect_replies(port, parser, 2)
        _, values = collect(port, parser, 20)
    assert [(r.serial, r.code) for r in replies] == [("ISE9ZZ99", None), (None, 0)]
    assert (np.diff(values[-10:, 0].astype(int)) == 10).all()  # 100 samples a second
    assert np.diff(device.truth().times[-10:]) == pytest.approx(0.01)


def test_speed_zero_stops_it_and_zeroing_subtracts():
    source = table_source(np.full((10_000, 3), (100, -50, 7)), 1000.0)
    with reading(VirtualOptoForce(source)) as port:
        parser = Parser()
        port.write(configure_command(1, 4, 255))
        collect_replies(port, parser, 1)
        values = collect(port, parser, 100)[1]
        assert not values[-1].any()
        port.write(configure_command(1, 4, 0))
        collect_replies(port, parser, 1)
        assert tuple(collect(port, parser, 100)[1][-1]) == (100, -50, 7)
        port.write(configure_command(0))
        until = time.monotonic() + 10
        while port.read(0.3)[0]:
            assert time.monotonic() < until


def test_a_bad_message_is_passed_over_and_the_next_one_heard():
    device = VirtualOptoForce(numbered)
    with reading(device) as port:
        bad = b"\xaa\x00\x32" + configure_command(1)[:-1] + b"\x00"
        port.write(bad + b"junk" + configure_command(2, 3))
        replies = collect_replies(port, Parser(), 1)
    assert device.configured == [(2, 3, 0)]
    assert [reply.code for reply in replies] == [0]


@given(st.lists(st.binary(max_size=12) | st.sampled_from([configure_command(3), serial_command()])))
@settings(max_examples=100, deadline=None)
def test_whatever_it_is_sent_it_takes_every_good_message_once(pieces):
    device = VirtualOptoForce(numbered)
    data = b"".join(pieces) + bytes(9)
    whole = device._answer(data)
    device = VirtualOptoForce(numbered)
    assert whole == b"".join(device._answer(data[i : i + 1]) for i in range(len(data)))
    assert len(device._received) <= 8  # less than a message


def test_beyond_its_limit_a_reading_saturates_and_the_status_says_so():
    source = table_source(np.tile([[10, -40_000, 0]], (5000, 1)), 1000.0)
    with reading(VirtualOptoForce(source)) as port:
        status, values = collect(port, Parser(), 20)
    assert values[:, 1].min() == -32_767
    assert (status == 1 << 8).all()  # Fy


def test_closing_leaves_no_thread_and_no_name_behind():
    device = VirtualOptoForce(numbered)
    with device:
        assert device.path.is_symlink()
    device.close()
    assert not device.path.parent.exists()
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("virtual")]


def test_a_name_that_is_taken_is_refused(tmp_path):
    (tmp_path / "ttyACM0").write_text("mine")
    with pytest.raises(InputError, match="choose another name"):
        VirtualOptoForce(numbered, path=tmp_path / "ttyACM0").open()
    assert (tmp_path / "ttyACM0").read_text() == "mine"


def test_a_text_device_prints_what_it_was_told_to():
    device = VirtualTextDevice(
        lambda t: np.column_stack([t, -t]),
        200,
        names=("a", "b"),
        header=True,
        clock="ms",
        waits=True,
    )
    data = b""
    with device:
        port = Port(device.port, 9600)
        port.open()
        until = time.monotonic() + 10
        while data.count(b"\n") < 12 and time.monotonic() < until:
            data += port.read(0.1)[0]
        port.close()
    lines = data.decode().splitlines()
    assert lines[0] == "ms,a,b"
    assert lines[1:4] == ["0,0.000,-0.000", "5,0.005,-0.005", "10,0.010,-0.010"]


def test_the_first_line_is_not_dropped_with_what_was_there_before(monkeypatch):
    monkeypatch.setattr("forcelab.capture.emulator.OPENING", 0.4)
    device = VirtualTextDevice(lambda t: t[:, None], 200, names=("a",), header=True, waits=True)
    with device:
        port = os.open(device.port, os.O_RDONLY | os.O_NOCTTY)
        time.sleep(0.05)  # as on a busy machine
        termios.tcflush(port, termios.TCIFLUSH)
        assert os.read(port, 100).startswith(b"a")
        os.close(port)


def test_a_reading_beyond_all_numbers_is_clipped_and_keeps_its_sign():
    signals = np.ones((20, 3))
    signals[7, 0], signals[9, 1] = 1e300, -1e300
    channels = tuple(Channel(name, "N") for name in ("fx1", "fy1", "fz1"))
    demonstration = Demonstration("tongs 01", "tongs", np.arange(20) / 1000, signals, channels)
    (sensor,) = extract_sensors(
        demonstration, read_calibrations(asset("calibrations", "3-axis-40N.toml"))
    )
    assert sensor.clipped == 2
    assert sensor.counts[7, 0] > 32_767
    assert sensor.counts[9, 1] < -32_767
