from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import lognorm

from forcelab.errors import InputError
from forcelab.recognition import hsmm as model
from forcelab.recognition.hsmm import FixedLag, HsmmParameters, decode, marginals
from forcelab.recognition.task_grammar import TaskGrammar

USES = ("none", "durations", "order")
STEP = 0.1


def random_grammar(rng: np.random.Generator, K: int, median: float = 0.3) -> TaskGrammar:
    follow = rng.random((K, K)) * (1 - np.eye(K))
    return TaskGrammar(
        tuple(f"action {k}" for k in range(K)),
        rng.normal(math.log(median), 0.6, K),
        rng.uniform(0.2, 0.6, K),
        rng.dirichlet(np.full(K, 3.0)),
        rng.dirichlet(np.full(K, 3.0)),
        follow / np.maximum(follow.sum(axis=1, keepdims=True), 1e-300),
    )


def some_logs(rng: np.random.Generator, n: int, K: int, confidence: float = 0.5) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log(rng.dirichlet(np.full(K, confidence), n) if n else np.empty((0, K)))


def everywhere(logs: np.ndarray) -> np.ndarray:
    return np.ones(len(logs), dtype=bool)


def segmentations(n: int, K: int):
    """Every way to cut n steps into segments, neighbours of different actions."""
    for cuts in range(n):
        for inner in itertools.combinations(range(1, n), cuts):
            edges = (0, *inner, n)
            for codes in itertools.product(range(K), repeat=cuts + 1):
                if all(a != b for a, b in itertools.pairwise(codes)):
                    yield edges, codes


class Plainly:
    """The model as its documentation states it, number by number."""

    def __init__(self, grammar, logs, step, use, places=False, changes=None):
        self.c, self.use, self.step = grammar, use, step
        self.K = len(grammar.actions)
        floor = logs.max(axis=1, keepdims=True) + math.log(model.FLOOR)
        prior = model.PRIOR * np.log(grammar.share)
        self.evidence = min(1, model.EVIDENCE * step / 0.02) * (np.maximum(logs, floor) - prior)
        self.emphasis = 0 if use == "none" else model.DURATION
        self.places = math.log(step / 0.02) if places else 0.0
        near = np.zeros(len(logs))
        if changes is not None and use != "none":
            near = model.CHANGE * (changes - model.LIKELIER)
        self.change = 0.5 * (near[:-1] + near[1:])  # of one after each step but the last
        self.limits = HsmmParameters.from_grammar(grammar, step, use)
        self.whole, self.cut = self.lengths()

    def _lines(self, k, near):
        """`near` up to the longest length; from there the tangent of the log density."""
        steps = np.arange(1, len(self.evidence) + 1)
        last, mean, sd = self.limits.longest[k], self.c.mean[k], self.c.sd[k]
        fall = min(-(1 + (math.log(last * self.step) - mean) / sd**2) / last, 0)
        table = np.minimum(steps, last)
        scores = near(lognorm(sd, scale=math.exp(mean)), table * self.step)
        return scores + fall * (steps - table)

    def lengths(self):
        """Scores of whole and of cut off segments of 1, 2, ... steps, each shape (K, n)."""
        K, n = self.K, len(self.evidence)
        middle = [self._lines(k, lambda d, s: d.logpdf(s) + math.log(0.5)) for k in range(K)]
        cut = [self._lines(k, lambda d, s: d.logsf(s)) for k in range(K)]
        short = np.arange(1, n + 1) < self.limits.shortest[:, None]
        middle = np.where(short, -np.inf, self.emphasis * np.array(middle))
        return middle, self.emphasis * np.array(cut)

    def first(self, k):
        return math.log(self.c.start[k] if self.use == "order" else 1 / self.K)

    def follow(self, j, k):
        if self.use == "none":
            return self.places - model.SWITCH
        share = self.c.follow[j, k] if self.use == "order" else 1 / (self.K - 1)
        return self.places + (math.log(share) if share else -math.inf)

    def score(self, edges, codes):
        last = len(codes) - 1
        total = self.first(codes[0])
        for i, k in enumerate(codes):
            steps = edges[i + 1] - edges[i]
            total += (self.cut if i in (0, last) else self.whole)[k, steps - 1]
            total += self.evidence[edges[i] : edges[i + 1], k].sum()
            total += self.follow(codes[i - 1], k) + self.change[edges[i] - 1] if i else 0.0
        return total


