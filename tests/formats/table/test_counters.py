"""A device's counter is no signal; where nothing else tells the time, it tells what was lost."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.table import read
from forcelab.formats.table_columns import counter_ticks, is_counter_name


@pytest.fixture
def table(tmp_path):
    """Writes a table of a counter, perhaps stamps, and a force that is the row's true number."""

    def write(counts, header="Paket;Daumen_x", times=None):
        rows = [header if times is None else f"Zeit;{header}"]
        for row, count in enumerate(counts):
            stamp = [] if times is None else [f"{times[row]:.3f}".replace(".", ",")]
            rows.append(";".join([*stamp, str(count), f"{np.sin(row):.3f}".replace(".", ",")]))
        path = tmp_path / "trial.csv"
        path.write_text("\n".join(rows) + "\n")
        return path

    return write


def loaded(path, **options):
    (recording,) = read(path, ReadOptions(**options))
    return recording


#: Of 300 samples 80 are lost, and a 16-bit counter begins again.
NUMBERS = np.array([n for n in range(300) if not 100 <= n < 180])
COUNTS = (65_400 + NUMBERS) % 65_536


def test_beside_stamps_a_counter_is_left_out_and_said(table):
    recording = loaded(table(COUNTS, times=NUMBERS / 200))
    assert [c.name for c in recording.demonstration.channels] == ["Daumen_x"]
    assert "Column Paket was left out: counting samples." in recording.remarks


def test_without_stamps_it_places_the_rows_so_that_what_was_lost_is_a_gap(table):
    recording = loaded(table(COUNTS), rate=200.0)
    np.testing.assert_allclose(recording.demonstration.times, NUMBERS / 200, atol=1e-12)
    assert "80 of 300 were lost" in " ".join(recording.remarks)


def test_a_column_of_on_and_off_is_a_signal_and_said_to_be_one_unless_it_was_asked_for(tmp_path):
    path = tmp_path / "trial.csv"
    rows = [f"{i / 100},{np.sin(i):.3f},{i % 2},{i % 3}" for i in range(40)]
    path.write_text("\n".join(["t (s),fz,button,gear", *rows]) + "\n")
    (remark,) = loaded(path).remarks
    assert remark.startswith("Column button holds nothing but 0 and 1")
    assert loaded(path, signals=("button",)).remarks == ()
    assert "button" not in " ".join(loaded(path, leave_out=("button",)).remarks[1:])


@pytest.mark.parametrize("last", [300, 1500, 20_000, 30_999, 40_000])
def test_a_device_that_was_restarted_is_a_gap_of_unknown_length_and_no_loss(table, last):
    counts = [*range(last - 199, last + 1), *range(100)]
    recording = loaded(table(counts), rate=200.0)
    np.testing.assert_allclose(recording.demonstration.times, np.arange(300) / 200, atol=1e-12)
    said = " ".join(recording.remarks)
    assert "none was lost" in said
    assert "'Paket' begins again once, first in line 202" in said
    assert "a gap of unknown length" in said


def test_a_device_that_was_restarted_early_counts_far_beyond_that(table):
    recording = loaded(table([*range(200), *range(3, 600)]), rate=200.0)
    assert [c.name for c in recording.demonstration.channels] == ["Daumen_x"]


@pytest.mark.parametrize("counts", [[*range(200), 198, *range(199, 400)], [*range(400, 0, -1)]])
def test_what_falls_but_not_to_its_beginning_is_a_signal_whatever_its_name(table, counts):
    path = table(counts, times=np.arange(len(counts)) / 200)
    assert [c.name for c in loaded(path).demonstration.channels] == ["Paket", "Daumen_x"]


def test_a_turn_at_which_samples_were_lost_is_no_restart(table):
    counts = [*range(32_000, 32_700), *range(50, 300)]
    said = " ".join(loaded(table(counts), rate=200.0).remarks)
    assert "118 of 1,068 were lost" in said
    assert "begins again" not in said


def test_one_of_any_name_is_known_by_how_it_goes_on(table):
    recording = loaded(table(COUNTS, "Wert_A;Wert_B"), rate=200.0)
    assert [c.name for c in recording.demonstration.channels] == ["Wert_B"]
    assert recording.demonstration.duration == pytest.approx(1.5)
    assert "if it is a signal, import it as one (--signal)" in " ".join(recording.remarks)


def test_a_column_taken_for_a_counter_is_a_signal_where_it_is_asked_for(table):
    path = table(np.arange(200), "Traverse;Daumen_x", times=np.arange(200) / 200)
    assert [c.name for c in loaded(path).demonstration.channels] == ["Daumen_x"]
    demonstration = loaded(path, signals=("traverse",)).demonstration
    assert [c.name for c in demonstration.channels] == ["Traverse", "Daumen_x"]
    np.testing.assert_array_equal(demonstration.signals[:, 0], np.arange(200))
    with pytest.raises(InputError, match="'Traverse' is asked for as a signal and as something"):
        loaded(path, signals=("Traverse",), leave_out=("Traverse",))


@pytest.mark.parametrize("wish", ["leave_out", "signals"])
def test_rows_do_not_go_by_a_column_that_is_said_to_be_no_counter(table, wish):
    recording = loaded(table(COUNTS), rate=200.0, **{wish: ("Paket",)})
    np.testing.assert_allclose(recording.demonstration.times, np.arange(NUMBERS.size) / 200)


