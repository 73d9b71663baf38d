"""The response of a ring, where a wavelet is cut at the Nyquist frequency."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.signals.cwt_engine import ring_length, ring_response
from forcelab.signals.wavelets import Morlet


@pytest.mark.parametrize("length", [98, 5832, 5880, 60000, 65856])
def test_the_nyquist_bin_stands_for_both_signs_whatever_the_length(length):
    """5832 is among the lengths for which length * (1 / length) is not 1 in floating point."""
    morlet = Morlet()
    peak = np.sqrt(2.0) * morlet.spectrum(2.0 * np.array([-np.pi, np.pi])).mean().real
    response = ring_response(morlet, 2.0, length).real
    assert response[length // 2] == pytest.approx(peak, rel=1e-12)
    assert response[length // 2 - 1] == pytest.approx(2 * peak, rel=0.5)
    assert response[length // 2 + 1] == pytest.approx(0.0, abs=1e-12)


def test_the_ring_of_the_published_preset_does_not_change():
    """How scale 2 rings depends on it, and with it every run that was stored."""
    assert [ring_length(n, 2.0, Morlet().radius) for n in (5533, 5282, 5717)] == [5632, 5390, 5832]
