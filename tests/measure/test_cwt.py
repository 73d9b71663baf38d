"""The measurements of the wavelet transform say what they measured."""

from __future__ import annotations

import os
import sys
import types
from importlib.machinery import ModuleSpec

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.measure.cwt import (
    PEERS,
    Peer,
    cached_wavelet,
    direct_sums,
    features_of,
    measure_long_recording,
    measure_transforms,
    peers_of_tapered,
    tapered_forces,
)
from forcelab.measure.extremes import CASES, Case, tabulate_extremes


def quad_sum(x, a, b):
    """The same sum from the wavelet as it is written in the paper."""
    n = np.arange(len(x))
    t = (n - b) / a
    psi = np.pi**-0.25 * (np.exp(5j * t) - np.exp(-12.5)) * np.exp(-(t**2) / 2)
    return np.sum(x * np.conj(psi)) / np.sqrt(a)


def test_direct_sums_are_the_definition():
    x = tapered_forces(700, 2)
    result = direct_sums(x, np.array([4.5, 50.0, 600.0]), np.array([0, 300, 699]))
    for c in range(2):
        for j, a in enumerate((4.5, 50.0, 600.0)):
            for i, b in enumerate((0, 300, 699)):
                assert result[c, j, i] == pytest.approx(quad_sum(x[c], a, b), abs=1e-12)


def test_the_engine_errs_less_than_its_tolerance_and_peers_are_measured_or_named():
    rows = finish(measure_transforms(tapered_forces(1024, 2), 1.0, 1))
    mine = [row for row in rows if row.name == "forcelab"]
    assert [row.setting for row in mine] == [
        f"tolerance {t:g}" for t in (1e-3, 1e-5, 1e-7, 1e-10, 1e-14)
    ]
    assert mine[0].error < 1e-3
    assert mine[1].error < 1e-5
    assert mine[2].error < 4e-7
    assert mine[3].error < 1e-10
    assert mine[4].error < 1e-13
    others = {row.name: row for row in rows[len(mine) :]}
    peers = peers_of_tapered()
    assert list(others) == ["forcelab, plan anew", *(peer.name for peer in peers)]
    assert others["forcelab, plan anew"].error == mine[2].error
    for peer in peers:
        row = others[peer.name]
        if peer.installed and not row.refusal:
            assert row.error > mine[2].error
        else:
            assert peer.name in row.refusal
    assert others["PyWavelets"].error > 0.01  # half a sample early
    for row in rows:
        if not row.refusal:
            assert 0 < row.further["scales to n / 16"] <= row.error


def test_a_peer_that_would_take_minutes_is_left_out_by_name():
    x, spent = tapered_forces(512, 1), {}
    finish(measure_transforms(x, 1.0, 1, (1e-3,), spent))
    assert 0 < spent["PyWavelets"] < 1e-3
    rows = finish(measure_transforms(x, 1.0, 1, (1e-3,), {"PyWavelets": 1.0}))
    refusal = {row.name: row.refusal for row in rows}["PyWavelets"]
    assert "PyWavelets is left out" in refusal
    assert "more than 60 s" in refusal


def test_the_memory_of_a_long_recording_is_told_without_its_tables():
    (row,) = finish(measure_long_recording(tapered_forces(1 << 19, 1), np.array([2.0, 300.0])))
    assert row.name == "forcelab"
    assert row.error < 4e-7
    assert row.peak_bytes < 30 * (1 << 19)  # with the tables' 16 bytes a sample it would be 41


def test_what_is_not_installed_is_refused_by_name():
    peer = Peer("WaveLab", "no_such_module_anywhere", lambda x, *_: x)
    with pytest.raises(InputError, match=r"WaveLab is not installed .*; pip install .*peers"):
        peer.coefficients(np.zeros((1, 8)), np.array([4.0]))


