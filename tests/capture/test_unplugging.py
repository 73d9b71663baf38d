"""Unplugged and plugged in again, over a real pty: one demonstration, gaps where they were."""

import os
import time
from itertools import pairwise

import numpy as np

from forcelab.capture.device_names import parse_device
from forcelab.capture.recorder import Recorder
from forcelab.capture.save import CAPTURES
from forcelab.demonstration import GAP_PERIODS
from forcelab.project import Project
from tests.capture.helpers import eventually
from tests.capture.virtual_devices import VirtualOptoForce, VirtualTextDevice

#: How often it is unplugged within one recording; more often when asked, as each takes a second.
UNPLUGS = int(os.environ.get("FORCELAB_UNPLUGS", "2"))
#: Seconds by which a stretch's stamps may be off its earliest arrival: a busy machine makes that
#: late, and nobody can know by how much; beyond it nothing bends or shifts them.
NEAR = 0.005


def counting(times):
    """A reading that counts milliseconds of the device's clock, in two parts, beside a constant."""
    counts = np.round(times * 1000).astype(np.int64)
    return np.stack([counts % 8000, counts // 8000, np.full_like(counts, 5)], axis=1)


def pull_cable(recorder, daq, seconds):
    """Pull the cable for some seconds; gives when, on the host's clock."""
    daq.unplug()
    gone = time.monotonic()
    eventually(lambda: "unplugged" in recorder.state().devices[0].alarms)
    time.sleep(seconds)
    daq.replug()
    back = time.monotonic()
    eventually(lambda: recorder.state().devices[0].plugged)
    return gone, back


def test_each_time_it_was_unplugged_is_a_gap_in_the_one_demonstration(project):
    times_pulled = []
    with VirtualOptoForce(counting, clock_ppm=150) as daq:
        device = parse_device(f"optoforce:{daq.port}")
        with Recorder(project, [device]) as recorder:
            recorder.start("LEGO")
            for turn in range(UNPLUGS):
                samples = recorder.state().devices[0].samples
                eventually(lambda s=samples: recorder.state().devices[0].samples >= s + 150)
                times_pulled.append(pull_cable(recorder, daq, 0.02 * (turn % 5)))
            samples = recorder.state().devices[0].samples
            eventually(lambda: recorder.state().devices[0].samples >= samples + 150)
            remarks = recorder.remarks()
            saved = recorder.stop()
    assert sum("is back after" in sentence for sentence in remarks) == UNPLUGS
    assert device.connections == UNPLUGS + 1
    how_often = "once" if UNPLUGS == 1 else f"{UNPLUGS} times"
    assert any(f"was unplugged {how_often}" in remark for remark in saved.remarks)
    with Project.open(project) as opened:
        assert [info.name for info in opened.demonstrations.infos()] == ["LEGO 01"]
        d = opened.demonstrations.load("LEGO 01")
        times, signals = np.array(d.times), np.array(d.signals)
        stamps = opened.media.stamps(d.id)
    assert len(times) == len(stamps["arrived_0"]) >= 150 * (UNPLUGS + 1)
    assert np.isfinite(signals).all()
    assert len(d.gaps) == UNPLUGS
    # The clock of the device went on meanwhile: what it counted says when each sample was taken.
    truth = daq.begun + (signals[:, 1] * 8000 + signals[:, 0]) / 1000 / (1 + 150e-6)
    off, late = stamps["start"] + times - truth, stamps["arrived_0"] - truth
    edges = [0, *(np.searchsorted(times, end) for _, end in d.gaps), len(times)]
    for first, last in pairwise(edges):
        assert np.abs(off[first:last] - late[first:last].min()).max() < NEAR
    for (begin, end), (gone, back) in zip(d.gaps, times_pulled, strict=True):
        assert begin < gone - stamps["start"] + late.max()
        assert end > back - stamps["start"] - NEAR
        assert end - begin > GAP_PERIODS * d.period
    assert list((project / CAPTURES).iterdir()) == []


def test_lines_that_a_stuck_hub_holds_back_keep_their_times(project):
    def numbered(times):
        return np.column_stack([np.round(400 * times), times])

    with VirtualTextDevice(numbered, 400, decimals=6) as board:
        device = parse_device(f"text:{board.port}?rate=400")
        with Recorder(project, [device]) as recorder:
            recorder.start("LEGO")
            eventually(lambda: recorder.state().devices[0].samples > 200)
            board.stall(0.6)
            held = time.monotonic()
            eventually(lambda: recorder.latest(0.0)[0][1][0] > held + 0.8)
            _, live, values = recorder.latest(2.0)[0]
            recorder.discard()
        taken = board.truth().times
    # Within what a busy machine makes late; what came at once was up to 0.6 s late.
    assert np.abs(live - taken[values[:, 0].astype(int)]).max() < 0.2
