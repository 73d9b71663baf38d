from __future__ import annotations

import math
import warnings
from inspect import signature

import numpy as np
import pytest
import pywt
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.special import eval_hermitenorm, gamma

from forcelab.errors import InputError
from forcelab.signals.cwt import (
    cwt,
    early_error,
    frequencies,
    geometric_scales,
    reaches,
    usual_scales,
)
from forcelab.signals.wavelets import DOG, Haar, Morlet, RealMorlet, cone_of_influence

PAPER = geometric_scales()

# The reference: the sum itself, with psi from its closed form, none of it the project's code.


def morlet(p):
    def psi(t):
        return np.pi**-0.25 * (np.exp(1j * p * t) - np.exp(-(p**2) / 2)) * np.exp(-(t**2) / 2)

    return psi


def real_morlet(p):
    return lambda t: morlet(p)(t).real


def derivative_of_gaussian(m):
    def psi(t):
        return -eval_hermitenorm(m, t) * np.exp(-(t**2) / 2) / math.sqrt(gamma(m + 0.5))

    return psi


def direct_sum(x, scale, psi, half_width=10.0, offset=0.0):
    """a^-1/2 sum_n x_n conj(psi((n - b - offset) / a)), x held at both ends, b = 0 .. N-1."""
    reach = math.ceil(half_width * scale) + 1
    m = np.arange(-reach, reach + 1)
    kernel = np.conj(psi((m - offset) / scale)) / math.sqrt(scale)
    held = np.pad(np.asarray(x, dtype=np.float64), reach, mode="edge")
    return np.correlate(held, np.conj(kernel), mode="valid")


def random_force(n):
    return np.random.default_rng(11).standard_normal(n)


def impacts(n):
    """A tap that rings, a jump to another force and a single wild sample."""
    t = np.arange(n)
    tap = np.where(t >= n // 3, np.exp(-(t - n // 3) / 12.0) * np.sin((t - n // 3) * 0.9), 0.0)
    return 5 * tap + 2.0 * (t > n // 2) + 30.0 * (t == 3 * n // 4) - 1.5


def two_tones(n):
    t = np.arange(n)
    return np.sin(2 * np.pi * t / 37.3) + 0.4 * np.cos(2 * np.pi * t / 9.1 + 1.0) + 3.0


SIGNALS = [random_force, impacts, two_tones]
SUMS = [
    *((Morlet(p), morlet(p)) for p in (1.0, 3.0, 5.0, 6.0)),
    (RealMorlet(5.0), real_morlet(5.0)),
    *((DOG(m), derivative_of_gaussian(m)) for m in (1, 2, 3, 6, 10)),
]


def assert_equal_to(expected, found, share=1e-9):
    """Equal at every sample, edges and all, to a share of the largest coefficient."""
    assert np.abs(found - expected).max() <= share * np.abs(expected).max()


@pytest.mark.parametrize("signal", SIGNALS)
@pytest.mark.parametrize(("wavelet", "psi"), SUMS, ids=[wavelet.name for wavelet, _ in SUMS])
def test_the_transform_is_the_direct_sum_over_the_held_signal_edges_included(wavelet, psi, signal):
    x = signal(331)
    scales = [4.0, 4.7, 8.0, 16.0, 61.3, 128.0, 1024.0]
    for scale, row in zip(scales, cwt(x, scales, wavelet), strict=True):
        assert_equal_to(direct_sum(x, scale, psi, wavelet.radius + 2), row)


@pytest.mark.parametrize("p", [8.0, 12.0])
def test_fast_carriers_need_wider_scales_before_nothing_is_cut(p):
    x = random_force(300)
    first = (p + 6.5) / np.pi
    for scale in (first, 2 * first):
        assert_equal_to(direct_sum(x, scale, morlet(p)), cwt(x, [scale], Morlet(p))[0])


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 13, 97, 256, 257])
def test_any_length_agrees_with_the_direct_sum_at_scales_up_to_ten_times_as_long(n):
    x = random_force(n) + 2.0
    x[0] += 1.0
    for scale in {4.0, max(4.0, n / 2), max(4.0, 10.0 * n)}:
        found, expected = cwt(x, [scale])[0], direct_sum(x, scale, morlet(5.0))
        # The sum over a single sample is the sum over a constant: nothing but rounding.
        assert np.abs(found - expected).max() <= 1e-9 * max(np.abs(expected).max(), 1e-6)


