"""The table of the scalogram on the screen: right pictures have small errors, wrong ones not."""

import numpy as np
import pytest

from forcelab.jobs import finish
from forcelab.measure import scalogram as measured


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
        assert exact.pareto


def test_a_picture_that_shows_too_much_has_its_error(noise, monkeypatch):
    exact = measured._energy
    monkeypatch.setattr(
        measured, "_energy", lambda *where: {a: 2 * e for a, e in exact(*where).items()}
    )
    rows = finish(measured.measuring(noise, (4_000,), 1, columns=200))
    assert rows[1].error == pytest.approx(0.5, abs=0.05)


def test_the_reference_is_the_mean_over_the_span_in_pieces(noise, monkeypatch):
    whole = measured._energy(noise, 9_000, 29_000)
    monkeypatch.setattr(measured, "PIECE", 1 << 12)
    assert measured._energy(noise, 9_000, 29_000) == pytest.approx(whole, rel=1e-4)
