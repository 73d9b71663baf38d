"""A recording as the counts of the sensors that play it."""

import numpy as np

from forcelab.capture.replay import extract_sensors
from forcelab.demonstration import Channel, Demonstration
from forcelab.formats.calibration import read_calibrations
from forcelab.resources import asset


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
