import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.measure.rows import Row, Table, with_front


def row(error=1e-3, seconds=0.5, name="Radau", size="foam", setting="tolerance 1 mN", **others):
    numbers = {"error": error, "seconds": seconds, "spread": 0.01, "peak_bytes": 2_500_000}
    return Row(name, setting, size, "a finer solution", **{**numbers, **others})


def refused(name="explicit", size="foam", sentence="It takes too many steps."):
    return Row(name, "tolerance 1 mN", size, "a finer solution", refusal=sentence)


def table(*rows):
    return Table("Contact mechanics", "error (N rms)", "CPU s per simulated s", rows)


def beats(first, second):
    """Whether a row is as good in both respects and better in one, by definition."""
    if first.refusal or second.refusal or first.size != second.size:
        return False
    no_worse = first.error <= second.error and first.seconds <= second.seconds
    return no_worse and (first.error < second.error or first.seconds < second.seconds)


# Few values, so that ties in one and in both are common.
ERRORS = st.sampled_from([0.0, 1e-9, 1e-3, 2e-3, 5.0])
SECONDS = st.sampled_from([1e-6, 0.1, 0.2, 0.4, 30.0])
ROWS = st.lists(
    st.one_of(
        st.builds(row, ERRORS, SECONDS, size=st.sampled_from("ab")),
        st.builds(refused, size=st.sampled_from("ab")),
    ),
    max_size=12,
)


@given(ROWS)
@settings(max_examples=100, deadline=None)
def test_the_front_is_what_no_other_row_of_the_size_beats(rows):
    found = [marked.pareto for marked in with_front(rows)]
    assert found == [not r.refusal and not any(beats(second, r) for second in rows) for r in rows]


@given(error=st.floats(0, 1e300), seconds=st.floats(1e-300, 1e300), pareto=st.booleans())
@settings(max_examples=50, deadline=None)
def test_a_row_comes_back_from_json_as_it_was(error, seconds, pareto):
    first = row(error, seconds, further={"largest (N)": 2.0}, pareto=pareto)
    front = table(first, refused()).to_json()
    text = json.dumps(front, allow_nan=False)
    assert tuple(Row(**fields) for fields in json.loads(text)["rows"]) == (first, refused())


def test_json_says_what_the_numbers_mean_and_where_they_were_measured():
    content = table(row()).to_json()
    assert set(content) == {"title", "units", "machine", "versions", "rows"}
    assert content["units"] == {"error": "error (N rms)", "seconds": "CPU s per simulated s"}
    assert content["machine"]["cores"] >= 1
    assert content["machine"]["processor"]
    assert {"forcelab", "numpy", "scipy"} <= set(content["versions"])
    assert set(content["rows"][0]) >= {
        "name", "setting", "size", "error", "reference", "seconds", "spread", "peak_bytes",
        "pareto",
    }  # fmt: skip


@pytest.mark.parametrize(
    "wrong",
    [
        {"error": math.nan},
        {"error": -1e-9},
        {"error": None},
        {"seconds": 0.0},
        {"seconds": math.inf},
        {"seconds": None},
        {"spread": -0.1},
        {"spread": math.nan},
        {"peak_bytes": None},
        {"further": {"largest (N)": math.nan}},
        {"refusal": "It takes too many steps."},
    ],
)
def test_a_row_without_all_its_numbers_is_refused_by_name(wrong):
    with pytest.raises(InputError, match="'Radau, tolerance 1 mN'"):
        row(**wrong)


def test_a_refusal_has_no_numbers_and_is_on_no_front():
    for wrong in ({"error": 1.0}, {"pareto": True}, {"further": {"largest (N)": 1.0}}):
        with pytest.raises(InputError, match="explicit"):
            Row("explicit", "step 1 us", "foam", "", refusal="No.", **wrong)


def test_cells_have_a_column_for_everything_and_units_in_the_header():
    measured = table(*with_front([row(further={"largest (N)": 0.01}), row(1e-2, 1.0), refused()]))
    header, first, second, third = measured.cells("foam")
    assert header[3:6] == ["error (N rms)", "largest (N)", "CPU s per simulated s"]
    assert first == [
        "*", "Radau", "tolerance 1 mN", "1.00e-03", "1.00e-02", "0.500", "0.010", "2.5",
    ]  # fmt: skip
    assert second[0] == second[4] == ""
    assert third == ["", "explicit", "tolerance 1 mN", "refused", "", "", "", ""]


def test_sizes_stay_in_their_order_with_their_rows():
    rows = [row(size="snap"), row(size="foam"), row(0.1, size="snap")]
    measured = table(*rows)
    assert measured.sizes == ("snap", "foam")
    assert measured.of("snap") == (rows[0], rows[2])


def test_a_table_of_nothing_is_refused():
    with pytest.raises(InputError, match="'Contact mechanics' has no row"):
        table()
