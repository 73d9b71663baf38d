"""Work for other processes, which import it from here: without pytest, which takes its time."""

import os
import signal
import time
from pathlib import Path

from forcelab.errors import InputError


def doubled(number):
    time.sleep(0.05 * (number % 2))  # the odd ones take longer
    return 2 * number, os.getpid()


def refused(number):
    if number == 2:
        raise InputError("Number 2 cannot be done; leave it out.")
    return number


def read_missing_file(number):
    return Path(f"missing {number}").read_bytes()


def interrupting_itself(number):
    signal.raise_signal(signal.SIGINT)
    return number


def lasting(number):
    time.sleep(30)
    return number


def killed(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def killed_once(item):
    number, marker = item
    if number == 2 and not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def waiting(_):
    os.write(1, f"{os.getpid()}\n".encode())  # at once: another process writes as well
    time.sleep(60)