def spectrum_of_morlet(w, p=5.0):
    bells = np.exp(-((w - p) ** 2) / 2) - np.exp(-(p**2) / 2) * np.exp(-(w**2) / 2)
    return math.sqrt(2 * math.pi) * math.pi**-0.25 * bells


def spectrum_of_haar(w):
    return 4j * np.sin(w / 4) ** 2 / w


@pytest.fixture(scope="module")
def waves():
    """Offsets m, frequencies w in -pi .. pi with their weights, and exp(i w m)."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    m = np.arange(-250, 251)
    return m, np.pi * nodes, np.pi * weights, np.exp(1j * np.pi * np.outer(m, nodes))


@pytest.mark.parametrize(
    ("wavelet", "spectrum"),
    [(Morlet(5.0), spectrum_of_morlet), (Haar(), spectrum_of_haar)],
    ids=["Morlet", "Haar"],
)
@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0, 3.0, 4.0, 16.0])
def test_what_lies_above_the_nyquist_frequency_is_cut_from_the_wavelet(
    wavelet, spectrum, scale, waves
):
    # psi, cut: a / 2 pi times the integral of psi_hat(a w) exp(i w m) over -pi < w < pi.
    _, omega, weights, exponentials = waves
    cut = np.sum(exponentials * (weights * spectrum(scale * omega)), axis=1) * scale / (2 * np.pi)
    x = np.zeros(4000)
    x[1950:2050] = random_force(100)
    middle = slice(1850, 2150)
    expected = np.correlate(x, cut, mode="same")[middle] / math.sqrt(scale)
    # What a cut wavelet rings is heard around the ring again, weakly.
    assert_equal_to(expected, cwt(x, [scale], wavelet)[0, middle], share=5e-4)


def test_a_wide_haar_wavelet_is_the_difference_of_two_sums():
    def haar(t):
        """A sample on a jump counts for the middle of the jump: so does the cut wavelet."""
        return -np.sign(t) * np.heaviside(0.5 - np.abs(t), 0.5)

    x = np.cumsum(random_force(600))
    assert_equal_to(direct_sum(x, 128.0, haar), cwt(x, [128.0], Haar())[0], share=0.01)


def test_pywavelets_agrees_within_its_own_error_and_is_the_less_exact():
    # cmorB-C is (pi B)^-1/2 exp(2 pi i C t) exp(-t^2/B): B = 2 and C = p / 2 pi give ours but for a
    # constant. PyWavelets takes differences of the wavelet's integral: a mean over one sample,
    # centred half a sample early, read from a table.
    p, n = 5.0, 1024
    x = np.zeros(n)
    x[400:624] = random_force(224) * np.hanning(224)
    wavelet = pywt.ContinuousWavelet(f"cmor2-{p / (2 * np.pi):.17g}")
    half_early = np.exp(-1j * np.pi * np.fft.fftfreq(n))
    for scale in (8.0, 16.0, 32.0):
        finely = {"precision": 12} if "precision" in signature(pywt.cwt).parameters else {}
        theirs, _ = pywt.cwt(x, [scale], wavelet, **finely)
        theirs = theirs[0] * np.pi**-0.25 * np.sqrt(2 * np.pi)
        ours = cwt(x, [scale], Morlet(p))[0]
        size = np.abs(ours).max()
        our_error = np.abs(ours - direct_sum(x, scale, morlet(p))).max() / size
        early = direct_sum(x, scale, morlet(p), offset=-0.5)
        their_error = np.abs(theirs - early).max() / size
        # Between samples ours is read by its Fourier series: it is zero long before both ends.
        between = np.fft.ifft(np.fft.fft(ours) * half_early)
        assert our_error < 1e-12
        assert 1e-4 < their_error < 0.03
        assert np.abs(between - theirs).max() / size <= their_error + 1e-9


@pytest.mark.parametrize("n", [200, 201, 203, 206])
def test_the_real_morlet_gives_the_real_part(n):
    # At scale 2 and rings of even length this needs the Nyquist bin to stand for both its signs.
    x = random_force(n)
    both, real = cwt(x, PAPER, Morlet()), cwt(x, PAPER, RealMorlet())
    np.testing.assert_allclose(real.real, both.real, rtol=0, atol=1e-13)


# What any transform of this kind must do, whatever the numbers.

signals = hnp.arrays(
    np.float64, st.integers(1, 60), elements=st.floats(-1e3, 1e3, allow_subnormal=False)
)
wavelets = st.sampled_from([Morlet(), Morlet(2.0), RealMorlet(), DOG(1), DOG(2), DOG(5), Haar()])
SOME = [0.5, 2.0, 7.0, 40.0]


@settings(max_examples=60, deadline=None)
@given(signals, wavelets, st.floats(-8, 8), st.integers(0, 2**32 - 1))
def test_it_is_linear(x, wavelet, factor, seed):
    y = np.random.default_rng(seed).standard_normal(x.size)
    mixed = cwt(factor * x + y, SOME, wavelet)
    parts = factor * cwt(x, SOME, wavelet) + cwt(y, SOME, wavelet)
    scale = 1 + (1 + abs(factor)) * np.abs(x).max() + np.abs(y).max()
    np.testing.assert_allclose(mixed, parts, rtol=0, atol=1e-13 * scale)


@settings(max_examples=60, deadline=None)
@given(signals, wavelets, st.integers(-300, 300))
def test_a_power_of_two_passes_through_bit_by_bit(x, wavelet, power):
    x = np.where(np.abs(x) < 1e-100, 0.0, x)  # so that nothing becomes subnormal
    plain = cwt(x, SOME, wavelet)
    scaled = cwt(np.ldexp(x, power), SOME, wavelet)
    for part, other in ((plain.real, scaled.real), (plain.imag, scaled.imag)):
        normal = np.abs(part) > 1e-200
        np.testing.assert_array_equal(np.ldexp(part, power)[normal], other[normal])


@settings(max_examples=60, deadline=None)
@given(signals, wavelets, st.floats(-1e6, 1e6))
def test_a_constant_added_changes_nothing_but_rounding(x, wavelet, constant):
    moved = cwt(x + constant, SOME, wavelet)
    rounding = 8 * np.finfo(float).eps * (1 + np.abs(x).max() + abs(constant)) * np.sqrt(40.0)
    np.testing.assert_allclose(moved, cwt(x, SOME, wavelet), rtol=0, atol=2 * rounding)


@settings(max_examples=20, deadline=None)
@given(signals, wavelets.filter(lambda wavelet: wavelet.real))
def test_real_wavelets_give_real_coefficients_exactly(x, wavelet):
    assert not cwt(x, SOME, wavelet).imag.any()


def test_scales_are_computed_each_by_itself_in_any_order():
    x = random_force(150)
    rows = cwt(x, [512.0, 3.0, 40.0])
    np.testing.assert_array_equal(rows[1], cwt(x, [3.0])[0])
    np.testing.assert_array_equal(rows[[2, 0, 1]], cwt(x, [40.0, 512.0, 3.0]))


def test_the_ends_hold_even_for_wavelets_that_ring():
    # The jump from last to first value of the ring must not be heard at the ends.
    x = np.concatenate([np.zeros(400), np.linspace(0, 1, 200), np.ones(400)])
    held = np.pad(x, 20_000, mode="edge")
    for wavelet in (Morlet(), Haar(), DOG(1)):
        for scale in (1.0, 2.0, 2.83):
            found = cwt(x, [scale], wavelet)[0]
            expected = cwt(held, [scale], wavelet)[0, 20_000:21_000]
            assert np.abs(found - expected).max() < 1e-5


# Extremes. Warnings are errors here as everywhere in the tests.


@pytest.mark.parametrize("value", [-0.0, 5e-324, 0.1, -1.7e308])
@pytest.mark.parametrize("wavelet", [Morlet(), DOG(2)], ids=str)
def test_a_constant_force_gives_exactly_nothing(value, wavelet):
    assert not cwt(np.full(77, value), [0.5, *PAPER], wavelet).any()


@pytest.mark.parametrize("size", [1e-300, 1e-150, 1e150, 1e300])
def test_tiny_and_huge_forces_are_transformed_like_any_other(size):
    x = random_force(200)
    expected = cwt(x, PAPER) * size
    np.testing.assert_allclose(cwt(x * size, PAPER), expected, rtol=1e-9, atol=1e-12 * size)


def test_a_vibration_of_a_micronewton_shows_on_a_giganewton():
    t = np.arange(4000)
    x = 1e9 + 1e-6 * np.sin(2 * np.pi * t / 64)
    scale = 64 / Morlet().fourier_factor
    # What is left of the vibration is what float64 holds of it: steps of 1.2e-7.
    expected = direct_sum((x - 1e9) * 1e6, scale, morlet(5.0)) * 1e-6
    np.testing.assert_allclose(cwt(x, [scale])[0], expected, rtol=0, atol=1e-15)
    assert np.abs(expected[1000:3000]).min() > 1e-6


def test_missing_samples_are_bridged():
    x = two_tones(300)
    broken = x.copy()
    broken[[50, 51, 200]] = np.nan, np.inf, -np.inf
    bridged = x.copy()
    bridged[50:52] = np.interp([50, 51], [49, 52], x[[49, 52]])
    bridged[200] = 0.5 * (x[199] + x[201])
    np.testing.assert_allclose(cwt(broken, PAPER), cwt(bridged, PAPER), atol=1e-12)
    assert not cwt(np.full(9, np.nan), PAPER).any()


def test_any_type_byte_order_and_layout_gives_the_same():
    x = np.round(100 * two_tones(120))
    expected = cwt(x, PAPER)
    frozen = x.copy()
    frozen.flags.writeable = False
    wide = np.zeros((120, 4))
    wide[:, 2] = x
    for other in (
        x.astype(np.int16),
        x.astype(">f8"),
        x.astype(">i4"),
        x.astype(np.float32),
        wide[:, 2],
        frozen,
        list(x),
    ):
        np.testing.assert_array_equal(cwt(other, PAPER), expected)


@pytest.mark.parametrize("n", [1, 2, 3, 5, 8, 997])
@pytest.mark.parametrize("wavelet", [Morlet(), Morlet(40.0), DOG(1), DOG(60), Haar()], ids=str)
def test_scales_from_half_a_sample_to_ten_recordings_are_finite(n, wavelet):
    scales = [1e-6, 0.5, 1.0, 2.0, float(n), 10.0 * n]
    found = cwt(random_force(n), scales, wavelet)
    assert found.shape == (6, n)
    assert found.dtype == np.complex128
    assert np.isfinite(found).all()


def test_a_long_recording_of_awkward_length_is_transformed_without_waiting():
    n = 100_003  # a prime
    t = np.arange(n)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = cwt(np.sin(2 * np.pi * t / 50), [50 / Morlet().fourier_factor])[0]
    inner = np.abs(found[1000:-1000])
    assert np.ptp(inner) < 1e-9 * inner.max()


# Scales, frequencies and the cone of influence.


def test_the_method_keeps_the_scales_2_to_1024():
    assert geometric_scales().tolist() == [2, 4, 8, 16, 32, 64, 128, 256, 512, 1024]


def test_scales_stop_at_the_last_and_stand_as_close_as_asked():
    assert geometric_scales(2, 40).tolist() == [2, 4, 8, 16, 32]
    assert geometric_scales(3, 12, 0.5) == pytest.approx([3, 3 * 2**0.5, 6, 6 * 2**0.5, 12])
    assert geometric_scales(5, 5).tolist() == [5]
    for spacing in (0.1, 1 / 3, 0.125):
        assert geometric_scales(2, 1024, spacing)[-1] == pytest.approx(1024)
    # Rounding puts log2 of the ratio over the spacing a little below 1 and 8 here.
    assert len(geometric_scales(2, 2 * 2**0.1, 0.1)) == 2
    assert len(geometric_scales(2, 2 * 2**0.8, 0.1)) == 9


def test_a_recording_has_scales_up_to_its_length():
    assert usual_scales(4096).tolist() == [2.0**j for j in range(1, 13)]
    assert usual_scales(5000)[-1] == 4096
    assert usual_scales(1).tolist() == [2]


@pytest.mark.parametrize(
    "wrong", [(0, 8, 1), (-2, 8, 1), (8, 4, 1), (2, np.inf, 1), (2, 8, 0), (2, np.nan, 1)]
)
def test_scales_that_cannot_be_are_refused(wrong):
    with pytest.raises(InputError, match="largest scale no smaller than the smallest"):
        geometric_scales(*wrong)


@pytest.mark.parametrize("scales", [[0.0], [-1.0], [2.0, np.nan], [np.inf], [[2.0, 4.0]]])
def test_a_transform_at_no_scale_is_refused(scales):
    with pytest.raises(InputError, match="positive numbers of samples"):
        cwt([1.0, 2.0], scales)


@pytest.mark.parametrize("x", [[], [[1.0, 2.0]], 3.0])
def test_anything_but_one_channel_is_refused(x):
    with pytest.raises(InputError, match="One channel of at least one sample"):
        cwt(x, [2.0])


@pytest.mark.parametrize("wavelet", [Morlet(), DOG(6)], ids=str)
def test_two_tones_stand_out_at_their_frequencies(wavelet):
    rate = 1000.0
    t = np.arange(6000) / rate
    scales = geometric_scales(2, 400, 1 / 24)
    hertz = frequencies(scales, rate, wavelet)
    for tone in (4.0, 31.0):
        power = np.abs(cwt(np.sin(2 * np.pi * tone * t), scales, wavelet)[:, 1500:4500]) ** 2
        assert hertz[np.argmax(power.mean(axis=1))] == pytest.approx(tone, rel=2 ** (1 / 24) - 1)


def test_the_cone_of_influence_widens_from_both_ends():
    times = 1e5 + (np.arange(5) + 0.5) / 100
    cone = cone_of_influence(times, (1e5, 1e5 + 0.05), math.sqrt(2))
    assert cone == pytest.approx(np.array([0.5, 1.5, 2.5, 1.5, 0.5]) / 100 / np.sqrt(2))


def test_inside_the_cone_what_lies_beyond_the_ends_matters_little():
    scale, n = 32.0, 400
    sure = cone_of_influence(np.arange(n) + 0.5, (0, n), math.sqrt(2)) >= scale
    error, power = np.zeros(n), 0.0
    for seed in range(20):
        x = np.random.default_rng(seed).standard_normal(3 * n)
        surrounded = cwt(x, [scale])[0, n : 2 * n]
        error += np.abs(cwt(x[n : 2 * n], [scale])[0] - surrounded) ** 2 / 20
        power += np.mean(np.abs(surrounded) ** 2) / 20
    assert error[sure].max() < math.exp(-2) * power < error[[0, -1]].min()
    assert 0.7 < sure.mean() < 0.8


@pytest.mark.parametrize("wavelet", [Morlet(), Morlet(2.0), RealMorlet(), DOG(2), Haar()])
@pytest.mark.parametrize("scale", [8.0, 60.0])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_what_lies_beyond_the_reach_of_a_wavelet_does_not_matter(wavelet, scale, tolerance):
    scales, x = np.array([scale]), random_force(4001)
    (reach,) = reaches(scales, wavelet, tolerance)
    held = x.copy()
    held[: 2000 - reach], held[2001 + reach :] = held[2000 - reach], held[2000 + reach]
    whole, cut = (cwt(part, scales, wavelet)[0] for part in (x, held))
    assert abs(whole[2000] - cut[2000]) <= 2 * tolerance * np.abs(whole).max()


@pytest.mark.parametrize(("kind", "most"), [("walk", 1.0), ("noise", 3.0)])
def test_a_coefficient_whose_wavelet_has_not_passed_errs_as_much_as_is_said(kind, most):
    """By direct sums in which the newest sample stands for all that follow."""
    scale, x = 32.0, random_force(20_000)
    if kind == "walk":
        x = np.cumsum(x)
    m = np.arange(-200, 201)
    kernel = morlet(5.0)(m / scale)  # its conjugate is taken by np.correlate
    whole = np.correlate(x, kernel, mode="valid")
    for heard in (0.5, 1.0, 2.0, 3.0):
        newest = int(heard * scale)
        held = np.where(m <= newest, kernel, 0)
        held[m == newest] += kernel[m > newest].sum()
        error = np.std(np.correlate(x, held, mode="valid") - whole) / np.std(whole)
        assert 0.85 * early_error(heard) < error < most * early_error(heard)
