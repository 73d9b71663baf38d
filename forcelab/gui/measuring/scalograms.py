"""How long the window takes to a channel's scalogram: never seen, from its file, seen before."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Generator, Iterator
from functools import partial
from itertools import cycle
from pathlib import Path

from forcelab.gui.label.scalogram import ScalogramPanel
from forcelab.gui.label.scalogram_asking import PATIENCE
from forcelab.gui.measuring import recordings
from forcelab.gui.measuring.stage import settle, shown, until
from forcelab.gui.window import Window
from forcelab.jobs import Progress
from forcelab.measure.latency import Bound, Latency, refused

__all__ = ["measuring_scalograms"]

FIRST, EXACT = "first scalogram", "exact scalogram"
#: Spans that are looked at, in samples, besides the whole recording, and the share by which one is
#: then made shorter.
SPANS, NEARER = (4_000, 65_000, 1_000_000), 0.01
#: Of exact pictures; a span rests for a while before it is computed.
PROMPT = Bound("p95", PATIENCE / 1000 + 0.150)
WAYS = ("never seen", "seen before", "from its file")

#: Seconds to the first and to the exact picture.
Taken = tuple[float, float]
_Way = Callable[[Window], "Taken | None"]


def measuring_scalograms(
    folder: Path, count: int, *, times: int, size: tuple[int, int]
) -> Generator[Progress, None, tuple[Latency, ...]]:
    """Ask for scalograms of one of six channels; see :mod:`forcelab.gui.measuring`.

    What was never seen has a bound in the shortest span alone: the colours' range and the powers of
    longer ones take longer on two cores.

    Parameters
    ----------
    folder : Path
        Where the recording is made, and deleted again.
    count : int
        Samples of each channel.
    times : int
        For each span and way.
    size : tuple of int
        Of the window, in pixels.
    """
    setting = f"6 x {count:,} samples"
    if sentence := recordings.refusal(folder, count):
        return refused([FIRST, EXACT], setting, sentence)
    yield Progress(0, 1, f"{setting}: making the recording")
    path = recordings.long(folder, count)
    rows: list[Latency] = []
    with shown(path, size) as window:
        spans = [*(span for span in SPANS if span < count), count]
        names = cycle(channel.name for channel in recordings.CHANNELS)
        ways: tuple[_Way, ...] = (partial(_never, names=names), _before, _from_file)
        for i, way in enumerate(ways):
            yield Progress(i, len(WAYS), f"{setting}: scalograms {WAYS[i]}")
            for span in spans:
                _look(window, span, phase=i == 0)
                taken = [way(window) for _ in range(times)]
                if None in taken:  # only long recordings have files
                    break
                where = f"{setting}, {span:,} visible, {WAYS[i]}"
                bounded = i > 0 or span == spans[0]
                firsts, exacts = zip(*taken, strict=True)
                rows.append(Latency(FIRST, where, firsts))
                rows.append(Latency(EXACT, where, exacts, PROMPT if bounded else None))
    shutil.rmtree(path)
    return tuple(sorted(rows, key=lambda row: (FIRST, EXACT).index(row.name)))


def _look(window: Window, span: int, *, phase: bool) -> None:
    """Show so many samples from the middle of the recording, and wait for all that is computed."""
    document, half = window.document, 0.5 * span / recordings.RATE
    middle = 0.5 * (document.bounds[0] + document.bounds[1])
    document.set_span(middle - half, middle + half)
    window.label.scalogram.set_phase(phase)
    settle(window)


def _never(window: Window, names: Iterator[str]) -> Taken:
    """Of a channel of which nothing is known, while phases are shown.

    Phases end the computing of what is not seen, which is not waited for.
    """
    panel = window.label.scalogram
    for file in _files(window):
        file.unlink()

    def act() -> None:
        panel.set_phase(False)
        panel.set_channel(next(names))

    taken = _taken(panel, act)
    panel.set_phase(True)
    settle(window)
    return taken


def _before(window: Window) -> Taken:
    """Of a span a little shorter than the one before, of a channel of which all is known."""
    document, panel = window.document, window.label.scalogram
    start, end = document.start, document.end
    nearer = partial(document.set_span, start, end - NEARER * (end - start))
    taken = _taken(panel, nearer)
    document.set_span(start, end)
    settle(window)
    return taken


def _from_file(window: Window) -> Taken | None:
    """Of a channel that a file was kept of; None where none is kept."""
    if not _files(window):
        return None
    panel = window.label.scalogram
    known = panel.channel
    panel.set_channel(next(one.name for one in recordings.CHANNELS if one.name != known))
    settle(window)
    return _taken(panel, partial(panel.set_channel, known))


def _taken(panel: ScalogramPanel, act: Callable[[], object]) -> Taken:
    """Seconds from an act to the first picture and to the exact one."""
    before = panel.picture
    begin = time.perf_counter()
    act()
    until(lambda: panel.picture is not None and panel.picture is not before)
    first = time.perf_counter() - begin
    until(lambda: panel.settled)
    return first, time.perf_counter() - begin


def _files(window: Window) -> list[Path]:
    """What was kept of scalograms."""
    project = window.document.project
    assert project is not None
    return sorted(project.path.rglob("scalogram-*.npz"))
