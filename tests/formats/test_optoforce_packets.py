"""Packets of OptoForce DAQs: found in a stream, their counter and their status."""

import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.formats.optoforce_packets import (
    KINDS,
    TURN,
    Parser,
    Unwrapper,
    is_faulty,
    modal_step,
    parse_all,
    status_sentences,
)
from tests.formats.optoforce_streams import (
    CONFIGURED,
    chance,
    fuzz,
    in_pieces,
    packet,
    parsed_slowly,
    sealed,
    stream,
)

#: Strings of the fuzzing; ``FORCELAB_FUZZ=1000000`` for the whole, which takes minutes.
STRINGS = int(os.environ.get("FORCELAB_FUZZ", "800"))
AXES3, FOUR, AXES6 = KINDS
SERIAL = sealed(bytes([170, 0, 18, 8]) + b"ISE012\0\0")


@pytest.mark.parametrize(
    ("kind", "header", "size"),
    [(AXES3, (170, 7, 8, 10), 16), (FOUR, (170, 7, 8, 28), 34), (AXES6, (170, 7, 8, 16), 22)],
)
def test_the_kinds_are_those_of_the_protocol(kind, header, size):
    assert (tuple(kind.header), kind.size) == (header, size)
    assert len(packet(kind, 0)) == size


def test_channels_of_several_sensors_have_their_number():
    assert FOUR.names()[:4] == ("fx1", "fy1", "fz1", "fx2")
    assert AXES6.names() == ("fx1", "fy1", "fz1", "tx1", "ty1", "tz1")
    assert AXES3.names(first=2) == ("fx2", "fy2", "fz2")


def test_a_packet_of_a_real_device_is_read_right():
    data = bytes.fromhex("aa07080a2d6a0000fff7fffb00070551")
    parser, packets = parse_all(data)
    assert (parser.kind, packets.counts.tolist(), packets.status.tolist()) == (AXES3, [11626], [0])
    assert packets.values.tolist() == [[-9, -5, 7]]


@pytest.mark.parametrize("kind", KINDS, ids=[kind.name for kind in KINDS])
def test_every_packet_is_found_with_its_readings(kind):
    counts = range(65_000, 68_000)
    data, values = stream(kind, counts)
    parser, packets = parse_all(data)
    assert parser.kind == kind
    assert packets.counts.tolist() == [count % 65_536 for count in counts]
    assert (packets.values == values).all()
    assert (parser.statistics.packets, parser.statistics.skipped_bytes) == (3_000, 0)


def test_replies_between_packets_are_told_and_cost_none():
    data = packet(AXES3, 1) + CONFIGURED + packet(AXES3, 2) + SERIAL + packet(AXES3, 3)
    rows, parser = in_pieces(data, [20, 21, 25])
    assert [count for _, count, _, _ in rows] == [1, 2, 3]
    code, serial = parser.take_replies()
    assert (code.code, serial.serial) == (0, "ISE012")
    assert parser.take_replies() == []
    assert parser.statistics.skipped_bytes == 0


def test_a_header_inside_a_wrong_packet_is_looked_at_one_byte_further():
    whole = packet(AXES3, 7, [1, 2, 3])
    # Five bytes of a packet that broke off, so that the next one begins inside it.
    rows, parser = in_pieces(whole + whole[:5] + packet(AXES3, 9, [4, 5, 6]), [])
    assert [count for _, count, _, _ in rows] == [7, 9]
    assert (parser.statistics.bad_checksums, parser.statistics.skipped_bytes) == (1, 5)


def test_header_bytes_among_the_readings_do_no_harm():
    reading = int.from_bytes(b"\xaa\x07", "big"), int.from_bytes(b"\x08\x0a", "big"), 5
    data = b"".join(packet(AXES3, count, reading) for count in range(20))
    rows, parser = in_pieces(data, range(0, len(data), 7))
    assert [values for *_, values in rows] == [(reading[0] - 65_536, reading[1], 5)] * 20
    assert parser.statistics.bad_checksums == 0


def test_after_the_first_packet_other_kinds_mean_nothing():
    rows, parser = in_pieces(packet(AXES6, 1) + packet(AXES3, 2) + packet(AXES6, 3), [10])
    assert [count for _, count, _, _ in rows] == [1, 3]
    assert parser.statistics.skipped_bytes == 16


def test_what_waits_is_never_more_than_an_unfinished_packet():
    parser = Parser()
    for byte in FOUR.header * 50:
        parser.feed(bytes([byte]))
        assert parser.pending < 34


