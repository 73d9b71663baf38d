import os
import sys
from pathlib import Path

import pytest

from forcelab.capture.discovery import FoundCamera, find_cameras


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
