"""The engine against direct sums: every tolerance, every scale, interior and edges."""

from __future__ import annotations

import math
import platform
import subprocess
import sys
from functools import cache

import numpy as np
import pytest
from factories import blas_threads
from hypothesis import given, settings
from hypothesis import strategies as st
from threadpoolctl import threadpool_limits

from forcelab.errors import InputError
from forcelab.runtime import one_blas_thread
from forcelab.signals.conditioning import condition
from forcelab.signals.cwt import geometric_scales, transform_channels, usual_scales
from forcelab.signals.cwt_blocks import (
    PARTS,
    TOLERANCES,
    design,
    from_spectrum,
    spectrum,
)
from forcelab.signals.cwt_engine import ROUNDING, Plan, plan_for
from forcelab.signals.wavelets import DOG, Haar, Morlet, RealMorlet, TorrenceCompoMorlet

#: What single precision adds to an error, and double precision, as shares of the largest.
SINGLE, DOUBLE = 2e-7, 1e-14


def direct(x, scale, p, at):
    """a^-1/2 sum_n x_n conj(psi((n - b) / a)) of channels held at both ends, at some b."""
    reach = math.ceil(9.5 * scale) + 1
    t = np.arange(-reach, reach + 1, dtype=np.longdouble) / np.longdouble(scale)
    bell = np.exp(-(t**2) / 2) * np.longdouble(np.pi) ** -0.25 / np.sqrt(np.longdouble(scale))
    mean = np.exp(np.longdouble(-(p**2) / 2))
    cosine, sine = (np.cos(p * t) - mean) * bell, -np.sin(p * t) * bell
    held = np.pad(np.asarray(x, dtype=np.longdouble), ((0, 0), (reach, reach)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(held, 2 * reach + 1, axis=1)
    return np.stack([windows[:, b] @ cosine + 1j * (windows[:, b] @ sine) for b in at], axis=1)


def shown(n):
    """Edges, and places all over."""
    places = np.r_[0, 1, n - 2, n - 1, np.linspace(0, n - 1, 11).astype(int)]
    return np.unique(places.clip(0, n - 1))


def white(n):
    return np.random.default_rng(n).standard_normal(n)


def walk(n):
    return np.cumsum(white(n))


def impact(n):
    x = 1e-3 * white(n)
    x[n // 3] += 1.0
    return x


def step(n):
    return np.where(np.arange(n) < n // 2, -1.0, 2.0)


def ramp(n):
    return np.linspace(0.0, 1e6, n)


def worst(x, found, scales, p=5.0, expected=None):
    """The largest error of each scale, relative to its largest coefficient."""
    at = shown(x.shape[1])
    errors = []
    for j, scale in enumerate(scales):
        right = direct(x, scale, p, at) if expected is None else expected[j]
        sizes = np.abs(found[:, j]).max(axis=1, keepdims=True)
        # What float64 holds of a ramp of amplitude 1 is much beside its coefficients.
        wrong = np.abs(found[:, j, at] - right) - 1e-15 * np.sqrt(scale)
        errors.append(float((wrong / sizes).max()))
    return np.array(errors)


def allowed(tolerance):
    return tolerance + (SINGLE if tolerance >= 1e-7 else DOUBLE)


#: From the first scale that nothing is cut from, over narrow and wide ones, to ten times n.
CASES = {
    n: (condition(np.stack([white(n), walk(n), impact(n), step(n), ramp(n)])).values, scales)
    for n, scales in (
        (150, np.r_[geometric_scales(4.4, 150, 0.5), 1500.0]),
        (1500, geometric_scales(4.4, 1500, 1.2)),
    )
}


@cache
def direct_coefficients(n):
    x, scales = CASES[n]
    return [direct(x, scale, 5.0, shown(n)) for scale in scales]


@pytest.mark.parametrize("tolerance", TOLERANCES)
@pytest.mark.parametrize("n", CASES)
def test_every_tolerance_is_held_at_every_scale_edges_included(tolerance, n):
    x, scales = CASES[n]
    found = plan_for(n, scales, tolerance=tolerance).coefficients(x)
    assert found.shape == (len(x), len(scales), n)
    assert worst(x, found, scales, expected=direct_coefficients(n)).max() < allowed(tolerance)


def random_signal(seed, n):
    """A random signal: rough or smooth, perhaps with impacts, steps and a trend."""
    random = np.random.default_rng(seed)
    x = random.standard_normal(n)
    for _ in range(seed % 3):
        x = np.cumsum(x - x.mean())
    x /= np.abs(x).max()
    x[random.integers(0, n, seed % 4)] += random.standard_normal(seed % 4) * 10
    x[random.integers(0, n) :] += random.standard_normal()
    return x + random.standard_normal() * np.linspace(-1, 1, n) * (seed % 2)


def test_every_tolerance_is_held_on_twenty_random_signals_at_every_scale_edges_included():
    n, scales = 600, np.r_[geometric_scales(4.4, 600, 0.4), 1300.0]
    x = condition(np.stack([random_signal(seed, n) for seed in range(20)])).values
    expected = [direct(x, scale, 5.0, shown(n)) for scale in scales]
    for tolerance in TOLERANCES:
        found = plan_for(n, scales, tolerance=tolerance).coefficients(x)
        errors = worst(x, found, scales, expected=expected)
        assert errors.max() < allowed(tolerance), tolerance


@pytest.mark.parametrize(("n", "p"), [(7404, 0.3), (150_000, 5.0)])
def test_what_a_slow_strong_force_adds_is_bounded(n, p):
    slow = np.stack([np.linspace(0.0, 1.0, n), np.sin(3 * np.arange(n) / n)])
    x, scales = slow + 1e-8 * white(n), np.array([1.3, 9.3, 35.4, 1000.0])
    ready = condition(x)
    expected = transform_channels(ready.values, scales, Morlet(p))
    sizes = np.abs(expected).max(axis=2)
    besides = np.ptp(ready.values, axis=1)[:, None] * np.sqrt(scales) / 50
    for tolerance in TOLERANCES:
        found = plan_for(n, scales, Morlet(p), tolerance).coefficients(ready.values)
        error = np.abs(found - expected).max(axis=2)
        held = allowed(tolerance) * sizes + tolerance * besides + ROUNDING * np.sqrt(scales)
        assert np.all(error < held), tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_a_ramp_over_many_blocks_adds_a_two_hundredth_of_what_other_forces_may(tolerance):
    n, scales = 150_000, np.array([9.3, 35.4, 120.0, 500.0, 1000.0])
    x = np.linspace(-0.5, 0.5, n)[np.newaxis]
    expected = transform_channels(x, scales, Morlet())
    found = Plan(n, scales, Morlet(), tolerance, False).coefficients(x)
    error = np.abs(found - expected).max(axis=2)
    assert np.all(error < (tolerance / 50 / 200 + ROUNDING) * np.sqrt(scales))


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="other C libraries decide for good")
def test_memory_is_not_had_from_the_system_again_for_each_transform():
    faults = "resource.getrusage(resource.RUSAGE_SELF).ru_minflt"
    lines = (
        "import numpy as np, resource",
        "from forcelab.signals.cwt_engine import plan_for",
        "x = np.random.default_rng(0).standard_normal((6, 1 << 15))",
        "plan = plan_for(1 << 15, 2.0 ** np.arange(1, 16))",
        "for _ in range(5):",
        f"    before = {faults}",
        "    plan.log_polar(x)",
        f"print({faults} - before)",
    )
    run = subprocess.run(
        [sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True, check=True
    )
    assert int(run.stdout) < 300


@pytest.mark.parametrize("p", [0.5, 2.0, 12.0, 50.0])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-7, 1e-14])
def test_other_carriers_are_transformed_as_exactly(p, tolerance):
    n = 400
    x = condition(np.stack([white(n), step(n)])).values
    scales = [(p + 9) / np.pi, 45.0, 400.0]
    found = plan_for(n, scales, Morlet(p), tolerance).coefficients(x)
    assert worst(x, found, scales, p).max() < allowed(tolerance) * 2


def share_of_largest(found, expected):
    sizes = np.abs(expected).max(axis=-1)
    return float((np.abs(found - expected).max(axis=-1) / np.maximum(sizes, 1e-290)).max())


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 700), st.integers(0, 2**32 - 1), st.sampled_from(list(TOLERANCES)))
def test_any_length_agrees_with_the_plain_way_at_any_scale(n, seed, tolerance):
    random = np.random.default_rng(seed)
    x = condition(np.cumsum(random.standard_normal((2, n)), axis=1)).values
    scales = np.sort(random.uniform(0.5, 3.0 * n + 1, 5))
    found = plan_for(n, scales, tolerance=tolerance).coefficients(x)
    # One sample is a constant, of which there is nothing but rounding.
    expected = transform_channels(x, scales, Morlet())
    assert found.shape == (2, 5, n)
    if n > 1:
        # The plain way rounds in rings that are much longer than the signal.
        assert share_of_largest(found, expected) < allowed(tolerance) + 1e-12
    else:
        assert np.abs(found).max() < 1e-13


