"""Completion, as real shells do it at their prompt."""

import io
import os
import pty
import select
import shutil
import subprocess
import time
from contextlib import closing, redirect_stdout

import pytest

from forcelab.cli import main

#: How a shell starts without anybody's settings, and what makes Ctrl+T show the line so far.
#: A key that others begin with, such as Ctrl+X, is waited after for half a second.
STARTS = {
    "bash": (
        ["bash", "--norc", "--noprofile", "-i"],
        r"""bind -x '"\C-t": printf "<<%s>>" "$READLINE_LINE"'; source {folder}/bash""",
    ),
    "zsh": (
        ["zsh", "-f", "-i"],
        r"""show() {{ print -rn -- "<<$BUFFER>>" }}; zle -N show; bindkey "^T" show
fpath=({folder} $fpath); autoload -Uz compinit; compinit -D -u""",
    ),
}
#: What is typed, and what it is after the Tab key.
COMPLETED = {
    "forcelab eva": "forcelab evaluate ",
    "forcelab evaluate l": "forcelab evaluate lab.forcelab/",
    "forcelab evaluate lab.forcelab --test-t": "forcelab evaluate lab.forcelab --test-task ",
    "forcelab plan p d --no-phase --preset b": "forcelab plan p d --no-phase --preset best ",
    "forcelab import p pull.csv r": r"forcelab import p pull.csv right\ hand.csv ",
    r"forcelab import p right\ h": r"forcelab import p right\ hand.csv ",
    "forcelab evaluate p --task pu": "forcelab evaluate p --task pu",  # a task is no file
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a project, recordings and the scripts of all shells."""
    folder = tmp_path_factory.mktemp("completion")
    for shell, name in (("bash", "bash"), ("zsh", "_forcelab"), ("fish", "fish")):
        with redirect_stdout(io.StringIO()) as script:
            assert main(["completion", shell]) == 0
        (folder / name).write_text(script.getvalue(), "utf-8")
    (folder / "lab.forcelab").mkdir()
    for name in ("pull.csv", "right hand.csv"):
        (folder / name).touch()
    return folder


class Prompt:
    """A shell on a terminal of its own."""

    def __init__(self, shell, folder):
        words, setup = STARTS[shell]
        self.leader, follower = pty.openpty()
        self.process = subprocess.Popen(
            words,
            cwd=folder,
            stdin=follower,
            stdout=follower,
            stderr=follower,
            start_new_session=True,
            env={"PATH": os.environ["PATH"], "HOME": str(folder), "TERM": "dumb"},
        )
        os.close(follower)
        self.type(f"{setup.format(folder=folder)}; echo read''y\n")
        self.read_until("ready")

    def type(self, text):
        os.write(self.leader, text.encode())

    def read_until(self, mark):
        shown, deadline = "", time.monotonic() + 60
        while mark not in shown:
            ready, _, _ = select.select([self.leader], [], [], deadline - time.monotonic())
            assert ready, shown
            shown += os.read(self.leader, 65536).decode(errors="replace")
        return shown

    def complete(self, line):
        """The line after the Tab key; it is cleared again."""
        self.type(f"{line}\t\x14")
        shown = self.read_until(">>")
        self.type("\x15")
        return shown.rpartition("<<")[2].partition(">>")[0]

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self.leader)


@pytest.mark.parametrize("shell", STARTS)
def test_tab_completes_commands_options_choices_and_files(shell, folder):
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    with closing(Prompt(shell, folder)) as prompt:
        assert {line: prompt.complete(line) for line in COMPLETED} == COMPLETED


def test_fish_offers_commands_options_choices_and_files_with_their_help(folder):
    if shutil.which("fish") is None:
        pytest.skip("fish is not installed")
    lines = [
        "forcelab eva",
        "forcelab evaluate l",
        "forcelab train p --classifier extra",
        "forcelab plan p d --no-phase --preset b",
        "forcelab import p pull.csv r",
        "forcelab evaluate p --task pu",
    ]
    asked = "".join(f"; complete -C '{line}'; echo ---" for line in lines)
    done = subprocess.run(
        ["fish", "--no-config", "-c", f"source {folder}/fish{asked}"],
        cwd=folder,
        env={"PATH": os.environ["PATH"], "HOME": str(folder)},
        capture_output=True,
        text=True,
        check=True,
    )
    offered = [answer.strip().split("\t")[0] for answer in done.stdout.split("---\n")]
    assert offered == ["evaluate", "lab.forcelab/", "extra-trees", "best", "right hand.csv", "", ""]
    assert "evaluate\tRecognise each demonstration" in done.stdout
