"""Timestamps: how they are written, their units, and the rules by which they are repaired."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.formats.table_sniff import NotANumberError
from forcelab.formats.timestamps import RawTimestamps, TimestampReader, repair_timestamps

EPOCH = 1_657_539_356_236.0


def repair(values, *, per_second=1.0, absolute=False, strict=False, jitter=0.0):
    values = np.array(values, np.float64)
    raw = RawTimestamps(values, 0, per_second, absolute)
    return repair_timestamps(
        raw, np.arange(values.size) + 2, "reach.csv", strict=strict, jitter=jitter
    )


def refusal(values, **options) -> str:
    with pytest.raises(InputError) as caught:
        repair(values, strict=True, **options)
    return str(caught.value)


def test_good_stamps_are_shifted_to_zero_and_nothing_is_said():
    result = repair([5.0, 5.1, 5.3, 5.35], strict=True)
    assert result.times.tolist() == [0.0, 5.1 - 5, 5.3 - 5, 5.35 - 5]
    assert result.rows.tolist() == [0, 1, 2, 3]
    assert result.start == 5.0
    assert result.remarks == ()


def test_rows_stamped_after_2100_are_dropped_and_counted():
    values = EPOCH + 10 * np.arange(1000)
    late = np.zeros(1000, bool)
    late[100:130] = late[-11:] = True
    values[late] += 2.6e12
    result = repair(values, per_second=1000, absolute=True)
    assert result.remarks[0] == "41 rows stamped after 2100 were dropped."
    np.testing.assert_array_equal(result.rows, np.flatnonzero(~late))
    assert result.times[-1] == 9.88
    assert "line 102" in refusal(values, per_second=1000, absolute=True)


def test_stamps_before_the_clock_was_set_are_dropped():
    values = EPOCH + 10 * np.arange(500)
    values[:3] = [0, 10, 20]
    result = repair(values, per_second=1000, absolute=True)
    assert result.rows[0] == 3
    assert result.times[-1] == 4.96
    assert result.remarks == (
        "3 rows stamped more than 1000 times the recording's length away from the rest were "
        "dropped.",
    )


@pytest.mark.parametrize("place", [0, 57, 99])
def test_a_single_torn_stamp_is_dropped_wherever_it_stands(place):
    values = np.arange(100) / 100
    values[place] = 4e9
    result = repair(values)
    assert result.rows.tolist() == [i for i in range(100) if i != place]
    assert result.remarks[0].startswith("1 row stamped more than 1000 times")
    assert f"line {place + 2}" in refusal(values)


def test_of_stamps_in_order_the_same_ones_are_far_as_of_others():
    """Where all are in order, they need not be sorted by how far they are."""
    random = np.random.default_rng(6)
    for count in range(20, 60):
        values = np.cumsum(random.uniform(0.5, 1.5, count))
        values[: random.integers(3)] -= 1e6
        values[count - random.integers(3) :] += 10.0 ** random.uniform(3, 7)
        distance = np.abs(values - np.median(values))
        reach = np.sort(distance)[count - max(1, count // 20) - 1]
        near = distance <= reach
        far = distance > max(1000 * np.ptp(values[near]), reach)
        assert repair(values).rows.tolist() == np.flatnonzero(~far).tolist()


def test_a_pause_of_a_day_is_a_gap_and_nothing_is_dropped():
    values = np.concatenate([np.arange(60), 8_640_000 + np.arange(40)]) / 100
    result = repair(values)
    assert result.rows.size == 100
    assert result.remarks == ("1 gap in the stamps, 8.64e+04 s in all, is kept as a gap.",)


def test_of_repeated_stamps_the_first_row_is_kept():
    values = np.arange(100) / 100
    values[[10, 11, 50]] = values[[9, 9, 49]]
    result = repair(values)
    assert result.rows.tolist() == [i for i in range(100) if i not in (10, 11, 50)]
    assert result.remarks == (
        "3 rows repeat the stamp before; the first row of each stamp was kept.",
    )
    assert "line 12" in refusal(values)
    values = np.arange(100) / 100
    values[10] = values[9]
    assert repair(values).remarks[0].startswith("1 row repeats the stamp before")
    values = np.floor(np.random.default_rng(0).uniform(0, 1, 100).cumsum()) / 100
    assert repair(values).remarks[0].endswith(", and all are if stamps may jitter (--jitter).")
    assert repair(values, jitter=0.1).rows.size == 100


def test_equal_bursts_are_spread_evenly_up_to_the_next_stamp():
    values = np.repeat(np.arange(20) * 0.1, 10)
    result = repair(values)
    np.testing.assert_allclose(result.times, np.arange(200) * 0.01, atol=1e-12)
    assert result.rows.size == 200
    assert result.remarks == (
        "The stamps come in 20 bursts of about 10 rows with one stamp; the rows of a burst were "
        "spread evenly up to the next stamp.",
    )
    assert "line 3" in refusal(values)


def test_stamps_of_whole_seconds_are_bursts_with_a_short_first_and_last_one():
    true = 0.73 + np.arange(1000) / 100
    result = repair(np.floor(true))
    np.testing.assert_allclose(result.times, np.arange(1000) / 100, atol=1e-9)


def test_a_burst_before_a_gap_keeps_the_usual_step():
    values = np.repeat(np.concatenate([np.arange(10), np.arange(40, 50)]) * 0.1, 10)
    result = repair(values)
    expected = np.concatenate([np.arange(100), np.arange(400, 500)]) * 0.01
    np.testing.assert_allclose(result.times, expected, atol=1e-12)
    assert result.remarks[1] == "1 gap in the stamps, 3 s in all, is kept as a gap."


def test_bursts_of_unlike_length_are_not_spread():
    values = np.repeat(np.arange(40) * 0.1, [2, 7, 4, 11] * 10)
    assert "the first row of each stamp was kept" in repair(values).remarks[0]


def test_rows_out_of_order_are_dropped_with_as_few_as_possible():
    values = np.arange(100) / 100
    values[30] = 0.805  # ahead, and back: one row goes, not the fifty after it
    values[60] = 0.105
    result = repair(values)
    assert result.rows.tolist() == [i for i in range(100) if i not in (30, 60)]
    assert result.remarks == ("2 rows whose stamp is out of order were dropped.",)
    assert "line 32" in refusal(values)


def test_a_clock_that_starts_again_is_refused_with_the_line():
    values = np.concatenate([np.arange(100), np.arange(100)]) / 100
    with pytest.raises(InputError, match=r"line 102: time runs backwards.*split the file"):
        repair(values)


def test_gaps_are_counted_never_filled_and_refused_if_strict():
    values = np.arange(100) / 100
    values[40:] += 0.5
    values[80:] += 0.05
    result = repair(values)
    assert result.rows.size == 100
    assert result.remarks == ("2 gaps in the stamps, 0.55 s in all, are kept as gaps.",)
    assert "line 42" in refusal(values)
    values = np.arange(100) / 100
    values[40:] += 0.035  # 4.5 periods are none
    assert repair(values, strict=True).remarks == ()


def test_rows_without_a_stamp_are_dropped():
    values = np.arange(10) / 100
    values[[3, 9]] = np.nan
    result = repair(values)
    assert result.rows.tolist() == [0, 1, 2, 4, 5, 6, 7, 8]
    assert result.remarks == ("2 rows without a usable stamp were dropped.",)
    assert "line 5" in refusal(values)


@pytest.mark.parametrize("values", [[], [1.0], [np.nan] * 9, [2.0] * 9])
def test_too_few_stamps_are_refused_in_a_sentence(values):
    with pytest.raises(InputError, match=r"reach\.csv.*\.$"):
        repair(values)


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.integers(0, 60), min_size=2, max_size=40).map(sorted),
    st.lists(st.tuples(st.integers(0, 39), st.integers(-(10**6), 10**6)), max_size=3),
)
def test_what_comes_out_increases_and_stands_for_rows_that_were_there(ticks, damage):
    values = [float(tick) for tick in ticks]
    for place, value in damage:
        values[place % len(values)] = float(value)
    try:
        result = repair(values)
    except InputError:
        return
    assert (np.diff(result.times) > 0).all()
    assert (np.diff(result.rows) > 0).all()
    assert result.times[0] == 0
    assert result.times.size == result.rows.size
    # Nothing is done in silence.
    changed = result.times.tolist() != [value - values[0] for value in values]
    assert not changed or result.remarks


def test_stamps_that_jitter_are_taken_where_that_is_allowed():
    """A logger that stamps on arrival: a fifth of its stamps are before the last one."""
    even = np.arange(1000) / 1000
    values = even + np.random.default_rng(3).normal(0, 0.0007, even.size)
    assert (np.diff(values) <= 0).mean() > 0.1
    with pytest.raises(InputError, match=r"time runs backwards.*may jitter \(--jitter\)"):
        repair(values)
    result = repair(values, jitter=0.005)
    assert result.rows.tolist() == list(range(1000))
    assert (np.diff(result.times) > 0).all()
    error = result.times + result.start - even
    assert np.abs(error - np.median(error)).max() < 0.003
    assert error.std() < np.std(values - even)  # no worse than before
    (remark,) = result.remarks
    assert "rows with stamps that repeat or run backwards, by up to 0.00" in remark
    assert "were spread evenly between their neighbours" in remark
    with pytest.raises(InputError, match=r"more than the jitter of 1e-05 s; allow more"):
        repair(values, jitter=1e-5)
    assert "spread evenly" in refusal(values, jitter=0.005)


def test_jitter_moves_nothing_that_increases_and_drops_no_repeat():
    values = [0.0, 1.0, 2.0, 3.000002, 3.000001, 4.0, 5.0, 5.0, 6.0]
    result = repair(values, jitter=0.4)
    assert result.rows.size == len(values)
    moved = np.flatnonzero(result.times != np.array(values)).tolist()
    assert moved == [3, 4, 6, 7]
    assert (np.diff(result.times) > 0).all()
    assert repair([0.0, 1.0, 2.0], jitter=0.1).remarks == ()


@given(st.lists(st.integers(-(10**6), 10**6), min_size=2, max_size=60))
def test_whatever_jitters_increases_after_it_or_is_refused(microseconds):
    try:
        result = repair(microseconds, per_second=1e6, jitter=1e6)
    except InputError:
        return
    assert (np.diff(result.times) > 0).all()


def clock(cells: list[str], unit: str = "", decimal: str = ".") -> RawTimestamps:
    reader = TimestampReader(cells, decimal)
    return reader.finish(reader.read(cells), unit, "reach.csv", "time")


def seconds(raw: RawTimestamps) -> list[float]:
    return ((raw.values - raw.values[0]) / raw.per_second).tolist()


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        (["1657539356", "1657539357"], [0.0, 1.0]),
        (["1657539356.236123", "1657539356.236124"], [0.0, 1e-6]),
        (["1657539356236", "1657539356243"], [0.0, 0.007]),
        (["1657539356236000", "1657539356236001"], [0.0, 1e-6]),
        (["1657539356236123456", "1657539356236123457"], [0.0, 1e-9]),
        (["2022-07-11T11:35:56.236Z", "2022-07-11T11:35:56.243Z"], [0.0, 0.007]),
        (["2022-07-11 23:59:59.9", "2022-07-12 00:00:00.4"], [0.0, 0.5]),
        (["2022-07-11 11:35:56,236123", "2022-07-11 11:35:56,236124"], [0.0, 1e-6]),
        (["2022/07/11 01:00:00+02:00", "2022/07/10 23:00:01Z"], [0.0, 1.0]),
        (["2024-02-28T23:59:59", "2024-03-01T00:00:00"], [0.0, 86_401.0]),
    ],
)
def test_dates_are_told_by_themselves(cells, expected):
    raw = clock(cells)
    assert raw.absolute
    assert raw.remarks == ()
    np.testing.assert_allclose(seconds(raw), expected, rtol=1e-9, atol=2e-10)


def test_dates_in_words_and_in_numbers_are_the_same_instant():
    words = clock(["2022-07-11T11:35:56.236Z", "2022-07-11T11:35:57Z"])
    number = clock(["1657539356236", "1657539357000"])
    assert words.seconds(words.values[:1])[0] == number.seconds(number.values[:1])[0]


def test_a_date_far_in_the_future_stays_one():
    raw = clock(["2022-07-11 11:35:56", "2022-07-11 11:35:57", "9999-01-01 00:00:00"])
    assert raw.seconds(raw.values)[2] == 253_370_764_800.0


@pytest.mark.parametrize("unit", ["s", "ms", "us", "µs", "ns", "min"])
def test_the_unit_in_the_header_is_believed(unit):
    per_second = {"s": 1, "ms": 1e3, "us": 1e6, "µs": 1e6, "ns": 1e9, "min": 1 / 60}[unit]
    raw = clock(["0", "2000", "4000"], unit)
    assert seconds(raw) == [0, 2000 / per_second, 4000 / per_second]
    assert not raw.absolute
    assert raw.remarks == ()


def test_a_unit_that_contradicts_the_stamps_is_refused():
    with pytest.raises(InputError, match="^reach.csv, column 'time', is said to be in s, but its"):
        clock(["1657539356236", "1657539356243"], "s")


@pytest.mark.parametrize(
    ("step", "unit"), [("0.5", "s"), ("5", "ms"), ("100", "ms"), ("5000", "us"), ("5000000", "ns")]
)
def test_without_a_unit_the_step_tells_it_and_a_guess_is_said(step, unit):
    raw = clock([str(float(step) * i) for i in range(10)])
    assert raw.per_second == {"s": 1, "ms": 1e3, "us": 1e6, "ns": 1e9}[unit]
    assert bool(raw.remarks) == (unit != "s")
    output = f"Column 'time' names no unit and was taken as {unit}"
    assert all(remark.startswith(output) for remark in raw.remarks)


def test_times_of_the_day_run_past_midnight():
    raw = clock(["23:59:59.5", "", "00:00:00.25", "00:00:01"])
    np.testing.assert_array_equal(raw.values - raw.values[0], [0, np.nan, 0.75, 1.5])
    assert not raw.absolute


def test_times_that_have_passed_are_read_as_pandas_writes_them():
    raw = clock(["0 days 23:59:59.500000", "", "1 day 00:00:00", "2 days 00:00:01.25"])
    np.testing.assert_array_equal(raw.values - raw.values[0], [0, np.nan, 0.5, 86401.75])
    assert not raw.absolute


def test_twelve_hours_run_past_noon_and_midnight():
    noon = clock(["11:59:59.5 AM", "", "12:00:00.25 PM", "12:59:59 pm", "1:00:00\u202fp.m."])
    np.testing.assert_array_equal(noon.values - noon.values[0], [0, np.nan, 0.75, 3599.5, 3600.5])
    night = clock(["11:59:59.5 PM", "12:00:00.25AM", "01:00:00 AM"])
    np.testing.assert_array_equal(night.values - night.values[0], [0, 0.75, 3600.5])
    dated = clock(["2024-03-01 11:59:59 PM", "2024-03-02 12:00:01 AM", "2024-03-02 12:00:02 PM"])
    np.testing.assert_array_equal(dated.values - dated.values[0], [0, 2, 43203])


@pytest.mark.parametrize("bad", ["02:15:05", "14:15:05 PM", "00:15:05 AM", "02:15:05 XM"])
def test_of_twelve_hours_each_says_which_half_of_the_day_it_is_in(bad):
    with pytest.raises(NotANumberError) as caught:
        clock(["02:15:03.250 PM", "02:15:04 PM", bad])
    assert (caught.value.index, caught.value.cell) == (2, bad)
    with pytest.raises(NotANumberError):
        clock(["02:15:03", "02:15:04", "02:15:05 PM"])


def test_large_numbers_keep_decimal_commas_exponents_and_empty_cells():
    raw = clock(["1657539356,25", "", "1,6575393575E9"], decimal=",")
    np.testing.assert_array_equal(raw.values - raw.values[0], [0, np.nan, 1.25])


@pytest.mark.parametrize("bad", ["soon", "2022-13-45 00:00:00", "2022-07-11 25:00:00", "11:00:00"])
def test_a_stamp_that_is_none_is_named(bad):
    with pytest.raises(NotANumberError) as caught:
        clock(["2022-07-11 11:35:56", "2022-07-11 11:35:57", bad])
    assert caught.value.index == 2
    assert caught.value.cell == bad


def test_dates_with_the_day_first_and_points_are_those_of_iso_8601():
    raw = clock(["31.05.2024 23:59:59,5", "01.06.2024 00:00:00,250", "1.6.2024, 00:00:01"])
    iso = clock(["2024-05-31 23:59:59.5", "2024-06-01 00:00:00.250", "2024-06-01 00:00:01"])
    assert seconds(raw) == [0, 0.75, 1.5]
    assert raw.absolute
    assert raw.base == iso.base


def test_a_day_that_is_none_is_refused_where_it_stands():
    for stamp in ("31.02.2024 12:00:00", "2024-13-01 12:00:00"):
        with pytest.raises(NotANumberError, match=stamp):
            clock([stamp, "2024-05-31 12:00:00"])
