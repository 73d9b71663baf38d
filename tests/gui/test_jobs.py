import sys
import threading
import time

from window_helpers import PATIENCE

from forcelab.errors import InputError
from forcelab.gui.jobs import Jobs


def steps(count=3, result="done", began=None):
    """A job of some steps that tells in which thread it began."""
    if began is not None:
        began.append(threading.current_thread())
    yield from range(count)
    return result


def endless(began, closed):
    """A job that goes on until it is closed, and tells in which thread it began and was closed."""
    began.append(threading.current_thread())
    try:
        while True:
            yield None
            time.sleep(0.001)
    finally:
        closed.append(threading.current_thread())


def test_a_job_works_in_another_thread_and_answers_in_this_one(jobs, until):
    began, answers = [], []
    job = jobs.run(
        steps(began=began), lambda result: answers.append((result, threading.current_thread()))
    )
    until(lambda: answers)
    assert answers == [("done", threading.main_thread())]
    assert began[0] is not threading.main_thread()
    assert not job.running


def test_a_job_is_busy_until_its_result_is_delivered(jobs, until):
    answers = []
    job = jobs.run(steps(), answers.append, key="run")
    end = time.monotonic() + PATIENCE
    while job.running and time.monotonic() < end:
        time.sleep(0.001)
    time.sleep(0.05)  # its thread has nothing left to do; this one has not been told
    assert (jobs.busy, answers) == (("run",), [])
    until(lambda: answers)
    assert jobs.busy == ()


def test_progress_comes_in_order_and_before_the_result(jobs, until):
    messages, listener = [], threading.Semaphore(0)

    def job():
        for step in range(5):
            yield step
            assert listener.acquire(timeout=PATIENCE)
        return "done"

    def note_step(step):
        messages.append(step)
        listener.release()

    jobs.run(job(), messages.append, progress=note_step)
    until(lambda: "done" in messages)
    assert messages == [0, 1, 2, 3, 4, "done"]


def test_only_the_newest_progress_waits_for_a_busy_window(jobs, until):
    messages = []
    job = jobs.run(steps(1000), lambda _: messages.append("done"), progress=messages.append)
    while job.running:
        time.sleep(0.001)
    until(lambda: "done" in messages)
    assert messages == [999, "done"]


def test_a_cancelled_job_stops_and_delivers_nothing(jobs, until):
    messages, began, closed = [], [], []
    job = jobs.run(endless(began, closed), messages.append, messages.append, key="slow")
    until(lambda: began)
    assert jobs.busy == ("slow",)
    job.cancel()
    until(lambda: not job.running and not jobs.busy)
    assert messages == []
    assert closed == began


def test_the_newest_of_a_key_wins(jobs, until):
    messages, began, may_end = [], [], threading.Event()

    def held(number):
        began.append(number)
        may_end.wait(PATIENCE)
        yield

    for number in range(5):
        jobs.run(held(number), lambda _, n=number: messages.append(n), key="view")
    last = jobs.run(steps(result="last"), messages.append, key="view")
    may_end.set()
    until(lambda: messages)
    assert messages == ["last"]
    assert not last.running
    # The first had begun; the others were replaced while they waited and never did.
    assert began in ([], [0])


def test_an_older_job_that_ended_before_it_was_asked_again_is_dropped_too(jobs, until):
    messages = []
    old = jobs.run(steps(result="old"), messages.append, key="view")
    while old.running:
        time.sleep(0.001)
    jobs.run(steps(result="new"), messages.append, key="view")
    until(lambda: "new" in messages)
    assert messages == ["new"]


def test_jobs_of_one_key_share_a_thread_and_never_overlap(jobs, until):
    working, most, messages = [], [], []

    def job():
        working.append(1)
        most.append(len(working))
        try:
            for _ in range(3):
                time.sleep(0.002)
                yield None
        finally:
            working.pop()

    for _ in range(10):
        jobs.run(job(), messages.append, key="view")
        time.sleep(0.003)
    until(lambda: messages)
    assert max(most) == 1


def test_jobs_of_different_keys_run_side_by_side(jobs, until):
    meeting, messages = threading.Barrier(2, timeout=PATIENCE), []

    def job():
        yield None
        meeting.wait()
        return "met"

    jobs.run(job(), messages.append, key="one")
    jobs.run(job(), messages.append, key="two")
    until(lambda: len(messages) == 2)
    assert messages == ["met", "met"]


