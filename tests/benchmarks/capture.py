"""What recording costs, what it loses, and how true its stamps are, through real pseudo-terminals.

Two virtual DAQs at 1 kHz, the clock of one 200 ppm fast and of the other 200 ppm slow, and a camera
are recorded for minutes. Each reading tells when it was taken, so that the demonstration that comes
of it can be held against the truth, sample by sample.
"""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Generator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from forcelab.capture.device_names import parse_device
from forcelab.capture.recorder import Recorder
from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure.rows import Row, Table, with_front
from forcelab.project import Project
from forcelab.video.codecs import opencv
from tests.capture.virtual_devices import FaultyOptoForce, VirtualCamera

Real = NDArray[np.float64]

#: Seconds of the recording, and of the quick one.
LONG, QUICK = 600.0, 30.0
RATE, PPM = 1000.0, (200.0, -200.0)
CAMERA = (30.0, 640, 480)
#: Milliseconds that the first axis counts before it begins anew; the second counts how often.
LAP = 8000
#: Seconds between two looks at the recorder, as the window looks; share of the recording that is
#: left out of the memory, as what is kept for views fills at first, in seconds at most.
LOOK, FILLING, FILLS = 0.2, 0.3, 90.0
#: Share of the recording at its beginning and end between which stamps may drift.
EDGE = 0.1


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Table]:
    """Record for ten minutes, with `quick` for half a minute."""
    row = yield from recording(QUICK if quick else LONG)
    return Table(
        "Capture",
        "error of the stamps, p99 (s)",
        "CPU s per s (share of a core)",
        with_front([row]),
    )


def recording(seconds: float) -> Generator[Progress, None, Row]:
    """Record for so many seconds and hold what was kept against the truth.

    The error is how far stamps are off when their samples were taken, at p99 over both DAQs, the
    time that of this process without the virtual DAQs' threads. Beside them: samples that are
    missing, frames that are, by how much the resident memory grew once what is kept for views is
    full, and by how much the stamps' error changed from the beginning to the end.
    """
    if not (hasattr(time, "pthread_getcpuclockid") and Path("/proc/self/statm").exists()):
        raise InputError("What recording costs is told by Linux alone; measure it there.")
    with tempfile.TemporaryDirectory(prefix="forcelab-capture-") as folder, ExitStack() as stack:
        path = Path(folder) / "measured.forcelab"
        Project.create(path).close()
        before = set(threading.enumerate())
        daqs = [
            FaultyOptoForce(_counting, RATE, clock_ppm=ppm, serial=f"MEAS{number:04}")
            for number, ppm in enumerate(PPM)
        ]
        for daq in daqs:
            stack.enter_context(daq)
        others = [thread for thread in threading.enumerate() if thread not in before]
        opencv()  # to load it stops every thread, as no recording does: who opens a camera has it
        devices = [parse_device(f"optoforce:{daq.port}") for daq in daqs]
        cameras = [("camera", VirtualCamera(*CAMERA))]
        with Recorder(path, devices, cameras) as recorder:
            recorder.start("measured")
            run = yield from _watched(recorder, seconds, others)
            name = recorder.stop().added.name
        begun = [daq.begun or 0.0 for daq in daqs]
        return _row(path, name, begun, run, seconds)


@dataclass(frozen=True)
class _Run:
    """What was seen while it was recorded."""

    cpu: float
    resident: Real  # (n, 2): seconds since the beginning, bytes
    frames: int
    dropped: int


def _watched(
    recorder: Recorder, seconds: float, others: list[threading.Thread]
) -> Generator[Progress, None, _Run]:
    """Let it record, looking at it now and then as a window does."""
    resident = []
    begun, worked = time.monotonic(), _worked(others)
    while (passed := time.monotonic() - begun) < seconds:
        yield Progress(int(passed), int(seconds), "recording")
        resident.append((passed, _resident()))
        recorder.state()
        time.sleep(LOOK)
    cpu = (_worked(others) - worked) / passed
    (camera,) = recorder.state().cameras
    return _Run(cpu, np.array(resident), camera.frames, camera.dropped)


def _worked(others: list[threading.Thread]) -> float:
    """CPU seconds of this process so far, without those of some threads."""
    clocks = [time.pthread_getcpuclockid(t.ident) for t in others if t.ident is not None]
    return time.process_time() - sum(time.clock_gettime(clock) for clock in clocks)


def _resident() -> int:
    """Bytes of memory that the process has at present."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def _counting(times: Real) -> NDArray[np.int64]:
    """Readings that say when they were taken: milliseconds of the device's clock, in two parts."""
    counts = np.round(times * 1000).astype(np.int64)
    return np.stack([counts % LAP, counts // LAP, np.full_like(counts, 5)], axis=1)


def _row(path: Path, name: str, begun: list[float], run: _Run, seconds: float) -> Row:
    """What became of it, beside the truth."""
    with Project.open(path) as project:
        demonstration = project.demonstrations.load(name)
        stamps = project.media.stamps(demonstration.id)
    assert stamps is not None
    host = np.asarray(demonstration.times) + float(stamps["start"])
    signals = np.asarray(demonstration.signals)
    errors, lost = [], 0
    for i, (start, ppm) in enumerate(zip(begun, PPM, strict=True)):
        ticks = stamps[f"ticks_{i}"]
        lost += int(ticks[-1] - ticks[0]) + 1 - len(ticks)
        errors.append(_off(host, signals[:, 3 * i : 3 * i + 3], start, ppm))
    full = run.resident[run.resident[:, 0] >= min(FILLING * seconds, FILLS), 1]
    off = np.concatenate([error for _, error in errors])
    return Row(
        "2 DAQs and a camera",
        f"{RATE:.0f} Hz each, clocks {PPM[0]:+.0f} and {PPM[1]:+.0f} ppm, {CAMERA[0]:.0f} frames/s",
        f"{seconds:.0f} s through pseudo-terminals",
        "when the samples were taken",
        error=float(np.percentile(np.abs(off), 99)),
        seconds=run.cpu,
        spread=0.0,
        peak_bytes=int(run.resident[:, 1].max()),
        further={
            "lost samples": float(lost),
            "dropped frames": float(run.dropped),
            "drift (ms)": 1e3 * max(abs(_drift(*course)) for course in errors),
            "memory grown (MB)": float(full[-1] - full[0]) / 1e6,
            "memory swing (MB)": float(np.ptp(full)) / 1e6,
        },
    )


def _off(host: Real, signals: Real, begun: float, ppm: float) -> tuple[Real, Real]:
    """Stamps, and by how much each is off the truth, in seconds.

    The second DAQ's readings lie between two samples; what is mixed of two laps tells nothing.
    """
    count, lap = signals[:, 0], signals[:, 1]
    counted = np.isfinite(count) & (lap == np.round(lap)) & (count >= 0) & (count <= LAP - 1)
    truth = begun + (lap[counted] * LAP + count[counted]) / 1000.0 / (1.0 + 1e-6 * ppm)
    return host[counted], host[counted] - truth


def _drift(host: Real, off: Real) -> float:
    """By how much the error changed between the beginning and the end (s)."""
    edge = EDGE * (host[-1] - host[0])
    first, last = off[host < host[0] + edge], off[host > host[-1] - edge]
    return float(np.median(last) - np.median(first))
