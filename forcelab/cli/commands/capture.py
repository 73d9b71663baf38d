r"""Record a demonstration from sensors and cameras.

All devices are recorded on one clock into a project, which is created if need be, for
--seconds or until Ctrl+C. Samples are on the disk within 0.2 s: after a crash --recover
makes demonstrations of them. An unplugged device is waited for, and the time without it
is a gap. Each camera gives a video of its name, on the same clock.

A device is KIND:PORT?OPTION=VALUE&...; without PORT it is the only one of its kind:
  optoforce:PORT   rate, filter, calibration, serial
  text:PORT        baud, rate
  encoder:PORT     scale, unit, channel, rate, reverse
  netft:ADDRESS    an ATI Net F/T: rate; force and torque, counts a N and a Nm, where its
                   page does not say
  lsl:STREAM       a stream of the Lab Streaming Layer, by its sender's stamps, or of
                   texts, which become labels: source, dejitter
  replay:PROJECT   a demonstration as a device, over and over unless loop=no:
                   demonstration, loop
In PORT and VALUE write & as %26, ? as %3F and % as %25.

for example:
  forcelab capture --list
  forcelab capture lab.forcelab --task foam --seconds 20 --camera 0 \
      --device "optoforce:/dev/ttyACM0?calibration=left.toml" \
      --device "encoder:/dev/ttyUSB1?scale=0.01&unit=mm"
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, TextIO, TypeVar

from forcelab.capture.camera import open_cameras
from forcelab.capture.device import Device
from forcelab.capture.device_names import name_stream, parse_devices
from forcelab.capture.discovery import (
    LISTS_CAMERAS,
    FoundCamera,
    FoundPort,
    find_cameras,
    find_ports,
)
from forcelab.capture.lsl import FoundStream, find_streams
from forcelab.capture.optoforce import sends_raw_counts, uncalibrated_warning
from forcelab.capture.recorder import Recorder, RecorderState
from forcelab.capture.save import (
    CAPTURES,
    RecoveredRecording,
    SavedRecording,
    recover,
    unfinished_journals,
)
from forcelab.cli.interrupts import uninterrupted
from forcelab.cli.options import PROJECT, UsageError, add_file, add_json, add_task
from forcelab.cli.output import (
    clear_line,
    json_text,
    print_remark,
    printable,
    show_line,
    shows_progress,
    table,
)
from forcelab.cli.project_hints import hint_at_new_names
from forcelab.errors import InputError
from forcelab.live.label_outlet import LabelOutlet
from forcelab.live.recognition import (
    LATENCY,
    ClosedSegment,
    LiveRecognition,
    lost_track_sentence,
    track_summary,
)
from forcelab.project import Project
from forcelab.recognition.storage import load_recogniser
from forcelab.text import counted

NOTHING_FOUND = "No serial port and no camera is plugged in, or this user may not see them."
#: What is said where the system does not tell what cameras there are.
UNLISTED = "Cameras are not listed on this system; name one by its number, such as --camera 0."
#: Seconds between two looks at how it goes, and at what a recogniser makes of it.
STATUS_INTERVAL, RECOGNITION_INTERVAL = 0.1, 0.02


def list_devices(arguments: argparse.Namespace) -> None:
    """Print the serial ports, streams and cameras, and what they seem to be."""
    ports, streams, found_cameras = find_ports(), find_streams(), find_cameras()
    if arguments.json:
        print(json_text(_devices_json(ports, streams, found_cameras)))
        return
    if not ports and not streams and not found_cameras:
        print(NOTHING_FOUND if LISTS_CAMERAS else UNLISTED)
        return
    rows = [["what to say", "what it seems to be", "serial number", ""]]
    for port in ports:
        option = f"--device {port.device or f'KIND:{port.path}'}"
        rows.append([option, port.description, port.serial or "-", _access_text(port.usable)])
    for stream in streams:
        option = f"--device {printable(name_stream(stream))}"
        rows.append([option, printable(stream.description), "-", ""])
    for camera in found_cameras:
        option = f"--camera {camera.device.removeprefix('/dev/video')}"
        rows.append([option, camera.name, "-", _access_text(camera.usable)])
    print(table(rows))
    if not LISTS_CAMERAS:
        print(UNLISTED)
    if not all(port.usable for port in ports):
        print("\nPorts that are not yours: sudo usermod -a -G dialout $USER, then log in again.")
    if any(port.device is None for port in ports):
        print("\nKIND is optoforce, text or encoder.")


def _devices_json(
    ports: Iterable[FoundPort], streams: Iterable[FoundStream], cameras: Iterable[FoundCamera]
) -> dict[str, Any]:
    return {
        "ports": [
            {
                "port": port.path,
                "kind": port.kind,
                "device": port.device,
                "description": port.description,
                "serial": port.serial,
                "usb": None if port.usb is None else f"{port.usb[0]:04x}:{port.usb[1]:04x}",
                "usable": port.usable,
            }
            for port in ports
        ],
        "streams": [
            {
                "stream": stream.name,
                "device": name_stream(stream),
                "content": stream.content,
                "host": stream.host,
                "source": stream.source,
                "channels": stream.channels,
                "rate": stream.rate,
            }
            for stream in streams
        ],
        "cameras": [
            {"camera": camera.device, "name": camera.name, "usable": camera.usable}
            for camera in cameras
        ],
    }


def _access_text(usable: bool) -> str:
    """What stands behind a device that cannot be opened."""
    return "" if usable else "not yours to open"


ResultT = TypeVar("ResultT")


class LiveTrackRecorder:
    """A recogniser on a recording, which goes on and is saved whatever fails here.

    Segments go to `out` as they end, unless a line on the terminal shows them.
    """

    def __init__(self, live: LiveRecognition, out: TextIO | None) -> None:
        self._live = live
        self._out = None if shows_progress() else out
        self.trouble = ""

    @property
    def now(self) -> str:
        """The action of the latest label and its probability; empty while there is none."""
        return "" if self.trouble else self._live.now

    def look(self) -> None:
        """Take in what came since."""
        with uninterrupted():
            segments = self._tried(self._live.look)
        self._print(segments or ())

    def finish(self) -> None:
        """The recording has ended: take in the last of it."""
        self._print(self._tried(self._live.finish) or ())

    def keep(self, path: Path, saved: SavedRecording) -> dict[str, Any] | None:
        """Keep the track and tell what became of it as plain values; None where there is none."""
        return self._tried(partial(self._live.keep, path, saved))

    def _tried(self, do: Callable[[], ResultT]) -> ResultT | None:
        """What a step gives; None once the track is lost."""
        if self.trouble:
            return None
        try:
            return do()
        except Exception as error:  # noqa: BLE001 - logged, and told when the recording is kept
            self.trouble = lost_track_sentence(error)
        return None

    def _print(self, segments: Sequence[ClosedSegment]) -> None:
        """Print the segments that have ended, as long as anybody reads that."""
        try:
            for segment in segments if self._out is not None else ():
                sure = "" if math.isnan(segment.probability) else f"  {segment.probability:.2f}"
                start, end = (
                    max(at - self._live.begun, 0.0) for at in (segment.start, segment.end)
                )
                line = f"{start:7.2f} {end:7.2f}  {printable(segment.action)}{sure}"
                print(line, file=self._out, flush=True)
        except OSError:
            self._out = None


def recognition_summary(figures: dict[str, Any]) -> str:
    """A sentence on the figures that :meth:`LiveRecognition.keep` gives."""
    after = figures["after"]
    late = (
        "no label in time"
        if after["median"] is None
        else f"labels {after['median']:.2f} s after the force (99 %: {after['p99']:.2f} s)"
    )
    return f"{track_summary(figures)}, {late}, {100 * figures['cpu']:.1f} % of a core."


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("project", metavar="PROJECT", type=Path, nargs="?", help=PROJECT)
    group = parser.add_argument_group("what is recorded")
    group.add_argument(
        "--device",
        metavar="DEVICE",
        action="append",
        default=[],
        help="such as optoforce:/dev/ttyACM0; may be repeated",
    )
    group.add_argument(
        "--camera",
        metavar="N",
        action="append",
        default=[],
        help="number or device of a camera; may be repeated",
    )
    group = parser.add_argument_group("the demonstration")
    add_task(group, "task of the demonstration")
    group.add_argument("--name", metavar="NAME", help="its name (the task and the next number)")
    group.add_argument(
        "--seconds", metavar="N", type=float, help="how long to record (until Ctrl+C)"
    )
    group = parser.add_argument_group("live recognition")
    add_file(
        group,
        "--recogniser",
        "label the recording live with a recogniser that train wrote; its track is kept",
    )
    group.add_argument(
        "--latency",
        metavar="SECONDS",
        type=float,
        help="delay of labels behind the forces; the longer, the better they are (0.3)",
    )
    group.add_argument(
        "--lsl-out",
        metavar="NAME",
        help="send the labels to the Lab Streaming Layer as well: the stream NAME has the action "
        "when it changes, 'NAME probabilities' those of all",
    )
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument("--list", action="store_true", help="show what is plugged in")
    mode.add_argument(
        "--recover", action="store_true", help="make demonstrations of unfinished recordings"
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """List what is plugged in, recover what was not finished, or record."""
    if arguments.list:
        list_devices(arguments)
        return 0
    if arguments.project is None:
        raise UsageError("Name the project to record into, or give --list.")
    if arguments.recover:
        return _recover(arguments.project, arguments.json)
    devices = _check(arguments)
    with hint_at_new_names(arguments.project):
        return _record(arguments, devices)


def _check(arguments: argparse.Namespace) -> list[Device]:
    """Refuse what cannot be recorded; gives the devices."""
    if not arguments.device:
        raise UsageError(
            "Name what to record, such as --device optoforce:/dev/ttyACM0; --list shows what is "
            "plugged in."
        )
    devices = parse_devices(arguments.device)
    if not arguments.task:
        raise UsageError("Say of which task the recording is (--task).")
    if arguments.seconds is not None and not 0 < arguments.seconds < math.inf:
        raise UsageError(f"--seconds must be positive, not {arguments.seconds:g}.")
    if arguments.latency is not None and arguments.recogniser is None:
        raise UsageError("--latency is that of a recogniser; name one with --recogniser FILE.")
    if arguments.lsl_out is not None and arguments.recogniser is None:
        raise UsageError("--lsl-out sends what a recogniser says; name one with --recogniser FILE.")
    return devices


def _record(arguments: argparse.Namespace, devices: Sequence[Device]) -> int:
    """Record into a project, and recognise meanwhile where that is asked for; 1 if that failed."""
    recogniser = None if arguments.recogniser is None else load_recogniser(arguments.recogniser)
    live = recognition = None
    recorder = Recorder(arguments.project, devices, open_cameras(arguments.camera))
    with _naming_journal(recorder), recorder:
        if recogniser is not None:
            latency = LATENCY if arguments.latency is None else arguments.latency
            name, stream = arguments.recogniser.stem, arguments.lsl_out
            outlet = LabelOutlet(stream, recogniser.actions) if stream else None
            live = LiveRecognition(recogniser, name, latency, recorder, outlet)
        _ready(arguments.project)
        raw = [uncalibrated_warning(device.name) for device in devices if sends_raw_counts(device)]
        for sentence in raw if live is None else [*raw, *live.remarks]:
            print_remark(sentence)
        name = recorder.start(arguments.task, arguments.name)
        if live is not None:
            live.begin(firsts=recorder.firsts)
            beside = None if arguments.quiet else sys.stderr
            recognition = LiveTrackRecorder(live, beside if arguments.json else sys.stdout)
        print_remark(f"Recording '{name}'; Ctrl+C stops and keeps it.")
        try:
            _watch(recorder, arguments.seconds, recognition)
        except KeyboardInterrupt:  # that is how a recording without an end is ended
            pass
        finally:
            clear_line()
        state = recorder.state()
        recorder.end()
        if recognition is not None:
            recognition.finish()
        saved = recorder.stop()
        remarks = recorder.remarks()
    for sentence in remarks:
        print_remark(sentence)
    recognised = None if recognition is None else recognition.keep(arguments.project, saved)
    trouble = "" if recognition is None else recognition.trouble
    if trouble:
        print(printable(trouble), file=sys.stderr, flush=True)
    if arguments.json:
        extra = {} if recognised is None else {"recognised": recognised}
        print(json_text(_json_content(saved, state) | extra))
    else:
        print(_summary(saved, state))
        if recognised is not None:
            print(printable(recognition_summary(recognised)))
    return int(bool(trouble))


@contextmanager
def _naming_journal(recorder: Recorder) -> Iterator[None]:
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


def _ready(path: Path) -> None:
    """Make the project where there is none, and tell of recordings that were not finished."""
    if Project.vacant(path):
        Project.create(path).close()
    left = unfinished_journals(path)
    if left:
        print_remark(
            f"{counted(len(left), 'unfinished recording')} of an earlier start "
            f"{'is' if len(left) == 1 else 'are'} in '{path}'; 'forcelab capture {path} --recover' "
            f"makes demonstrations of what there is."
        )


def _watch(
    recorder: Recorder, seconds: float | None, recognition: LiveTrackRecorder | None
) -> None:
    """Wait until so many seconds are recorded, and show how it goes."""
    until = time.monotonic() + (math.inf if seconds is None else seconds)
    shown_at = -math.inf
    while (left := until - time.monotonic()) > 0:
        time.sleep(min(STATUS_INTERVAL if recognition is None else RECOGNITION_INTERVAL, left))
        if recognition is not None:
            recognition.look()
        if time.monotonic() - shown_at < STATUS_INTERVAL:
            continue
        shown_at = time.monotonic()
        for sentence in recorder.remarks():
            print_remark(sentence)
        if shows_progress():
            now = "" if recognition is None or not recognition.now else f"{recognition.now}  |  "
            show_line(printable(now + _status_line(recorder.state())))


def _status_line(state: RecorderState) -> str:
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


def _summary(saved: SavedRecording, state: RecorderState) -> str:
    lost = sum(device.lost for device in state.devices)
    words = [counted(saved.samples, "sample"), f"{lost} lost"]
    words += [f"{counted(c.frames, 'frame')}, {c.dropped} dropped" for c in state.cameras]
    if saved.precision:
        words.append(f"stamps to {1000 * saved.precision:.2f} ms")
    lines = [printable(remark) for remark in saved.remarks]
    name = printable(saved.added.name)
    return "\n".join([*lines, f"'{name}': {saved.seconds:.2f} s, {', '.join(words)}."])


def _json_content(saved: SavedRecording, state: RecorderState) -> dict[str, Any]:
    return _saved_json(saved) | {
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


def _saved_json(saved: SavedRecording) -> dict[str, Any]:
    return {
        "id": saved.added.id,
        "name": saved.added.name,
        "status": saved.added.status,
        "samples": saved.samples,
        "seconds": saved.seconds,
        "remarks": list(saved.remarks),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _recover(path: Path, json: bool) -> int:
    """Make demonstrations of unfinished recordings; 1 where one that holds anything cannot be."""
    Project.open(path).close()
    recoveries = recover(path)
    if json:
        print(json_text({"recovered": [_recovery(recovered) for recovered in recoveries]}))
    else:
        for recovered in recoveries:
            saved = recovered.recording
            if saved is None:
                print(printable(recovered.problem))
                continue
            for remark in saved.remarks:
                print(printable(remark))
            print(f"{printable(saved.added.name)}: {saved.seconds:.2f} s recovered.")
        count = sum(recovered.recording is not None for recovered in recoveries)
        print(f"{counted(len(recoveries), 'unfinished recording')}: {count} recovered.")
    return int(
        any(recovered.recording is None and not recovered.removed for recovered in recoveries)
    )


def _recovery(recovered: RecoveredRecording) -> dict[str, Any]:
    content = (
        {"trouble": recovered.problem}
        if recovered.recording is None
        else _saved_json(recovered.recording)
    )
    return {"journal": str(recovered.path)} | content