def test_jobs_without_a_key_do_not_replace_each_other(jobs, until):
    messages = []
    for number in range(4):
        jobs.run(steps(result=number), messages.append)
    until(lambda: len(messages) == 4)
    assert sorted(messages) == [0, 1, 2, 3]


def failing(error):
    yield 1
    raise error


def test_a_failure_the_coder_can_mend_reaches_who_asked(jobs, until):
    messages = []
    jobs.run(failing(InputError("Choose a shorter span.")), messages.append, messages.append)
    until(lambda: messages)
    assert [str(error) for error in messages] == ["Choose a shorter span."]


def test_where_nobody_takes_care_the_sentence_is_told(jobs, until):
    messages = []
    jobs.trouble.connect(messages.append)
    jobs.run(failing(InputError("Choose a shorter span.")), messages.append)
    until(lambda: messages)
    assert messages == ["Choose a shorter span."]


def test_a_fault_of_the_program_is_reported_besides(jobs, until, monkeypatch):
    faults, messages = [], []
    monkeypatch.setattr(sys, "excepthook", lambda *what: faults.append(what))
    jobs.run(failing(ZeroDivisionError("oh")), messages.append, messages.append)
    until(lambda: messages)
    assert [type(error) for error in messages] == [ZeroDivisionError]
    [(kind, error, trace)] = faults
    assert (kind, error) == (ZeroDivisionError, messages[0])
    assert trace is not None


def test_a_fault_while_cleaning_up_is_reported_even_after_a_cancel(jobs, until, monkeypatch):
    faults, messages, began = [], [], []
    monkeypatch.setattr(sys, "excepthook", lambda *what: faults.append(what))

    def untidy():
        began.append(None)
        try:
            while True:
                yield None
                time.sleep(0.001)
        finally:
            raise OSError("cannot clean up")

    job = jobs.run(untidy(), messages.append, messages.append)
    until(lambda: began)
    job.cancel()
    until(lambda: faults)
    assert messages == []
    assert str(faults[0][1]) == "cannot clean up"


def test_an_error_in_an_answer_leaves_the_jobs_working(jobs, until, monkeypatch):
    faults, messages = [], []
    monkeypatch.setattr(sys, "excepthook", lambda *what: faults.append(what[0]))
    jobs.run(steps(), lambda _: 1 / 0)
    jobs.run(steps(), messages.append)
    until(lambda: messages and faults)
    assert faults == [ZeroDivisionError]


def test_closing_ends_all(app, until):
    jobs, messages, began, closed = Jobs(), [], [], []
    running = [jobs.run(endless(began, closed), messages.append, key=str(i % 3)) for i in range(9)]
    until(lambda: {thread.name for thread in began} == {"forcelab 0", "forcelab 1", "forcelab 2"})
    assert jobs.close(PATIENCE)
    app.processEvents()
    assert messages == []
    assert sorted(map(id, closed)) == sorted(map(id, began))
    assert not any(job.running for job in running)
    assert not [t for t in threading.enumerate() if t.name.startswith("forcelab")]


def test_what_is_asked_after_closing_is_cleaned_up_and_not_done(app, until):
    jobs, messages, began = Jobs(), [], []
    jobs.close()
    job = jobs.run(steps(began=began), messages.append)
    until(lambda: not job.running)
    app.processEvents()
    assert (messages, began) == ([], [])


def test_closing_does_not_wait_for_ever_for_a_job_that_never_yields(app):
    release, messages = threading.Event(), []

    def stubborn():
        release.wait()
        yield None

    jobs = Jobs()
    jobs.run(stubborn(), messages.append)
    assert not jobs.close(patience=0.1)
    release.set()


def test_a_window_that_is_gone_is_not_told(app, until):
    import shiboken6

    release = threading.Event()

    def late():
        release.wait(PATIENCE)
        return "too late"
        yield

    jobs = Jobs()
    job = jobs.run(late(), print)
    shiboken6.delete(jobs)
    release.set()
    until(lambda: not job.running)


def test_busy_tells_what_works(jobs, until):
    release = threading.Event()

    def held():
        release.wait(PATIENCE)
        yield None

    jobs.run(held(), lambda _: None, key="scalogram")
    assert jobs.busy == ("scalogram",)
    release.set()
    until(lambda: not jobs.busy)
