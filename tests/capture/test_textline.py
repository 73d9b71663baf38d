"""Lines of text: what Arduinos and load cells send, junk included, however it is cut."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.capture.serial_port import LONGEST
from forcelab.capture.text_device import TextParser

TORN = b"12.\n"  # the first line of a connection is not trusted


def parsed(data, cuts=()):
    """Samples, stamps and the parser, for bytes that come in pieces."""
    parser = TextParser()
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    pieces = [parser.feed(data[a:b]) for a, b in pairwise(edges)]
    pieces = [piece for piece in pieces if piece is not None]
    values = [row for piece in pieces for row in piece.values.tolist()]
    times = [t for piece in pieces if piece.times is not None for t in piece.times.tolist()]
    return values, times, parser


@pytest.mark.parametrize("separator", [b",", b", ", b"\t", b" ", b"   ", b";", b" , "])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_values_may_be_separated_in_any_usual_way(separator, end):
    rows = [[b"1.5", b"-2"], [b"1e5", b".5"], [b"+3.", b"7E-2"]]
    data = TORN + b"".join(separator.join(row) + end for row in rows)
    values, times, parser = parsed(data)
    assert values == [[1.5, -2.0], [1e5, 0.5], [3.0, 0.07]]
    assert times == []
    assert [channel.name for channel in parser.channels] == ["a1", "a2"]


def test_a_header_names_the_channels_and_the_clock():
    values, times, parser = parsed(b"time_ms,Fz [N],temp (C)\n10,1,2\n11,3,nan\n13,4,5,\n")
    assert [(c.name, c.unit) for c in parser.channels] == [("Fz", "N"), ("temp", "C")]
    assert times == pytest.approx([0.010, 0.011, 0.013])
    assert values[0] == [1, 2]
    assert np.isnan(values[1][1])
    assert parser.junk_lines == 0


@pytest.mark.parametrize(
    ("name", "second"),
    [
        ("ms", 1e3),
        ("millis", 1e3),
        ("micros", 1e6),
        ("t_us", 1e6),
        ("time (s)", 1),
        ("t [µs]", 1e6),
    ],
)
def test_a_column_named_as_time_with_a_unit_is_the_clock(name, second):
    _, times, parser = parsed(f"{name}\tF\n5\t1\n6\t1\n".encode())
    assert times == pytest.approx([5 / second, 6 / second])
    assert [channel.name for channel in parser.channels] == ["F"]


@pytest.mark.parametrize("name", ["time", "x", "force_N"])
def test_a_column_without_a_unit_of_time_is_a_channel(name):
    values, times, _ = parsed(f"{name},F\n5,1\n6,1\n".encode())
    assert (values, times) == ([[5, 1], [6, 1]], [])


def test_a_clock_of_32_bits_does_not_jump_back():
    _, times, _ = parsed(b"micros,F\n4294967290,1\n4294967295,1\n4,1\n9,1\n")
    assert np.diff(times) == pytest.approx([5e-6] * 3, abs=1e-9)


@pytest.mark.parametrize(
    ("line", "names", "values"),
    [
        (b"x:1.5,y:-2", ["x", "y"], [1.5, -2]),
        (b"x:1.5 y:-2", ["x", "y"], [1.5, -2]),
        (b"x: 1.5\ty: -2", ["x", "y"], [1.5, -2]),
        (b"Reading: 23.4 lbs", ["Reading"], [23.4]),
        (b"Load_cell output val: 12", ["Load_cell output val"], [12]),
        (b"one reading: 1.2 | average: 3.4", ["one reading", "average"], [1.2, 3.4]),
        (b"F = 1, z = 2", ["F", "z"], [1, 2]),
    ],
)
def test_labels_name_the_channels(line, names, values):
    found, _, parser = parsed(b"\n".join([line] * 4) + b"\n")
    assert [channel.name for channel in parser.channels] == names
    assert found == [values] * 3  # the first one might have been torn
    assert parser.junk_lines == 1


def test_a_unit_behind_a_labelled_value_is_the_channels():
    _, _, parser = parsed(b"F:1 N, t_ms:5\n" * 3)
    assert [(channel.name, channel.unit) for channel in parser.channels] == [("F", "N")]


def test_junk_is_counted_and_costs_nothing_else():
    junk = [b"HX711 not ready!", b"1,2,3", b"7", b"1,,2", b"\xff\xfe\x00,3", b"1.2.3,4", b"x:1,y:2",
            b"0x12,3", b"1_000,2", b"1 5,2", "١,٢".encode(), b"9" * (LONGEST + 1)]  # fmt: skip
    data = TORN + b"1,2\n" + b"".join(line + b"\n3,4\n" for line in [b"1,2", *junk]) + b"3,"
    values, _, parser = parsed(data)
    assert values == [[1, 2], [1, 2]] + [[3, 4]] * (len(junk) + 1)
    assert parser.junk_lines == 1 + len(junk)


def test_decimal_commas_are_no_numbers():
    values, _, parser = parsed(TORN + b"1,5;2,5\n" * 3)
    assert values == []
    assert parser.junk_lines == 4


def test_what_a_device_says_before_its_samples_is_no_header():
    values, _, parser = parsed(b"Calibrating, please wait\nStarting\nready\n1\n2\n3\n")
    assert values == [[1], [2], [3]]
    assert [channel.name for channel in parser.channels] in (["ready"], ["a1"])
    assert parser.junk_lines == 2


def test_a_header_that_comes_again_is_no_junk_and_the_first_line_may_be_torn_again():
    parser = TextParser()
    parser.feed(b"a,b\n1,2\n3,4\n5,")
    parser.restart()
    assert parser.feed(b".5,9\na,b\n5,6\n").values.tolist() == [[5, 6]]
    assert parser.junk_lines == 1


LINES = st.sampled_from(
    [b"1,2", b"3,4", b"-1e3,nan", b"a,b", b"x:1,y:2", b"x:3 y:4", b"", b" ", b"junk!", b"1,2,3",
     b"9" * 2_100, b" " * 2_100 + b"1", b"\xc2\xb5,b", b"\xff"]
)  # fmt: skip


@given(st.lists(LINES, max_size=12), st.lists(st.integers(0, 9_000), max_size=8))
def test_any_cutting_gives_the_same_samples(lines, cuts):
    data = b"".join(line + (b"\r\n", b"\n")[i % 2] for i, line in enumerate(lines))
    values, _, parser = parsed(data, cuts)
    whole, _, other = parsed(data)
    assert np.array_equal(np.array(values), np.array(whole), equal_nan=True)
    assert (parser.channels, parser.junk_lines) == (other.channels, other.junk_lines)


@given(st.binary(max_size=300), st.lists(st.integers(0, 300), max_size=4))
def test_no_bytes_are_fatal(data, cuts):
    parsed(data, cuts)
    parsed(b"a b\n1 2\n3 4\n" + data, cuts)
