from __future__ import annotations

import gc
import subprocess
import sys
import warnings

import pytest

from forcelab.jobs import Progress, finish, job


def test_a_finished_job_gives_its_result_and_all_progress_in_order():
    def job():
        yield "first"
        yield "second"
        return 42

    progress = []
    assert finish(job(), progress.append) == 42
    assert progress == ["first", "second"]


def test_a_job_without_progress_gives_its_result_unwatched():
    def job():
        return "done"
        yield

    assert finish(job()) == "done"


@pytest.mark.parametrize("guilty", ["job", "watch"])
def test_an_error_of_job_or_watcher_passes_and_the_job_is_left_behind_closed(guilty):
    closed = []

    def job():
        try:
            yield 1
            if guilty == "job":
                raise LookupError("lost")
            yield 2
        finally:
            closed.append(True)

    def watch(progress):
        if guilty == "watch":
            raise LookupError("lost")

    with pytest.raises(LookupError, match="lost"):
        finish(job(), watch)
    assert closed == [True]


@job
def count_job(total):
    """Count."""
    for done in range(total):
        yield Progress(done, total, "counting")
    return total


def test_a_job_says_what_to_do_with_it():
    counting = count_job(2)
    assert repr(counting) == (
        "<count_job, not started: forcelab.finish(job) runs it and gives its result>"
    )
    next(counting)
    assert repr(counting) == "<count_job, started, not finished>"
    assert finish(counting) == 2
    assert repr(counting) == "<count_job, over>"


@pytest.mark.filterwarnings("default")
def test_a_job_that_was_never_run_warns_when_it_is_dropped():
    with pytest.warns(RuntimeWarning, match="never run") as said:
        count_job(2)
    assert "forcelab.finish(count_job(...))" in str(said[0].message)
    assert len(said) == 1


def test_a_job_that_was_begun_or_cancelled_warns_of_nothing():
    def relayed():
        return (yield from count_job(1))

    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for _ in count_job(2):
            break
        finish(relayed())
        next(count_job(2))
        count_job(2).close()  # as the window does with what a newer job took the place of
        gc.collect()
    assert not said


def test_a_script_that_ends_without_running_its_job_is_told():
    script = "import forcelab; job = forcelab.make_sample_job('never.forcelab')"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert "make_sample_job was called and never run" in done.stderr
