"""Jobs done by a process of their own."""

import os
import signal
import subprocess
import sys
import threading
import time
from itertools import pairwise
from pathlib import Path

import process_jobs
import psutil
import pytest

from forcelab.errors import ForcelabError, InputError
from forcelab.jobs import finish
from forcelab.process import GRACE, run_in_process
from tests.capture.helpers import eventually


def begun(job):
    """The number of the process of a job, which has told it."""
    return next(int(p.text.split()[1]) for p in job if p.text.startswith("process "))


def test_a_job_elsewhere_gives_all_its_progress_and_its_result():
    progress = []
    result = finish(run_in_process(process_jobs.counted, 5), progress.append)
    assert result["sum"] == 10
    assert result["process"] != os.getpid()
    distinct = [progress[0], *(p for before, p in pairwise(progress) if p is not before)]
    # The first one may say that the process is starting, if that takes time.
    assert [p.done for p in distinct if p.text != "starting"] == [1, 2, 3, 4, 5]
    assert not psutil.pid_exists(result["process"])


def test_a_second_job_elsewhere_begins_at_once():
    finish(run_in_process(process_jobs.counted, 1))
    result = finish(run_in_process(process_jobs.counted, 1))
    # What the process computed, however busy the machine is: 0.02 s; 2 s to load it all.
    assert result["cpu"] < 0.5


def test_a_job_elsewhere_keeps_to_the_background():
    manners = finish(run_in_process(process_jobs.manners))
    if hasattr(os, "nice"):
        assert manners["nice"] > min(os.nice(0), 18)  # 19 is the end of the scale
    assert manners["interrupt"]
    assert set(manners["blas"]) == {1}
    assert manners["main thread"]


def test_a_job_elsewhere_refuses_in_its_own_words():
    with pytest.raises(InputError, match=r"^Nothing is labelled yet; label at least two actions"):
        finish(run_in_process(process_jobs.refused))


def test_a_fault_elsewhere_is_told_with_the_trace_from_there():
    with pytest.raises(RuntimeError, match="KeyError: 'no such key'") as caught:
        finish(run_in_process(process_jobs.broken))
    assert "process_jobs.py" in str(caught.value.__cause__)


def test_a_result_that_cannot_travel_is_a_fault_and_not_a_lack_of_memory():
    with pytest.raises(RuntimeError, match="lambda") as caught:
        finish(run_in_process(process_jobs.untellable))
    assert "dumps" in str(caught.value.__cause__)


def test_a_job_whose_process_is_killed_is_told_in_a_sentence():
    job = run_in_process(process_jobs.silent)
    os.kill(begun(job), signal.SIGKILL)
    with pytest.raises(ForcelabError, match=r"ended from outside.* short of memory"):
        finish(job)


@pytest.mark.parametrize("deaf", [False, True])
def test_closing_ends_a_job_in_the_middle_of_what_hears_nothing(monkeypatch, deaf):
    # What is asked to end does so at once, however long it may take; what is deaf even to that
    # is made to after GRACE, however long it would go on.
    assert GRACE <= 0.1
    monkeypatch.setattr("forcelab.process.GRACE", 0.01 if deaf else 20.0)
    job = run_in_process(process_jobs.silent, None, deaf)
    process = begun(job)
    computing(process)
    threads = threading.enumerate()
    started = time.monotonic()
    job.close()
    assert time.monotonic() - started < 15.0  # the work goes on for ever
    assert not psutil.pid_exists(process)
    assert set(threading.enumerate()) <= set(threads)


def computing(process):
    """Wait until a process has computed for a while."""
    used = psutil.Process(process).cpu_times
    before = sum(used()[:2])
    eventually(lambda: sum(used()[:2]) > before + 0.1, 60)


def test_closing_lets_what_is_interruptible_clean_up(tmp_path, monkeypatch):
    monkeypatch.setattr("forcelab.process.GRACE", 60.0)  # the machine may be busy
    job = run_in_process(process_jobs.silent, tmp_path / "half")
    begun(job)
    eventually((tmp_path / "half").exists)
    job.close()
    assert not list(tmp_path.iterdir())


def test_a_job_can_be_closed_before_its_process_is_there():
    job = run_in_process(process_jobs.silent)
    assert next(job).text == "starting"
    job.close()
    eventually(
        lambda: all(thread.name != "forcelab process" for thread in threading.enumerate()), 60
    )
    assert not busy()


def busy():
    """Whether any process below this one computes."""
    below = psutil.Process().children(recursive=True)
    return [p for p in below if p.nice() > psutil.Process().nice()]


WARM = """
import time
from process_jobs import counted, silent
from forcelab import process
from forcelab.jobs import finish
from forcelab.process import run_in_process, warm_up
process.HEAVY = ("numpy", "threadpoolctl")  # a part of what takes long to import will do
begun = time.monotonic()
warm_up(counted)
warm = time.monotonic()
finish(run_in_process(counted, 2))
print((warm - begun) / (time.monotonic() - begun))
job = run_in_process(silent)
while not next(job).text.startswith('process '): pass
"""


def test_warming_up_keeps_nobody_waiting_and_at_the_end_of_a_program_nothing_is_said():
    ended = subprocess.run(
        [sys.executable, "-W", "error", "-c", WARM],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert float(ended.stdout) < 0.5  # of the time that the first job took: 0.02 s of 0.5 s


LEFT = """
from process_jobs import silent
from forcelab import process as there
from forcelab.process import run_in_process
there.HEAVY = ()  # what takes long to import makes no difference here
for progress in run_in_process(silent):
    if progress.text.startswith("process "):
        print(progress.text.split()[1], flush=True)
"""


def test_a_job_elsewhere_ends_when_the_process_that_asked_for_it_is_killed():
    parent = subprocess.Popen(
        [sys.executable, "-c", LEFT],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    with parent:
        job = int(parent.stdout.readline())
        below = psutil.Process(parent.pid).children(recursive=True)
        parent.kill()
    assert job in [process.pid for process in below]
    _, alive = psutil.wait_procs(below, 60)
    assert not alive
