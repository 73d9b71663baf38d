from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.recognition.refining import nearest_codes, needed, refine, upsampled

TIMES = np.arange(400) / 500.0


def logs_of(codes: np.ndarray, K: int = 3) -> np.ndarray:
    return np.log(np.where(np.eye(K)[codes] > 0, 0.8, 0.1))


def test_a_boundary_goes_to_the_sample_where_the_evidence_changes():
    truth = np.repeat([0, 1, 2], [107, 153, 140])
    coarse_times = TIMES[::10]
    coarse = nearest_codes(truth[::10], coarse_times, TIMES)
    assert not np.array_equal(coarse, truth)
    assert np.array_equal(refine(coarse, TIMES, logs_of(truth), 0.04), truth)


def test_no_boundary_goes_further_than_its_reach():
    codes = np.repeat([0, 1], 200)
    evidence = logs_of(np.repeat([0, 1], [230, 170]))
    found = refine(codes, TIMES, evidence, 0.04)
    assert found.tolist() == np.repeat([0, 1], [220, 180]).tolist()


def test_where_nothing_tells_the_boundary_stays():
    codes = np.repeat([0, 1, -1, 2], [100, 90, 60, 150])
    assert np.array_equal(refine(codes, TIMES, np.zeros((400, 3))), codes)
    assert np.array_equal(refine(codes, TIMES, np.full((400, 3), -np.inf)), codes)
    assert np.array_equal(refine(codes, TIMES, np.full((400, 3), np.nan)), codes)


def test_edges_of_unlabelled_time_stay():
    codes = np.repeat([0, -1, 1], [100, 100, 200])
    assert np.array_equal(refine(codes, TIMES, logs_of(np.ones(400, dtype=int))), codes)
    assert not needed(codes, TIMES, 0.04).any()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_order_is_kept_and_only_what_is_needed_is_looked_at(data):
    seed = data.draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    lengths = rng.integers(1, 12, rng.integers(1, 12))
    codes = np.repeat(rng.integers(-1, 3, len(lengths)), lengths)
    times = np.cumsum(rng.uniform(0.5, 1.5, len(codes))) * 0.01
    logs = rng.normal(0, 2, (len(codes), 3))
    reach = float(rng.choice([0.0, 0.01, 0.03, 1.0]))
    found = refine(codes, times, logs, reach)

    def starts(a):
        return a[np.flatnonzero(np.diff(a, prepend=-9))].tolist()

    assert starts(found) == starts(codes)
    unseen = np.where(needed(codes, times, reach)[:, None], logs, np.nan)
    assert np.array_equal(refine(codes, times, unseen, reach), found)
    # Nothing got worse, and no boundary went too far.
    inside = codes >= 0
    rows = np.arange(len(codes))
    assert logs[rows, found][inside].sum() >= logs[rows, codes][inside].sum() - 1e-6
    before, after = (np.flatnonzero(np.diff(a)) + 1 for a in (codes, found))
    assert (np.abs(times[after] - times[before]) <= reach + 1e-12).all()


def test_probabilities_between_coarse_steps_put_the_boundary_where_they_cross():
    coarse_times = np.array([0.0, 0.1, 0.2, 0.3])
    logs = np.log(np.array([[0.9, 0.1], [0.7, 0.3], [0.4, 0.6], [0.1, 0.9]]))
    fine = upsampled(logs, coarse_times, np.arange(31) / 100)
    assert fine.shape == (31, 2)
    codes = refine(np.repeat([0, 1], [15, 16]), np.arange(31) / 100, fine, 0.05)
    assert int(np.diff(codes).argmax()) == int(np.flatnonzero(fine[:, 0] > fine[:, 1])[-1])


def test_gaps_of_the_fine_stamps_are_unlabelled():
    valid = np.array([True, False, True])
    found = nearest_codes(np.array([0, 1]), np.array([0.0, 1.0]), np.array([0.1, 0.2, 0.9]), valid)
    assert found.tolist() == [0, -1, 1]
    nothing = nearest_codes(np.empty(0, dtype=np.int64), np.empty(0), np.array([0.0, 1.0]))
    assert nothing.tolist() == [-1, -1]


def test_what_does_not_belong_together_is_refused():
    with pytest.raises(InputError, match="same samples"):
        refine(np.zeros(3, dtype=np.int64), np.arange(2.0), np.zeros((3, 2)))
    with pytest.raises(InputError, match="0 s or more"):
        refine(np.zeros(3, dtype=np.int64), np.arange(3.0), np.zeros((3, 2)), -1.0)
