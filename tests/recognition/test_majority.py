from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.recognition.majority import majority

CODES = st.lists(st.integers(-1, 4), max_size=30)


def by_counting(codes: list[int], width: int) -> list[int]:
    result = []
    for i, own in enumerate(codes):
        window = codes[max(0, i - width // 2) : i + (width - 1) // 2 + 1]
        votes = Counter(window)
        best = [code for code, count in votes.items() if count == max(votes.values())]
        result.append(own if own in best else min(best))
    return result


@given(codes=CODES, width=st.one_of(st.integers(1, 12), st.just(10**15)))
def test_each_sample_gets_the_code_with_most_votes(codes, width):
    found = majority(np.array(codes, dtype=np.int64), 5, width)
    assert found.dtype == np.int64
    assert found.tolist() == by_counting(codes, width)


@given(codes=CODES, order=st.permutations(range(5)))
def test_numbering_matters_only_where_others_are_equal(codes, order):
    codes = np.array(codes, dtype=np.int64)
    table = np.array([*order, -1])
    found, other = majority(codes, 5, 3), majority(table[codes], 5, 3)
    # Of three votes either two agree or each has its own, and then the middle one stays.
    inner = slice(1, -1)
    assert np.array_equal(table[found][inner], other[inner])


def test_no_action_is_invented_between_two():
    codes = np.repeat([1, 5], 10)
    assert set(majority(codes, 6, 10).tolist()) == {1, 5}


def test_a_window_must_hold_a_sample():
    with pytest.raises(InputError, match="at least 1 sample"):
        majority(np.array([0]), 1, 0)
