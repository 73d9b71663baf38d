import numpy as np
import pytest

from forcelab.gui.figures.wavelets import two_tones, view_wavelets

RATE = 200.0
TIMES = np.arange(0, 5, 1 / RATE)
TONES = (10.0, 16.0)
SIGNAL = sum(np.sin(2 * np.pi * tone * TIMES) for tone in TONES)


def test_each_p_shows_both_tones_and_a_large_p_tells_them_apart():
    few, many = view_wavelets((3.0, 20.0), SIGNAL, RATE, 4.0, 40.0)
    middle = len(TIMES) // 2
    window = slice(middle - 50, middle + 50)
    dips = []
    for view in (few, many):
        mean = view.magnitudes[:, window].mean(axis=1)
        at = [mean[np.argmin(np.abs(view.hertz - f))] for f in (*TONES, 12.65)]
        dips.append(at[2] / min(at[:2]))
    assert dips[0] > 0.8
    assert dips[1] < 0.1


def test_equal_tones_look_equally_strong():
    (view,) = view_wavelets((20.0,), SIGNAL, RATE, 4.0, 40.0)
    middle = view.magnitudes[:, 400:600].mean(axis=1)
    tops = [middle[np.abs(view.hertz - f) < 1].max() for f in TONES]
    assert tops[0] == pytest.approx(tops[1], rel=0.02)
    highest = view.hertz[np.argmax(middle)]
    assert min(abs(highest - tone) for tone in TONES) < 0.3


def test_the_wavelet_is_the_morlet_of_its_p():
    (view,) = view_wavelets((5.0,), SIGNAL, RATE, 4.0, 40.0)
    expected = np.pi**-0.25 * np.exp(5j * view.t - view.t**2 / 2)
    assert np.abs(view.psi - expected).max() < 1e-5


def test_each_tone_sounds_in_its_own_time_and_both_in_between():
    times, signal = two_tones(10.0, 16.0, RATE)
    np.testing.assert_array_equal(times, TIMES)
    (view,) = view_wavelets((5.0,), signal, RATE, 4.0, 40.0)
    rows = [np.argmin(np.abs(view.hertz - tone)) for tone in TONES]
    columns = np.searchsorted(times, [0.3, 1.5, 2.5, 3.5, 4.7])
    loud = view.magnitudes[rows][:, columns] > 0.5 * view.magnitudes.max()
    assert loud.tolist() == [[False, True, True, False, False], [False, False, True, True, False]]