def test_a_packet_behind_what_only_began_like_one_comes_at_the_end():
    data = packet(FOUR, 1) + FOUR.header + packet(FOUR, 2)[:-2]
    inside = AXES3.header + packet(AXES3, 5)
    assert [count for _, count, _, _ in in_pieces(data, [])[0]] == [1]
    assert [count for _, count, _, _ in in_pieces(inside, [], AXES3)[0]] == [5]


pieces = st.one_of(
    st.binary(max_size=12),
    st.sampled_from([CONFIGURED, SERIAL, b"'\nb'", *(kind.header for kind in KINDS)]),
    st.builds(
        packet,
        st.sampled_from(KINDS),
        st.integers(0, 65_535),
        st.none(),
        st.sampled_from([0, 0xAA07, 0x080A]),
    ),
    st.builds(
        lambda data, at, byte: data[: at % 16] + bytes([byte]) + data[at % 16 + 1 :],
        st.just(packet(AXES3, 9, [170, -1, 0xAA00])),
        st.integers(0, 15),
        st.integers(0, 255),
    ),
    st.builds(lambda end: packet(AXES6, 3)[:end], st.integers(0, 22)),
)


@given(st.lists(pieces, max_size=14), st.lists(st.integers(0, 400), max_size=12))
def test_any_cutting_gives_what_a_byte_for_byte_reading_gives(parts, cuts):
    data = b"".join(parts)
    rows, parser = in_pieces(data, cuts)
    slow = parsed_slowly(data)
    assert [offset for offset, *_ in rows] == [offset for offset, _ in slow]
    again, whole = in_pieces(data, [])
    assert again == rows
    assert whole.statistics == parser.statistics
    assert whole.take_replies() == parser.take_replies()


@given(st.lists(pieces, max_size=14), st.lists(st.integers(0, 400), max_size=5))
def test_every_byte_is_accounted_for(parts, cuts):
    data = b"".join(parts)
    _, parser = in_pieces(data, cuts)
    output = parser.statistics
    size = parser.kind.size if parser.kind else 0
    lengths = [7 if reply.code is not None else 14 for reply in parser.take_replies()]
    assert output.replies == len(lengths)
    assert output.packets * size + sum(lengths) + output.skipped_bytes == len(data)


def test_long_feeds_are_as_short_ones():
    data, values = stream(AXES3, range(5_000))
    packets = Parser().feed(b"\xaa\x07" + data * 30)  # several stretches
    assert len(packets) == 150_000
    assert (packets.values.reshape(30, 5_000, 3) == values).all()