@pytest.mark.parametrize("tolerance", [1e-3, 1e-7, 1e-14])
def test_cut_wavelets_and_those_of_other_kinds_are_the_plain_ones(tolerance):
    x = condition(np.stack([white(333), step(333)])).values
    for wavelet in (Morlet(), RealMorlet(), DOG(2), DOG(3), Haar()):
        scales = [0.5, 2.0, 2.83, 3.3] if wavelet == Morlet() else [0.5, 2.0, 20.0, 500.0]
        found = plan_for(333, scales, wavelet, tolerance).coefficients(x)
        assert share_of_largest(found, transform_channels(x, np.array(scales), wavelet)) < (
            5e-7 if tolerance >= 1e-7 else 1e-14
        )
        if wavelet.real:
            assert not found.imag.any()


@pytest.mark.parametrize("tolerance", [1e-7, 1e-14])
def test_a_recording_in_blocks_is_the_whole_recording(monkeypatch, tolerance):
    n = 7001
    x = condition(np.stack([white(n), walk(n)])).values
    scales = geometric_scales(2.0, 3.0 * n, 1.0)
    expected = plan_for(n, scales, tolerance=1e-14).coefficients(x)
    monkeypatch.setattr("forcelab.signals.cwt_engine.WHOLE", 4096)
    monkeypatch.setattr("forcelab.signals.cwt_engine.BLOCK", 2048)
    plan = Plan(n, scales.tolist(), Morlet(), tolerance, tolerance >= 1e-7)
    assert share_of_largest(plan.coefficients(x), expected) < allowed(tolerance)
    together = plan.log_polar(x)
    found = np.exp(together[0] + 1j * together[1])
    assert share_of_largest(found, expected) < 5 * allowed(tolerance)


