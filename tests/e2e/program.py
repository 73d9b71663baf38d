"""The real program, driven from outside by keys and mouse, and what it has stored."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from window_helpers import PATIENCE

from forcelab.project import Project

DRIVER = Path(__file__).with_name("driver.py")
#: Key codes of PC keyboards: where newer keymaps have a function key with Alt as well as without,
#: xdotool presses it with Alt if it is asked for by name.
FUNCTION_KEYS = {f"F{number}": str(66 + number) for number in range(1, 11)}


class Program:
    """The running program."""

    def __init__(self, arguments, environment, display=None):
        self.display = display
        self.process = subprocess.Popen(
            [sys.executable, str(DRIVER), *map(str, arguments)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.answer() == "ready"

    def answer(self):
        line = self.process.stdout.readline()
        assert line, self.process.stderr.read()
        return json.loads(line)

    def ask(self, what, **arguments):
        self.process.stdin.write(json.dumps({"ask": what, **arguments}) + "\n")
        self.process.stdin.flush()
        return self.answer()

    def until(self, condition, what="the program"):
        """Wait until the program's state is as expected."""
        deadline = time.monotonic() + PATIENCE
        while True:
            state = self.ask("state")
            if condition(state):
                return state
            assert time.monotonic() < deadline, (what, state)
            time.sleep(0.02)

    def xdotool(self, *words):
        environment = {**os.environ, "DISPLAY": self.display}
        subprocess.run(["xdotool", *map(str, words)], env=environment, check=True)

    def focus(self):
        """What a window manager does: give the window the keyboard."""
        window = self.until(lambda state: state["settled"])["window"]
        self.xdotool("windowfocus", "--sync", window)

    def press(self, *keys, times=1):
        """Press keys one after the other, each as often as said."""
        for key in keys:
            code = "+".join(FUNCTION_KEYS.get(part, part) for part in key.split("+"))
            self.xdotool("key", "--delay", 8, "--repeat", times, code)
        return self.ask("state")

    def move(self, x, y):
        self.xdotool("mousemove", "--sync", x, y)

    def click(self, spot, button=1):
        self.move(*spot)
        self.xdotool("click", button)
        return self.ask("state")

    def drag(self, start, end, button=1):
        self.move(*start)
        self.xdotool("mousedown", button)
        for share in (0.1, 0.5, 0.9, 1.0):
            self.move(*(round(a + (b - a) * share) for a, b in zip(start, end, strict=True)))
        self.ask("state")
        self.xdotool("mouseup", button)
        return self.ask("state")

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()


def stored_segments(path, name, author="Ada"):
    """The segments of a demonstration in the store, as plain rounded values."""
    with Project.open(path) as project:
        info = next(info for info in project.demonstrations.infos() if info.name == name)
        segments = project.tracks.get(info.id, author).segments
    return [(round(s.start, 4), round(s.end, 4), s.action) for s in segments]


def wait_for_stored_segments(path, name, holds):
    """What is stored as soon as it is as it should be: keys and mouse take their time."""
    deadline = time.monotonic() + PATIENCE
    while not holds(found := stored_segments(path, name)):
        assert time.monotonic() < deadline, found
        time.sleep(0.02)
    return found
