"""Filters that leave nothing of a prediction are told, with what took it."""

import numpy as np
import pytest

from forcelab.labels import UNLABELLED
from forcelab.recognition import results
from forcelab.recognition.results import empty_prediction_remarks
from forcelab.recognition.settings import Settings

N = 100
NOTHING = Settings(threshold=None, median=None, drop=None)


def reviewed(left, **stages):
    """A demonstration of which so many steps are left after the filters, and after each stage."""

    def codes(number):
        found = np.full(N, UNLABELLED)
        found[:number] = 0
        return found

    times, stages = np.arange(N) / 100, {name: codes(n) for name, n in stages.items()}
    return results.HeldOutPrediction(
        "a", "a", times, ("grab",), codes(N), codes(N), codes(left), stages
    )


@pytest.mark.parametrize(
    ("stages", "taken"),
    [
        ({"threshold": 2, "median": 2}, "less probable than 0.8 (threshold)"),
        ({"threshold": 90, "median": 80}, "lasts less than 0.125 of the shortest segment"),
    ],
)
def test_what_left_nothing_is_told_with_the_scales_in_seconds(stages, taken):
    (told,) = empty_prediction_remarks([reviewed(1, **stages)], Settings(), 20_000.0)
    assert told.startswith("The filters left 1.0 % of the predicted time")
    assert taken in told
    assert "at 20000 Hz the scales are 0.1 to 51.2 ms" in told
    assert "or another rate, such as 1000 Hz; or train" in told


def test_the_usual_rate_is_not_advised_where_it_is_that():
    (told,) = empty_prediction_remarks([reviewed(0, threshold=0)], Settings(), 1000.0)
    assert "the scales are 2 to 1,020 ms, so try others or another rate; or train" in told


def test_windows_have_no_scales_to_blame():
    (told,) = empty_prediction_remarks(
        [reviewed(0, threshold=0)], Settings(features="windows"), 50.0
    )
    assert "scales" not in told


@pytest.mark.parametrize(
    ("left", "settings"), [(50, Settings()), (0, NOTHING), (0, Settings(decoder="semi-markov"))]
)
def test_nothing_is_said_where_much_is_left_or_no_filter_took_it(left, settings):
    assert empty_prediction_remarks([reviewed(left, threshold=left)], settings, 1000.0) == ()