def test_a_temperature_called_t_is_a_signal_where_it_is_asked_for(table):
    path = table(NUMBERS // 8 + 20, "t;Daumen_x")
    demonstration = loaded(path, rate=200.0, signals=("t",)).demonstration
    assert [c.name for c in demonstration.channels] == ["t", "Daumen_x"]


def test_second_times_are_a_signal_where_they_are_asked_for(tmp_path):
    path = tmp_path / "trial.csv"
    rows = (f"{i / 100},{i * 7 % 5 / 10},{i}" for i in range(50))
    path.write_text("\n".join(["time,fx,device time", *rows]) + "\n")
    assert [c.name for c in loaded(path).demonstration.channels] == ["fx"]
    channels = loaded(path, signals=("device time",)).demonstration.channels
    assert [c.name for c in channels] == ["fx", "device time"]


@pytest.mark.parametrize("header", [None, "time,id,fx"])
def test_what_counts_rows_only_at_first_stays_a_signal(tmp_path, header):
    path = tmp_path / "trial.csv"
    there = [min(i, 12_000 - i) for i in range(9_000)]  # there, and half the way back
    rows = [f"{i / 100},{there[i]},{np.sin(i):.3f}" for i in range(9_000)]
    path.write_text("\n".join([*([header] if header else []), *rows]) + "\n")
    demonstration = loaded(path).demonstration
    assert len(demonstration.channels) == 2
    np.testing.assert_array_equal(demonstration.signals[:, 0], there)


def test_numbers_of_rows_of_which_some_were_taken_out_are_no_signal(tmp_path):
    path = tmp_path / "trial.csv"
    numbers = [i if i < 7_000 else 3 * i + i % 2 for i in range(9_000)]
    rows = [f"{i / 100},{number},{np.sin(i):.3f}" for i, number in enumerate(numbers)]
    path.write_text("\n".join(["time,index,fx", *rows]) + "\n")
    assert [c.name for c in loaded(path).demonstration.channels] == ["fx"]


def test_words_are_no_signal_even_where_they_are_asked_for(tmp_path):
    path = tmp_path / "trial.csv"
    rows = (f"{i / 100},{i * 7 % 5 / 10},word {i}" for i in range(50))
    path.write_text("\n".join(["time,fx,note", *rows]) + "\n")
    with pytest.raises(InputError, match="'note' holds no numbers, so that it is no signal"):
        loaded(path, signals=("note",))


@pytest.mark.parametrize("name", ["encoder_count", "MotorTicks", "Position", "enc2"])
def test_what_is_measured_at_an_even_speed_stays_a_signal(table, name):
    path = table(np.arange(200), f"{name};Daumen_x", times=np.arange(200) / 200)
    assert [c.name for c in loaded(path).demonstration.channels] == [name, "Daumen_x"]


def test_a_counter_that_is_asked_for_stands_before_stamps(table):
    path = table(COUNTS, times=np.arange(NUMBERS.size) / 200)
    recording = loaded(path, rate=100.0, counter="paket")
    np.testing.assert_allclose(recording.demonstration.times, NUMBERS / 100, atol=1e-12)
    with pytest.raises(InputError, match="'Daumen_x' does not go on by one step"):
        loaded(path, rate=100.0, counter="Daumen_x")
    with pytest.raises(InputError, match="'Paket' counts the samples; say how many there are"):
        loaded(path, counter="Paket")


def test_columns_that_are_not_wanted_become_no_channels(table):
    path = table(NUMBERS % 7, "Taster;Daumen_x", times=NUMBERS / 200)
    for wish, left in (("taster", "Daumen_x"), ("3", "Taster")):
        recording = loaded(path, leave_out=(wish,))
        assert [c.name for c in recording.demonstration.channels] == [left]
        assert any("was left out: not wanted" in remark for remark in recording.remarks)
    with pytest.raises(InputError, match="no column 'Daumenx' of values; name one of"):
        loaded(path, leave_out=("Daumenx",))


@pytest.mark.parametrize(
    ("values", "named"),
    [
        (np.arange(200) % 7, True),  # seven states in turn
        (np.sin(np.arange(200.0)), True),  # no whole numbers
        (np.repeat([0, 1], 100), True),  # a switch
        (np.random.default_rng(0).integers(0, 9000, 200), True),  # raw values of a sensor
        (np.arange(50), False),  # too few to tell
        (np.repeat(np.arange(400), [1] * 399 + [3]), False),  # stands still at last
        (np.full(200, np.nan), True),
    ],
)
def test_what_is_no_counter_stays_a_signal(values, named):
    assert counter_ticks(np.asarray(values, np.float64), named) is None


def test_steps_of_several_are_one_and_missing_counts_stay_missing():
    values = np.array([0, 10, 20, np.nan, 40, 50, 80, 90, 100, 110, 120, 130.0])
    np.testing.assert_array_equal(
        counter_ticks(values, True), [0, 1, 2, np.nan, 4, 5, 8, 9, 10, 11, 12, 13]
    )


@pytest.mark.parametrize(
    ("name", "counts"),
    [
        *((name, True) for name in ("Paket", "packet_no", "SampleCounter", "Zähler", "nr")),
        ("force_counter", True),
        *((name, False) for name in ("fx1", "Daumen_x", "norm", "pressure", "wheel ticks")),
    ],
)
def test_names_of_counters(name, counts):
    assert is_counter_name(name) is counts
