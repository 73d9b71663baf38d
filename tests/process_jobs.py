"""Jobs for another process, which imports them from here."""

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.process import interruptible


def counted(total, pause=0.0):
    for number in range(total):
        yield Progress(number + 1, total, f"process {os.getpid()}")
        time.sleep(pause)
    return {"sum": sum(range(total)), "process": os.getpid(), "cpu": time.process_time()}


def refused():
    yield Progress(1, 2, "before")
    raise InputError("Nothing is labelled yet; label at least two actions first.")


def broken():
    yield Progress(1, 2, "before")
    return {}["no such key"]


def ending_process(*_):
    """Of a function, not a job, the process ends at once."""
    os.kill(os.getpid(), signal.SIGSEGV)


def untellable():
    yield Progress(1, 2, "before")
    return lambda: None


def silent(path=None, deaf=False):
    """Tells its process, then computes for ever without a word; deaf even to being asked to end."""
    if deaf:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    yield Progress(1, 2, f"process {os.getpid()}")
    if path is not None:
        with interruptible():
            try:
                Path(path).write_text("half")
                for _ in range(6000):  # a signal just before a sleep is heard after it
                    time.sleep(0.01)
            finally:
                Path(path).unlink()
    matrix = np.random.default_rng(0).normal(size=(6000, 6000))
    while True:
        np.linalg.svd(matrix)
    yield


def manners():
    yield Progress(1, 1, "looking")
    from threadpoolctl import threadpool_info

    np.ones((2, 2)) @ np.ones((2, 2))
    return {
        "nice": os.nice(0),
        "interrupt": signal.getsignal(signal.SIGINT) is signal.SIG_IGN,
        "blas": [i["num_threads"] for i in threadpool_info() if i["user_api"] == "blas"],
        "main thread": threading.current_thread() is threading.main_thread(),
    }
