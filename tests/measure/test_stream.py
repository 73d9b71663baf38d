"""The measurements of streams say what they measured."""

import numpy as np
import pytest

from forcelab.jobs import finish
from forcelab.measure import live, stream
from forcelab.measure.endless import endless
from forcelab.measure.streams import ACTIONS, forces, performed
from forcelab.recognition.examples import Labelled
from forcelab.recognition.settings import Settings
from forcelab.recognition.training import train


def test_a_stream_errs_less_than_its_tolerance_and_less_the_longer_it_waits():
    x = forces(3000, 2)
    rows = finish(stream.measuring(x, np.array([8.0, 32.0]), (1e-3, 3e-6), (0.5, 1.0, 3.0), 0, 1))
    assert [row.name for row in rows] == ["complete"] * 2 + ["early"] * 3
    assert rows[0].error <= 1e-3
    assert rows[1].error <= 3e-6
    early = [row.further["error (rms)"] for row in rows[2:]]
    assert early == sorted(early, reverse=True)
    assert early[-1] < 0.05 < early[0]
    assert all(row.seconds > 0 and row.peak_bytes > 0 for row in rows)
    assert [row.further["delay (scales)"] for row in rows[2:]] == [0.5, 1.0, 3.0]


def test_live_rows_tell_agreement_cost_and_latency():
    demonstration, segments = performed(4.0, 200.0, 1)
    recogniser = train([Labelled(demonstration, segments)], Settings(max_scale=16.0, stride=5))
    rows = finish(live.measuring(recogniser, demonstration, (20, 50), (100,), 1))
    assert [row.size[-5:] for row in rows] == ["20 ms", "50 ms"]
    for row in rows:
        assert 0 < row.error == rows[0].error < 0.7  # whatever the blocks
        typical, most = (row.further[f"{share} of medians (ms)"] for share in ("p50", "p99"))
        assert 0 < typical <= most
        assert row.further["force to label (ms)"] > 120
    # 2048 samples, over and over: the first labels' noise is another one, later nothing changes.
    longer, _ = performed(11.0, 200.0, 2)
    row = finish(endless(recogniser, longer, 100, 10_000))
    assert row.size.startswith("10240 samples of 6 channels at 200 Hz")
    assert row.error == 0.0
    assert abs(row.further["memory grown (kB)"]) < 20


@pytest.mark.parametrize("seed", [0, 5])
def test_made_up_forces_hold_all_actions_and_repeat(seed):
    demonstration, segments = performed(8.0, 500.0, seed)
    assert {segment.action for segment in segments} == set(ACTIONS)
    assert demonstration == performed(8.0, 500.0, seed)[0]
    assert forces(100, 8).shape == (100, 8)


def test_what_disturbs_one_run_stands_in_the_p99_of_runs_and_not_in_that_of_medians():
    demonstration, _ = performed(4.0, 200.0, 1)
    codes = np.zeros(len(demonstration.times), dtype=np.int64)
    runs = []
    for repetition in range(3):
        cpu = np.full(100, 1e-3)
        cpu[7] = 2e-3  # a block that costs more every time
        cpu[20 + 3 * repetition : 23 + 3 * repetition] = 9e-3  # somebody else's work, elsewhere
        runs.append(live._Run(codes, cpu, cpu))
    row = live._row("paper", demonstration, (100, 20), runs, 1, codes)
    assert row.further["p50 of medians (ms)"] == pytest.approx(1.0)
    assert 1.0 < row.further["p99 of medians (ms)"] < 2.0
    assert row.further["p99 of a run (ms)"] == pytest.approx(9.0)
    # Who waits has one run only.
    assert row.further["force to label (ms)"] == pytest.approx(100 + 20 + 9)