def as_codes(edges, codes):
    return np.repeat(codes, np.diff(edges))


# --- against every segmentation -------------------------------------------------------------------


@pytest.mark.parametrize("known", [False, True], ids=["", "changes known"])
@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize(("n", "K"), [(1, 1), (5, 1), (1, 3), (6, 3), (8, 2)])
def test_best_course_and_marginals_are_those_of_all_segmentations(n, K, use, known):
    rng = np.random.default_rng(100 * n + K)
    grammar, logs = random_grammar(rng, K), some_logs(rng, n, K)
    changes = rng.normal(0.5, 2.0, n) if known else None
    every = list(segmentations(n, K))
    plain = Plainly(grammar, logs, STEP, use, changes=changes)
    best = max(every, key=lambda one: plain.score(*one))
    codes = decode(logs, everywhere(logs), STEP, grammar, use, changes=changes)
    assert codes.dtype == np.int64
    assert codes.tolist() == as_codes(*best).tolist()

    plain = Plainly(grammar, logs, STEP, use, places=True, changes=changes)
    scores = np.array([plain.score(*one) for one in every])
    shares = np.exp(scores - np.logaddexp.reduce(scores))
    expected = np.zeros((n, K))
    for share, one in zip(shares, every, strict=True):
        expected[np.arange(n), as_codes(*one)] += share
    found = marginals(logs, everywhere(logs), STEP, grammar, use, changes=changes)
    np.testing.assert_allclose(found, expected, atol=1e-10)


def viterbi(plain: Plainly, n: int, join=np.max) -> float:
    """Score of the best segmentation by a loop over places, actions and all lengths."""
    K = plain.K
    sums = np.concatenate([np.zeros((1, K)), np.cumsum(plain.evidence, axis=0)])
    follow = np.array(
        [[plain.follow(j, k) if j != k else -math.inf for k in range(K)] for j in range(K)]
    )
    starts = np.full((n + 1, K), -math.inf)
    best = -math.inf
    for t in range(1, n + 1):
        ends = np.full(K, -math.inf)
        for k in range(K):
            lengths = (plain.cut if t == n else plain.whole)[k, t - 1 :: -1][:t]
            inner = starts[:t, k] - sums[:t, k] + lengths
            first = plain.first(k) + plain.cut[k, t - 1]
            ends[k] = join(np.append(inner, first)) + sums[t, k]
        change = plain.change[t - 1] if t < n else 0.0
        starts[t] = [join(ends + follow[:, k]) + change for k in range(K)]
        best = join(ends)
    return best


def scored(plain: Plainly, codes: np.ndarray) -> float:
    edges = np.concatenate([[0], np.flatnonzero(np.diff(codes)) + 1, [len(codes)]])
    return plain.score(tuple(edges.tolist()), tuple(codes[edges[:-1]].tolist()))


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize(
    ("K", "step", "median"),
    [(3, 0.02, 0.15), (4, 0.004, 0.1), (12, 0.1, 1), (2, 0.001, 0.1), (3, 0.0002, 0.1)],
)
def test_no_course_is_better_where_segments_outlast_every_table(K, step, median, use):
    rng = np.random.default_rng(K)
    grammar = random_grammar(rng, K, median)
    # Long quiet stretches, much longer than any duration that was seen, and busy ones between.
    truth = np.repeat(rng.integers(0, K, 12), rng.integers(5, 60, 12))
    truth[100:250] = 0
    logs = some_logs(rng, len(truth), K, 1.0) + 2.0 * np.eye(K)[truth]
    changes = rng.normal(-1.0, 1.0, len(truth))
    codes = decode(logs, everywhere(logs), step, grammar, use, changes=changes)
    plain = Plainly(grammar, logs, step, use, changes=changes)
    assert scored(plain, codes) == pytest.approx(viterbi(plain, len(codes)), abs=1e-8)


