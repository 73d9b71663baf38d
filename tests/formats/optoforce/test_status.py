"""Status words become sentences that name the part and the cure."""

import numpy as np
import pytest

from forcelab.formats.optoforce_packets import is_faulty, is_overloaded, status_sentences


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (0x0000, ()),
        (0x2000, ("The DAQ reports an error; unplug it and plug it in again.",)),
        (0x4000, ("The DAQ cannot talk to the sensor; check the sensor's cable.",)),
        (0x0402, ("Sensor 2 is absent; check its cable.",)),
        (0x0801, ("Sensor 1 has failed; it may have to be repaired.",)),
        (0x1000, ("The sensor is too hot or too cold; let it come to room temperature.",)),
        (0x0200, ("The sensor is overloaded in Fx; press less.",)),
        (0x0083, ("Sensor 3 is overloaded in Fz; press less.",)),
        (0x0051, ("Sensor 1 is overloaded in Tx, Tz; press less.",)),
        (0x0408, ("The sensor (and others) is absent; check its cable.",)),
    ],
)
def test_each_bit_has_its_sentence(status, said):
    assert status_sentences(status) == said


def test_several_things_are_several_sentences():
    assert len(status_sentences(0x2000 | 0x0800 | 0x0300)) == 3
    assert "Fx, Fy" in status_sentences(0x0300)[0]


def test_samples_are_marked_by_kind():
    words = np.array([0, 0x0010, 0x0200, 0x0400, 0x8000, 0x000F], np.uint16)
    assert is_overloaded(words).tolist() == [False, True, True, False, False, False]
    assert is_faulty(words).tolist() == [False, False, False, True, True, False]
