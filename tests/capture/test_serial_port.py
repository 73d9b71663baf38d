import errno
import os
import time

import pytest

from forcelab.capture.device import UnpluggedError
from forcelab.capture.serial_port import Port, open_error
from forcelab.errors import InputError


class Pty:
    """A pseudo-terminal whose far end the test holds."""

    def __init__(self):
        self.master, self._slave = os.openpty()
        self.path = os.ttyname(self._slave)
        self.plugged = True

    def send(self, data):
        os.write(self.master, data)

    def unplug(self):
        if self.plugged:
            os.close(self.master)
            os.close(self._slave)
        self.plugged = False


@pytest.fixture
def pty():
    pty = Pty()
    yield pty
    pty.unplug()


@pytest.fixture
def port(pty):
    port = Port(pty.path, 1_000_000)
    port.open()
    yield port
    port.close()


def test_a_read_gives_all_there_is_with_one_stamp(pty, port):
    pty.send(b"\x00\xaa\r\n\x03\x11\x13")  # bytes that a terminal would take for commands
    before = time.monotonic()
    data, arrived = port.read(5.0)
    assert data == b"\x00\xaa\r\n\x03\x11\x13"
    assert before <= arrived <= time.monotonic()


def test_more_than_the_system_hands_over_at_once_is_read_too(pty, port):
    sent = bytes(range(256)) * 40
    pty.send(sent)
    received = b""
    until = time.monotonic() + 10
    while len(received) < len(sent) and time.monotonic() < until:
        received += port.read(0.5)[0]
    assert received == sent


def test_nothing_is_given_after_the_time_that_it_may_wait(port):
    before = time.monotonic()
    data, arrived = port.read(0.05)
    assert data == b""
    assert arrived - before >= 0.05


def test_what_arrived_before_it_was_opened_is_dropped(pty):
    pty.send(b"old")
    port = Port(pty.path, 9600)
    port.open()
    pty.send(b"new")
    assert port.read(5.0)[0] == b"new"
    port.close()


def test_reads_that_gather_leave_time_between_them(pty, monkeypatch):
    monkeypatch.setattr("forcelab.capture.device.GATHER_SECONDS", 0.05)
    port = Port(pty.path, 9600)
    port.open()
    pty.send(b"a")
    first = port.read(5.0)[1]
    pty.send(b"b")
    pty.send(b"c")
    data, second = port.read(5.0)
    port.close()
    assert data == b"bc"
    assert second - first >= 0.05


def test_what_is_written_reaches_the_device(pty, port):
    port.write(b"\xaa\x00\x32\x0a")
    assert os.read(pty.master, 100) == b"\xaa\x00\x32\x0a"


@pytest.mark.parametrize("act", [lambda port: port.read(1.0), lambda port: port.write(b"x")])
def test_an_unplugged_device_is_told_with_its_name(pty, port, act):
    pty.unplug()
    with pytest.raises(UnpluggedError, match=f"{pty.path} is gone"):
        act(port)
    port.close()
    port.close()


def test_a_closed_port_is_not_read(pty, port):
    port.close()
    with pytest.raises(UnpluggedError, match="not open"):
        port.read(0.1)


def test_a_port_that_is_not_there_is_told_with_the_cure():
    with pytest.raises(InputError, match=r"no port /dev/ttyNONE7.*--list"):
        Port("/dev/ttyNONE7", 9600).open()


def test_a_port_that_is_in_use_is_refused(pty, port):
    with pytest.raises(InputError, match="in use by another program"):
        Port(pty.path, 9600).open()
    port.read(0.01)  # the one that has it keeps it


def test_a_file_is_no_port(tmp_path):
    (tmp_path / "notes").write_text("not a port")
    with pytest.raises(InputError, match=r"cannot be opened .*is it a serial port\?"):
        Port(str(tmp_path / "notes"), 9600).open()


@pytest.mark.parametrize("number", [errno.EACCES, errno.EPERM])
def test_a_port_of_others_is_told_with_the_group(number):
    assert "dialout" in open_error("/dev/ttyACM0", OSError(number, "no"))
