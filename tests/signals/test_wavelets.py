from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import minimize_scalar
from scipy.special import erfc, eval_hermitenorm, gammaln

from forcelab.errors import InputError
from forcelab.signals.cwt import cwt
from forcelab.signals.cwt_engine import plan_for
from forcelab.signals.wavelets import (
    DOG,
    Haar,
    Morlet,
    RealMorlet,
    TorrenceCompoMorlet,
    UncorrectedMorlet,
    wavelet_named,
)

SMOOTH = [
    *(Morlet(p) for p in (0.3, 1.0, 2.0, 5.0, 6.0, 12.0)),
    *(RealMorlet(p) for p in (0.3, 2.0, 5.0, 8.0)),
    *(DOG(m) for m in (1, 2, 3, 4, 6, 10, 25)),
]
ALL = [*SMOOTH, Haar()]


def name(wavelet):
    return wavelet.name


def fine_times(wavelet, step=1 / 512):
    half = math.ceil(wavelet.radius + 2)
    return np.arange(-half, half + step / 2, step), step


def integral(values, step):
    """The trapezoid of a function that is smooth and zero at its ends converges exponentially."""
    return values.sum(axis=-1) * step


# The closed forms, written here a second time, not with the project's code.


def morlet(t, p):
    return np.pi**-0.25 * (np.exp(1j * p * t) - np.exp(-(p**2) / 2)) * np.exp(-(t**2) / 2)


def derivative_of_gaussian(t, m):
    # d^m/dt^m exp(-t^2/2) = (-1)^m He_m(t) exp(-t^2/2)
    return -eval_hermitenorm(m, t) * np.exp(-(t**2) / 2) / math.exp(gammaln(m + 0.5) / 2)


@pytest.mark.parametrize("p", [0.3, 1.0, 5.0, 6.0, 12.0])
def test_the_morlet_is_the_published_one_with_its_correction(p):
    t = np.linspace(-7, 7, 1401)
    np.testing.assert_allclose(Morlet(p).time(t), morlet(t, p), rtol=0, atol=1e-15)
    np.testing.assert_allclose(RealMorlet(p).time(t), morlet(t, p).real, rtol=0, atol=1e-15)


@pytest.mark.parametrize("p", [0.3, 2.0, 5.0, 12.0])
def test_the_uncorrected_morlet_and_that_of_torrence_and_compo_are_their_closed_forms(p):
    t = np.linspace(-4, 4, 401)
    plain = np.pi**-0.25 * np.exp(1j * p * t - t**2 / 2)
    np.testing.assert_allclose(UncorrectedMorlet(p).time(t), plain, rtol=0, atol=1e-15)
    # The inverse transform from frequency 0 on; without the correction both have the same peak.
    positive = plain * (1 - 0.5 * erfc((p + 1j * t) / math.sqrt(2)))
    np.testing.assert_allclose(TorrenceCompoMorlet(p).time(t), positive, rtol=0, atol=2e-14)
    omega = np.array([-3.0, -1e-9, 0.0, 1e-9, 1.0, p, 20.0])
    bell = math.sqrt(2 * math.pi) * math.pi**-0.25 * np.exp(-((omega - p) ** 2) / 2)
    np.testing.assert_allclose(UncorrectedMorlet(p).spectrum(omega), bell, rtol=1e-14)
    np.testing.assert_allclose(
        TorrenceCompoMorlet(p).spectrum(omega), bell * (omega > 0), rtol=1e-14
    )


@pytest.mark.parametrize("at", [0.0, 0.7, 3.0, 25.0])
def test_torrence_and_compos_morlet_is_the_integral_over_positive_frequencies(at):
    nodes, weights = np.polynomial.legendre.leggauss(400)
    w = 7.0 * (nodes + 1)  # 0 .. 14
    bells = np.pi**-0.25 / math.sqrt(2 * np.pi) * np.exp(-((w - 5) ** 2) / 2)
    expected = complex(7.0 * weights @ (bells * np.exp(1j * w * at)))
    assert complex(TorrenceCompoMorlet(5.0).time(at)) == pytest.approx(expected, abs=1e-13)


def test_the_other_morlets_cost_what_the_documents_say():
    far = np.array([50.0, 100.0])
    tail = np.abs(TorrenceCompoMorlet(5.0).time(far))
    level = math.pi**-0.25 * math.exp(-12.5) / math.sqrt(2 * math.pi)
    np.testing.assert_allclose(tail * far, level, rtol=0.02)
    assert not Morlet(5.0).time(far).any()
    share = abs(complex(UncorrectedMorlet(5.0).spectrum(0.0) / UncorrectedMorlet(5.0).spectrum(5)))
    assert share == pytest.approx(3.7e-6, rel=0.02)
    # Two levels: the second, where the first is usual, is answered for ever.
    x = np.where(np.arange(4000) < 3000, 0.0, 1.0)
    scales = np.array([4.0, 16.0])
    found = np.abs(cwt(x, scales, UncorrectedMorlet())[:, 3700])
    np.testing.assert_allclose(
        found,
        math.sqrt(2 * math.pi) * math.pi**-0.25 * math.exp(-12.5) * np.sqrt(scales),
        rtol=1e-6,
    )
    assert np.abs(cwt(x, scales, Morlet())[:, 3700]).max() < 1e-14


