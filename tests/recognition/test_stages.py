"""What each filter leads to, kept beside the prediction."""

import numpy as np
import pytest
from synthetic import synthetic_set
from trained_project import FAST

from forcelab.labels import UNLABELLED
from forcelab.recognition import filters
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.training import train


@pytest.fixture(scope="module")
def labelled():
    return [LabelledDemonstration(demo, segments) for demo, segments in synthetic_set(3, 100.0)]


@pytest.mark.parametrize("threshold", [None, 0.9])
@pytest.mark.parametrize("median", [None, 5])
@pytest.mark.parametrize("drop", [None, 0.5])
def test_each_stage_is_the_filter_applied_to_the_one_before(labelled, threshold, median, drop):
    recogniser = train(labelled[:2], FAST.replace(threshold=threshold, median=median, drop=drop))
    made = recogniser.predict(labelled[2].demonstration, probability_trace=True)
    codes, expected = made.raw, {}
    if threshold is not None:
        best = made.probabilities.max(axis=1)
        expected["threshold"] = codes = np.where(best >= threshold, codes, UNLABELLED)
    if median is not None:
        expected["median"] = codes = filters.median(codes, median)
    assert list(made.stages) == list(expected)
    for name, stage in expected.items():
        assert np.array_equal(made.stages[name], stage)
    if drop is None:
        assert np.array_equal(made.filtered, codes)
    else:
        changed = made.filtered != codes
        assert (made.filtered[changed] == UNLABELLED).all()


def test_gaps_have_no_certainty(labelled):
    from dataclasses import replace

    demonstration = labelled[2].demonstration
    keep = np.abs(demonstration.times - 2.0) > 0.3
    gappy = replace(
        demonstration, times=demonstration.times[keep], signals=demonstration.signals[keep]
    )
    made = train(labelled[:2], FAST).predict(gappy, probability_trace=True)
    inside = np.abs(made.probability_trace.times - 2.0) < 0.25
    assert inside.any()
    assert (made.probability_trace.values[inside] == 0).all()
    outside = np.abs(made.probability_trace.times - 2.0) > 0.32
    # Probabilities add up to one, in 255ths that are rounded each.
    assert np.abs(made.probability_trace.values[outside].sum(axis=1, dtype=int) - 255).max() <= 2
