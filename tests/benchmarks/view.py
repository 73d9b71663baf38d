"""How long the window takes to draw, scroll, open, play and paint: measured in the real window.

By default nothing is seen of it: the window is painted into memory. With ``QT_QPA_PLATFORM`` set,
such as to ``xcb``, it is shown on that display.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from bisect import bisect_left
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from importlib.util import find_spec
from itertools import cycle, pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QEvent, QEventLoop, QObject, QSize, Qt, QTimer
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractItemView, QApplication, QVBoxLayout, QWidget

from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.gui import theme
from forcelab.gui.app import quiet_qt
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.capture.recognition_controller import RecogniserSelection
from forcelab.gui.capture.workspace import CaptureWorkspace
from forcelab.gui.kit.time_panel import TimePanel
from forcelab.gui.label.overview import Overview
from forcelab.gui.label.scalogram import LOADING_DELAY_MS, ScalogramPanel
from forcelab.gui.qt_check import require_qt
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.labels import Segment, Segments, Track
from forcelab.measure.cwt import made_up_demonstration
from forcelab.project import NewDemonstration, Project
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import save_recogniser
from forcelab.recognition.training import train
from forcelab.runtime import collect_garbage, collect_garbage_rarely, switch_threads_often
from forcelab.video.codecs import opencv
from tests.benchmarks.latency import Bound, Latencies, Latency, load, refused
from tests.capture.virtual_devices import VirtualOptoForce, table_source

#: What measures something.
Measured = Generator[Progress, None, tuple[Latency, ...]]

#: The coder of all measurements, and the size of the window in pixels.
AUTHOR = "Measured"
SIZE = (1920, 1080)
#: Seconds that anything, and one paint, may take before a measurement is given up.
STAGE_PATIENCE = 120.0
PAINT_PATIENCE = 30.0
#: Milliseconds between two ticks of the timer whose lateness is measured.
TICK_MS = 5
#: How long nothing may have changed before the window counts as settled, in seconds.
STILL = 0.1


@dataclass(frozen=True, slots=True)
class Amount:
    """How much is measured."""

    samples: tuple[int, ...] = (1_000_000, 10_000_000)  # lengths of the recordings that are panned
    gestures: int = 10  # for each recording and range of spans, of eight frames each
    frames: int = 1500  # of a video
    moves: int = 500  # steps and jumps in it
    segments: int = 10_000  # of the track that is painted on
    strokes: int = 100  # painted at each zoom
    starts: int = 9  # of the program
    openings: int = 10  # of each project
    demonstrations: int = 1000  # in the project that has many
    scalograms: int = 5  # of each span of the longest recording, in each way
    live: int = 600  # frames of the Capture workspace, with each of what it can show


FULL = Amount()
QUICK = Amount(
    samples=(1_000_000,),
    gestures=4,
    frames=600,
    moves=60,
    strokes=20,
    starts=5,
    openings=5,
    scalograms=3,
    live=150,
)


@contextmanager
def stage() -> Iterator[Path]:
    """An application, settings of its own, and a folder for data; all gone afterwards."""
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    require_qt()
    running = QApplication.instance()
    application = running if isinstance(running, QApplication) else QApplication(["forcelab"])
    quiet_qt()
    theme.use_theme(application, "light")
    before = os.environ.get("FORCELAB_SETTINGS")
    # A waiting event loop has to wake up to see that something took too long.
    wake = QTimer()
    wake.start(250)
    with tempfile.TemporaryDirectory(prefix="forcelab-measure-") as folder:
        os.environ["FORCELAB_SETTINGS"] = str(Path(folder) / "settings.ini")
        try:
            yield Path(folder)
        finally:
            wake.stop()
            if before is None:
                del os.environ["FORCELAB_SETTINGS"]
            else:
                os.environ["FORCELAB_SETTINGS"] = before


@contextmanager
def shown(project: Path | None = None, size: tuple[int, int] = SIZE) -> Iterator[Window]:
    """The real window, with a project and its first demonstration open."""
    window = Window(AUTHOR, remembering=False)
    collect_garbage_rarely()
    window.document.demonstration_changed.connect(collect_garbage)
    switch_threads_often()
    window.resize(*size)
    window.show()
    window.activateWindow()
    try:
        if project is not None and not window.opening.open(project):
            raise InputError(f"The project made for the measurement, '{project}', did not open.")
        settle(window)
        yield window
    finally:
        window.close()
        window.deleteLater()
        QApplication.processEvents()


def until(holds: Callable[[], bool], patience: float = STAGE_PATIENCE) -> None:
    """Run the event loop, as the program does, until something holds."""
    deadline = time.monotonic() + patience
    while not holds():
        if time.monotonic() > deadline:
            raise InputError(
                f"The window was not done after {patience:g} s; measure on a quieter machine."
            )
        # To wait inside Qt, and not in Python, leaves the interpreter to the window's threads.
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.WaitForMoreEvents)


def rest(seconds: float) -> None:
    """Run the event loop for some time."""
    timer = QTimer()
    timer.setTimerType(Qt.TimerType.PreciseTimer)
    timer.setSingleShot(True)
    timer.start(round(1000 * seconds))
    until(lambda: not timer.isActive())


def settle(window: Window, still: float = STILL) -> None:
    """Run the event loop until everything that was asked for is on the screen, and stays so."""
    quiet_since = time.monotonic()

    def calm() -> bool:
        nonlocal quiet_since
        if not window.settled:
            quiet_since = time.monotonic()
        return time.monotonic() - quiet_since >= still

    tick = QTimer()
    tick.start(10)
    until(calm)
    tick.stop()


def time_panels(window: Window) -> list[QWidget]:
    """All that the window shows on the time axis, and the overview."""
    inside = window.findChildren(QWidget)
    panels = [w for w in inside if isinstance(w, TimePanel | Overview) and w.isVisible()]
    return [panel.viewport() for panel in panels]


class Painted(QObject):
    """Measures from an act to the end of the paint that shows it.

    `widgets`: all of them have to be painted anew.
    """

    def __init__(self, widgets: Sequence[QWidget]) -> None:
        super().__init__()
        self._widgets = tuple(widgets)
        self._left: set[QWidget] = set()
        for widget in self._widgets:
            widget.installEventFilter(self)

    def __enter__(self) -> Painted:
        return self

    def __exit__(self, *_: object) -> None:
        for widget in self._widgets:
            widget.removeEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Hear that a widget is being painted; Qt paints all that is stale in one go."""
        if event.type() == QEvent.Type.Paint and isinstance(watched, QWidget):
            self._left.discard(watched)
        return False

    def seconds(self, act: Callable[[], object], also: Callable[[], bool] | None = None) -> float:
        """How long it takes from `act` until all is painted, and `also` holds, in seconds."""
        self._left = set(self._widgets)
        begin = time.perf_counter()
        act()
        until(lambda: not self._left and (also is None or also()), PAINT_PATIENCE)
        return time.perf_counter() - begin


