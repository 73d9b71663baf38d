"""The authors' databases: what a record becomes, and what is refused."""

import pickle
import time
from pathlib import Path

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.formats import pdl
from forcelab.formats.recording import ReadOptions
from forcelab.labels import Segment, Track

TONGS = Path(__file__).resolve().parents[3] / "../shared/data/tongs"
needs_tongs = pytest.mark.skipif(not TONGS.is_dir(), reason="the real recordings are not here")

N = 8


def record(name="grip-1", **changed):
    """A record of eight samples at 100 Hz, with distinct numbers in every signal."""
    fx1, fy1, fx2, fy2 = (np.arange(N) * step + step for step in (0.3, 0.4, 0.6, 0.8))
    signals = [[] for _ in range(11)]
    signals[0], signals[1] = np.hypot(fx1, fy1), np.hypot(fx2, fy2)
    signals[2], signals[3] = -np.arange(N) - 0.25, -np.arange(N) - 0.75
    signals[7], signals[8], signals[9], signals[10] = fx1, fy1, fx2, fy2
    made = {
        "name": name,
        "timestamps": [12.5 + i / 100 for i in range(N)],
        "labels": ["", "grab", "grab", "grab", "", "slip", "grab", "grab"],
        "signals": [[float(value) for value in signal] for signal in signals],
        "signal_bundle": None,
        "__id__": 0,
    }
    return made | changed


def database(*records, protocol=2):
    parts = (["name", "signals"], len(records), dict(enumerate(records)), {}, {"name": None})
    return b"".join(pickle.dumps(part, protocol) for part in parts)


@pytest.fixture
def written(tmp_path):
    """Writes a database and gives its path."""

    def write(*records, **how):
        path = tmp_path / "tongs_sig.pdl"
        path.write_bytes(database(*records, **how))
        return path

    return write


def test_six_forces_in_newton_come_from_their_places(written):
    (recording,) = pdl.read(written(record()), ReadOptions(task="stylus", rate=50.0))
    demonstration = recording.demonstration
    assert [channel.name for channel in demonstration.channels] == [
        "fx1", "fy1", "fz1", "fx2", "fy2", "fz2",
    ]  # fmt: skip
    assert {channel.unit for channel in demonstration.channels} == {"N"}
    np.testing.assert_allclose(
        demonstration.signals[2], [0.9, 1.2, -2.25, 1.8, 2.4, -2.75], rtol=1e-14
    )
    assert (demonstration.name, demonstration.task) == ("grip-1", "stylus")
    assert demonstration.grid_rate == 50.0
    assert recording.remarks == ()


def test_time_starts_at_zero_and_labels_go_with_it(written):
    (recording,) = pdl.read(written(record()), ReadOptions(author="Ada"))
    times = recording.demonstration.times
    assert times[0] == 0.0
    np.testing.assert_allclose(times, np.arange(N) / 100, atol=1e-12)
    assert recording.tracks == (
        Track(
            "Ada",
            (
                Segment(times[1], times[4], "grab"),
                Segment(times[5], times[6], "slip"),
                Segment(times[6], times[7] + recording.demonstration.period, "grab"),
            ),
        ),
    )


@pytest.mark.parametrize("labels", [[""] * N, ["Unlabelled"] * N, None])
def test_a_record_without_labels_has_no_track(written, labels):
    (recording,) = pdl.read(written(record(labels=labels)), ReadOptions())
    assert recording.tracks == ()


@pytest.mark.parametrize("protocol", [0, 1, 2])
def test_every_protocol_of_python_2_is_told_by_content_and_read(tmp_path, protocol):
    path = tmp_path / "renamed.bin"
    path.write_bytes(database(record(), protocol=protocol))
    assert pdl.sniff(path, path.read_bytes()[:64])
    assert len(pdl.read(path, ReadOptions())) == 1


@pytest.mark.parametrize(
    "head", [b"t,fx\n0,1\n", b"(label)\n", b"]\n", b"PK\x03\x04", b"channel\n"]
)
def test_what_is_no_pickle_is_not_taken_for_one(tmp_path, head):
    assert not pdl.sniff(tmp_path / "x.csv", head)


def test_demonstrations_keep_the_order_of_the_file(written):
    path = written(*(record(name) for name in ("z", "a", "m")))
    assert [r.demonstration.name for r in pdl.read(path, ReadOptions())] == ["z", "a", "m"]


@pytest.mark.parametrize("names", [("a", "a"), ("a", ""), ("a", None), ("a", "b\nc"), (3, "a")])
def test_records_without_names_of_their_own_are_named_after_the_file(written, names):
    recordings = pdl.read(written(*map(record, names)), ReadOptions())
    assert [r.demonstration.name for r in recordings] == ["tongs_sig 01", "tongs_sig 02"]
    assert recordings[0].remarks == (
        "The names of the records are missing or not unique; the demonstrations are called "
        "'tongs_sig 01' and so on.",
    )
    assert recordings[1].remarks == ()


