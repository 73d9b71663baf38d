"""Fake devices that count in real time, a full disk, and what was recorded, read again."""

import errno
import io
import struct
import threading
import time

import numpy as np

from forcelab.capture.device import Block, Device, UnpluggedError
from forcelab.capture.journal import JournalReader, SampleBuffer
from forcelab.demonstration import Channel
from forcelab.errors import InputError


class FullDisk(io.FileIO):
    """A file on a disk with so many bytes left."""

    room = 10**9

    def write(self, data):
        fits = min(len(data), FullDisk.room)
        if not fits:
            raise OSError(errno.ENOSPC, "No space left on device")
        FullDisk.room -= fits
        return super().write(data[:fits])


class FakeDevice(Device):
    """Three axes whose values are the tick, its double and its negative, at `rate`."""

    def __init__(self, name="fake:0", rate=1000.0, ppm=0.0, burst=0.01, ticked=True):
        super().__init__()
        self.name, self.rate = name, rate
        self.channels = tuple(Channel(axis, "N") for axis in ("fx", "fy", "fz"))
        self.ppm, self.burst, self.ticked = ppm, burst, ticked
        self.status = 0
        self.lose = ()
        self.gone = threading.Event()
        self.opened = self.closed = self.reopened = self.zeroed = 0
        self.next, self.began = 0, 0.0
        #: The longest that nobody read it, in seconds: no stamp can be better than that.
        self.unread, self._read = 0.0, 0.0

    def open(self):
        if self.gone.is_set():
            raise InputError(f"{self.name} is not there; plug it in.")
        self.opened += 1
        self.began, self.next = time.monotonic(), 0
        self._read = self.began

    def reopen(self):
        self.open()
        self.reopened += 1

    def say(self, sentence):
        self._messages.put(sentence)

    def zero(self):
        self.zeroed += 1

    def close(self):
        self.closed += 1

    def read(self, timeout):
        time.sleep(min(timeout, self.burst))
        if self.gone.is_set():
            raise UnpluggedError(f"{self.name} is gone; plug it in again.")
        now = time.monotonic()
        self.unread, self._read = max(self.unread, now - self._read), now
        due = int((now - self.began) * self.rate / (1 + 1e-6 * self.ppm))
        ticks = np.arange(self.next, due, dtype=np.int64)
        self.next = max(due, self.next)
        ticks = ticks[~np.isin(ticks, self.lose)]
        if not len(ticks):
            return None
        values = np.stack([ticks, 2.0 * ticks, -1.0 * ticks], axis=1)
        status = np.full(len(ticks), self.status, dtype=np.uint16)
        return Block(np.full(len(ticks), now), ticks if self.ticked else None, values, status)


class FakeEncoder(FakeDevice):
    """An opening that changes when told."""

    def __init__(self, name="fake encoder"):
        super().__init__(name)
        self.holds, self.channels = True, (Channel("opening", "mm"),)
        self.changes = []

    def read(self, timeout):
        time.sleep(min(timeout, self.burst))
        if self.gone.is_set():
            raise UnpluggedError(f"{self.name} is gone; plug it in again.")
        if not self.changes:
            return None
        value = self.changes.pop(0)
        return Block(np.array([time.monotonic()]), None, np.array([[float(value)]]), None)


def numbered(times):
    """Readings whose first is the number of the millisecond."""
    k = np.round(1000 * times).astype(np.int64)
    return np.column_stack([k, -k, k % 7])


def eventually(true, seconds=30.0):
    """Wait until something is true; fails if that takes too long on the slowest machine."""
    limit = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < limit
        time.sleep(0.01)


def block_of(payload):
    """The block of samples in the payload of a journal's record."""
    samples = SampleBuffer(struct.unpack_from("<IH", payload)[1])
    samples.add(payload)
    return samples.block()


def journal_of(data):
    """The contents of a journal whose bytes are all there."""
    return JournalReader(lambda: iter((data,)), "test")
