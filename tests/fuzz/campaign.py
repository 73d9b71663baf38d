"""Commands on mutated files, each in a process of its own with bounds on memory and time.

What a hostile file may do at most: end a command with a sentence and a status of 1. A traceback, a
signal, a bound reached or a change outside the file's own folder is a finding.
"""

import argparse
import hashlib
import multiprocessing
import os
import random
import resource
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

MEMORY = 2 * 2**30
"""Bytes that a command may take beside what the parent holds."""
SECONDS = 60


W = TypeVar("W")


@dataclass(frozen=True)
class Campaign(Generic[W]):
    """What is mutated, such as "archive", and how.

    `prepare` makes what is whole in a folder; `mutate` writes a mutation of that into the folder of
    a case, by chance, and gives the command lines to run on it.
    """

    what: str
    prepare: Callable[[Path], W]
    mutate: Callable[[W, Path, random.Random], Sequence[Sequence[str]]]


@dataclass(frozen=True)
class Finding:
    """One case that did more than refuse its file."""

    case: str
    why: str


def contents(folder: Path) -> dict[str, str]:
    """What lies below a folder: each path with its kind and, of files and links, the content."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_symlink():
            what = f"link {path.readlink()}"
        elif path.is_file():
            what = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            what = "folder"
        found[str(path.relative_to(folder))] = what
    return found


def fault_of_commands(commands: Sequence[Sequence[str]], output: Path) -> str | None:
    """Run command lines one after another in a child process; why that is a finding, or None.

    The child may take MEMORY bytes and SECONDS; what it prints goes to the file `output`.
    """
    child = multiprocessing.get_context("fork").Process(target=_run, args=(commands, output))
    child.start()
    child.join(SECONDS)
    if child.exitcode is None:
        os.kill(child.pid, signal.SIGKILL)
        child.join()
        return f"still running after {SECONDS} s"
    printed = output.read_text("utf-8", "replace") if output.exists() else ""
    if "Traceback (most recent call last)" in printed:
        return "traceback: " + printed.strip().splitlines()[-1]
    return None if child.exitcode == 0 else f"ended with {child.exitcode}: {printed[-200:]}"


def _run(commands: Sequence[Sequence[str]], output: Path) -> None:
    from forcelab.cli import main

    handle = os.open(output, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(handle, 1)
    os.dup2(handle, 2)
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    limit = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    try:
        for command in commands:
            status = main(command)
            if status not in {0, 1}:
                print(f"{command} ended with status {status}", flush=True)
                os._exit(3)
    except BaseException:  # noqa: BLE001 - whatever escapes is what is looked for
        traceback.print_exc()
        os._exit(3)
    os._exit(0)


def findings(campaign: Campaign[W], count: int, seed: int, folder: Path) -> Iterator[Finding]:
    """Run so many cases, and yield those that did more than refuse their file.

    All of it happens in `folder`; canaries lie in it beside the folder of the case.
    """
    (folder / "whole").mkdir(parents=True)
    whole = campaign.prepare(folder / "whole")
    canaries = folder / "canaries"
    (canaries / "victim").mkdir(parents=True)
    (canaries / "victim" / "canary.txt").write_text("untouched\n", "utf-8")
    (canaries / "canary.mp4").write_bytes(b"untouched")
    before = contents(canaries)
    for number in range(count):
        if number and number % 500 == 0:
            print(f"{number} so far", file=sys.stderr, flush=True)
        name, place = f"{campaign.what} {number} of seed {seed}", folder / "case"
        place.mkdir()
        commands = campaign.mutate(whole, place, random.Random(f"{seed} {number}"))
        why = fault_of_commands(commands, folder / "output.txt")
        if contents(canaries) != before:
            yield Finding(name, "a canary beside the project was touched")
            return
        if why:
            yield Finding(name, why)
        _remove(place)


def run(description: str | None, campaign: Campaign[W]) -> None:
    """Run a campaign as the command line says, and print what it finds."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    number = 0
    with tempfile.TemporaryDirectory() as folder:
        for finding in findings(campaign, options.count, options.seed, Path(folder)):
            number += 1
            print(f"{finding.case}: {finding.why}", flush=True)
    print(f"{campaign.what}: {options.count} cases, {number} findings")


def _remove(folder: Path) -> None:
    for path in sorted(folder.rglob("*"), reverse=True):
        if path.is_dir() and not path.is_symlink():
            path.rmdir()
        else:
            path.unlink()
    folder.rmdir()
