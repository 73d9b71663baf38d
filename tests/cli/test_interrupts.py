"""Being told to stop ends a command as Ctrl+C does."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
from joblib import cpu_count

from forcelab.cli.interrupts import uninterrupted


def restore_signals():
    """Signals end what is started here also where the tests run under nohup, which ignores one."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def test_a_signal_ends_a_command_with_a_sentence_and_nothing_half_done(tmp_path):
    command = [sys.executable, "-m", "forcelab", "simulate", "--task", "LEGO", "--count", "6"]
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    running = subprocess.Popen(
        [*command, "--seed", "3", "--out", "new.forcelab", "--no-video"],
        cwd=tmp_path,
        env=os.environ | {"TMPDIR": str(scratch)},
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=restore_signals,  # noqa: PLW1509 - no thread of the tests holds what it needs
    )
    process, deadline = psutil.Process(running.pid), time.monotonic() + 60
    # Until it shares the work; one processor shares with none.
    begun = process.children if cpu_count() > 1 else lambda: any(scratch.iterdir())
    while not begun() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.2)
    running.send_signal(signal.SIGTERM)
    _, result = running.communicate(timeout=60)
    assert result == "forcelab: stopped; nothing was left half done.\n"
    assert running.returncode == 128 + signal.SIGTERM
    assert list(tmp_path.rglob("*")) == [scratch]


def test_what_must_not_be_cut_is_done_before_ctrl_c_is_heard():
    done = []
    before = signal.getsignal(signal.SIGINT)

    def interrupted():
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            done.append("all")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done == ["all"]
    assert signal.getsignal(signal.SIGINT) is before