def test_log_magnitude_and_phase_are_those_of_the_coefficients_down_to_rounding():
    n, scales = 3000, np.array([700.0, 3.0, 9.0, 80.0])
    x = condition(np.stack([walk(n), np.zeros(n), impact(n)])).values
    x[2] *= 1e-12
    for tolerance, atol in ((1e-7, 2e-5), (1e-10, 1e-9)):
        plan = plan_for(n, scales, tolerance=tolerance)
        size = np.abs(found := plan.coefficients(x))
        floor = (ROUNDING * np.sqrt(scales))[:, None]
        magnitudes, phases = plan.log_polar(x)
        np.testing.assert_allclose(magnitudes, np.log(np.maximum(size, floor)), atol=atol)
        turned = np.abs(np.angle(np.exp(1j * (phases - np.angle(found)))))
        assert turned[size > 1.01 * floor].max() < 50 * atol
        low = size < 0.99 * floor
        assert low[2].any()
        assert not low[2].all()
        assert not phases[low].any()


def test_the_quiet_after_an_impact_is_as_exact_as_if_there_had_been_none():
    n = 6000
    x = np.zeros((1, n))
    x[0, 500] = 1.0
    x[0, 4000:4400] = 1e-6 * np.sin(np.arange(400) / 4.0)
    scales = np.array([80.0, 120.0])
    found = plan_for(n, scales, tolerance=1e-7).coefficients(x)
    expected = transform_channels(x, scales, Morlet())
    # Single precision errs in relation to what is near, not to the impact 3500 samples away.
    assert np.abs(found - expected)[0, :, 3900:4500].max() < 1e-10


