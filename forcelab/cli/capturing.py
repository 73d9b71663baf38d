"""``forcelab capture``."""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from forcelab.capture.camera import open_cameras
from forcelab.capture.device import Device
from forcelab.capture.devices import devices_named
from forcelab.capture.optoforce_device import counting, uncalibrated
from forcelab.capture.reader import RecorderState
from forcelab.capture.recorder import Recorder
from forcelab.capture.save import CAPTURES, Recovered, SavedRecording, recover, unfinished
from forcelab.cli import capture_listing
from forcelab.cli.newcomers import telling_newcomers
from forcelab.cli.options import WrongWordError
from forcelab.cli.output import json_text, printable
from forcelab.cli.recognising_live import Recognition, told
from forcelab.errors import InputError
from forcelab.live.recognition import LATENCY, LiveRecognition
from forcelab.project import Project
from forcelab.recognition.storage import load
from forcelab.text import counted

#: Seconds between two looks at how it goes, and at what a recogniser makes of it.
LOOK, BLOCK = 0.1, 0.02


def run(arguments: argparse.Namespace) -> int:
    """List what is plugged in, recover what was not finished, or record."""
    if arguments.list:
        capture_listing.run(arguments)
        return 0
    if arguments.project is None:
        raise WrongWordError("Name the project to record into, or give --list.")
    if arguments.recover:
        return _recover(arguments.project, arguments.json)
    _check(arguments)
    with telling_newcomers(arguments.project):
        return _record(arguments)


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what cannot be recorded."""
    if not arguments.device:
        raise WrongWordError(
            "Name what to record, such as --device optoforce:/dev/ttyACM0; --list shows what is "
            "plugged in."
        )
    if not arguments.task:
        raise WrongWordError("Say of which task the recording is (--task).")
    if arguments.seconds is not None and not 0 < arguments.seconds < math.inf:
        raise WrongWordError(f"--seconds must be positive, not {arguments.seconds:g}.")
    if arguments.latency is not None and arguments.recogniser is None:
        raise WrongWordError("--latency is that of a recogniser; name one with --recogniser FILE.")


def _record(arguments: argparse.Namespace) -> int:
    """Record into a project, and recognise meanwhile where that is asked for; 1 if that failed."""
    recogniser = None if arguments.recogniser is None else load(arguments.recogniser)
    devices = devices_named(arguments.device)
    live = recognition = None
    recorder = Recorder(arguments.project, devices, open_cameras(arguments.camera))
    with _telling_where(recorder), recorder:
        if recogniser is not None:
            latency = LATENCY if arguments.latency is None else arguments.latency
            name = arguments.recogniser.stem
            live = LiveRecognition(recogniser, name, latency, recorder, devices)
        _ready(arguments.project)
        for sentence in _warnings(devices, live):
            _say(sentence)
        name = recorder.start(arguments.task, arguments.name)
        if live is not None:
            live.begin(firsts=recorder.firsts)
            recognition = Recognition(live, sys.stderr if arguments.json else sys.stdout)
        _say(f"Recording '{name}'; Ctrl+C stops and keeps it.")
        try:
            _watch(recorder, arguments.seconds, recognition)
        except KeyboardInterrupt:  # that is how a recording without an end is ended
            pass
        finally:
            _clear()
        state = recorder.state()
        recorder.end()
        if recognition is not None:
            recognition.finish()
        kept = recorder.stop()
        remarks = recorder.remarks()
    for sentence in remarks:
        _say(sentence)
    recognised = None if recognition is None else recognition.keep(arguments.project, kept)
    trouble = "" if recognition is None else recognition.trouble
    if trouble:
        _say(trouble)
    if arguments.json:
        more = {} if recognised is None else {"recognised": recognised}
        print(json_text(_plain(kept, state) | more))
    else:
        print(_told(kept, state))
        if recognised is not None:
            print(printable(told(recognised)))
    return int(bool(trouble))


@contextmanager
def _telling_where(recorder: Recorder) -> Iterator[None]:
    """Say where the recording is, too, that the project's disk did not take."""
    try:
        yield
    except InputError as error:
        if recorder.saved is None:
            raise
        raise InputError(
            f"{error} All of the recording is in '{recorder.saved}'; when that is mended, move it "
            f"to '{recorder.path / CAPTURES}' and give --recover."
        ) from error


def _warnings(devices: Sequence[Device], live: LiveRecognition | None) -> list[str]:
    """What is to be known before it is recorded: forces without a unit, or not the learnt one."""
    found = [uncalibrated(device.name) for device in devices if counting(device)]
    return found if live is None else [*found, *live.remarks]


