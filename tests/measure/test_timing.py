import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.measure.timing import Method, machine, timed_methods


class Clock:
    """A clock that the ways themselves move on."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def spending(clock, name, *durations, log=None, result=None):
    """A way that takes the given durations one after the other, then the last one again."""
    left = list(durations)

    def run():
        clock.now += left.pop(0) if len(left) > 1 else left[0]
        if log is not None:
            log.append(name)
        return result

    return Method(name, run, lambda found: found)


@pytest.mark.parametrize("repetitions", [1, 3, 5, 8])
def test_median_and_spread_are_those_of_the_repetitions(repetitions):
    clock = Clock()
    durations = [7.0, 1.0, 30.0, 2.0, 4.0, 3.0, 9.0, 5.0][:repetitions]
    # The first run is for the result and the memory: its time counts nothing.
    (timed,) = finish(timed_methods([spending(clock, "A", 99.0, *durations)], repetitions, clock))
    assert timed.seconds == pytest.approx(np.median(durations))
    assert timed.spread == pytest.approx(np.subtract(*np.percentile(durations, [75, 25])))


def test_what_takes_long_is_repeated_less_often_but_once_at_least():
    clock, log = Clock(), []
    ways = [spending(clock, name, t, log=log) for name, t in (("A", 1.0), ("B", 4.0), ("C", 99.0))]
    timed = finish(timed_methods(ways, 5, clock, longest=8.0))
    assert "".join(log) == "ABC" + "ABC" + "AB" + "A" * 3
    assert [timing.seconds for timing in timed] == [1.0, 4.0, 99.0]


def test_what_is_too_short_for_the_clock_is_repeated_until_it_is_not():
    clock, log = Clock(), []
    (timed,) = finish(timed_methods([spending(clock, "A", 1e-5, log=log)], 3, clock))
    assert timed.seconds == pytest.approx(1e-5, rel=1e-6)
    assert len(log) >= 300


def test_only_the_first_result_is_looked_at_and_looking_takes_no_time():
    clock, judged = Clock(), []

    def look(result):
        clock.now += 1000.0
        judged.append(result)
        return result + 1

    way = spending(clock, "A", 1.0, result=41)
    (timed,) = finish(timed_methods([Method("A", way.run, look)], 3, clock))
    assert (timed.judged, judged) == (42, [41])
    assert timed.seconds == pytest.approx(1.0)


def test_peak_memory_is_what_is_held_at_once():
    def at_once():
        return [np.ones(250_000) for _ in range(4)]

    def in_turn():
        return [np.ones(250_000).sum() for _ in range(4)]

    ways = [Method(run.__name__, run, len) for run in (at_once, in_turn)]
    much, little = finish(timed_methods(ways, 1))
    assert 8e6 <= much.peak_bytes < 9e6
    assert 2e6 <= little.peak_bytes < 3e6


@pytest.mark.parametrize("where", ["run", "look"])
def test_a_way_that_refuses_has_its_sentence_and_stops_no_other(where):
    clock, log = Clock(), []

    def refuse(*_):
        log.append("B")
        raise InputError("The step is too long.")

    work = spending(clock, "B", 1.0)
    bad = Method("B", refuse, len) if where == "run" else Method("B", work.run, refuse)
    ways = [spending(clock, "A", 1.0, log=log), bad, spending(clock, "C", 2.0, log=log)]
    first, refusing, last = finish(timed_methods(ways, 2, clock))
    assert (refusing.refusal, refusing.judged) == ("The step is too long.", None)
    assert "".join(log) == "ABCACAC"  # not tried again
    assert (first.seconds, last.seconds) == pytest.approx((1.0, 2.0))


def test_any_other_error_is_not_taken_for_a_refusal():
    def broken():
        raise ZeroDivisionError("division by zero")

    with pytest.raises(ZeroDivisionError):
        finish(timed_methods([Method("A", broken, len)], 1))


def test_progress_reaches_its_total_and_names_what_runs():
    clock, texts = Clock(), []
    finish(timed_methods([spending(clock, name, 1.0) for name in "AB"], 3, clock), texts.append)
    assert [progress.done for progress in texts] == list(range(8))
    assert {progress.total for progress in texts} == {8}
    assert [progress.text for progress in texts[:4]] == ["A, memory", "B, memory", "A", "B"]


def test_no_repetition_is_refused_before_anything_runs():
    clock, log = Clock(), []
    with pytest.raises(InputError, match="not 0"):
        finish(timed_methods([spending(clock, "A", 1.0, log=log)], 0, clock))
    assert log == []


def test_the_machine_is_named():
    found = machine()
    assert found["processor"]
    assert found["cores"] >= 1
    assert found["system"]
