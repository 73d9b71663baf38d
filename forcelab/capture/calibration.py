"""Calibration of DAQs that are read live: the same files as for dumps, found by serial number."""

from forcelab.formats.optoforce.calibration import (
    ANY,
    Calibration,
    Calibrations,
    channels_of,
    read_calibrations,
)

__all__ = ["ANY", "Calibration", "Calibrations", "channels_of", "read_calibrations"]
