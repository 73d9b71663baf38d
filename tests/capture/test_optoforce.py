"""Live DAQs: commands as the protocol has them, and bytes that become blocks."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.capture.optoforce import (
    FILTERS,
    PacketStream,
    configure_command,
    serial_command,
    speed_code,
)
from forcelab.errors import InputError
from forcelab.formats.optoforce_packets import KINDS, Parser
from tests.formats.optoforce_streams import CONFIGURED, packet, stream

AXES3 = KINDS[0]


def test_commands_are_those_of_the_protocol():
    assert list(configure_command(10)) == [170, 0, 50, 3, 10, 4, 0, 0, 237]
    assert list(configure_command(1, 0, 255)) == [170, 0, 50, 3, 1, 0, 255, 1, 223]
    assert list(serial_command()) == [171, 0, 18, 8, 0, 197]
    assert FILTERS == (0, 500, 150, 50, 15, 5, 1.5)


@pytest.mark.parametrize(("rate", "code"), [(1000, 1), (333.3, 3), (100, 10), (4, 250)])
def test_a_rate_has_its_speed(rate, code):
    assert speed_code(rate) == code


@pytest.mark.parametrize("rate", [-1, 2000, 700, 1, float("nan"), float("inf")])
def test_a_rate_that_no_daq_has_is_refused_with_others(rate):
    with pytest.raises(InputError, match=r"choose 1000 / n .* such as \d"):
        speed_code(rate)


def blocks(data, cuts=(), rate=1000.0):
    """A stream fed in pieces, each arriving when its last byte does at 16 bytes a sample."""
    packet_stream = PacketStream(rate)
    edges = [0, *sorted({cut % len(data) for cut in cuts} - {0}), len(data)]
    found = [packet_stream.feed(data[a:b], b / AXES3.size / rate) for a, b in pairwise(edges)]
    return [block for block in [*found, packet_stream.flush()] if block is not None], packet_stream


@given(st.sampled_from([1, 2, 10]), st.lists(st.integers(0, 5_000), max_size=10))
def test_blocks_hold_every_sample_however_the_bytes_came(step, cuts):
    data, values = stream(AXES3, range(65_400, 65_400 + 200 * step, step))
    found, packet_stream = blocks(data[:800] + CONFIGURED + data[800:], cuts)
    assert np.concatenate([block.ticks for block in found]).tolist() == list(range(200))
    assert (np.concatenate([block.values for block in found]) == values).all()
    assert [reply.code for reply in packet_stream.parser.take_replies()] == [0]


def test_samples_keep_the_time_at_which_they_arrived_while_the_step_is_learnt():
    packet_stream, data = PacketStream(1000.0), stream(AXES3, range(30))[0]
    for i in range(16):
        assert packet_stream.feed(data[16 * i : 16 * (i + 1)], float(i)) is None
    block = packet_stream.feed(data[256:272], 16.0)
    assert block.arrived.tolist() == list(range(17))
    assert block.ticks.tolist() == list(range(17))
    assert len(packet_stream.feed(data[272:288], 17.0)) == 1


def test_few_samples_come_at_the_end():
    (block,), packet_stream = blocks(stream(AXES3, [5, 7, 9])[0])
    assert block.ticks.tolist() == [0, 1, 2]
    assert packet_stream.flush() is None


def test_lost_doubled_and_wrong_packets_leave_a_gap():
    packets = [packet(AXES3, count, [count, 0, 0], status=0x0080) for count in range(200)]
    packets[50] = b"\x00" + packets[50][1:]
    packets[100:103] = []
    packets[150] += packets[150]
    ((block,), _) = blocks(b"".join(packets))
    assert block.ticks.tolist() == block.values[:, 0].astype(int).tolist()
    assert set(range(200)) - set(block.ticks.tolist()) == {50, 100, 101, 102}
    assert set(block.status) == {0x0080}


def test_a_daq_that_was_plugged_in_again_goes_on_by_the_hosts_clock():
    packet_stream, data = PacketStream(1000.0), stream(AXES3, range(100))[0]
    packet_stream.feed(data, 0.1)
    assert packet_stream.flush() is None
    packet_stream.restart(Parser())
    block = packet_stream.feed(stream(AXES3, range(40_000, 40_100))[0], 2.1)
    assert block.ticks.tolist() == list(range(2_099, 2_199))