@pytest.mark.parametrize("shortest", [1, 2, 3])
def test_many_of_the_shortest_segments_in_a_row_are_found(shortest):
    rng = np.random.default_rng(shortest)
    grammar = random_grammar(rng, 3, 0.1)
    # Each step speaks for an action loudly enough to pay for a change.
    truth = np.repeat(np.arange(150) % 3, shortest)
    truth[90:240] = rng.permutation(truth[90:240])
    logs = 20.0 * np.eye(3)[truth]
    codes = decode(logs, everywhere(logs), 0.02, grammar, "none")
    plain = Plainly(grammar, logs, 0.02, "none")
    assert scored(plain, codes) == pytest.approx(viterbi(plain, len(codes)), abs=1e-8)
    assert np.mean(codes == truth) > 0.9


def test_marginals_where_evidence_lies_hundreds_of_nats_apart():
    rng = np.random.default_rng(6)
    grammar = random_grammar(rng, 2, 12.0)
    truth = np.repeat([0, 1], [130, 130])
    logs = 20.0 * np.eye(2)[truth]
    logs[120:140] = some_logs(rng, 20, 2, 1.0)  # where one ends is not plain to see
    found = marginals(logs, everywhere(logs), 0.1, grammar, "order")
    plain = Plainly(grammar, logs, 0.1, "order", places=True)
    for t in (3, 121, 128, 133, 138, 250):
        sums = []
        for more in (-1e-4, 1e-4):
            plain.evidence[t, 1] += more
            sums.append(viterbi(plain, len(logs), np.logaddexp.reduce))
            plain.evidence[t, 1] -= more
        assert (sums[1] - sums[0]) / 2e-4 == pytest.approx(found[t, 1], abs=1e-6)


@pytest.mark.parametrize("step", [0.0008, 0.0004])
def test_marginals_of_many_steps_are_those_of_all_segmentations(step):
    rng = np.random.default_rng(4)
    grammar = random_grammar(rng, 2, 0.1)
    truth = np.repeat([0, 1, 0], [80, 170, 60])
    logs = some_logs(rng, len(truth), 2, 1.0) + 2.0 * np.eye(2)[truth]
    assert HsmmParameters.from_grammar(grammar, step, "order").longest.min() > 128
    found = marginals(logs, everywhere(logs), step, grammar, "order")
    plain = Plainly(grammar, logs, step, "order", places=True)
    for t, k in [(0, 0), (75, 1), (84, 0), (160, 1), (255, 0), (309, 1)]:
        # What a little more evidence there adds to the sum of all segmentations.
        sums = []
        for more in (-1e-4, 1e-4):
            plain.evidence[t, k] += more
            sums.append(viterbi(plain, len(logs), np.logaddexp.reduce))
            plain.evidence[t, k] -= more
        assert (sums[1] - sums[0]) / 2e-4 == pytest.approx(found[t, k], abs=1e-6)


# --- what a user cares about ----------------------------------------------------------------------


def a_known_one(K: int = 3) -> TaskGrammar:
    """Actions of about a second that come one after the other."""
    follow = np.full((K, K), 0.02 / max(K - 2, 1))
    follow[np.arange(K), (np.arange(K) + 1) % K] = 0.98
    np.fill_diagonal(follow, 0.0)
    even = np.full(K, 1 / K)
    actions = tuple(map(str, range(K)))
    return TaskGrammar(actions, np.zeros(K), np.full(K, 0.3), even, even, follow)


@pytest.mark.parametrize("use", USES)
def test_a_flickering_classifier_gives_whole_segments(use):
    rng = np.random.default_rng(0)
    truth = np.repeat([0, 1, 2, 0], 50)
    flickering = np.where(rng.random(200) < 0.2, rng.integers(0, 3, 200), truth)
    logs = np.log(np.where(np.eye(3)[flickering] > 0, 0.7, 0.15))
    codes = decode(logs, everywhere(logs), 0.02, a_known_one(), use)
    assert codes[np.flatnonzero(np.diff(codes, prepend=-1))].tolist() == [0, 1, 2, 0]
    assert np.mean(codes == truth) > 0.95


