"""The offset at which labels agree best with others is found, with how well they agree there."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.formats.label_offset import fit_offset
from forcelab.labels import Segment


def labels(seed, count, longest=4.0):
    random = np.random.default_rng(seed)
    edges = np.cumsum(random.uniform(0.2, longest, 2 * count))
    words = random.choice(["grab", "hold", "slip"], count)
    pairs = zip(edges[::2], edges[1::2], words, strict=True)
    return tuple(Segment(float(a), float(b), str(word)) for a, b, word in pairs)


def moved(segments, by, jitter=0.0):
    noise = np.random.default_rng(1).normal(0.0, jitter, (len(segments), 2))
    pairs = zip(segments, noise, strict=True)
    return tuple(Segment(s.start + by + a, s.end + by + b, s.action) for s, (a, b) in pairs)


@pytest.mark.parametrize("by", [0.0, 0.734, -3.2, 41.7, -300.0])
def test_the_shift_between_the_same_labels_is_found_exactly(by):
    own = labels(3, 30)
    fit = fit_offset(moved(own, -by), own)
    assert fit.offset == pytest.approx(by, abs=1e-9)
    assert fit.agreement > 0.97
    assert fit.before == pytest.approx(1.0 if by == 0 else fit.before, abs=0.02)


def test_two_coders_are_as_apart_as_most_of_their_edges():
    by, own = 1.25, labels(4, 40)
    fit = fit_offset(moved(own, -by, jitter=0.03), own)
    assert fit.offset == pytest.approx(by, abs=0.02)
    assert 0.9 < fit.agreement < 1.0


def test_agreement_is_that_of_the_seconds():
    own, other = labels(5, 20, 2.0), labels(6, 20, 2.0)
    times = np.arange(0.0, 100.0, 0.0005)
    of = [np.full(times.size, "", dtype="<U4") for _ in range(2)]
    for row, segments in zip(of, (own, other), strict=True):
        for s in segments:
            row[(times >= s.start) & (times < s.end)] = s.action
    same = np.mean((of[0] == of[1]) & (of[0] != ""))
    labelled = np.mean(of[0] != "") + np.mean(of[1] != "")
    assert fit_offset(own, other).before == pytest.approx(2 * same / labelled, abs=0.02)


def test_few_segments_or_none_in_common_tell_nothing():
    own = labels(7, 30)
    assert fit_offset(own[:2], own) is None
    other = tuple(Segment(s.start, s.end, "twist") for s in own)
    fit = fit_offset(own, other)
    assert fit.agreement == pytest.approx(0.0, abs=1e-9)


def test_in_a_recording_of_hours_the_edges_tell_what_the_steps_do_not():
    own = labels(8, 3_000)
    fit = fit_offset(moved(own, -5.0), own)
    assert fit.offset == pytest.approx(5.0, abs=1e-6)
