import json

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.measure.latency import Bound, Latencies, Latency, load, refused

SAMPLES = tuple(np.random.default_rng(0).exponential(0.01, 101).tolist())


def test_quantiles_are_those_of_the_sorted_samples():
    row = Latency("pan", "all", SAMPLES)
    in_order = sorted(SAMPLES)
    assert row.at("median") == pytest.approx(in_order[50])
    assert row.at("p95") == pytest.approx(in_order[95])
    assert row.at("p99") == pytest.approx(in_order[99])
    assert row.at("worst") == in_order[-1]


@pytest.mark.parametrize(
    ("bound", "wrong", "kept"),
    [
        (None, None, None),
        (Bound("worst", 0.031), None, True),
        (Bound("worst", 0.030), None, False),  # it must be less
        (Bound("median", 0.021), None, True),
        (Bound("median", 0.021), 0, True),
        (Bound("median", 0.021), 1, False),
    ],
)
def test_a_bound_is_kept_below_it_and_with_nothing_wrong(bound, wrong, kept):
    row = Latency("pan", "all", (0.01, 0.02, 0.03), bound, wrong)
    assert row.kept is kept


@pytest.mark.parametrize(
    ("samples", "refusal"), [((), ""), ((0.1,), "no"), ((-0.1,), ""), ((np.nan,), "")]
)
def test_a_row_has_sound_samples_or_a_refusal(samples, refusal):
    with pytest.raises(InputError, match="pan, all"):
        Latency("pan", "all", samples, refusal=refusal)


def test_a_table_needs_a_row():
    with pytest.raises(InputError, match="no row"):
        Latencies("t", ())


def test_an_alternative_is_that_of_the_same_setting():
    rows = (
        Latency("pan", "few", (0.01,), alternative="plain"),
        Latency("pan", "many", (0.01,), alternative="plain"),
        Latency("plain", "few", (0.03,)),
        *refused(["plain"], "many", "there is no memory for it"),
    )
    table = Latencies("t", rows)
    assert table.ratio(rows[0]) == pytest.approx(3.0)
    assert table.ratio(rows[1]) is None
    assert table.ratio(rows[2]) is None
    assert table.cells()[1][-1] == "3 x (plain)"


def test_text_and_json_tell_the_same():
    rows = (
        Latency("pan", "all", (0.01, 0.02), Bound("p95", 0.033), alternative="plain"),
        Latency("plain", "all", (0.1, 0.2)),
        Latency("seek", "film", (0.5,), Bound("p95", 0.2), wrong=0),
        *refused(["seek"], "other", "PyAV is missing"),
    )
    table = Latencies("Window", rows, (0.5, 0.7), ("a remark",))
    header, *lines = table.cells()
    assert {len(line) for line in lines} == {len(header)}
    assert lines[0][2:4] == ["2", "15.0"]
    assert lines[2][header.index("kept")] == "NO"
    assert lines[3][2] == "refused"
    plain = json.loads(json.dumps(table.to_json(), allow_nan=False))
    assert plain["rows"][0]["median"] == pytest.approx(0.015)
    assert plain["rows"][0]["alternative"]["ratio"] == pytest.approx(10.0)
    assert plain["rows"][2]["kept"] is False
    assert plain["rows"][3] == {"name": "seek", "setting": "other", "refusal": "PyAV is missing"}
    assert plain["load"] == [0.5, 0.7]


def test_the_load_is_no_negative_number():
    assert load() >= 0