def test_order_decides_where_nothing_is_seen_and_is_left_out_on_request():
    logs = np.zeros((150, 3))
    logs[:50, 0] = logs[100:, 2] = 3.0  # nothing tells what is between
    codes = decode(logs, everywhere(logs), 0.02, a_known_one(), "order")
    assert codes[np.flatnonzero(np.diff(codes, prepend=-1))].tolist() == [0, 1, 2]
    codes = decode(logs, everywhere(logs), 0.02, a_known_one(), "none")
    assert codes[np.flatnonzero(np.diff(codes, prepend=-1))].tolist() == [0, 2]


def test_an_order_and_a_length_never_seen_are_recognised_when_they_are_plain_to_see(monkeypatch):
    monkeypatch.setattr(model, "EVIDENCE", 1.0)
    truth = np.repeat([2, 1, 0], [1000, 10, 50])  # backwards; 20 s and 0.2 s instead of about 1 s
    logs = np.log(np.where(np.eye(3)[truth] > 0, 0.98, 0.01))
    codes = decode(logs, everywhere(logs), 0.02, a_known_one(), "order")
    assert np.array_equal(codes, truth)


@pytest.mark.parametrize("use", ["durations", "order"])
def test_an_action_changes_where_that_is_seen_though_the_steps_beside_it_tell_nothing(use):
    logs = np.zeros((150, 3))
    logs[:50, 0] = logs[100:, 1] = 3.0
    for place in (60, 75, 90):
        near = np.abs(np.arange(150) - place + 0.5) < 3  # 60 ms to either side
        changes = np.where(near, 2.0, -2.0)
        codes = decode(logs, everywhere(logs), 0.02, a_known_one(), use, changes=changes)
        assert codes[np.flatnonzero(np.diff(codes, prepend=-1))].tolist() == [0, 1]
        assert abs(int(np.flatnonzero(np.diff(codes))[0]) + 1 - place) <= 3


@pytest.mark.parametrize("use", USES)
def test_long_gaps_are_unlabelled_and_part_what_is_decoded(use, monkeypatch):
    monkeypatch.setattr(model, "BRIDGED", 0.0)
    rng = np.random.default_rng(5)
    grammar, logs = a_known_one(), some_logs(rng, 90, 3)
    valid = np.ones(90, dtype=bool)
    valid[:4] = valid[40:50] = False
    logs[60] = np.nan  # no number is no step
    codes = decode(logs, valid, 0.02, grammar, use)
    share = marginals(logs, valid, 0.02, grammar, use)
    valid[60] = False
    assert (codes[~valid] == -1).all()
    assert (codes[valid] >= 0).all()
    np.testing.assert_allclose(share.sum(axis=1), valid, atol=1e-12)
    noisy = logs.copy()
    noisy[50:60] = 0.0
    other = decode(noisy, valid, 0.02, grammar, use)
    assert np.array_equal(other[:50], codes[:50])
    assert np.array_equal(other[61:], codes[61:])


@pytest.mark.parametrize("use", USES)
def test_a_short_gap_is_unlabelled_and_what_lies_around_it_is_decoded_as_one(use):
    truth = np.repeat([0, 1, 2], 50)
    logs = np.where(np.eye(3)[truth] > 0, 0.0, -1.0)
    valid = np.ones(150, dtype=bool)
    for first, last in ((20, 30), (48, 60), (110, 135)):  # 0.2 to 0.5 s, and over a boundary
        valid[first:last] = False
    garbage = np.where(valid[:, None], logs, np.nan)
    codes = decode(garbage, valid, 0.02, a_known_one(), use)
    assert np.array_equal(codes, np.where(valid, truth, -1))
    # What it counts as: time of which nothing is known.
    through = decode(
        np.where(valid[:, None], logs, 0.0), everywhere(logs), 0.02, a_known_one(), use
    )
    assert np.array_equal(codes, np.where(valid, through, -1))
    share = marginals(garbage, valid, 0.02, a_known_one(), use)
    np.testing.assert_allclose(share.sum(axis=1), valid, atol=1e-12)


