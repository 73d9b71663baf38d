from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference, median_step
from forcelab.errors import InputError

TIMES = np.arange(8) / 1000
SIGNALS = np.arange(16.0).reshape(8, 2)
CHANNELS = (Channel("tangential", "N"), Channel("normal", "N"))


def make(**changes: object) -> Demonstration:
    """A small demonstration, with some of its parts changed."""
    parts = {
        "name": "LEGO 07",
        "task": "LEGO",
        "times": TIMES,
        "signals": SIGNALS,
        "channels": CHANNELS,
    }
    return Demonstration(**{**parts, **changes})


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"name": " "}, "needs a name"),
        ({"times": TIMES[:1], "signals": SIGNALS[:1]}, "'LEGO 07' has fewer than two samples"),
        ({"times": []}, "fewer than two samples"),
        ({"times": TIMES * 1e-300}, "1e-303 s apart.*unit of its stamps"),
        ({"times": TIMES * 1e14}, r"1e\+11 s apart.*unit of its stamps"),
        ({"signals": SIGNALS[:7]}, r"shape \(7, 2\) do not fit 8 times and 2 channels"),
        ({"signals": SIGNALS.ravel()}, r"shape \(16,\) do not fit"),
        ({"channels": CHANNELS[:1]}, "do not fit 8 times and 1 channels"),
        ({"channels": (), "signals": np.empty((8, 0))}, "do not fit 8 times and 0 channels"),
        ({"times": np.where(TIMES == 0.003, np.nan, TIMES)}, "sample 3 has no finite time"),
        ({"times": np.where(TIMES == 0.007, np.inf, TIMES)}, "sample 7 has no finite time"),
        (
            {"times": np.where(TIMES == 0.004, 0.003, TIMES)},
            r"does not increase at sample 4 \(0\.003 s, then 0\.003 s\)",
        ),
        ({"times": TIMES[::-1]}, r"does not increase at sample 1 \(0\.007 s, then 0\.006 s\)"),
        ({"channels": (Channel("fx"), Channel("fx", "N"))}, "two channels called 'fx'"),
        ({"grid_rate": 0.0}, "rate must be positive, not 0.0 Hz"),
        ({"grid_rate": -5.0}, "rate must be positive"),
        ({"grid_rate": np.inf}, "rate must be positive"),
        ({"grid_rate": np.nan}, "rate must be positive"),
    ],
)
def test_what_is_no_demonstration_is_refused_with_a_sentence(changes, sentence):
    with pytest.raises(InputError, match=sentence):
        make(**changes)


@pytest.mark.parametrize("name", ["", " \t"])
def test_a_channel_needs_a_name(name):
    with pytest.raises(InputError, match="A channel needs a name"):
        Channel(name)


def test_missing_samples_are_kept_as_they_are():
    signals = np.where(SIGNALS == 3, np.nan, np.where(SIGNALS == 4, np.inf, SIGNALS))
    np.testing.assert_array_equal(make(signals=signals).signals, signals)