class Lateness:
    """How late the event loop comes to a timer that is due every few milliseconds.

    `samples`: seconds that each tick came later than it was due.
    """

    def __init__(self) -> None:
        self.samples: list[float] = []
        self._last = 0.0
        self._timer = QTimer()
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.setInterval(TICK_MS)
        self._timer.timeout.connect(self._tick)

    def __enter__(self) -> Lateness:
        self._last = time.perf_counter()
        self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.stop()

    def _tick(self) -> None:
        now = time.perf_counter()
        self.samples.append(max(0.0, now - self._last - TICK_MS / 1000))
        self._last = now


#: Samples a second, the channels, and what is labelled.
RATE = 1000.0
CHANNELS = tuple(Channel(f"f{axis}{sensor}", "N") for sensor in (1, 2) for axis in "xyz")
ACTIONS = ("grab", "hold", "pull", "release", "still")


def recording(
    count: int, name: str = "01", videos: tuple[VideoReference, ...] = (), seed: int = 0
) -> Demonstration:
    """Six channels of noise, with a grip that comes and goes at all time scales.

    `count`: number of samples.
    """
    random = np.random.default_rng(seed)
    times = np.arange(count) / RATE
    signals = np.empty((count, len(CHANNELS)))
    for column in range(len(CHANNELS)):
        signals[:, column] = 0.02 * random.standard_normal(count)
        for period in (1.7, 23.0, 411.0):
            signals[:, column] += np.sin(2 * np.pi * (times / period + random.random()))
    times.flags.writeable = signals.flags.writeable = False
    return Demonstration(name, "measured", times, signals, CHANNELS, videos=videos)


def long(folder: Path, count: int) -> Path:
    """A project with one recording of so many samples, in six channels."""
    with Project.create(folder / f"long {count}.forcelab") as project:
        project.demonstrations.add(recording(count), [Track(AUTHOR, (Segment(0.5, 1.0, "grab"),))])
        return project.path


def segmented(folder: Path, segments: int, count: int = 1_000_000) -> Path:
    """A project with one recording whose track has so many segments, with gaps between them."""
    whole = recording(count)
    length = (whole.end - whole.start) / segments
    track = tuple(
        Segment(i * length, (i + 0.8) * length, ACTIONS[i % len(ACTIONS)]) for i in range(segments)
    )
    with Project.create(folder / f"segments {segments}.forcelab") as project:
        project.demonstrations.add(whole, [Track(AUTHOR, track)])
        return project.path


def many(folder: Path, count: int) -> Path:
    """A project with so many short demonstrations of ten tasks, by two coders."""

    def each() -> Iterator[NewDemonstration]:
        for number in range(count):
            base = recording(200, f"{number:04d}", seed=number)
            demonstration = Demonstration(
                base.name, f"task {number % 10}", base.times, base.signals, base.channels
            )
            track = (Segment(0.02, 0.08, "grab"), Segment(0.08, 0.15, "hold"))
            yield NewDemonstration(demonstration, (Track(AUTHOR, track), Track("Other", track)))

    with Project.create(folder / f"many {count}.forcelab") as project:
        project.demonstrations.add_all(each())
        return project.path