def test_what_lies_between_gaps_of_more_than_half_a_second_is_decoded_by_itself():
    # By order and durations the middle is 1; seen alone, it is whatever is seen a little.
    logs = np.zeros((150, 3))
    logs[:50, 0] = logs[100:, 2] = 3.0
    logs[60:90, 0] = 0.02
    for gap, middle in ((25, 1), (26, 0)):
        valid = np.ones(150, dtype=bool)
        valid[62 - gap : 62] = valid[88 : 88 + gap] = False
        codes = decode(logs, valid, 0.02, a_known_one(), "order")
        assert set(codes[62:88]) == {middle}
        assert (codes[~valid] == -1).all()


@pytest.mark.parametrize("use", USES)
@pytest.mark.parametrize("n", [0, 1, 2, 40])
def test_certain_and_impossible_probabilities_and_few_steps(n, use):
    logs = np.full((n, 3), -np.inf)
    logs[:, 1] = 0.0
    found = decode(logs, everywhere(logs), 0.02, a_known_one(), use)
    assert found.tolist() == [1] * n
    share = marginals(logs, everywhere(logs), 0.02, a_known_one(), use)
    assert share.shape == (n, 3)
    assert np.isfinite(share).all()
    nothing = np.full((n, 3), -np.inf)
    assert (decode(nothing, everywhere(nothing), 0.02, a_known_one(), use) >= 0).all()


def test_two_hundred_actions(monkeypatch):
    monkeypatch.setattr(model, "EVIDENCE", 1.0)
    rng = np.random.default_rng(1)
    truth = np.repeat(rng.permutation(200)[:6], 20)
    logs = 4.0 * np.eye(200)[truth]
    grammar = a_known_one(200)
    codes = decode(logs, everywhere(logs), 0.02, grammar, "durations")
    assert np.array_equal(codes, truth)
    share = marginals(logs, everywhere(logs), 0.02, grammar, "durations")
    assert np.isfinite(share).all()


def test_no_action_decodes_nothing():
    nobody = TaskGrammar.learn([], ())
    codes = decode(np.empty((3, 0)), np.ones(3, dtype=bool), 0.02, nobody, "order")
    assert codes.tolist() == [-1] * 3


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), use=st.sampled_from(USES))
def test_numbering_of_actions_and_units_of_steps_play_no_part(seed, use):
    rng = np.random.default_rng(seed)
    n, K = int(rng.integers(1, 60)), int(rng.integers(1, 6))
    grammar, logs = random_grammar(rng, K), some_logs(rng, n, K)
    codes = decode(logs, everywhere(logs), STEP, grammar, use)
    order = rng.permutation(K)
    other = TaskGrammar(
        tuple(grammar.actions[k] for k in order),
        *(getattr(grammar, name)[order] for name in ("mean", "sd", "share", "start")),
        grammar.follow[np.ix_(order, order)],
    )
    permuted = decode(logs[:, order], everywhere(logs), STEP, other, use)
    assert np.array_equal(order[permuted], codes)
    # Densities instead of probabilities: each step has a factor of its own.
    shifted = logs + rng.normal(0, 50, (n, 1))
    assert np.array_equal(decode(shifted, everywhere(logs), STEP, grammar, use), codes)


@pytest.mark.parametrize("use", USES)
def test_finer_steps_that_say_the_same_decide_the_same(monkeypatch, use):
    monkeypatch.setattr(model, "SWITCH", 4.0)
    rng = np.random.default_rng(8)
    truth = np.repeat([0, 1, 2, 1], [40, 60, 50, 30])
    logs = some_logs(rng, 180, 3) + np.eye(3)[truth]
    coarse = decode(logs, everywhere(logs), 0.02, a_known_one(), use)
    fine = np.repeat(logs, 5, axis=0)
    finer = decode(fine, everywhere(fine), 0.004, a_known_one(), use)
    assert np.mean(finer == np.repeat(coarse, 5)) > 0.97
    one = marginals(logs, everywhere(logs), 0.02, a_known_one(), use)
    other = marginals(fine, everywhere(fine), 0.004, a_known_one(), use)
    assert np.abs(other[2::5] - one).mean() < 0.02


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"step": 0.0}, "longer than 0 s"),
        ({"use": "everything"}, "none, durations or order"),
        ({"log_probabilities": np.zeros((5, 4))}, "3 actions"),
        ({"valid": np.ones(4, dtype=bool)}, "5 steps"),
    ],
)
def test_what_cannot_be_decoded_is_refused(wrong, message):
    given_ = {
        "log_probabilities": np.zeros((5, 3)),
        "valid": np.ones(5, dtype=bool),
        "step": 0.02,
        "grammar": a_known_one(),
    }
    with pytest.raises(InputError, match=message):
        decode(**(given_ | wrong))


