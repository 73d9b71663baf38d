import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.recognition.clusters import cluster, compare_wavelets, trapezoid
from forcelab.signals.wavelets import Morlet

TIMES, SIGNAL = trapezoid()
RISE, FALL = (TIMES > 2.1) & (TIMES < 2.9), (TIMES > 5.1) & (TIMES < 5.9)


def confused(codes):
    """Share of the rise whose cluster is that of the same force on the way down."""
    return np.mean(codes[RISE] == codes[FALL][::-1])


def test_the_trapezoid_is_the_same_forwards_and_backwards():
    assert pytest.approx(SIGNAL[::-1]) == SIGNAL
    assert SIGNAL[[0, -1]].tolist() == [0, 0]
    assert SIGNAL.max() == SIGNAL[np.searchsorted(TIMES, 4.0)] == 10
    assert np.interp(2.5, TIMES, SIGNAL) == pytest.approx(5.0)
    assert TIMES[-1] == pytest.approx(8.0)


def test_only_the_morlet_with_phase_tells_rising_from_falling():
    found = compare_wavelets(SIGNAL)
    assert [c.title for c in found] == [
        "Morlet, magnitude and phase",
        "Morlet, magnitude only",
        "Derivative of Gaussian",
        "Haar",
    ]
    assert confused(found[0].codes) == 0.0
    assert all(confused(c.codes) > 0.9 for c in found[1:])


def test_with_phase_each_flank_and_the_hold_is_one_cluster_of_its_own():
    codes = compare_wavelets(SIGNAL)[0].codes
    hold = (TIMES > 3.5) & (TIMES < 4.5)
    still = (TIMES < 1.0) | (TIMES > 7.0)
    each = [set(codes[part].tolist()) for part in (RISE, FALL, hold, still)]
    assert all(len(clusters) == 1 for clusters in each)
    assert set().union(*each) == {0, 1, 2, 3}


def test_the_finding_survives_noise():
    noisy = SIGNAL + 0.02 * np.random.default_rng(1).standard_normal(len(SIGNAL))
    found = compare_wavelets(noisy)
    assert confused(found[0].codes) < 0.05
    assert all(confused(c.codes) > 0.85 for c in found[1:])


def test_the_unit_of_the_force_does_not_matter():
    newton = cluster(SIGNAL, Morlet(), phase=True)
    assert (cluster(1e-6 * SIGNAL, Morlet(), phase=True) == newton).all()
    assert (cluster(1e6 * SIGNAL, Morlet(), phase=True) == newton).all()


def test_clusters_are_numbered_in_the_order_of_occurrence_and_repeat():
    codes = cluster(SIGNAL, Morlet(), phase=False)
    assert list(dict.fromkeys(codes.tolist())) == [0, 1, 2, 3]
    assert (codes == cluster(SIGNAL, Morlet(), phase=False)).all()
    assert set(cluster(SIGNAL, Morlet(), phase=True, clusters=1)) == {0}


def test_a_signal_that_never_changes_is_refused():
    with pytest.raises(InputError, match="never changes"):
        cluster(np.full(500, 3.0), Morlet(), phase=True)


def test_more_clusters_than_time_steps_are_refused():
    with pytest.raises(InputError, match="3 time steps"):
        cluster(np.arange(3.0), Morlet(), phase=True)
