"""What is wrong is told in a sentence each."""

import math

import pytest

from forcelab.capture.camera import CameraState
from forcelab.capture.reader import DeviceState
from forcelab.capture.recorder import RecorderState
from forcelab.demonstration import Channel
from forcelab.gui.capture.status_panel import device_alarms

FZ = Channel("fz1", "N")
NAME = "optoforce:/dev/ttyACM0?rate=1000"


def alarms_of(alarms=(), drifted=(), camera=(), in_memory=0, name=NAME, recording=True):
    device = DeviceState(
        name, (FZ,), True, 1, 0, 0, 0.0, math.nan, math.nan,
        math.nan, alarms, drifted,
    )  # fmt: skip
    frames = CameraState("camera 0", 1, 0, 30.0, camera)
    return device_alarms(RecorderState(recording, "LEGO 01", 1.0, in_memory, (device,), (frames,)))


def test_nothing_wrong_is_nothing_said():
    assert alarms_of() == []


@pytest.mark.parametrize(
    ("alarm", "part"),
    [
        ("unplugged", "plug it in again"),
        ("stalled", "look at its cable"),
        ("saturation", "beyond its range"),
        ("lost samples", "they are gaps"),
        ("drift", "its clock"),
    ],
)
def test_each_alarm_names_its_device(alarm, part):
    [sentence] = alarms_of((alarm,))
    assert "optoforce:/dev/ttyACM0" in sentence
    assert "?" not in sentence
    assert part in sentence


def test_a_zero_that_wanders_is_told_with_how_far_and_what_to_do_and_when():
    [now] = alarms_of(("zero",), ((FZ, -0.3125),), recording=False)
    assert "fz1 \N{MINUS SIGN}0.31 N" in now
    assert "let go of everything and press Zero." in now
    [later] = alarms_of(("zero",), ((FZ, -0.3125),))
    assert "press Zero before the next recording." in later


def test_long_names_are_told_apart_in_a_line():
    path = "optoforce:/tmp/forcelab-replay-abcdefgh/ttyACM{}?calibration=x"
    [first], [second] = (alarms_of(("stalled",), name=path.format(i)) for i in (0, 1))
    assert first != second
    assert len(first) < 70


def test_cameras_and_the_disk_have_theirs():
    silent, disk = alarms_of(camera=("no picture",), in_memory=2_500_000)
    assert "camera 0 gives no picture" in silent
    assert "2.5 MB" in disk
