"""Colours measured in CIELAB, a space that has no part in how they were made."""

import numpy as np
import pytest

from forcelab.gui.label.scalogram_painting import magnitude_colours, oklch_to_srgb, phase_colours

WHITE = np.array([0.95047, 1.0, 1.08883])
XYZ = np.array(
    [
        [0.4124564, 0.3575761, 0.1804375],
        [0.2126729, 0.7151522, 0.0721750],
        [0.0193339, 0.1191920, 0.9503041],
    ]
)


def cielab(rgb):
    """L*, a* and b* under D65, after IEC 61966-2-1 and CIE 15."""
    v = np.asarray(rgb, dtype=np.float64) / 255
    linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
    t = linear @ XYZ.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = f[..., 0], f[..., 1], f[..., 2]
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


@pytest.mark.parametrize("dark", [True, False])
def test_magnitudes_have_a_lightness_that_is_almost_a_straight_line(dark):
    lightness = cielab(magnitude_colours(dark))[:, 0]
    steps = np.diff(lightness) if dark else -np.diff(lightness)
    # Rounding to 8 bits moves a colour by up to a quarter of a unit.
    assert steps.min() > -0.25
    line = np.linspace(lightness[0], lightness[-1], len(lightness))
    assert np.max(np.abs(lightness - line)) < 6
    assert abs(lightness[-1] - lightness[0]) > 65


@pytest.mark.parametrize("dark", [True, False])
def test_equal_steps_of_magnitude_look_about_equal(dark):
    lab = cielab(magnitude_colours(dark)[::8])
    steps = np.linalg.norm(np.diff(lab, axis=0), axis=1)
    assert steps.max() / steps.min() < 4


@pytest.mark.parametrize("dark", [True, False])
def test_the_least_magnitude_is_close_to_the_ground(dark):
    ground = [0x16, 0x19, 0x1E] if dark else [255, 255, 255]
    distance = np.linalg.norm(cielab(magnitude_colours(dark)[0]) - cielab(ground))
    assert distance < 14


@pytest.mark.parametrize("dark", [True, False])
def test_phases_have_one_lightness_and_close_the_circle(dark):
    lab = cielab(phase_colours(dark))
    assert np.ptp(lab[:, 0]) < 9
    steps = np.linalg.norm(lab - np.roll(lab, 1, axis=0), axis=1)
    assert steps.max() < 3
    opposite = np.linalg.norm(lab - np.roll(lab, len(lab) // 2, axis=0), axis=1)
    assert opposite.min() > 35


def test_what_the_screen_cannot_show_loses_chroma_only():
    rgb = oklch_to_srgb(np.array([0.6]), np.array([0.5]), np.array([2.0]))
    grey = oklch_to_srgb(np.array([0.6]), np.array([0.0]), np.array([2.0]))
    assert cielab(rgb)[0, 0] == pytest.approx(cielab(grey)[0, 0], abs=5)
    assert np.ptp(grey) == 0