# --- on a stream ----------------------------------------------------------------------------------


def with_lag(logs, valid, t, lag, grammar, use):
    """The plain definition: decode all that is seen by then, and look at the step in question."""
    steps = slice(0, t + lag + 1)
    return decode(logs[steps], valid[steps], 0.02, grammar, use)[t]


@pytest.mark.parametrize("gap", [25, 26], ids=lambda gap: f"gap of {gap}")
@pytest.mark.parametrize(("use", "lag"), [("none", 3), ("durations", 0), ("order", 30)])
def test_each_step_is_what_decoding_gives_it_after_the_lag(use, lag, gap):
    rng = np.random.default_rng(lag)
    grammar = random_grammar(rng, 3, 0.1)
    logs = some_logs(rng, 260, 3, 1.0)
    valid = np.ones(260, dtype=bool)
    valid[150 : 150 + gap] = False
    valid[156] = False
    stream = FixedLag(0.02, lag, grammar, use)
    parts = [
        stream.push(logs[first : first + 7], valid[first : first + 7]) for first in range(0, 260, 7)
    ]
    waiting = len(logs) - sum(map(len, parts))
    assert waiting == lag
    codes = np.concatenate([*parts, stream.finish()])
    for t in [*range(0, 260, 23), *range(146, 160), *range(149 + gap, 155 + gap), 259]:
        assert codes[t] == with_lag(logs, valid, t, lag, grammar, use)


@settings(max_examples=25)
@given(st.integers(1, 90), st.lists(st.integers(1, 40), min_size=1, max_size=6), st.integers(0, 99))
def test_with_a_lag_that_covers_everything_it_is_the_offline_decoder(n, blocks, seed):
    rng = np.random.default_rng(seed)
    grammar = random_grammar(rng, 4, 0.15)
    logs, valid = some_logs(rng, n, 4, 1.0), rng.random(n) > 0.05
    logs[rng.random((n, 4)) < 0.1] = -np.inf
    stream = FixedLag(0.02, n, grammar, "order")
    parts, first = [], 0
    while first < n:
        last = first + blocks[len(parts) % len(blocks)]
        parts.append(stream.push(logs[first:last], valid[first:last]))
        first = last
    codes = np.concatenate([*parts, stream.finish()])
    assert codes.tolist() == decode(logs, valid, 0.02, grammar, "order").tolist()


def test_a_stream_goes_on_without_growing_and_forgets_nothing_it_needs():
    rng = np.random.default_rng(9)
    grammar = random_grammar(rng, 3, 0.08)
    truth = np.repeat(rng.integers(0, 3, 60), rng.integers(5, 25, 60))
    truth[300:520] = 1  # much longer than what is kept
    logs = some_logs(rng, len(truth), 3, 1.0) + 3 * np.eye(3)[truth]
    stream = FixedLag(0.02, 12, grammar, "order")
    codes = np.concatenate([stream.push(logs), stream.finish()])
    assert len(codes) == len(truth)
    for t in range(20, len(truth) - 12, 231):
        assert codes[t] == with_lag(logs, everywhere(logs), t, 12, grammar, "order")


def test_a_stream_that_ends_at_once_or_waits_backwards():
    stream = FixedLag(0.02, 4, a_known_one())
    assert stream.push(np.empty((0, 3))).tolist() == []
    assert stream.finish().tolist() == []
    assert stream.push(np.zeros((2, 3))).tolist() == []
    assert len(stream.finish()) == 2
    with pytest.raises(InputError, match="0 steps or more"):
        FixedLag(0.02, -1, a_known_one())
