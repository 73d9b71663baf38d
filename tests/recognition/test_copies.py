"""Near copies of a recording are found, and two performances of a task never taken for one."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from factories import read_labelled, synthetic_set
from hypothesis import given
from hypothesis import strategies as st

from forcelab.demonstration import Channel, Demonstration
from forcelab.formats import read
from forcelab.jobs import finish
from forcelab.recognition import copies
from forcelab.recognition.copies import LEAST_LIKENESS, find_copies
from forcelab.recognition.cross_validation import leave_one_out_job, train_and_test_job
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.groups import fold_groups
from forcelab.recognition.presets import preset

RATE = 250.0


def with_signals(demonstration, change):
    return replace(demonstration, signals=change(np.array(demonstration.signals)))


def cut(demonstration, *, first=0.0, last=0.0):
    """Without so many seconds at the ends, its clock begun anew."""
    times = demonstration.times - demonstration.times[0]
    inside = (times >= first) & (times <= times[-1] - last)
    signals = demonstration.signals[inside]
    return replace(demonstration, times=times[inside] - first, signals=signals)


def resampled(demonstration, factor):
    """At another rate, read off straight lines."""
    times = demonstration.times
    stamps = np.linspace(times[0], times[-1], int(factor * len(times)))
    columns = [np.interp(stamps, times, column) for column in demonstration.signals.T]
    return replace(demonstration, times=stamps, signals=np.stack(columns, axis=1))


def without(demonstration, start, end):
    """With no samples from start to end (s)."""
    left = ~((demonstration.times >= start) & (demonstration.times < end))
    return replace(
        demonstration, times=demonstration.times[left], signals=demonstration.signals[left]
    )


def glitch(signals):
    signals[len(signals) // 2] = 1000.0
    return signals


def lose_samples(signals):
    signals[::9] = np.nan
    return signals


COPIES = {
    "rounded": lambda d: with_signals(d, lambda signals: np.round(signals, 1)),
    "cropped": lambda d: cut(d, first=0.107),
    "cropped at both ends": lambda d: cut(d, first=0.3, last=0.2),
    "scaled": lambda d: with_signals(d, lambda signals: 1.001 * signals),
    "zeroed": lambda d: with_signals(d, lambda signals: signals - signals[0]),
    "resampled": lambda d: resampled(d, 0.7),
    "thinned": lambda d: replace(d, times=d.times[::2], signals=d.signals[::2]),
    "with lost samples": lambda d: with_signals(d, lose_samples),
    "with a gap": lambda d: without(d, 1.0, 1.2),
    "with a glitch": lambda d: with_signals(d, glitch),
    "all of these": lambda d: resampled(
        with_signals(cut(d, first=0.05), lambda signals: 1.01 * np.round(glitch(signals), 2)), 0.8
    ),
}


@pytest.fixture(scope="module")
def five():
    return [demonstration for demonstration, _ in synthetic_set(5, RATE)]


def alone(demonstrations):
    return [[i] for i in range(len(demonstrations))]


@pytest.mark.parametrize("change", COPIES)
def test_copies_that_were_changed_a_little_are_found(five, change):
    found = find_copies([*five, COPIES[change](five[1]), COPIES[change](five[3])])
    assert found == [[0], [1, 5], [2], [3, 6], [4]]


@given(
    st.integers(0, 4),
    st.floats(0.0, 0.4),
    st.floats(0.0, 0.4),
    st.floats(0.9, 1.1),
    st.floats(0.5, 1.0),
    st.permutations(range(6)),
)
def test_a_copy_is_found_whatever_was_done_to_it(five, chosen, first, last, scale, factor, order):
    copy = resampled(cut(five[chosen], first=first, last=last), factor)
    copy = replace(
        copy,
        signals=scale * copy.signals[:, order],
        channels=tuple(copy.channels[i] for i in order),
    )
    expected = [[i, 5] if i == chosen else [i] for i in range(5)]
    assert find_copies([*five, copy]) == expected


def added(demonstration, name, column):
    signals = np.column_stack([demonstration.signals, column(len(demonstration.times))])
    return replace(
        demonstration, signals=signals, channels=(*demonstration.channels, Channel(name))
    )


SHARED = {
    "counter": np.arange,
    "counter of a byte": lambda n: np.arange(n) % 256,
    "trigger": lambda n: (np.arange(n) > 200).astype(float),
    "hum": lambda n: np.sin(np.arange(n) / 20),
    "constant": np.ones,
    "nothing": lambda n: np.full(n, np.nan),
    "glitch": lambda n: 1e6 * (np.arange(n) == 100),
}


@pytest.mark.parametrize("name", SHARED)
def test_a_channel_that_recordings_share_makes_them_no_copies(five, name):
    items = [added(demonstration, name, SHARED[name]) for demonstration in five]
    assert find_copies(items) == alone(items)
    narrow = [replace(i, signals=i.signals[:, 2:], channels=i.channels[2:]) for i in items]
    assert find_copies(narrow) == alone(narrow)
    copy = with_signals(items[1], lambda signals: 1.001 * np.round(signals, 2))
    assert find_copies([*items, copy]) == [[0], [1, 5], [2], [3], [4]]


def test_a_jolt_that_all_share_makes_them_no_copies(five):
    def jolted(signals):
        signals[300:340] += 50.0
        return signals

    items = [with_signals(demonstration, jolted) for demonstration in five]
    assert find_copies(items) == alone(items)


def test_a_recording_that_holds_another_is_its_copy_and_copies_of_copies_are(five):
    whole = five[2]
    parts = [cut(whole, last=whole.duration / 3), cut(whole, first=whole.duration / 3)]
    assert find_copies([parts[0], *five[:2], whole, parts[1]]) == [[0, 3, 4], [1], [2]]


def test_extra_channels_and_a_channel_that_is_missing_hide_no_copy(five):
    copy = added(with_signals(five[0], lambda s: np.round(s, 2)), "hum", SHARED["hum"])
    fewer = replace(five[1], signals=five[1].signals[:, :4], channels=five[1].channels[:4])
    assert find_copies([*five, copy, fewer]) == [[0, 5], [1, 6], [2], [3], [4]]


def test_recordings_too_short_or_without_movement_or_common_channels_are_copies_only_if_equal():
    def recording(n, value, name="f"):
        signals = np.full((n, 1), value)
        return Demonstration("a", "foam", np.arange(n) / 100, signals, (Channel(name),))

    items = [recording(2, 1.0), recording(2, 2.0), recording(900, 1.0), recording(900, 2.0)]
    items += [replace(items[2], times=items[2].times + 1), recording(500, 3.0, "g")]
    assert find_copies(items) == [[0], [1], [2, 4], [3], [5]]
    assert find_copies([]) == []


def periodic(seed):
    """Shaking at 2 Hz, as steadily as a person can."""
    random = np.random.default_rng(seed)
    t = np.arange(1600) / 200
    slow = [np.interp(t, np.arange(9), random.standard_normal(9)) for _ in range(2)]
    speed = 2 + 0.1 * random.standard_normal() + 0.15 * slow[0]
    phase = 2 * np.pi * np.cumsum(speed) / 200
    loudness = 1 + 0.1 * slow[1]
    columns = [loudness * np.sin(phase + shift) for shift in (0.0, 0.3, 1.0, 2.0)]
    signals = np.stack(columns, axis=1) + 0.01 * random.standard_normal((1600, 4))
    channels = tuple(Channel(f"c{i}") for i in range(4))
    return Demonstration(f"shake {seed}", "shaking", t, signals, channels)


def test_the_same_again_and_again_is_no_copy():
    items = [periodic(seed) for seed in range(40)]
    assert find_copies(items) == alone(items)
    assert find_copies([*items, cut(items[7], first=0.4)])[7] == [7, 40]
    for i in range(4):
        assert find_copies([channel_of(item, i) for item in items]) == alone(items)


def channel_of(demonstration, i):
    """One of the channels by itself."""
    signals, channels = demonstration.signals[:, [i]], (demonstration.channels[i],)
    return replace(demonstration, signals=signals, channels=channels)


def test_of_the_pairs_of_200_recordings_few_are_looked_at_twice_and_they_are_compared_once(
    monkeypatch,
):
    items = [demonstration for demonstration, _ in synthetic_set(200, rate=500.0)]
    looked_at = []
    likeness = copies.likeness
    monkeypatch.setattr(copies, "likeness", lambda *two: looked_at.append(two) or likeness(*two))
    assert find_copies(items) == alone(items)
    assert len(looked_at) < 0.02 * 200 * 199 / 2
    monkeypatch.setattr(copies, "measure_movements", None)
    assert find_copies(items) == alone(items)


def test_six_simulated_pick_ups_are_no_copies():
    files = sorted((Path(__file__).parents[2] / "assets").glob("foam-*.csv"))
    items = [recording.demonstration for file in files for recording in read(file)]
    assert len(items) == 6
    assert find_copies(items) == alone(items)


@pytest.mark.real
def test_six_walks_with_a_watch_are_no_copies(real_file):
    files = sorted(real_file("imu").glob("*.csv"))
    items = [recording.demonstration for file in files for recording in read(file)]
    assert len(items) == 6
    assert find_copies(items) == alone(items)


@pytest.mark.real
def test_real_recordings_are_far_from_copies_and_their_copies_are_found(real_file):
    items = [item.demonstration for item in read_labelled(real_file("tongs/soft_sig.pdl"))]
    movements = copies.measure_movements([d.signals for d in items], [d.times for d in items])
    most = max(copies.likeness(*pair) for pair in combinations(movements, 2))
    assert most < 0.7 < LEAST_LIKENESS
    for i in range(len(items[0].channels)):
        single = [channel_of(item, i) for item in items]
        scaled = with_signals(single[0], lambda signals: 1.001 * np.round(signals, 3))
        assert find_copies([*single, scaled])[0] == [0, len(items)]
        assert find_copies(single) == alone(single)
    for name, change in COPIES.items():
        if name != "with a gap":  # which may lie where most happens
            both = [*items, *map(change, items)]
            expected = [[i, i + len(items)] for i in range(len(items))]
            assert find_copies(both) == expected, name


def labelled(demonstrations):
    names = {d.id: segments for d, segments in synthetic_set(5, RATE)}
    return [LabelledDemonstration(d, names[d.id]) for d in demonstrations]


def test_copies_are_left_out_together_which_a_remark_says(five):
    items = labelled(five[:3])
    copy = replace(COPIES["all of these"](five[1]), name="copy")
    evaluation = finish(
        leave_one_out_job(
            [*items, LabelledDemonstration(copy, items[1].segments)],
            preset("fast").replace(decoder="filters", classifier="logistic"),
        )
    )
    (remark,) = [r for r in evaluation.remarks if "recording" in r and "hold" in r]
    assert remark == (
        f"{five[1].name} and copy hold nearly the same recording, so that they were left out "
        f"together; remove all but one."
    )
    assert fold_groups([*five[:3], copy], None) == [[0], [1, 3], [2]]


def test_where_all_are_copies_they_are_tested_all_the_same(five):
    item = labelled(five[:1])[0]
    copy = replace(COPIES["rounded"](five[0]), name="copy")
    settings = preset("fast").replace(decoder="filters", classifier="logistic")
    evaluation = finish(
        leave_one_out_job([item, LabelledDemonstration(copy, item.segments)], settings)
    )
    assert any("tested by recognisers that had seen it" in r for r in evaluation.remarks)
    evaluation = finish(
        train_and_test_job([item], [LabelledDemonstration(copy, item.segments)], settings)
    )
    assert any(
        remark.startswith("'copy' holds nearly the same recording as")
        for remark in evaluation.remarks
    )
