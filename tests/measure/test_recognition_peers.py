"""Peers see what ours sees, are scored as ours is, and are named where they are missing."""

import numpy as np
import pytest
from synthetic import synthetic_set

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.labels import Segment
from forcelab.measure.peers.classifiers import LIGHTGBM, MINIROCKET
from forcelab.measure.peers.networks import CNN, MS_TCN
from forcelab.measure.peers.peer import Peer, Task, around
from forcelab.measure.recognition import measuring
from forcelab.measure.recognition_peers import PEERS, measuring_peers
from forcelab.measure.recognition_settings import Variant
from forcelab.recognition.examples import Labelled
from forcelab.recognition.forest import softmax
from forcelab.recognition.presets import PRESETS

RATE = 100.0


@pytest.fixture(scope="module")
def labelled():
    return [Labelled(*item) for item in synthetic_set(4, RATE)]


def level(channels, rate, places):
    return channels[:, places].T


def nearest(task, seed):
    """The action whose mean is nearest; what it was given is checked on the way."""
    X, y = task.labelled()
    assert (y >= 0).all()
    assert [len(rows) for rows in task.rows] == [len(codes) for codes in task.codes]
    means = np.stack([X[y == k].mean(axis=0) for k in range(task.actions)])
    return lambda rows: softmax(-((rows[:, None] - means) ** 2).sum(axis=2))


def peer(name="nearest mean", module="numpy", look=level, fit=nearest):
    return Peer(name, module, look, fit)


def test_peers_have_the_rows_that_ours_have(labelled):
    (ours,) = finish(measuring(labelled, [Variant("preset", "fast", PRESETS["fast"])], "foam", 2))
    rows = finish(measuring_peers(labelled, "foam", 2, [peer()]))
    assert [(r.name, r.setting) for r in rows] == [
        ("nearest mean", "as it comes"), ("nearest mean", "with our decoder")]  # fmt: skip
    for row in rows:
        assert not row.refusal
        assert row.further.keys() == ours.further.keys()
        assert (row.size, row.reference) == (ours.size, ours.reference)
        assert row.seconds > 0
        assert row.peak_bytes > 0
    assert rows[1].further["edit"] > rows[0].further["edit"]  # what the decoder is for


def test_whoever_knows_the_labels_makes_no_mistake_and_sees_no_left_out_one(labelled):
    seen = []

    def look(channels, rate, places):
        return np.stack([places / rate, np.full(len(places), channels.sum())], axis=1)

    def told(task, seed):
        sums = {float(rows[0, 1]) for rows in task.rows}
        seen.append(sums)

        def recognised(rows):
            assert float(rows[0, 1]) not in sums
            (item,) = [i for i in labelled if abs(total(i) - rows[0, 1]) < 1e-6]
            out = np.full((len(rows), task.actions), 0.0)
            actions = list(dict.fromkeys(s.action for i in labelled for s in i.segments))
            for row, t in zip(out, rows[:, 0], strict=True):
                now = [s.action for s in item.segments if s.start <= t < s.end]
                row[actions.index(now[0]) if now else 0] = 1.0
            return out

        return recognised

    def total(item):
        from forcelab.signals.channels import channel_map
        from forcelab.signals.grid import on_grid

        grid = on_grid(item.demonstration, RATE)
        return channel_map(item.demonstration.channels).apply(grid.signals).sum()

    row, _ = finish(measuring_peers(labelled, "foam", None, [peer(look=look, fit=told)]))
    assert row.further["accuracy"] > 0.97  # steps of 20 ms
    assert [len(sums) for sums in seen] == [3, 3, 3, 3]


def test_what_is_not_installed_is_named_and_the_others_measured(labelled):
    absent = peer("WaveForest", "no_such_module_anywhere")
    broken = peer("broken", fit=lambda *_: (_ for _ in ()).throw(ImportError("no compiler")))
    rows = finish(measuring_peers(labelled, "foam", 2, [absent, broken, peer()]))
    assert "WaveForest is not installed (no_such_module_anywhere); pip install" in rows[0].refusal
    assert "no compiler" in rows[1].refusal
    assert rows[2].point is not None
    with pytest.raises(InputError, match="pip install 'forcelab\\[peers\\]'"):
        absent.check()


def test_too_few_labels_are_refused():
    demonstration, segments = synthetic_set(2, RATE)[0]
    with pytest.raises(InputError, match="there is 1"):
        finish(measuring_peers([Labelled(demonstration, segments)], "foam", 2, [peer()]))
    one = [Labelled(d, (Segment(0.0, 1.0, "still"),)) for d, _ in synthetic_set(2, RATE)]
    (row,) = finish(measuring_peers(one, "foam", 2, [peer()]))
    assert "two actions" in row.refusal


def test_cells_hold_means_and_end_values_go_on():
    channel = np.arange(40.0) ** 2
    places = np.array([0, 10, 39])
    found = around(np.stack([channel, -channel]), 10.0, places, 4, 0.2).reshape(3, 2, 4)
    held = np.pad(channel, 10, mode="edge")
    for row, place in zip(found, places, strict=True):
        for j in range(4):
            # Two samples a cell: those halfway between the middle and its ends count by half.
            first = place + 10 + 0.5 + 2 * (j - 2)
            whole = int(np.floor(first))
            share = first - whole
            total = (1 - share) * held[whole] + held[whole + 1] + share * held[whole + 2]
            assert row[0, j] == pytest.approx(total / 2)
            assert row[1, j] == pytest.approx(-total / 2)


@pytest.mark.parametrize("real", PEERS, ids=lambda one: one.module + " " + one.name)
def test_a_peer_that_is_installed_learns_what_is_plain(real):
    if not real.installed:
        pytest.skip(f"{real.name} is not installed")
    random = np.random.default_rng(0)
    rows, codes = [], []
    for _ in range(4):
        y = np.repeat([0, 1, 2, 0], 50)
        channels = np.repeat(np.stack([y == 1, y == 2]).astype(float), 2, axis=1)
        channels += 0.05 * random.standard_normal(channels.shape)
        rows.append(real.look(channels, RATE, np.arange(1, 400, 2)))
        y[:3] = -1
        codes.append(y)
    found = real.fit(Task(rows[:3], codes[:3], 4, 2), 0)(rows[3])
    assert found.shape == (200, 4)
    known = codes[3] >= 0
    assert np.mean(found.argmax(axis=1)[known] == codes[3][known]) > 0.9
    assert np.allclose(found.sum(axis=1), 1.0, atol=1e-5)


def test_the_four_that_are_promised_are_there():
    assert PEERS == (MINIROCKET, LIGHTGBM, CNN, MS_TCN)
    assert [one.module for one in PEERS] == ["aeon", "lightgbm", "torch", "torch"]