def _ready(path: Path) -> None:
    """Make the project where there is none, and tell of recordings that were not finished."""
    if Project.vacant(path):
        Project.create(path).close()
    left = unfinished(path)
    if left:
        _say(
            f"{counted(len(left), 'unfinished recording')} of an earlier start "
            f"{'is' if len(left) == 1 else 'are'} in '{path}'; 'forcelab capture {path} --recover' "
            f"makes demonstrations of what there is."
        )


def _watch(recorder: Recorder, seconds: float | None, recognition: Recognition | None) -> None:
    """Wait until so many seconds are recorded, and show how it goes."""
    until = time.monotonic() + (math.inf if seconds is None else seconds)
    shown = -math.inf
    while (left := until - time.monotonic()) > 0:
        time.sleep(min(LOOK if recognition is None else BLOCK, left))
        if recognition is not None:
            recognition.look()
        if time.monotonic() - shown < LOOK:
            continue
        shown = time.monotonic()
        for sentence in recorder.remarks():
            _say(sentence)
        if sys.stderr.isatty():
            now = "" if recognition is None or not recognition.now else f"{recognition.now}  |  "
            sys.stderr.write(f"\r\x1b[K{printable(now + _line(recorder.state()))}")
            sys.stderr.flush()


def _line(state: RecorderState) -> str:
    """How it goes, in one line."""
    parts = [f"{state.seconds:.1f} s"]
    for device in state.devices:
        words = f"{counted(device.samples, 'sample')}, {device.lost} lost"
        if math.isfinite(device.residual):
            words += f", clock {1000 * device.residual:.2f} ms"
        parts.append(" ".join([words, *(f"[{alarm}]" for alarm in device.alarms)]))
    for camera in state.cameras:
        words = f"{counted(camera.frames, 'frame')}, {camera.dropped} dropped"
        parts.append(" ".join([words, *(f"[{alarm}]" for alarm in camera.alarms)]))
    return "  |  ".join(parts)


def _clear() -> None:
    """Remove the line that shows how it goes."""
    if sys.stderr.isatty():
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()


def _say(sentence: str) -> None:
    """Say something that is no result."""
    _clear()
    print(printable(sentence), file=sys.stderr, flush=True)


def _told(kept: SavedRecording, state: RecorderState) -> str:
    """The result for people."""
    lost = sum(device.lost for device in state.devices)
    words = [counted(kept.samples, "sample"), f"{lost} lost"]
    words += [f"{counted(c.frames, 'frame')}, {c.dropped} dropped" for c in state.cameras]
    if kept.precision:
        words.append(f"stamps to {1000 * kept.precision:.2f} ms")
    lines = [printable(remark) for remark in kept.remarks]
    name = printable(kept.added.name)
    return "\n".join([*lines, f"'{name}': {kept.seconds:.2f} s, {', '.join(words)}."])


def _plain(kept: SavedRecording, state: RecorderState) -> dict[str, Any]:
    """The same as plain values."""
    return _kept(kept) | {
        "devices": [
            {
                "device": device.name,
                "channels": [channel.name for channel in device.channels],
                "samples": device.samples,
                "lost": device.lost,
                "saturated": device.saturated,
                "rate": device.rate,
                "clock": {
                    "offset": _finite(device.offset),
                    "rate": _finite(device.clock_rate),
                    "residual": _finite(device.residual),
                },
            }
            for device in state.devices
        ],
        "cameras": [
            {"camera": camera.name, "frames": camera.frames, "dropped": camera.dropped}
            for camera in state.cameras
        ],
    }


def _kept(kept: SavedRecording) -> dict[str, Any]:
    """A demonstration that was kept, as plain values."""
    return {
        "id": kept.added.id,
        "name": kept.added.name,
        "status": kept.added.status,
        "samples": kept.samples,
        "seconds": kept.seconds,
        "remarks": list(kept.remarks),
    }


def _finite(value: float) -> float | None:
    """JSON has no NaN."""
    return value if math.isfinite(value) else None


def _recover(path: Path, json: bool) -> int:
    """Make demonstrations of unfinished recordings; 1 where one that holds anything cannot be."""
    Project.open(path).close()
    found = recover(path)
    if json:
        print(json_text({"recovered": [_recovery(one) for one in found]}))
    else:
        for one in found:
            if one.kept is None:
                print(printable(one.trouble))
                continue
            for remark in one.kept.remarks:
                print(printable(remark))
            print(f"{printable(one.kept.added.name)}: {one.kept.seconds:.2f} s recovered.")
        good = sum(one.kept is not None for one in found)
        print(f"{counted(len(found), 'unfinished recording')}: {good} recovered.")
    return int(any(one.kept is None and not one.removed for one in found))


def _recovery(one: Recovered) -> dict[str, Any]:
    """What became of an unfinished recording, as plain values."""
    kept = {"trouble": one.trouble} if one.kept is None else _kept(one.kept)
    return {"journal": str(one.path)} | kept
