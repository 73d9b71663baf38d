"""What a stretch looked like in little; no decoder is asked for where there is no video."""

import sys

import numpy as np
import pytest
from explained import FAST, made

from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import finish
from forcelab.review.differences import Interval
from forcelab.review.explanation import force_preview, preview_job


@pytest.fixture
def demonstration():
    times = np.arange(1000) / 100.0
    signals = np.random.default_rng(0).normal(size=(1000, 2))
    return Demonstration("01", "foam", times, signals, (Channel("a"), Channel("b")))


def test_a_trace_holds_the_extremes_of_its_columns(demonstration):
    found = force_preview(demonstration, 2.0, 7.0, columns=50)
    blocks = demonstration.signals[200:700].reshape(50, 10, 2)
    assert np.array_equal(found.low, blocks.min(axis=1))
    assert np.array_equal(found.high, blocks.max(axis=1))


def test_a_short_stretch_has_a_column_for_each_sample(demonstration):
    found = force_preview(demonstration, 2.0, 2.05, columns=50)
    assert np.array_equal(found.low, demonstration.signals[200:205])
    assert np.array_equal(found.low, found.high)


def test_a_stretch_after_the_last_stamp_has_the_last_sample(demonstration):
    end = demonstration.end
    found = force_preview(demonstration, demonstration.times[-1] + 1e-3, end)
    assert np.array_equal(found.low, demonstration.signals[-1:])


def test_what_is_missing_is_passed_over():
    signals = np.ones((100, 1))
    signals[:50], signals[70] = np.nan, np.inf
    gappy = Demonstration("01", "foam", np.arange(100) / 10.0, signals, (Channel("a"),))
    found = force_preview(gappy, 0.0, 10.0, columns=10)
    assert np.isnan(found.low[:5]).all()
    assert (found.high[5:] == 1.0).all()


def test_no_video_needs_no_decoder(tmp_path, monkeypatch):
    path = tmp_path / "study.forcelab"
    outcome = made(path, FAST.replace(classifier="naive-bayes"), count=2)
    monkeypatch.setitem(sys.modules, "cv2", None)  # importing it fails
    places = [Interval(one.id, 1.0, 2.0) for one in outcome.tested]
    found = finish(preview_job(path, places))
    assert [one.name for one in found] == [one.name for one in outcome.tested]
    assert all(one.frame is None for one in found)