@pytest.mark.timeout(600 + STRINGS // 100)  # a million takes minutes, and longer where others work
def test_random_and_mutated_strings_neither_fail_nor_pass():
    accepted, invalid, unsent = fuzz(STRINGS, seed=1)
    assert invalid == 0
    assert accepted > 0.3 * STRINGS  # packets that no mutation touched
    # Two wrong bytes that make up for each other pass any sum, about once in 256 times.
    assert unsent < 3 + STRINGS / 256


def test_noise_passes_no_oftener_than_a_sum_lets_it():
    # A sum of fourteen bytes, twelve of them noise, is one of about 1,000 values near 1,700; the
    # two bytes of the checksum are one of 4,096. Without the checksum all 200,000 would pass.
    assert chance(200_000) < 200_000 / 4_096 * 3


@pytest.mark.real
def test_a_real_stream_loses_one_packet_at_each_place_where_bytes_were_put_into_it(real_file):
    data = real_file("optoforce/stream-3axis.bin").read_bytes()
    parser, packets = parse_all(data)
    assert len(packets) == 34_374 - 54
    assert parser.statistics.bad_checksums == 54
    counts = packets.counts.astype(int)
    assert (counts[0], counts[-1], set(np.diff(counts))) == (11_626, 45_999, {1, 2})
    assert int(np.sum(np.diff(counts) == 2)) == 54


@pytest.mark.real
def test_a_real_stream_is_whole_without_those_bytes(real_file):
    data = real_file("optoforce/stream-3axis.bin").read_bytes()
    parser, packets = parse_all(data.replace(b"'\nb'", b""))
    assert packets.counts.tolist() == list(range(11_626, 46_000))
    assert parser.statistics.bad_checksums == 0
    assert not packets.status.any()


def counter(values):
    return (np.asarray(values, np.int64) % TURN).astype(np.uint16)


@pytest.mark.parametrize("step", [1, 2, 10, 37])
def test_the_step_is_the_commonest_one(step):
    ticks = np.delete(np.arange(5_000), [3, 4, 100, 2_000])
    found, share = modal_step(counter(65_000 + step * ticks))
    assert found == step
    assert share > 0.99


def test_a_counter_that_stands_still_has_no_step():
    assert modal_step(counter([5, 5, 5])) == (1, 0.0)
    assert modal_step(counter([])) == (1, 0.0)


@given(
    st.sampled_from([1, 2, 10]),
    st.integers(0, TURN - 1),
    st.lists(st.integers(1, 40), min_size=1, max_size=60),
    st.lists(st.integers(1, 20), max_size=8),
)
def test_ticks_are_the_samples_whatever_the_step_the_start_and_the_blocks(step, at, on, sizes):
    truth = np.cumsum([0, *on])
    counts = counter(at + step * truth)
    unwrapper, ticks, place = Unwrapper(step, 1000.0), [], 0
    for size in [*sizes, len(counts)]:
        ticks += unwrapper.feed(counts[place : place + size]).ticks.tolist()
        place += size
    assert ticks == truth.tolist()
    assert unwrapper.missing == truth[-1] + 1 - len(truth)


def test_a_sample_that_came_twice_is_dropped_and_counted():
    unwrapper = Unwrapper(1, 1000.0)
    output = unwrapper.feed(counter([9, 9, 10, 11, 11]), np.full(5, 2.0))
    assert output.is_new.tolist() == [True, False, True, True, False]
    assert output.ticks.tolist() == [0, 1, 2]
    assert unwrapper.feed(counter([11, 12]), np.full(2, 2.0)).ticks.tolist() == [3]
    assert (unwrapper.doubled, unwrapper.missing, unwrapper.jumps) == (3, 0, 0)


@pytest.mark.parametrize("lost", [30_000, 40_000, 65_535, 65_536, 100_000, 200_000])
def test_beyond_half_a_turn_the_hosts_clock_tells_the_turns(lost):
    ticks = np.array([0, 1, 2, 2 + lost, 3 + lost])
    arrived = ticks / 1000 + [0.0, 0.004, 0.001, 0.2, 0.19]
    unwrapper = Unwrapper(1, 1000.0)
    assert unwrapper.feed(counter(500 + ticks), arrived).ticks.tolist() == ticks.tolist()
    assert (unwrapper.missing, unwrapper.jumps) == (lost - 1, 0)


def test_a_counter_that_jumps_back_is_not_believed():
    unwrapper = Unwrapper(2, 500.0)
    arrived = np.array([0.0, 0.002, 0.004, 0.010, 0.012])
    ticks = unwrapper.feed(counter([100, 102, 104, 6, 8]), arrived).ticks
    assert ticks.tolist() == [0, 1, 2, 5, 6]
    assert (unwrapper.jumps, unwrapper.missing) == (1, 2)


def test_a_counter_that_was_started_again_goes_on_by_the_hosts_clock():
    unwrapper = Unwrapper(10, 100.0)
    unwrapper.feed(counter([1000, 1010]), np.array([5.0, 5.01]))
    unwrapper.resume(10, 100.0)
    again = unwrapper.feed(counter([0, 10, 20]), np.array([8.01, 8.02, 8.03]))
    assert again.ticks.tolist() == [301, 302, 303]
    assert (unwrapper.missing, unwrapper.jumps) == (299, 0)


@pytest.mark.parametrize(
    ("status", "sentences"),
    [
        (0x0000, ()),
        (0x2000, ("The DAQ reports an error; unplug it and plug it in again.",)),
        (0x4000, ("The DAQ cannot talk to the sensor; check the sensor's cable.",)),
        (0x0402, ("Sensor 2 is absent; check its cable.",)),
        (0x0801, ("Sensor 1 has failed; it may have to be repaired.",)),
        (0x1000, ("The sensor is too hot or too cold; let it come to room temperature.",)),
        (0x0200, ("The sensor is overloaded in Fx; press less.",)),
        (0x0083, ("Sensor 3 is overloaded in Fz; press less.",)),
        (0x0051, ("Sensor 1 is overloaded in Tx, Tz; press less.",)),
        (0x0408, ("The sensor (and others) is absent; check its cable.",)),
    ],
)
def test_each_bit_has_its_sentence(status, sentences):
    assert status_sentences(status) == sentences


def test_several_things_are_several_sentences():
    assert len(status_sentences(0x2000 | 0x0800 | 0x0300)) == 3
    assert "Fx, Fy" in status_sentences(0x0300)[0]


def test_what_sensor_a_word_is_about_is_no_fault():
    words = np.array([0, 0x0010, 0x0200, 0x0400, 0x8000, 0x000F], np.uint16)
    assert is_faulty(words).tolist() == [False, True, True, True, True, False]