PLAIN_PLOTS = "pyqtgraph, peak, clipped"


class PlainPlots(QWidget):
    """A plot for each channel, one above the other, with peak downsampling and clipping."""

    def __init__(self, demonstration: Demonstration) -> None:
        super().__init__()
        import pyqtgraph

        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        self._plots = [pyqtgraph.PlotWidget() for _ in demonstration.channels]
        for i, plot in enumerate(self._plots):
            column.addWidget(plot)
            plot.setDownsampling(auto=True, mode="peak")
            plot.setClipToView(True)
            plot.plot(demonstration.times, demonstration.signals[:, i])
            plot.disableAutoRange()
            if i:
                plot.setXLink(self._plots[0])

    @property
    def surfaces(self) -> list[QWidget]:
        """What is painted."""
        return [plot.viewport() for plot in self._plots]

    def set_span(self, start: float, end: float) -> None:
        """Show ``[start, end]``, in seconds."""
        self._plots[0].setXRange(start, end, padding=0)


@contextmanager
def plain_plots(demonstration: Demonstration, size: QSize) -> Iterator[PlainPlots]:
    """The plots on the screen, of the size of the window's force panel."""
    plots = PlainPlots(demonstration)
    plots.resize(size)
    plots.show()
    QApplication.processEvents()
    try:
        yield plots
    finally:
        plots.close()
        plots.deleteLater()
        QApplication.processEvents()


FRAME = Bound("p95", 0.033)
LATE_FRAME = Bound("worst", 0.050)
PAN, LOOP = "pan and zoom", "event loop's lateness"
#: Seconds from the beginning of one frame to that of the next, frames of one gesture, and the
#: pause after it, in which the scalogram is begun: the next gesture meets it at work.
PACE, GESTURE, PAUSE = 1 / 60, 8, 0.08
#: The shortest span that is looked at, in seconds.
CLOSE = 1.0

Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Zoom:
    """A range of visible spans, in seconds."""

    name: str
    least: float
    most: float

    def gesture(self, whole: Span, frames: int, random: np.random.Generator) -> list[Span]:
        """Spans of this range, each a little panned and zoomed from the one before."""
        length = float(np.exp(random.uniform(np.log(self.least), np.log(self.most))))
        start = random.uniform(whole[0], whole[1] - length)
        towards, spans = random.choice([-1.0, 1.0]), []
        for frame in range(frames):
            longer = length * (1.08 if frame % 4 < 2 else 1 / 1.08)
            # Never longer than the range, and never the same span twice: nothing is painted then.
            longer = min(max(longer, self.least), self.most * (0.999 - 0.001 * frame))
            start += (length - longer) / 2 + 0.03 * towards * longer
            start, length = min(max(start, whole[0]), whole[1] - longer), longer
            spans.append((start, start + length))
        return spans


def zooms(seconds: float) -> list[Zoom]:
    """From the whole recording to one second, decade by decade."""
    edges = [seconds]
    while edges[-1] > 1.01 * CLOSE:
        edges.append(max(edges[-1] / 10, CLOSE))
    decades = [
        Zoom(f"{low:.3g} to {high:.3g} s visible", low, high) for high, low in pairwise(edges)
    ]
    return [Zoom("all visible", 0.9 * seconds, seconds), *decades]