@pytest.fixture
def ssqueezepy(monkeypatch):
    """Calls of a stand-in, as the library may not be there."""
    calls = []

    def transform(x, wavelet, scales, padtype):
        calls.append((x, wavelet, scales, padtype, os.environ.get("SSQ_PARALLEL")))
        return np.ones((len(x), len(scales), x.shape[1]), dtype=np.complex64), scales

    library = types.ModuleType("ssqueezepy")
    library.__spec__ = ModuleSpec("ssqueezepy", None)
    library.cwt = transform
    library.Wavelet = lambda verdict, dtype: [verdict, dtype]
    monkeypatch.setitem(sys.modules, "ssqueezepy", library)
    cached_wavelet.cache_clear()
    yield calls
    cached_wavelet.cache_clear()


@pytest.mark.parametrize("before", [None, "1"])
def test_ssqueezepy_keeps_its_wavelet_and_runs_on_one_thread_as_its_guide_has_it(
    ssqueezepy, monkeypatch, before
):
    if before is None:
        monkeypatch.delenv("SSQ_PARALLEL", raising=False)
    else:
        monkeypatch.setenv("SSQ_PARALLEL", before)
    peers = {peer.name: peer for peer in peers_of_tapered()}
    for name in ("ssqueezepy", "ssqueezepy", "ssqueezepy, wavelet anew"):
        peers[name].features(np.zeros((2, 8)), np.array([4.0]))
    first, second, anew = (wavelet for _, wavelet, *_ in ssqueezepy)
    assert first is second
    assert first == [anew, "float32"] == [("morlet", {"mu": 5.0}), "float32"]
    assert {call[3:] for call in ssqueezepy} == {("zero", "0")}
    assert os.environ.get("SSQ_PARALLEL") == before


def test_ssqueezepy_is_asked_for_our_error_in_double_precision_and_with_room_for_its_wavelets(
    ssqueezepy,
):
    peers = {peer.name: peer for peer in peers_of_tapered()}
    x, scales = np.ones((2, 100)), 2.0 ** np.arange(1, 10)
    assert peers["ssqueezepy, as exact"].coefficients(x, scales).shape == (2, 9, 100)
    assert [len(call[2]) for call in ssqueezepy] == [5, 4]
    for padded, wavelet, part, padtype, _ in ssqueezepy:
        assert padded.dtype == wavelet[1] == "float64"
        assert padtype is None
        reach = (padded.shape[1] - 100) / part.max()
        assert np.exp(-(reach**2) / 2) < 1e-7
        np.testing.assert_array_equal(padded[:, :100], x)
        assert not padded[:, 100:].any()


def test_features_of_coefficients_are_logarithm_and_angle():
    result = np.array([[[3 + 4j, -1, 1e-5j]]])
    magnitudes, phases = features_of(result)
    np.testing.assert_allclose(magnitudes, np.log(np.abs(result)))
    np.testing.assert_allclose(phases, np.angle(result))


def test_ours_is_right_in_every_extreme_and_what_is_wrong_is_told(monkeypatch):
    monkeypatch.setattr("forcelab.measure.extremes.PEERS", [p for p in PEERS if p.module == "pywt"])
    verdicts = finish(tabulate_extremes())
    assert len(verdicts.rows) == len(CASES) > 25
    for name, words in verdicts.rows:
        assert words[:3] == ("right",) * 3, name
    verdict = {name: words[3] for name, words in verdicts.rows}
    assert verdict["zeros"] == "not finite"  # its logarithm is -inf
    assert verdict["a step"] in {"wrong", "not finite"}  # the second before PyWavelets 1.9
    assert verdicts.cells()[0][1:] == list(verdicts.methods)
    assert verdicts.to_json()["rows"][0]["forcelab 1e-7"] == "right"


def test_a_transform_that_is_wrong_or_raises_is_found_out(monkeypatch):
    def raising(x, scales):
        if not np.any(x):
            raise ValueError("nothing there")
        return np.ones((1, len(scales), x.shape[1]), dtype=complex)

    monkeypatch.setattr("forcelab.measure.extremes.PEERS", [Peer("bad", "numpy", raising)])
    noise = np.random.default_rng(0).standard_normal((1, 900))
    cases = [Case("noise", noise, np.array([5.0])), Case("zeros", 0 * noise, np.array([5.0]))]
    verdicts = finish(tabulate_extremes(cases))
    assert [words[3] for _, words in verdicts.rows] == ["wrong", "raised"]