def test_nobody_can_change_a_demonstration():
    times, signals = TIMES.copy(), SIGNALS.copy()
    demonstration = make(times=times, signals=signals)
    times[:] = 0
    signals[:] = 0
    assert demonstration == make()
    np.testing.assert_array_equal(demonstration.signals, SIGNALS)
    for array in (demonstration.times, demonstration.signals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
    with pytest.raises(AttributeError):
        demonstration.name = "other"


def test_a_memory_mapped_recording_is_not_copied(tmp_path):
    np.save(tmp_path / "times.npy", TIMES)
    np.save(tmp_path / "signals.npy", SIGNALS)
    times, signals = (
        np.load(tmp_path / name, mmap_mode="r", allow_pickle=False)
        for name in ("times.npy", "signals.npy")
    )
    demonstration = make(times=times, signals=signals)
    assert np.shares_memory(demonstration.times, times)
    assert np.shares_memory(demonstration.signals, signals)
    assert demonstration.id == make().id


@pytest.mark.parametrize(
    "signals",
    [
        SIGNALS.astype(np.float32),
        SIGNALS.astype(">f8"),
        np.asfortranarray(SIGNALS),
        SIGNALS.tolist(),
    ],
)
def test_the_id_does_not_depend_on_how_numbers_lay_in_memory(signals):
    assert make(signals=signals).id == make().id


def test_read_only_numbers_of_another_kind_become_float64():
    signals = SIGNALS.astype(np.float32)
    signals.flags.writeable = False
    assert make(signals=signals).signals.dtype == np.float64
    assert make(signals=signals).id == make().id


def test_a_recording_is_the_same_whatever_it_is_called():
    video = VideoReference(Path("lego.mp4"), ClockMap(offset=0.2))
    other = make(name="first", task="stylus", videos=(video,), grid_rate=500.0)
    assert other.id == make().id
    assert other == make()
    assert len({other, make()}) == 1
    assert make() != "LEGO 07"


@given(st.sampled_from(["times", "signals"]), st.integers(0, 15), st.integers(0, 2))
def test_the_id_tells_a_single_bit(which, position, bit):
    array = (TIMES + 1.0 if which == "times" else SIGNALS + 1.0).copy()
    base = make(**{which: array.copy()})
    array.reshape(-1).view(np.uint64)[position % array.size] ^= np.uint64(1 << bit)
    changed = make(**{which: array})
    assert changed.id != base.id
    assert changed != base


@pytest.mark.parametrize(
    "channels",
    [
        (Channel("tangential", "N"), Channel("Normal", "N")),
        (Channel("tangential", "N"), Channel("normal", "mN")),
        CHANNELS[::-1],
        (Channel("tangentialN", ""), Channel("normal", "N")),
    ],
)
def test_the_id_tells_channel_names_and_units(channels):
    assert make(channels=channels).id != make().id


def test_the_id_is_the_same_in_every_process():
    # Written down once: projects keep ids on disk. It must never change.
    assert make().id == "186f90fcee6cc049aa6a9f630eb24476"


def test_rate_is_the_inverse_of_the_median_period_unless_asked_for():
    times = np.array([0.0, 0.01, 0.02, 0.03, 0.05, 0.06, 0.5, 0.51])
    assert make(times=times).period == pytest.approx(0.01)
    assert make(times=times).rate == pytest.approx(100.0)
    assert make(times=times, grid_rate=250.0).rate == 250.0
    assert make(times=times, grid_rate=250.0).period == pytest.approx(0.01)


@pytest.mark.parametrize("n", [2, 3, 4, 5, 1000, 1001])
def test_the_period_is_the_median_to_the_last_digit(n):
    times = np.cumsum(np.random.default_rng(n).choice([1e-3, 1e-3, 2.1e-3, 0.7e-3], n))
    assert make(times=times, signals=np.zeros((n, len(CHANNELS)))).period == np.median(
        np.diff(times)
    )


@pytest.mark.parametrize("step", ["even", "random", "tiny", "any"])
@pytest.mark.parametrize("n", [9, 10, 300, 301])
def test_the_median_step_is_the_same_where_there_is_no_room_for_all_steps(step, n, monkeypatch):
    monkeypatch.setattr("forcelab.demonstration._COPIED", 7)
    random = np.random.default_rng(n)
    times = {
        "even": 1.7e9 + np.arange(n) / 1000,
        "random": np.cumsum(random.exponential(size=n)),
        "tiny": np.cumsum(random.integers(1, 4, n) * 1e-300),
        "any": np.unique(np.cumsum(10.0 ** random.uniform(-20, 20, n))),
    }[step]
    assert median_step(times) == np.median(np.diff(times))


def test_the_last_sample_lasts_one_period():
    demonstration = make(times=2.0 + np.arange(8) * 0.5)
    assert (demonstration.start, demonstration.end, demonstration.duration) == (2.0, 6.0, 4.0)


@given(st.lists(st.integers(1, 9), min_size=7, max_size=40))
def test_gaps_are_the_stretches_of_more_than_five_periods(steps):
    times = np.cumsum([0, *steps]).astype(float)
    n = times.size
    demonstration = make(times=times, signals=np.zeros((n, 2)))
    period = sorted(steps)[len(steps) // 2]
    if len(steps) % 2 == 0:
        period = (period + sorted(steps)[len(steps) // 2 - 1]) / 2
    expected = [(times[i] + period, times[i + 1]) for i in range(n - 1) if steps[i] > 5 * period]
    assert list(demonstration.gaps) == expected


def test_a_demonstration_sent_to_another_process_is_the_same_there():
    demonstration = make(grid_rate=500.0)
    copy = pickle.loads(pickle.dumps(demonstration))  # noqa: S301
    assert copy == demonstration
    assert copy.name == demonstration.name
    assert copy.grid_rate == 500.0
    for array in (copy.times, copy.signals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