def test_plans_are_kept_and_wrong_requests_refused():
    assert plan_for(100, [4.0, 8.0]) is plan_for(100, np.array([4.0, 8.0]))
    assert plan_for(100, [4.0, 8.0]) is not plan_for(100, [4.0, 8.0], tolerance=1e-5)
    assert (
        Plan(50, [9.0], Morlet(), 1e-7, False).coefficients(np.ones((1, 50))).dtype == np.complex128
    )
    assert plan_for(50, [9.0]).coefficients(np.ones((1, 50))).dtype == np.complex64
    with pytest.raises(InputError, match="tolerance is one of"):
        plan_for(100, [4.0], tolerance=1e-6)
    with pytest.raises(InputError, match="tolerance is one of"):
        plan_for(100, [4.0], Haar(), tolerance=0.1)
    for scales in ([], [0.0], [np.nan], [[2.0]]):
        with pytest.raises(InputError, match="positive numbers"):
            plan_for(100, scales)
    with pytest.raises(InputError, match="at least one sample"):
        plan_for(0, [4.0])
    with pytest.raises(InputError, match="100 samples"):
        plan_for(100, [4.0]).coefficients(np.zeros((1, 99)))


def test_a_usual_plan_takes_little_memory_beside_the_result(peak_memory):
    n = 1 << 15
    x = condition(walk(n)[None]).values
    plan = plan_for(n, usual_scales(n))
    plan.coefficients(x)
    found, peak = peak_memory(lambda: plan.coefficients(x))
    assert peak < found.nbytes + 60 * n


def test_a_wavelet_that_takes_a_long_ring_takes_little_memory_beside_the_result(peak_memory):
    n = 1 << 22
    plan = Plan(n, [4.0, 64.0], TorrenceCompoMorlet(), 1e-7, True)
    x = white(n)[None]
    found, peak = peak_memory(lambda: plan.coefficients(x))
    assert peak < found.nbytes + 12 * n  # 200 MB at 2^24


def test_the_band_and_the_reach_widen_as_the_tolerance_falls():
    designs = [design(5.0, tolerance) for tolerance in TOLERANCES]
    assert np.all(np.diff([d.reach for d in designs]) > 0)
    assert np.all(np.diff([d.high for d in designs]) > 0)
    assert all(d.kernel.taps <= 16 for d in designs)


@pytest.mark.parametrize("n", [500, 501, 503])
@pytest.mark.parametrize("wavelet", [Morlet(), DOG(3)], ids=str)
def test_a_ring_too_long_to_keep_its_responses_gives_the_same(monkeypatch, n, wavelet):
    x = condition(np.stack([white(n), walk(n)])).values
    scales = [0.7, 2.0, 3.0]
    monkeypatch.setattr("forcelab.signals.cwt_engine.RING_EVEN", 100)
    expected = transform_channels(x, np.array(scales), wavelet)
    for limit in ("RING_KEPT", "RING_WHOLE"):
        monkeypatch.setattr(f"forcelab.signals.cwt_engine.{limit}", 100)
        plan = Plan(n, scales, wavelet, 1e-14, False)
        assert share_of_largest(plan.coefficients(x), expected) < 1e-14


def test_a_cut_wavelet_in_a_long_ring_takes_little_memory_beside_the_result(
    monkeypatch, peak_memory
):
    n = 1 << 20
    monkeypatch.setattr("forcelab.signals.cwt_engine.RING_WHOLE", n)
    x = condition(np.cumsum(np.random.default_rng(1).standard_normal((1, n)), axis=1)).values
    plan = Plan(n, [2.0, 2.5, 3.0], Morlet(), 1e-7, True)
    (magnitudes, phases), peak = peak_memory(lambda: plan.log_polar(x))
    # 200 MB at 2^24; and 4 MB that do not grow.
    assert peak < magnitudes.nbytes + phases.nbytes + 12 * n + (1 << 22)