@pytest.mark.parametrize("kind", [UncorrectedMorlet, TorrenceCompoMorlet])
@pytest.mark.parametrize("tolerance", [1e-7, 1e-14])
def test_the_engine_transforms_with_the_other_morlets_as_the_plain_way(kind, tolerance):
    x = np.random.default_rng(1).standard_normal((2, 500))
    x -= np.median(x, axis=1, keepdims=True)
    x /= np.abs(x).max(axis=1, keepdims=True)
    scales = np.array([2.0, 5.0, 40.0, 700.0])
    found = plan_for(500, scales, kind(), tolerance).coefficients(x)
    for c in range(2):
        expected = cwt(x[c], scales, kind())
        error = np.abs(found[c] - expected).max(axis=1) / np.abs(expected).max(axis=1)
        assert error.max() < (1e-6 if tolerance == 1e-7 else 1e-12)


@pytest.mark.parametrize("m", [1, 2, 3, 4, 6, 10, 25])
def test_the_derivatives_of_a_gaussian_are_those_of_torrence_and_compo(m):
    t = np.linspace(-12, 12, 2401)
    np.testing.assert_allclose(DOG(m).time(t), derivative_of_gaussian(t, m), rtol=0, atol=1e-13)


def test_the_haar_wavelet_is_one_then_minus_one():
    t = [-0.51, -0.5, -0.01, 0.0, 0.49, 0.5]
    assert Haar().time(t).tolist() == [0, 1, 1, -1, -1, 0]


@pytest.mark.parametrize("wavelet", SMOOTH, ids=name)
def test_the_spectrum_is_the_fourier_integral_of_the_wavelet(wavelet):
    t, step = fine_times(wavelet)
    omega = np.concatenate([np.linspace(-16, 16, 65), [1e-3, -1e-3, 0.1, 40.0]])
    psi = wavelet.time(t)
    expected = integral(psi * np.exp(-1j * omega[:, np.newaxis] * t), step)
    tolerance = 1e-12 * np.abs(expected).max()
    np.testing.assert_allclose(wavelet.spectrum(omega), expected, rtol=0, atol=tolerance)


@pytest.mark.parametrize(
    "omega", [-30.0, -4.6, -0.2, 0.0, 1e-4, 1.0, 4.6, 2 * math.pi, 4 * math.pi]
)
def test_the_spectrum_of_haar_is_its_fourier_integral(omega):
    def part(function):
        def value(t):
            return float(Haar().time(t).real) * function(omega * t)

        return quad(value, -0.5, 0.5, points=[0.0], epsabs=1e-13)[0]

    expected = part(math.cos) - 1j * part(math.sin)
    assert complex(Haar().spectrum(omega)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("wavelet", ALL, ids=name)
def test_the_mean_is_zero_so_that_a_constant_gives_nothing(wavelet):
    assert abs(wavelet.spectrum(0.0)) < 1e-15
    t, step = fine_times(wavelet)
    psi = wavelet.time(t)
    assert abs(integral(psi, step)) < 1e-13 * integral(np.abs(psi), step)


@pytest.mark.parametrize(
    ("wavelet", "energy", "within"),
    [
        # The correction takes a little: exactly 1 + exp(-p^2) - 2 exp(-3 p^2 / 4).
        *((Morlet(p), 1 + math.exp(-(p**2)) - 2 * math.exp(-0.75 * p**2), 1e-13) for p in (1, 5)),
        (Morlet(5.0), 1.0, 2e-8),
        (RealMorlet(5.0), 0.5, 2e-8),
        *((DOG(m), 1.0, 1e-12) for m in (1, 2, 3, 6, 10, 25)),
        (Haar(), 1.0, 1e-12),
    ],
    ids=str,
)
def test_the_energy_is_what_it_is_said_to_be(wavelet, energy, within):
    t, step = fine_times(wavelet)
    assert integral(np.abs(wavelet.time(t)) ** 2, step) == pytest.approx(energy, abs=within)


@pytest.mark.parametrize("wavelet", ALL, ids=name)
def test_a_wavelet_says_truly_whether_it_is_real(wavelet):
    t, _ = fine_times(wavelet)
    assert wavelet.real == bool(np.all(wavelet.time(t).imag == 0))
    omega = np.linspace(0.1, 12, 50)
    mirrored = np.conj(wavelet.spectrum(-omega))
    assert wavelet.real == bool(np.allclose(wavelet.spectrum(omega), mirrored, atol=1e-12))


def strongest(wavelet):
    """Period of a sine over the scale that answers to it most, searched for numerically.

    A sine of angular frequency w has the response sqrt(a) |psi_hat(a w)| at scale a.
    """
    u = np.linspace(0.01, 60, 60000)
    near = u[np.argmax(np.sqrt(u) * np.abs(wavelet.spectrum(u)))]
    found = minimize_scalar(
        lambda v: -float(np.sqrt(v) * np.abs(wavelet.spectrum(v))),
        bounds=(near - 0.01, near + 0.01),
        method="bounded",
        options={"xatol": 1e-10},
    )
    return 2 * math.pi / found.x


@pytest.mark.parametrize(
    ("wavelet", "within"),
    [
        *((Morlet(p), 1e-7) for p in (0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 6.0, 12.0, 50.0)),
        *((UncorrectedMorlet(p), 1e-7) for p in (0.5, 2.0, 5.0)),
        *((TorrenceCompoMorlet(p), 1e-7) for p in (0.5, 2.0, 5.0)),
        *((RealMorlet(p), 1e-7) for p in (0.1, 0.5, 1.0, 2.0, 3.0, 5.0, 12.0, 50.0)),
        *((DOG(m), 1e-6) for m in (1, 2, 3, 6, 25)),
        (Haar(), 1e-6),
    ],
    ids=str,
)
def test_the_fourier_factor_is_where_a_sine_answers_most_over_the_scales(wavelet, within):
    assert wavelet.fourier_factor == pytest.approx(strongest(wavelet), rel=within)


@pytest.mark.parametrize(("p", "within"), [(5.0, 1e-10), (6.0, 1e-12), (1000.0, 1e-12)])
def test_where_p_is_large_the_fourier_factor_is_that_of_torrence_and_compo(p, within):
    published = 4 * math.pi / (p + math.sqrt(2 + p**2))
    assert Morlet(p).fourier_factor == pytest.approx(published, rel=within)


@pytest.mark.parametrize("wavelet", ALL, ids=name)
def test_nothing_of_the_wavelet_lies_outside_its_radius(wavelet):
    t = np.linspace(0, wavelet.radius + 10, 40001)
    size = np.maximum(np.abs(wavelet.time(t)), np.abs(wavelet.time(-t)))
    share = 1e-11 if isinstance(wavelet, Morlet) and wavelet.p < 3 else 1e-13
    assert size[t > wavelet.radius].max() <= share * size.max()


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 100), st.floats(-60, 60))
def test_derivatives_of_any_order_stay_finite(m, x):
    assert np.isfinite(DOG(m).time(x))
    assert np.isfinite(DOG(m).spectrum(x))


