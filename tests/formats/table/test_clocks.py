"""Units of time are told by the header, else by magnitude, and no digit is lost."""

from __future__ import annotations

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.formats.table_sniff import NotANumberError
from forcelab.formats.timestamps import RawTimestamps, TimestampReader


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
    told = f"Column 'time' names no unit and was taken as {unit}"
    assert all(remark.startswith(told) for remark in raw.remarks)


def test_times_of_the_day_run_past_midnight():
    raw = clock(["23:59:59.5", "", "00:00:00.25", "00:00:01"])
    np.testing.assert_array_equal(raw.values - raw.values[0], [0, np.nan, 0.75, 1.5])
    assert not raw.absolute


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
