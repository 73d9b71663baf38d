"""Work shared by several processes."""

import os
import signal
import time

import pytest

from forcelab.errors import InputError
from forcelab.processes import shared


def doubled(number):
    time.sleep(0.05 * (number % 2))  # the odd ones take longer
    return 2 * number, os.getpid()


def refused(number):
    if number == 2:
        raise InputError("Number 2 cannot be done; leave it out.")
    return number


def hears_interrupts(_):
    return signal.getsignal(signal.SIGINT) is not signal.SIG_IGN


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_what_was_given(jobs):
    made = list(shared(doubled, range(6), jobs))
    assert [number for number, _ in made] == [0, 2, 4, 6, 8, 10]
    elsewhere = {process for _, process in made} - {os.getpid()}
    assert bool(elsewhere) == (jobs == 2)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_of_one_arrives_as_it_was_raised(jobs):
    with pytest.raises(InputError, match=r"^Number 2 cannot be done; leave it out\.$"):
        list(shared(refused, range(4), jobs))


def test_stopping_early_leaves_the_rest_undone_and_the_next_call_works():
    making = shared(doubled, range(1000), 2)
    assert next(making)[0] == 0
    started = time.monotonic()
    making.close()
    assert time.monotonic() - started < 20  # all of them would take 12 s a process and more
    assert [number for number, _ in shared(doubled, range(3), 2)] == [0, 2, 4]


def test_interrupts_of_the_terminal_reach_this_process_alone():
    before = signal.getsignal(signal.SIGINT)
    assert not any(shared(hears_interrupts, range(4), 2))
    assert signal.getsignal(signal.SIGINT) is before