def measuring_panning(folder: Path, count: int, gestures: int) -> Measured:
    """Pan and zoom a recording of six channels, so many gestures for each range of spans."""
    setting = f"6 x {_power(count)}"
    yield Progress(0, 1, f"{setting} samples: making the recording")
    path = long(folder, count)
    rows: list[Latency] = []
    with shown(path) as window:
        demonstration = window.document.demonstration
        assert demonstration is not None
        whole = (demonstration.start, demonstration.end)
        ranges = zooms(whole[1] - whole[0])
        panels, box = time_panels(window), window.label.force.size()
        with Painted(panels) as painted:
            for i, zoom in enumerate(ranges):
                yield Progress(i, 2 * len(ranges), f"{setting} samples: {zoom.name}")
                taken = _frames(zoom, whole, gestures, window.document.view.set_span, painted)
                where = f"{setting}, {zoom.name}"
                rows.append(Latency(PAN, where, taken, FRAME, alternative=PLAIN_PLOTS))
                late = _lateness(window, zoom, whole, gestures)
                rows.append(Latency(LOOP, where, late, LATE_FRAME))
        with plain_plots(demonstration, box) as plots, Painted(plots.surfaces) as painted:
            for i, zoom in enumerate(ranges):
                yield Progress(
                    len(ranges) + i, 2 * len(ranges), f"{setting} samples: {PLAIN_PLOTS}"
                )
                few = max(1, gestures // 4)
                taken = _frames(zoom, whole, few, plots.set_span, painted)
                rows.append(Latency(PLAIN_PLOTS, f"{setting}, {zoom.name}", taken))
    shutil.rmtree(path)  # half a gigabyte, and there is more to come
    return tuple(sorted(rows, key=lambda row: (PAN, LOOP, PLAIN_PLOTS).index(row.name)))


def _frames(
    zoom: Zoom,
    whole: Span,
    gestures: int,
    set_span: Callable[[float, float], object],
    painted: Painted,
) -> tuple[float, ...]:
    """Seconds of each frame of some gestures, asked for at most sixty times a second."""
    random = np.random.default_rng(1)
    taken = []
    for _ in range(gestures):
        for start, end in zoom.gesture(whole, GESTURE, random):
            begin = time.perf_counter()
            taken.append(painted.seconds(partial(set_span, start, end)))
            rest(max(0.0, PACE - (time.perf_counter() - begin)))
        rest(PAUSE)
    return tuple(taken)


def _lateness(window: Window, zoom: Zoom, whole: Span, times: int) -> tuple[float, ...]:
    """How late the event loop is while scalograms of some spans are computed."""
    random = np.random.default_rng(2)
    samples: list[float] = []
    for _ in range(times):
        settle(window)
        with Lateness() as lateness:
            window.document.view.set_span(*zoom.gesture(whole, 1, random)[0])
            settle(window)
        samples += lateness.samples
    return tuple(samples)


def _power(count: int) -> str:
    """A power of ten as ``1e6``, any other number as it is."""
    power = round(np.log10(count))
    return f"1e{power}" if 10**power == count else str(count)


OPENING = "open a project"


def measuring_opening(folder: Path, dense: Path, amount: Amount) -> Measured:
    """Open projects of much in a window that is there already."""
    yield Progress(0, 1, f"making {amount.demonstrations} demonstrations")
    projects = {
        f"{amount.demonstrations} demonstrations": many(folder, amount.demonstrations),
        f"{amount.segments} segments": dense,
    }
    rows, times = [], amount.openings
    with shown() as window:
        shows = [
            window.demonstrations.view.viewport(),
            window.label.tracks.viewport(),
            window.label.segments.table.viewport(),
        ]
        for i, (name, project) in enumerate(projects.items()):
            taken = []
            with Painted(shows) as painted:
                for number in range(times):
                    yield Progress(times * i + number, times * len(projects), f"{OPENING}, {name}")
                    taken.append(painted.seconds(partial(window.opening.open, project)))
                    settle(window)
                    window.document.close()
                    settle(window)
            rows.append(Latency(OPENING, name, tuple(taken)))
    return tuple(rows)


PAINTING, AFTER = "key to paint", "event loop's lateness after it"
PAINT, LATE_STROKE = Bound("p95", 0.016), Bound("worst", 0.050)
#: Seconds in which the event loop is watched after strokes: what is put off is done by then.
AFTERWARDS = 1.0
#: How long a painted action lasts, in seconds: as the actions of the sample project do.
LASTING = (0.2, 1.5)


def measuring_strokes(project: Path, amount: Amount) -> Measured:
    """Paint by keys on the track of many segments of a project's first demonstration."""
    rows, segments = [], amount.segments
    with shown(project) as window:
        whole = window.document.view.bounds
        looks = {"all visible": whole[1] - whole[0], "10 s visible": 10.0}
        for i, (words, length) in enumerate(looks.items()):
            yield Progress(i, len(looks), f"{PAINTING}, {segments} segments, {words}")
            where = f"{segments} segments, {words}"
            taken, late = _strokes(window, length, amount.strokes)
            rows.append(Latency(PAINTING, where, taken, PAINT))
            rows.append(Latency(AFTER, where, late, LATE_STROKE))
    return tuple(rows)


def _strokes(
    window: Window, length: float, times: int
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Seconds of some strokes, and how late the event loop is once they are done."""
    document, label = window.document, window.label
    (low, high), actions = document.view.bounds, tuple(document.vocabulary)
    # The overview follows a moment later; what it takes is in the lateness afterwards.
    lists: list[QWidget] = [label.tracks.viewport(), label.segments.table.viewport()]
    random, taken = np.random.default_rng(5), []
    with Painted([widget for widget in lists if widget.isVisible()]) as painted:
        for _ in range(times):
            start = float(random.uniform(low, high - 0.05 * length))
            document.view.set_span(start - 0.4 * length, start + 0.6 * length)
            document.view.seek(start)
            # An action that is there already would change nothing.
            row = _row(document.editor.segments, start)
            present = {
                segment.action for segment in document.editor.segments[max(row - 2, 0) : row + 2]
            }
            action = next(action for action in actions if action.name not in present)
            key = Qt.Key(ord(action.key.upper()))
            target = QApplication.focusWidget() or label.tracks
            QTest.keyClick(target, key)
            document.view.seek(start + float(random.uniform(*LASTING)))
            _scroll(window, row)
            settle(window)
            before = document.editor.segments
            taken.append(painted.seconds(partial(QTest.keyPress, target, key)))
            QTest.keyRelease(target, key)
            if document.editor.segments == before:
                raise InputError("A key painted nothing; the measurement means nothing then.")
            document.editor.undo_everywhere()  # so that there are as many segments the next time
    with Lateness() as lateness:
        rest(AFTERWARDS)
    return tuple(taken), tuple(lateness.samples)


def _row(segments: Segments, time: float) -> int:
    """The first segment that begins at or after a time."""
    row = bisect_left(segments, time, key=lambda segment: segment.start)
    return min(row, len(segments) - 1)


def _scroll(window: Window, row: int) -> None:
    """Let the table of segments show a row, so that it has to paint what changes there."""
    table, centre = window.label.segments.table, QAbstractItemView.ScrollHint.PositionAtCenter
    table.scrollTo(table.model().index(row, 0), centre)


FIRST, EXACT = "first scalogram", "exact scalogram"
#: Spans that are looked at, in samples, besides the whole recording, and the share by which one is
#: then made shorter.
SPANS, NEARER = (4_000, 65_000, 1_000_000), 0.01
#: Of exact pictures; a span rests for a while before it is computed.
PROMPT = Bound("p95", LOADING_DELAY_MS / 1000 + 0.150)
WAYS = ("never seen", "seen before")

#: Seconds to the first and to the exact picture.
Taken = tuple[float, float]
_Way = Callable[[Window], Taken]


def measuring_scalograms(folder: Path, count: int, times: int) -> Measured:
    """Ask for scalograms of one of six channels, so often for each span and way.

    What was never seen has a bound in the shortest span alone: the colours' range and the powers of
    longer ones take longer on two cores.
    """
    setting = f"6 x {count:,} samples"
    yield Progress(0, 1, f"{setting}: making the recording")
    path = long(folder, count)
    rows: list[Latency] = []
    with shown(path) as window:
        spans = [*(span for span in SPANS if span < count), count]
        names = cycle(channel.name for channel in CHANNELS)
        ways: tuple[_Way, ...] = (partial(_never, names=names), _before)
        for i, way in enumerate(ways):
            yield Progress(i, len(WAYS), f"{setting}: scalograms {WAYS[i]}")
            for span in spans:
                _look(window, span, phase=i == 0)
                taken = [way(window) for _ in range(times)]
                where = f"{setting}, {span:,} visible, {WAYS[i]}"
                bounded = i > 0 or span == spans[0]
                firsts, exacts = zip(*taken, strict=True)
                rows.append(Latency(FIRST, where, firsts))
                rows.append(Latency(EXACT, where, exacts, PROMPT if bounded else None))
    shutil.rmtree(path)
    return tuple(sorted(rows, key=lambda row: (FIRST, EXACT).index(row.name)))


def _look(window: Window, span: int, *, phase: bool) -> None:
    """Show so many samples from the middle of the recording, and wait for all that is computed."""
    document, half = window.document, 0.5 * span / RATE
    middle = 0.5 * (document.view.bounds[0] + document.view.bounds[1])
    document.view.set_span(middle - half, middle + half)
    window.label.scalogram.set_phase(phase)
    settle(window)


def _never(window: Window, names: Iterator[str]) -> Taken:
    """Of a channel of which nothing is known, while phases are shown.

    Phases end the computing of what is not seen, which is not waited for.
    """
    panel = window.label.scalogram

    def act() -> None:
        panel.set_phase(False)
        panel.set_channel(next(names))

    taken = _time_pictures(panel, act)
    panel.set_phase(True)
    settle(window)
    return taken


def _before(window: Window) -> Taken:
    """Of a span a little shorter than the one before, of a channel of which all is known."""
    document, panel = window.document, window.label.scalogram
    start, end = document.view.start, document.view.end
    nearer = partial(document.view.set_span, start, end - NEARER * (end - start))
    taken = _time_pictures(panel, nearer)
    document.view.set_span(start, end)
    settle(window)
    return taken


def _time_pictures(panel: ScalogramPanel, act: Callable[[], object]) -> Taken:
    """Seconds from an act to the first picture and to the exact one."""
    before = panel.picture
    begin = time.perf_counter()
    act()
    until(lambda: panel.picture is not None and panel.picture is not before)
    first = time.perf_counter() - begin
    until(lambda: panel.settled)
    return first, time.perf_counter() - begin


Picture = NDArray[np.uint8]

WIDTH, HEIGHT = 640, 480
#: Bits of a number, and the side of a bit's square in pixels.
BITS, BLOCK = 16, 40
FRAMES_PER_SECOND = 30
FINE = Fraction(1, 90_000)
#: Key frames 250 frames apart, as cameras' and converters' defaults have it.
H264 = {
    "g": "250",
    "keyint_min": "250",
    "sc_threshold": "0",
    "bf": "2",
    "preset": "veryfast",
    "threads": "2",
}


@dataclass(frozen=True, slots=True)
class Film:
    """One kind of video."""

    name: str  # for people
    codec: str
    even: bool  # whether its frames are all equally far apart

    @property
    def refusal(self) -> str:
        """Why it cannot be made here; empty if it can."""
        if self.codec == "h264" and find_spec("av") is None:
            return "PyAV, which makes these H.264 videos, is missing; get it by: pip install av"
        return ""

    @property
    def sketched(self) -> bool:
        """Whether its key frames are so far apart that small pictures of all frames are made."""
        return self.codec == "h264"

    def times(self, count: int) -> NDArray[np.float64]:
        """Times of the frames in seconds, shape (count,), from 0."""
        if self.even:
            return np.arange(count) / FRAMES_PER_SECOND
        steps = np.random.default_rng(0).uniform(1 / 60, 1 / 12, count)
        steps[count // 3] = 0.9
        ticks = np.round(np.cumsum(steps) / float(FINE))
        return (ticks - ticks[0]) * float(FINE)

    def make(self, path: Path, count: int) -> None:
        """Write the video."""
        if self.codec == "h264":
            self._encode(path, count)
        else:
            cv2 = opencv()
            code = cv2.VideoWriter.fourcc(*self.codec)
            writer = cv2.VideoWriter(str(path), code, FRAMES_PER_SECOND, (WIDTH, HEIGHT))
            for picture in _pictures(count):
                writer.write(picture)
            writer.release()

    def _encode(self, path: Path, count: int) -> None:
        """Write H.264 with the times of the frames."""
        import av

        with av.open(str(path), "w") as container:
            stream = container.add_stream("libx264", rate=FRAMES_PER_SECOND, options=H264)
            stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
            stream.codec_context.time_base = stream.time_base = FINE
            for time, picture in zip(self.times(count), _pictures(count), strict=True):
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                frame.pts, frame.time_base = round(time / FINE), FINE
                container.mux(stream.encode(frame))
            container.mux(stream.encode())


FILMS = (
    Film("H.264, GOP 250", "h264", True),
    Film("H.264, GOP 250, VFR", "h264", False),
    Film("mp4v", "mp4v", True),
)


def number_of(picture: Picture) -> int:
    """The number that a frame carries, whatever its size.

    `picture` (height, width, channels).
    """
    height, width = picture.shape[:2]
    row = picture[height * BLOCK // (2 * HEIGHT)].mean(axis=1)
    middles = (np.arange(BITS) + 0.5) * BLOCK * width / WIDTH
    return int(sum(1 << bit for bit, x in enumerate(middles) if row[int(x)] > 128))


def _pictures(count: int) -> Iterator[Picture]:
    """Frames with a moving, textured ground: a plain one would be decoded in no time."""
    random = np.random.default_rng(3)
    coarse = random.integers(40, 200, (HEIGHT // 8 + 8, WIDTH // 8 + 64, 3))
    ground = np.kron(coarse, np.ones((8, 8, 1))).astype(np.uint8)
    ground += random.integers(0, 24, ground.shape, dtype=np.uint8)
    bits = np.arange(BITS)
    for number in range(count):
        x, y = int(200 + 190 * np.sin(number / 37)), int(30 + 29 * np.cos(number / 23))
        picture = np.ascontiguousarray(ground[y : y + HEIGHT, x : x + WIDTH])
        black_and_white = np.where(number >> bits & 1, 235, 16).astype(np.uint8)
        picture[:BLOCK] = np.repeat(black_and_white, BLOCK)[np.newaxis, :, np.newaxis]
        yield picture


STEP, SEEK = Bound("p95", 0.010), Bound("p95", 0.200)
FORWARD, BACKWARD, JUMP = "video: step forward", "video: step back", "video: seek"
#: From a jump to the picture of the right frame, be it the small one that is made in idle time.
PREPARED = "video: seek, to its picture in small"
#: What the times are compared with, and what other programs do.
PLAIN = "cv2 by frame count: "


def measuring_video(folder: Path, film: Film, frames: int, times: int) -> Measured:
    """Step forward, step back and seek in one video, so many times each."""
    if film.refusal:
        return refused([FORWARD, BACKWARD, JUMP], film.name, film.refusal)
    yield Progress(0, 6, f"{film.name}: making the video")
    path = folder / f"{film.codec} {film.even}.mp4"
    film.make(path, frames)
    stamps = film.times(frames)
    length = int(stamps[-1] * RATE) + 1000
    project = folder / f"{path.stem}.forcelab"
    with Project.create(project) as created:
        created.demonstrations.add(recording(length, videos=(VideoReference(path),)))
    random = np.random.default_rng(4)
    jumps = random.integers(0, frames, times).tolist()
    rows = []
    with shown(project) as window, Painted(window.label.video.panels) as painted:
        watch = _Watch(window, painted, stamps)
        for i, (name, bound, numbers) in enumerate(
            [
                (JUMP, SEEK, jumps),
                (PREPARED, SEEK, jumps),
                (FORWARD, STEP, _steps(frames, times, 1)),
                (BACKWARD, None, _steps(frames, times, -1)),
            ]
        ):
            yield Progress(1 + i, 6, f"{film.name}: {name}")
            act = watch.step if name in (FORWARD, BACKWARD) else watch.jump
            if name == PREPARED:
                if not film.sketched:
                    continue
                until(lambda: window.label.video.panels[0]._frames._decoder.prepared)
            taken, wrong = watch.measured(numbers, act, sharp=name != PREPARED)
            plain = PLAIN + (JUMP if name == PREPARED else name)
            rows.append(Latency(name, film.name, taken, bound, wrong, alternative=plain))
    yield Progress(5, 6, f"{film.name}: {PLAIN}")
    for name, numbers in (
        (JUMP, jumps),
        (FORWARD, _steps(frames, times, 1)),
        (BACKWARD, _steps(frames, times, -1)),
    ):
        taken, wrong = _plainly(path, numbers[: max(times // 5, 10)])
        rows.append(Latency(PLAIN + name, film.name, taken, wrong=wrong))
    return tuple(rows)


def _steps(frames: int, times: int, direction: int) -> list[int]:
    """Numbers of frames next to each other, from the middle of the video's free room."""
    times = min(times, frames - 2)
    first = (frames - times) // 2
    numbers = list(range(first, first + times + 1))
    return numbers[::direction]


@dataclass
class _Watch:
    """Moves the cursor and looks at what the video shows then."""

    window: Window
    painted: Painted
    stamps: NDArray[np.float64]

    def jump(self, number: int) -> None:
        """Seek into a frame, somewhere after its beginning."""
        after = self.stamps[min(number + 1, len(self.stamps) - 1)]
        at = self.stamps[number] + 0.4 * max(after - self.stamps[number], 1e-3)
        self.window.document.view.seek(float(at))

    def step(self, number: int) -> None:
        """Go one frame on or back."""
        self.window.document.view.step(1 if number > self.window.label.video.shown_index else -1)

    def measured(
        self, numbers: Iterable[int], act: Callable[[int], None], *, sharp: bool = True
    ) -> tuple[tuple[float, ...], int]:
        """Show frames one after the other.

        `numbers`: the first one is where it begins, and is not counted; `sharp`: whether to wait
        for the frame itself, or for any picture of it. Gives seconds of each; how many were not the
        right one.
        """
        video, taken, wrong = self.window.label.video.panels[0], [], 0
        first, *others = numbers
        # Onto the frame itself: from within it, a step back leads to its beginning.
        self.window.document.view.seek(float(self.stamps[first]))
        settle(self.window)
        for number in others:
            if number == video.shown_index:
                continue
            is_shown = (lambda: video.settled) if sharp else partial(self._pictured, number)
            taken.append(self.painted.seconds(partial(act, number), is_shown))
            image = video.image
            wrong += image is None or number_of(_pixels(image)) != number
            settle(self.window, 0.0)
        return tuple(taken), wrong

    def _pictured(self, number: int) -> bool:
        """Whether a picture of this frame is shown."""
        return self.window.label.video.shown_index == number


def _plainly(path: Path, numbers: Iterable[int]) -> tuple[tuple[float, ...], int]:
    """Time and wrong frames of OpenCV, told to go to frames by their numbers."""
    cv2: Any = opencv()
    capture = cv2.VideoCapture(str(path))
    taken, wrong = [], 0
    for number in numbers:
        begin = time.perf_counter()
        capture.set(cv2.CAP_PROP_POS_FRAMES, number)
        read, picture = capture.read()
        taken.append(time.perf_counter() - begin)
        wrong += not read or number_of(picture) != number
    capture.release()
    return tuple(taken), wrong


def _pixels(image: QImage) -> NDArray[np.uint8]:
    """A picture as an array of shape (height, width, 3), with memory of its own."""
    plain = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(plain.constBits(), np.uint8).reshape(plain.height(), plain.bytesPerLine())
    # The converted picture is gone after this, and its memory with it.
    return rows[:, : 3 * plain.width()].reshape(plain.height(), plain.width(), 3).copy()


EMPTY, OPEN = Bound("median", 1.5), Bound("median", 2.5)
START_PATIENCE = 120.0


def measuring_start(folder: Path, times: int) -> Measured:
    """Start the program, with and without a project."""
    yield Progress(0, 1, "making a project")
    project = long(folder, 60_000)
    environment = {**os.environ, "FORCELAB_SETTINGS": str(folder / "started.ini")}
    # So that the start without a project is not the first one ever, which makes the sample project.
    Path(environment["FORCELAB_SETTINGS"]).write_text("[window]\nbegun=true\n", "utf-8")
    cases: dict[str, tuple[list[str], Bound]] = {
        "no project": ([], EMPTY),
        "a demonstration open": ([str(project)], OPEN),
    }
    painted: dict[str, list[float]] = {name: [] for name in cases}
    complete: dict[str, list[float]] = {name: [] for name in cases}
    for number in range(times):
        for i, (name, (arguments, _)) in enumerate(cases.items()):
            yield Progress(len(cases) * number + i, len(cases) * times, f"start, {name}")
            first, all_ = _started(arguments, environment)
            painted[name].append(first)
            complete[name].append(all_)
    return tuple(
        row
        for name, (_, bound) in cases.items()
        for row in (
            Latency("start to the first painted window", name, tuple(painted[name]), bound),
            Latency("start until everything is there", name, tuple(complete[name])),
        )
    )


def _started(arguments: list[str], environment: dict[str, str]) -> tuple[float, float]:
    """Seconds from the call of a new process to its two stamps."""
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.started", *arguments],
        env=environment,
        capture_output=True,
        text=True,
        timeout=START_PATIENCE,
        check=False,
    )
    stamps = done.stdout.split()
    if done.returncode or len(stamps) != 2:
        raise InputError(
            f"The program that was started for the measurement ended with {done.returncode}: "
            f"{done.stderr.strip()[-300:]}"
        )
    return float(stamps[0]) - begin, float(stamps[1]) - begin


#: Frames are 33 ms apart; a painter that is late for one in twenty is not yet seen.
PACED, COST = Bound("median", 0.037), Bound("p95", 0.033)
FRAMES, WORK = "from one live frame to the next", "window's CPU time a live frame"
CAPTURED_RATE, SECONDS = 1000.0, 20.0
#: Counts of a newton, and the latency of the labels in milliseconds.
COUNTS, LATENCY = 200.0, 100
#: Seconds that everything runs before frames count.
SETTLED = 2.0


class _Frames(QObject):
    """When a view was painted, and how much CPU time its thread had taken by then."""

    def __init__(self, view: QWidget) -> None:
        super().__init__()
        self.painted: list[tuple[float, float]] = []
        view.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note each paint."""
        if event.type() == QEvent.Type.Paint:
            self.painted.append((time.monotonic(), time.thread_time()))
        return False


def measuring_capture(folder: Path, frames: int) -> Measured:
    """Watch two virtual DAQs at 1 kHz, scalogram and recognition off and on."""
    yield Progress(0, 1, "training a recogniser")
    performances = [made_up_demonstration(SECONDS, CAPTURED_RATE, seed) for seed in (1, 2)]
    recogniser = folder / "measured.skops"
    save_recogniser(
        train([LabelledDemonstration(*item) for item in performances], preset("fast")), recogniser
    )
    project = folder / "captured.forcelab"
    Project.create(project).close()
    counts = np.round(COUNTS * np.asarray(performances[0][0].signals)).astype(np.int64)
    found: list[Latency] = []
    with ExitStack() as stack:
        daqs = [VirtualOptoForce(table_source(counts[:, i : i + 3], CAPTURED_RATE)) for i in (0, 3)]
        for daq in daqs:
            stack.enter_context(daq)
        window = stack.enter_context(shown(project))
        window.show_workspace("capture")
        page = window.capture.workspace
        for daq in daqs:
            page.device_list.add(f"optoforce:{daq.port}")
        page.connect_button.click()
        until(lambda: page.controller.phase is CaptureState.READY)
        watched = _Frames(page.live_view.viewport())
        for recognised in (False, True):
            for channel in ("", "tangential 1"):
                yield Progress(len(found) // 2, 4, "live frames")
                _choose(page, channel, recogniser if recognised else None)
                rest(SETTLED)
                watched.painted.clear()
                until(lambda: len(watched.painted) > frames)
                found += _latencies_of_frames(watched.painted, channel != "", recognised)
    return tuple(found)


def _choose(page: CaptureWorkspace, channel: str, recogniser: Path | None) -> None:
    """Show a scalogram or none, recognise or not, and wait until it does."""
    page.scalogram.choose(channel)
    until(lambda: bool(page.scalogram.strip) == bool(channel))
    recognition = page.controller.recognition
    if (recogniser is None) == (recognition.selection is None):
        return
    recognition.set_latency(LATENCY)
    recognition.select(None if recogniser is None else RecogniserSelection("measured", recogniser))
    until(lambda: recogniser is None or recognition.track.snapshot is not None)


def _latencies_of_frames(
    painted: list[tuple[float, float]], scalogram: bool, recognised: bool
) -> tuple[Latency, Latency]:
    """How far frames are apart, and what each takes of the window's thread."""
    parts = ["2 DAQs at 1 kHz", *(["scalogram"] * scalogram), *(["recognition"] * recognised)]
    setting = ", ".join(parts)
    apart, work = zip(*((b[0] - a[0], b[1] - a[1]) for a, b in pairwise(painted)), strict=True)
    return (
        Latency(FRAMES, setting, apart, PACED),
        Latency(WORK, setting, work, COST),
    )


def tabulate(*, quick: bool = False) -> Generator[Progress, None, Latencies]:
    """Measure everything: some minutes, and 2 GB of disk for a while.

    With `quick` only recordings of 1e6 samples, and fewer repetitions.
    """
    amount = QUICK if quick else FULL
    before = load()
    rows: list[Latency] = []
    with stage() as folder:
        yield Progress(0, 1, f"making a track of {amount.segments} segments")
        dense = segmented(folder, amount.segments)
        for job in (
            measuring_start(folder, amount.starts),
            measuring_strokes(dense, amount),
            measuring_opening(folder, dense, amount),
            measuring_capture(folder, amount.live),
            *(measuring_video(folder, film, amount.frames, amount.moves) for film in FILMS),
            *(measuring_panning(folder, count, amount.gestures) for count in amount.samples),
            measuring_scalograms(folder, amount.samples[-1], amount.scalograms),
        ):
            rows += yield from job
    width, height = SIZE
    return Latencies(
        f"The window, {width} x {height} pixels, scalogram and lists shown; times in ms",
        tuple(rows),
        (before, load()),
    )
