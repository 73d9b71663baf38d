"""What was written down, read again: blocks of a journal, and the numbers in frames."""

from __future__ import annotations

import struct

import numpy as np

from forcelab.capture.emulator import BITS
from forcelab.capture.journal import JournalReader, SampleBuffer


def block_of(payload):
    """The block of samples in the payload of a journal's record."""
    samples = SampleBuffer(struct.unpack_from("<IH", payload)[1])
    samples.add(payload)
    return samples.block()


def parsed(data):
    """The contents of a journal whose bytes are all there."""
    return JournalReader(lambda: iter((data,)), "test")


def frame_number(picture):
    """The number in a picture of a virtual camera, modulo 65,536; lossy coding does it no harm."""
    side = picture.shape[1] // BITS
    squares = picture[:side, : side * BITS].mean(axis=(0, 2)).reshape(BITS, side)
    return int(((squares.mean(axis=1) > 127) << np.arange(BITS)).sum())
