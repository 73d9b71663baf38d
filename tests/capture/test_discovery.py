import argparse
import json
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from forcelab.capture.discovery import (
    FoundCamera,
    FoundPort,
    find_cameras,
    find_ports,
    only_port,
    optoforce_ports,
    relocate_port,
)
from forcelab.cli.commands import capture
from forcelab.errors import InputError


def listed(device, vid=None, pid=None, **described):
    words = {"serial_number": None, "manufacturer": None, "product": None, "description": "n/a"}
    return SimpleNamespace(device=device, vid=vid, pid=pid, **(words | described))


PORTS = [
    listed("/dev/ttyUSB1", 0x1A86, 0x7523, description="USB Serial"),
    listed("/dev/ttyACM0", 0x04D8, 0x000A, manufacturer="Microchip", serial_number="7"),
    listed("/dev/ttyUSB0", 0x0403, 0x6001, product="USB <-> QSB", serial_number="81830"),
    listed("/dev/ttyUSB2", 0x0403, 0x6001, product="FT232R USB UART"),
    listed("/dev/ttyACM1", 0x2341, 0x0043, description="Arduino Uno"),
    listed("/dev/ttyUSB3", 0x067B, 0x2303, description="PL2303 cable"),
    listed("/dev/ttyS0"),
]


@pytest.fixture
def plugged(monkeypatch):
    from serial.tools import list_ports

    monkeypatch.setattr(capture, "find_streams", tuple)  # which takes a second

    def plug(ports):
        monkeypatch.setattr(list_ports, "comports", lambda: ports)

    return plug


def found(path, kind="text", serial=None, usb=(1, 2)):
    return FoundPort(path, kind, "", serial, usb, usable=True)


def test_devices_are_known_by_what_usb_tells(plugged):
    plugged(PORTS)
    kinds = {port.path: port.kind for port in find_ports()}
    assert list(kinds) == sorted(kinds)
    assert kinds == {
        "/dev/ttyACM0": "optoforce",
        "/dev/ttyACM1": "text",
        "/dev/ttyUSB0": "encoder",
        "/dev/ttyUSB1": "text",
        "/dev/ttyUSB2": "text",
        "/dev/ttyUSB3": "unknown",
        "/dev/ttyS0": "unknown",
    }
    assert optoforce_ports() == ("/dev/ttyACM0",)


def test_the_only_device_of_a_kind_is_found_without_its_port(plugged):
    plugged(PORTS)
    assert only_port("encoder") == "/dev/ttyUSB0"
    with pytest.raises(InputError, match="3 devices that may be 'text'"):
        only_port("text")
    plugged([])
    with pytest.raises(InputError, match="No device of kind 'optoforce' is plugged in"):
        only_port("optoforce")


def test_a_device_is_found_again_by_its_serial_number_at_another_port():
    known = found("/dev/ttyUSB0", serial="A1")
    others = [found("/dev/ttyUSB0", serial="B2"), found("/dev/ttyUSB1", serial="A1")]
    assert relocate_port(known, others) == "/dev/ttyUSB1"
    assert relocate_port(known, others[:1]) is None


def test_a_device_without_a_serial_number_is_found_at_its_own_port_only():
    known = found("/dev/ttyUSB0")
    assert relocate_port(known, [found("/dev/ttyUSB0")]) == "/dev/ttyUSB0"
    assert relocate_port(known, [found("/dev/ttyUSB0", usb=(3, 4))]) is None
    assert relocate_port(known, [found("/dev/ttyUSB1")]) is None


def test_the_list_shows_what_to_say_and_what_it_is(plugged, capsys):
    plugged(PORTS)
    capture.list_devices(argparse.Namespace(json=False))
    shown = capsys.readouterr().out
    assert "--device optoforce:/dev/ttyACM0" in shown
    assert "--device KIND:/dev/ttyUSB3" in shown
    assert "81830" in shown
    capture.list_devices(argparse.Namespace(json=True))
    plain = json.loads(capsys.readouterr().out)
    assert plain["ports"][0]["usb"] == "04d8:000a"
    assert plain["ports"][0]["device"] == "optoforce:/dev/ttyACM0"


def test_where_there_is_nothing_one_sentence_says_so(plugged, capsys, monkeypatch):
    plugged([])
    monkeypatch.setattr(capture, "find_cameras", lambda: ())
    capture.list_devices(argparse.Namespace(json=False))
    assert capsys.readouterr().out == capture.NOTHING_FOUND + "\n"


def test_cameras_are_listed_by_the_number_that_is_said(plugged, capsys, monkeypatch):
    from forcelab.capture.discovery import FoundCamera

    plugged([])
    films = (FoundCamera("/dev/video2", "Webcam", usable=False),)
    monkeypatch.setattr(capture, "find_cameras", lambda: films)
    capture.list_devices(argparse.Namespace(json=False))
    shown = capsys.readouterr().out
    assert "--camera 2" in shown
    assert "not yours to open" in shown


def kernel_list(folder, **names):
    for device, name in names.items():
        (folder / device).mkdir()
        (folder / device / "name").write_bytes(name)
    return folder


def test_cameras_are_listed_with_the_names_their_drivers_give(tmp_path):
    folder = kernel_list(tmp_path, video71=b"Webcam \xff\n", video70=b"USB camera\n")
    assert find_cameras(folder) == (
        FoundCamera("/dev/video70", "USB camera", usable=False),
        FoundCamera("/dev/video71", "Webcam \ufffd", usable=False),
    )


def test_a_camera_that_can_be_read_is_usable(tmp_path):
    (camera,) = find_cameras(kernel_list(tmp_path, null=b"sees nothing"))
    assert camera.usable == os.access("/dev/null", os.R_OK)


def test_a_device_that_is_gone_before_it_was_looked_at_is_left_out(tmp_path):
    kernel_list(tmp_path, video70=b"USB camera\n")
    (tmp_path / "video71").mkdir()
    assert [camera.device for camera in find_cameras(tmp_path)] == ["/dev/video70"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc")
def test_a_name_that_cannot_be_read_is_left_out(tmp_path):
    kernel_list(tmp_path, video70=b"USB camera\n")
    (tmp_path / "video71").mkdir()
    (tmp_path / "video71" / "name").symlink_to("/proc/self/mem")  # reading it is an input error
    assert [camera.device for camera in find_cameras(tmp_path)] == ["/dev/video70"]


@pytest.mark.parametrize("folder", ["/no/such/folder", __file__, "/" + "a" * 5000])
def test_where_the_system_lists_no_cameras_there_are_none(folder):
    assert find_cameras(Path(folder)) == ()