@given(st.floats(0.5, 40), st.floats(-1e6, 1e6))
def test_morlets_stay_finite_far_out(p, x):
    for wavelet in (Morlet(p), RealMorlet(p)):
        assert np.isfinite(wavelet.time(x))
        assert np.isfinite(wavelet.spectrum(x))


@pytest.mark.parametrize(
    ("name", "parameter", "expected"),
    [
        ("morlet", None, Morlet(5.0)),
        ("morlet", 6.5, Morlet(6.5)),
        ("real-morlet", None, RealMorlet(5.0)),
        ("uncorrected-morlet", None, UncorrectedMorlet(5.0)),
        ("torrence-compo", 6.0, TorrenceCompoMorlet(6.0)),
        ("dog", None, DOG(2)),
        ("dog", 3.0, DOG(3)),
        ("haar", None, Haar()),
    ],
)
def test_a_wavelet_is_found_by_its_name(name, parameter, expected):
    wavelet = wavelet_named(name, parameter)
    assert wavelet == expected
    assert type(wavelet) is type(expected)


def test_the_names_tell_kinds_and_parameters_apart():
    assert [wavelet.name for wavelet in (Morlet(), RealMorlet(5.5), DOG(3), Haar())] == [
        "Morlet p = 5",
        "real Morlet p = 5.5",
        "DOG m = 3",
        "Haar",
    ]


@pytest.mark.parametrize(
    ("name", "parameter", "complaint"),
    [
        ("mexican", None, "no wavelet 'mexican'; choose from morlet, real-morlet, uncorr"),
        ("morlet", 0.0, "p must lie between 0.1 and 1000, not at 0"),
        ("morlet", 1e9, r"p must lie between 0.1 and 1000, not at 1e\+09"),
        ("morlet", math.nan, "p must lie between 0.1 and 1000, not at nan"),
        ("real-morlet", math.inf, "p must lie between 0.1 and 1000, not at inf"),
        ("dog", 0.0, "whole number from 1 to 100, not 0"),
        ("dog", 2.5, "whole number from 1 to 100, not 2.5"),
        ("dog", 1e6, "whole number from 1 to 100, not 1000000"),
        ("dog", math.nan, "whole number from 1 to 100, not nan"),
        ("dog", math.inf, "whole number from 1 to 100, not inf"),
        ("haar", 2.0, "has no parameter; leave it out"),
    ],
)
def test_a_wavelet_that_cannot_be_is_refused_in_one_sentence(name, parameter, complaint):
    with pytest.raises(InputError, match=complaint):
        wavelet_named(name, parameter)
