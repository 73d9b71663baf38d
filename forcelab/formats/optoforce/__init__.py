"""Raw dumps of the serial stream of OptoForce DAQs."""

from forcelab.formats.optoforce.reader import read, sniff

__all__ = ["read", "sniff"]
