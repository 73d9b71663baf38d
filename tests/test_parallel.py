"""Work done by other processes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import parallel_work
import psutil
import pytest

from forcelab.errors import ForcelabError, InputError
from forcelab.parallel import map_in_processes


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_in_the_order_of_what_was_given(jobs):
    results = list(map_in_processes(parallel_work.doubled, range(6), jobs))
    assert [number for number, _ in results] == [0, 2, 4, 6, 8, 10]
    elsewhere = {process for _, process in results} - {os.getpid()}
    assert bool(elsewhere) == (jobs == 2)


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_of_one_arrives_as_it_was_raised(jobs):
    with pytest.raises(InputError, match=r"^Number 2 cannot be done; leave it out\.$"):
        list(map_in_processes(parallel_work.refused, range(4), jobs))


def test_stopping_early_leaves_the_rest_undone_and_the_next_call_works():
    making = map_in_processes(parallel_work.doubled, range(10_000), 2)
    assert next(making)[0] == 0
    started = time.monotonic()
    making.close()
    assert time.monotonic() - started < 60  # all of them would take two minutes and more
    assert [number for number, _ in map_in_processes(parallel_work.doubled, range(3), 2)] == [
        0,
        2,
        4,
    ]


def test_interrupts_of_the_terminal_reach_this_process_alone():
    before = signal.getsignal(signal.SIGINT)
    assert list(map_in_processes(parallel_work.interrupting_itself, range(4), 2)) == [0, 1, 2, 3]
    assert signal.getsignal(signal.SIGINT) is before


def interrupting_the_start(numbers):
    """Numbers; Ctrl+C is pressed when the first is asked for, while processes are started."""
    signal.raise_signal(signal.SIGINT)
    yield from numbers


def test_an_interrupt_while_processes_start_is_not_lost():
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        list(map_in_processes(parallel_work.lasting, interrupting_the_start(range(4)), 2))
    assert time.monotonic() - started < 20
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert [number for number, _ in map_in_processes(parallel_work.doubled, range(3), 2)] == [
        0,
        2,
        4,
    ]


def test_a_process_that_is_killed_is_told_in_a_sentence():
    with pytest.raises(ForcelabError, match=r"ended from outside.* short of memory"):
        list(map_in_processes(parallel_work.killed, range(4), 2))


ORPHANS = """
from forcelab.parallel import map_in_processes
from parallel_work import waiting
for _ in map_in_processes(waiting, range(2), 2):
    pass
"""


def test_the_processes_end_when_the_one_that_started_them_is_killed():
    parent = subprocess.Popen(
        [sys.executable, "-c", ORPHANS],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    with parent:
        workers = [int(parent.stdout.readline()) for _ in range(2)]
        parent.kill()
    assert len(set(workers)) == 2
    _, alive = psutil.wait_procs([psutil.Process(w) for w in workers if psutil.pid_exists(w)], 40)
    assert not alive
