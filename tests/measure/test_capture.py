"""What recording is measured at: what is wrong is seen, and what is right is not blamed."""

import pytest

from forcelab.capture.virtual_faults import Faults
from forcelab.jobs import finish
from forcelab.measure.capture import recording


@pytest.mark.parametrize("dropped", [0.0, 0.05])
def test_a_recording_is_held_against_when_its_samples_were_taken(dropped):
    row = finish(recording(3.0, Faults(lost=dropped)))
    lost = row.further["lost samples"]
    assert 60 < lost < 300 if dropped else lost == 0
    assert row.error < 0.25  # a machine that is busy delays what arrives
    assert 0 < row.seconds < 1
    assert row.peak_bytes > 10e6
