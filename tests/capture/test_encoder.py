"""The encoder for the opening of the tongs: commands, answers, counts that never wrap."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.capture.encoder import COUNT, EncoderParser, setup_commands
from forcelab.errors import InputError


def line(letter, register, value, clock=None, spaced=True):
    parts = [letter, f"{register:02X}", f"{value % 2**32:08X}"]
    parts += [] if clock is None else [f"{clock % 2**32:08X}"]
    return ((" " if spaced else "").join([*parts, "!"]) + "\r\n").encode()


def test_setting_up_ends_with_the_stream():
    commands = setup_commands(reverse=True, rate=128)
    assert commands[-1] == b"S0E\r\n"
    assert {b"W0300000003\r\n", b"W0400000080\r\n", b"W0B00000001\r\n", b"W0C00000004\r\n"} <= set(
        commands
    )
    for wrong in (0, 600):
        with pytest.raises(InputError):
            setup_commands(rate=wrong)


@pytest.mark.parametrize("spaced", [True, False])
def test_counts_are_signed_whether_or_not_a_clock_comes_with_them(spaced):
    parser = EncoderParser()
    data = b"".join(line("s", COUNT, n, 512 + n, spaced) for n in (-2, -1, 0, 5))
    assert parser.feed(data).tolist() == [-2, -1, 0, 5]
    assert parser.feed(line("r", COUNT, 7)).tolist() == [7]


def test_a_count_does_not_wrap():
    values = [2**31 - 2, 2**31 - 1, 2**31, 2**31 + 1]
    data = b"".join(line("s", COUNT, value) for value in values)
    assert EncoderParser().feed(data).tolist() == values


def test_answers_are_kept_apart_from_the_stream_and_junk_is_passed_over():
    parser = EncoderParser()
    data = (
        b"QSB-D  0E!\r\n"
        + line("w", 0x15, 15, 0)
        + line("s", COUNT, 3, 1)
        + line("r", 0x14, (81_830 << 12) | 0x0007, 2)
        + line("e", 0x42, 1, 3)
        + b"s 0E 0000\r\n\xff\xfe\r\n"
    )
    assert parser.feed(data).tolist() == [3]
    assert parser.refused == 1


def test_after_it_was_plugged_in_again_counts_start_anew():
    parser = EncoderParser()
    parser.feed(line("s", COUNT, 4_000_000_000, 9) + b"s 0E 00")
    parser.restart()
    assert parser.feed(line("s", COUNT, -5, 0)).tolist() == [-5]


ANSWERS = st.one_of(
    st.builds(line, st.sampled_from("rwse"), st.sampled_from([COUNT, 0x14]), st.integers(-99, 99)),
    st.builds(line, st.just("s"), st.just(COUNT), st.integers(0, 99), st.integers(0, 99)),
    st.binary(max_size=30),
)


@given(st.lists(ANSWERS, max_size=10), st.lists(st.integers(0, 300), max_size=6))
def test_any_cutting_gives_the_same_counts(parts, cuts):
    data = b"".join(parts)
    edges = [0, *sorted(cut % (len(data) + 1) for cut in cuts), len(data)]
    parser, whole = EncoderParser(), EncoderParser()
    pieces = [parser.feed(data[a:b]) for a, b in pairwise(edges)]
    assert np.concatenate(pieces).tolist() == whole.feed(data).tolist()
    assert parser.refused == whole.refused
