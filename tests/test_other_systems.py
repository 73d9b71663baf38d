"""What Windows and macOS do otherwise, each shown here as their documentation says it."""

import errno
import multiprocessing
import os
import sys
import time
from pathlib import Path, PurePosixPath, PureWindowsPath
from types import SimpleNamespace

import psutil
import pytest
from serial import SerialException
from serial.tools import list_ports

from forcelab.capture import emulator, journal
from forcelab.capture.discovery import find_ports
from forcelab.capture.save import _free_stem
from forcelab.capture.serial_port import open_error
from forcelab.cli import main
from forcelab.cli.commands import capture, doctor
from forcelab.errors import InputError
from forcelab.formats import arrays
from forcelab.formats.output_folder import file_names
from forcelab.io import write_atomically
from forcelab.parallel import _end_with
from forcelab.process import _context
from forcelab.project.database import store_uri
from forcelab.project.files import file_errors


@pytest.fixture
def windows(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")


class OpenElsewhereError(PermissionError):
    """What Windows says of a file that a program has open."""

    winerror = 32


@pytest.mark.parametrize("name", ["CON", "nul", "aux.left", "Com1", "lpt9 .x", "COM²", "CONIN$"])
def test_no_file_has_the_name_of_a_device_of_windows(name):
    assert file_names([name]) == [f"_{name}"]


def test_names_that_only_begin_as_a_device_stay():
    names = ["console", "COM10", "auxiliary", "null", "lpt", "com"]
    assert file_names(names) == names


def test_files_of_a_recording_are_free_whatever_their_case_and_no_device(tmp_path):
    (tmp_path / "Pen.journal").touch()
    assert _free_stem(tmp_path, "pen") == "pen (2)"
    assert _free_stem(tmp_path, "con") == "_con"


@pytest.mark.parametrize(
    ("path", "address"),
    [
        (PureWindowsPath(r"\\lab\pens\a b\p"), "file:////lab/pens/a%20b/p?mode=ro"),
        (PureWindowsPath(r"C:\pens\p#1"), "file:///C:/pens/p%231?mode=ro"),
        (PurePosixPath("/pens/p?"), "file:///pens/p%3F?mode=ro"),
    ],
)
def test_a_store_has_an_address_without_a_machine_in_it(path, address):
    assert store_uri(path, "ro") == address


def test_a_file_that_is_open_elsewhere_is_told_with_the_cure(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_bytes(b"before")

    def refuse(*_):
        raise OpenElsewhereError(errno.EACCES, "The file is used by another process")

    monkeypatch.setattr(type(path), "replace", refuse)
    with pytest.raises(InputError, match="untouched; close it in other programs, or check who"):
        write_atomically(path, b"after")
    assert path.read_bytes() == b"before"
    with pytest.raises(InputError, match="close it in other programs"), file_errors("Not changed"):
        refuse()


def test_a_port_of_windows_is_judged_by_its_list_not_by_a_file(windows, monkeypatch):
    port = SimpleNamespace(
        device="COM3", vid=None, pid=None, serial_number=None, manufacturer=None, product=None,
        description="Communications Port",
    )  # fmt: skip
    monkeypatch.setattr(list_ports, "comports", lambda: [port])
    (found,) = find_ports()
    assert found.usable


@pytest.mark.parametrize(
    ("quoted", "sentence"),
    [
        ("PermissionError(13, 'Access is denied.', None, 5)", "in use by another program"),
        ("FileNotFoundError(2, 'The system cannot find the file.', None, 2)", "There is no port"),
    ],
)
def test_a_port_that_windows_refuses_is_told_with_the_cure(quoted, sentence):
    error = SerialException(f"could not open port 'COM3': {quoted}")
    assert sentence in open_error("COM3", error)


def test_a_reader_that_stops_early_is_no_error_under_windows(windows, monkeypatch, capfd):
    def closed(*_):
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr("forcelab.cli._run", closed)
    monkeypatch.setattr("forcelab.cli._drop_output", lambda: None)
    assert main(["doctor"]) == 0
    assert capfd.readouterr().err == ""


def test_a_worker_of_windows_ends_with_its_parent(windows, monkeypatch):
    """Its parent's number stays the same there when the parent is gone."""
    ended = []
    monkeypatch.setattr(psutil, "pid_exists", lambda _: False)
    monkeypatch.setattr(os, "_exit", ended.append)
    _end_with.__wrapped__(os.getppid())
    deadline = time.monotonic() + 5
    while not ended and time.monotonic() < deadline:
        time.sleep(0.01)
    assert ended == [1]


def test_a_job_under_macos_is_no_fork(monkeypatch):
    assert "forkserver" in multiprocessing.get_all_start_methods()
    monkeypatch.setattr(sys, "platform", "darwin")
    assert _context.__wrapped__("forcelab.jobs").get_start_method() == "spawn"


def test_without_proc_the_time_that_a_damaged_file_takes_is_bounded_all_the_same(
    tmp_path, monkeypatch
):
    resource = pytest.importorskip("resource")
    limits = {}
    monkeypatch.setattr(resource, "setrlimit", limits.__setitem__)
    monkeypatch.setattr(arrays, "_MEMORY", tmp_path / "missing")
    arrays._set_bounds(10**6)
    assert list(limits) == [resource.RLIMIT_CPU]


class Locks:
    """Locks as ``msvcrt`` sets them: of one byte, where the file stands."""

    LK_NBLCK = 2

    def __init__(self):
        self.locks = {}

    def locking(self, descriptor, mode, count):
        assert (mode, count) == (self.LK_NBLCK, 1)
        place = os.lseek(descriptor, 0, os.SEEK_CUR)
        if self.locks.setdefault((os.fstat(descriptor).st_ino, place), descriptor) != descriptor:
            raise OSError(errno.EACCES, "Permission denied")


def test_a_journal_of_windows_is_known_to_be_written(windows, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "msvcrt", Locks())
    path = tmp_path / "pen.journal"
    path.write_bytes(b"0123")
    with journal.FileIO(path, "r+") as file:
        file.seek(3)
        assert journal._lock(file)
        assert file.read() == b"3"
        assert journal.is_being_written(path)


def test_where_windows_cannot_lock_a_journal_counts_as_left_behind(windows, monkeypatch, tmp_path):
    def refuse(*_):
        raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(LK_NBLCK=2, locking=refuse))
    (tmp_path / "pen.journal").touch()
    assert not journal.is_being_written(tmp_path / "pen.journal")


def test_where_no_virtual_device_is_possible_another_way_is_told(monkeypatch):
    monkeypatch.setattr(emulator, "SUPPORTED", False)
    with pytest.raises(InputError, match="pseudo-terminals of Linux; .* as replay:PROJECT"):
        emulator.VirtualPort(Path("ttyACM0"))


def test_the_doctor_tells_what_a_system_lacks(monkeypatch):
    clock = SimpleNamespace(resolution=0.015625)
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(time, "get_clock_info", lambda _: clock)
    monkeypatch.setattr(emulator, "SUPPORTED", False)
    cures = {check.what: check.cure for check in doctor._limits()}
    assert cures["clock"] == "use Python 3.13 or later to record"
    assert "replay:PROJECT" in cures["replay"]
    assert "shortcut" in cures["install-launcher"]
    assert all(check.well for check in doctor._limits())


def test_cameras_that_no_system_lists_are_not_called_missing(monkeypatch, capsys):
    for module in ("forcelab.capture.discovery", "forcelab.cli.commands.capture"):
        monkeypatch.setattr(f"{module}.LISTS_CAMERAS", False)
        monkeypatch.setattr(f"{module}.find_cameras", lambda: ())
        monkeypatch.setattr(f"{module}.find_ports", lambda: ())
    monkeypatch.setattr(capture, "find_streams", lambda: ())
    (cameras,) = (check for check in doctor._devices() if check.what == "cameras")
    assert (cameras.found, cameras.cure) == (
        "not listed here",
        "name one by its number, such as --camera 0",
    )
    capture.list_devices(SimpleNamespace(json=False))
    assert "--camera 0" in capsys.readouterr().out