def test_a_long_ring_is_the_fourier_transform_of_the_whole():
    n = 3 * PARTS**2
    x = white(n)
    response = np.exp(2j * np.random.default_rng(1).uniform(0, 7, n))
    table = spectrum(lambda places: x[places], n, np.complex128)
    spectrum_of_all = np.fft.fft(x)
    expected = spectrum_of_all.reshape(PARTS, -1)[:, : len(table[0])]
    np.testing.assert_allclose(np.stack(table), expected, rtol=0, atol=1e-12)
    found = np.empty(n, dtype=complex)
    for start, piece in from_spectrum(table, n, lambda bins: response[bins]):
        found[start : start + len(piece)] = piece
    np.testing.assert_allclose(found, np.fft.ifft(spectrum_of_all * response), rtol=0, atol=1e-13)


def test_blas_has_its_threads_back_when_the_last_transform_has_ended():
    before = blas_threads()
    first, second = one_blas_thread(), one_blas_thread()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert set(blas_threads()) == {1}
    second.__exit__(None, None, None)
    assert blas_threads() == before


def test_a_blas_that_comes_while_a_transform_runs_is_kept_on_one_thread_too():
    with threadpool_limits(1, user_api="blas"):
        with one_blas_thread():
            threadpool_limits(2, user_api="blas")  # as one that has just been loaded
            with one_blas_thread():
                assert set(blas_threads()) == {1}
            assert set(blas_threads()) == {1}
        assert set(blas_threads()) == {2}


@pytest.mark.parametrize("n", [700, 150_000])
def test_largest_powers_and_samples_are_those_of_the_coefficients(n):
    x = condition(np.stack([white(n), impact(n)])).values
    plan = plan_for(n, [9.0, 2.0, 300.0, 40.0])
    coefficients = plan.coefficients(x)
    bounds = np.unique(np.random.default_rng(0).integers(3, n - 2, 60))
    power = np.abs(coefficients[:, :, : bounds[-1]]) ** 2
    expected = np.maximum.reduceat(power, bounds[:-1], axis=2)
    np.testing.assert_allclose(plan.largest_power(x, bounds), expected, rtol=1e-5)
    found = plan.at_samples(x, bounds)
    np.testing.assert_allclose(found, coefficients[:, :, bounds], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("wavelet", "tolerance"),
    [(Morlet(), 1e-3), (Morlet(), 1e-7), (DOG(2), 1e-5), (Haar(), 1e-7)],
    ids=str,
)
def test_few_neighbouring_samples_are_summed_up_alone(wavelet, tolerance, monkeypatch):
    n, scales = 2500, [64.0, 2.0, 500.0, 11.0]
    x = condition(np.stack([white(n), walk(n), impact(n)])).values
    expected = transform_channels(x, np.array(scales), wavelet)
    largest = np.abs(expected).max(axis=-1, keepdims=True)
    plan = Plan(n, scales, wavelet, tolerance, True)
    monkeypatch.setattr(plan, "_run", None)  # nothing else is transformed
    for samples in (slice(0, 40), slice(1200, 1201), slice(n - 64, None)):
        found = plan.coefficients(x, samples)
        assert found.shape == expected[:, :, samples].shape
        assert (np.abs(found - expected[:, :, samples]) / largest).max() < tolerance
    if wavelet.real:
        assert not found.imag.any()


def test_some_samples_are_those_of_the_whole():
    x = condition(walk(3000)[None]).values
    for plan in (plan_for(3000, [9.0, 200.0]), plan_for(3000, [9.0, 200.0], tolerance=1e-14)):
        whole = plan.coefficients(x)
        for samples in (slice(10, 2000), slice(7, None, 20), slice(5, 5)):
            assert np.array_equal(plan.coefficients(x, samples), whole[:, :, samples])
