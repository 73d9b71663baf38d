"""The table of the scalogram on the screen: right pictures have small errors, wrong ones not."""

import numpy as np
import pytest

from forcelab.jobs import finish
from forcelab.measure import scalogram as measured
from forcelab.signals import scalogram as signals
from forcelab.signals.cwt import cwt


@pytest.fixture(scope="module")
def noise():
    return np.random.default_rng(5).standard_normal(40_000)


def test_every_span_has_a_first_and_an_exact_image(noise):
    rows = finish(measured.measuring(noise, (4_000, 20_000), 1, columns=200))
    assert [row.name for row in rows] == ["first image", "exact image"] * 2
    assert len({row.size for row in rows}) == 2
    for first, exact in zip(rows[::2], rows[1::2], strict=True):
        assert exact.error < 0.03
        assert first.error < 0.5
        assert first.seconds < exact.seconds
        assert not exact.further


def test_long_spans_are_measured_before_and_after_their_tiles(noise, monkeypatch):
    for module in (measured, signals):
        monkeypatch.setattr(module, "LONG", 1 << 14)
    rows = finish(measured.measuring(noise, (40_000,), 1, columns=200))
    exact = ["first time", "tiles in a file", "tiles ready"]
    assert [row.name for row in rows] == ["first image", *(f"exact image, {way}" for way in exact)]
    _, once, file, ready = rows
    assert max(once.error, file.error, ready.error) < 0.03
    assert ready.seconds < 0.2 * once.seconds
    assert ready.further["tiles (MB)"] == pytest.approx(4 * 100 * (4**6 - 1) / 3 / 1e6)


def test_a_picture_that_shows_too_much_has_its_error(noise, monkeypatch):
    exact = measured._largest
    monkeypatch.setattr(measured, "_largest", lambda *where: 2 * exact(*where))
    rows = finish(measured.measuring(noise, (4_000,), 1, columns=200))
    assert rows[1].error == pytest.approx(0.5, abs=0.05)


def test_the_reference_is_the_same_in_pieces(noise, monkeypatch):
    edges = np.linspace(9_000, 29_000, 78).astype(np.int64)
    whole = measured._largest(noise, 30.0, edges)
    monkeypatch.setattr(measured, "PIECE", 1 << 12)
    np.testing.assert_allclose(measured._largest(noise, 30.0, edges), whole, rtol=1e-6)
    full = np.abs(cwt(noise, [30.0])[0]) ** 2
    assert whole[5] == pytest.approx(full[edges[5] : edges[6]].max(), rel=1e-6)