def test_magnitudes_that_belong_to_other_forces_are_told_or_refused(written):
    odd = record()
    odd["signals"][1] = [value * 1.001 for value in odd["signals"][1]]
    path = written(record("first"), odd)
    recordings = pdl.read(path, ReadOptions())
    assert recordings[1].remarks == (
        "'grip-1': signal 1 is not the magnitude of signals 9 and 10, which were taken.",
    )
    with pytest.raises(InputError, match="record 1: 'grip-1': signal 1 is not the magnitude"):
        pdl.read(path, ReadOptions(strict=True))


def without(place):
    signals = record()["signals"]
    signals[place] = []
    return signals


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"signals": without(9)}, "record 1: signal 9 has 0 samples where timestamps has 8"),
        ({"signals": record()["signals"][:9]}, "record 1: signal 9 has 0 samples"),
        ({"signals": None}, "record 1 has no signals"),
        ({"signals": [["1.5"] * N] * 11}, "record 1: signal 0 is no list of numbers"),
        ({"signals": [[True] * N] * 11}, "record 1: signal 0 is no list of numbers"),
        ({"timestamps": [0.0, 0.1]}, "signal 7 has 8 samples where timestamps has 2"),
        ({"timestamps": "12345678"}, "record 1: timestamps is no list of numbers"),
        ({"timestamps": [float("inf")] * N}, "record 1: timestamps holds something that is no"),
        ({"timestamps": [0.5] * N}, "'grip-1': time does not increase at sample 1"),
        ({"labels": ["grab"] * 7}, "record 1 has 7 labels for 8 samples"),
        ({"labels": [1] * N}, "record 1: labels is no list of names"),
        ({"labels": ["a\nb"] * N}, r"record 1: the label 'a\nb' is no printable name"),
    ],
)
def test_a_damaged_record_is_refused_by_its_number(written, changed, what):
    with pytest.raises(InputError) as refusal:
        pdl.read(written(record("fine"), record(**changed)), ReadOptions())
    assert what in str(refusal.value)


@pytest.mark.parametrize(
    ("parts", "what"),
    [
        (({"a": 1},), "is no pydblite database"),
        ((["name"], 1), "is no pydblite database"),
        ((["name"], 1, {}), "is a database without records"),
        ((["name"], 1, {"a": {}}), "what is kept under 'a' is no record"),
        ((["name"], 1, {0: [1]}), "what is kept under 0 is no record"),
        ((["name"], 1, {0: {}}), "record 0: timestamps is no list of numbers"),
    ],
)
def test_other_pickles_are_refused(tmp_path, parts, what):
    path = tmp_path / "x.pdl"
    path.write_bytes(b"".join(pickle.dumps(part, 2) for part in parts))
    with pytest.raises(InputError) as refusal:
        pdl.read(path, ReadOptions())
    assert what in str(refusal.value)


def test_the_authors_class_around_the_signals_is_not_built(tmp_path):
    bundle = b"(clabelSelectedData\nSignalBundle\no}U\x04nameU\x01xsb"
    plain = pickle.dumps(record(), 2)[2:-1]
    records = b"\x80\x02}K\x00" + plain + b"U\x0dsignal_bundle" + bundle + b"ss."
    path = tmp_path / "x.pdl"
    path.write_bytes(pickle.dumps(["name"], 2) + pickle.dumps(1, 2) + records)
    (recording,) = pdl.read(path, ReadOptions())
    assert recording.demonstration.times.size == N


def test_a_file_too_large_for_a_database_is_not_even_opened(tmp_path):
    path = tmp_path / "x.pdl"
    with path.open("wb") as sparse:
        sparse.truncate(64 * 2**20 + 1)
    with pytest.raises(InputError, match="is larger than 67,108,864 bytes"):
        pdl.read(path, ReadOptions())


@pytest.mark.real
@needs_tongs
@pytest.mark.parametrize(
    ("file", "actions"),
    [
        (
            "JPen_sig.pdl",
            {"still", "grab_pen", "pull_pen", "slip_pen", "sliptransition_pen", "slipped_pen"},
        ),
        ("soft_sig.pdl", {"still", "grab_soft", "hold_soft", "release_soft"}),
    ],
)
def test_the_papers_recordings(file, actions):
    started = time.process_time()
    recordings = pdl.read(TONGS / file, ReadOptions(author="coder"))
    assert time.process_time() - started < 1.5
    assert len(recordings) == 10
    assert {action for r in recordings for action in r.tracks[0].actions} == actions
    for recording in recordings:
        demonstration = recording.demonstration
        assert recording.remarks == ()
        assert demonstration.rate == pytest.approx(1000, rel=1e-9)
        assert demonstration.gaps == ()
        assert 3.5 < demonstration.duration < 6.3
        assert np.isfinite(demonstration.signals).all()
        # squeezing is negative on both normals, and the tongs are squeezed in every recording
        assert (demonstration.signals[:, [2, 5]].min(axis=0) < -1.5).all()
        unlabelled = 1 - recording.tracks[0].labelled / demonstration.duration
        assert 0.01 < unlabelled < 0.15
