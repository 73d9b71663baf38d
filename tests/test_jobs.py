from __future__ import annotations

import pytest

from forcelab.jobs import finish


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
