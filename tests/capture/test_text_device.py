"""Lines of values: what they are made of, torn ones, and their own clocks."""

from itertools import groupby, pairwise
from operator import itemgetter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.capture.assemble import assemble
from forcelab.capture.clock_smoother import spread_deliveries
from forcelab.capture.device import Block
from forcelab.capture.journal import RecordKind, encode_block, encode_header, encode_record
from forcelab.capture.recorder import Recorder
from forcelab.capture.serial_port import LONGEST
from forcelab.capture.text_device import SampleCounter, TextDevice, TextParser
from forcelab.project import Project
from tests.capture.helpers import eventually, journal_of
from tests.capture.virtual_devices import VirtualTextDevice

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
        *(("ms", 1e3), ("millis", 1e3), ("micros", 1e6)),
        *(("t_us", 1e6), ("time (s)", 1), ("t [µs]", 1e6)),
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
    complete, _, other = parsed(data)
    assert np.array_equal(np.array(values), np.array(complete), equal_nan=True)
    assert (parser.channels, parser.junk_lines) == (other.channels, other.junk_lines)


@given(st.binary(max_size=300), st.lists(st.integers(0, 300), max_size=4))
def test_no_bytes_are_fatal(data, cuts):
    parsed(data, cuts)
    parsed(b"a b\n1 2\n3 4\n" + data, cuts)


def torn(line, rng):
    """A line that lost its tail: with its end, it grows together with the next one.

    Two such in a row can be made of the very parts of a whole one, which nobody can tell.
    """
    least = line.index(b".") + 2
    cut = int(rng.integers(least, len(line) - 2))
    return line[:cut] + (b"\r\n" if rng.random() < 0.5 else b"")


class TearingBoard(VirtualTextDevice):
    """Prints its sample's number and what goes with it; tears a share of the lines."""

    def __init__(self, share, seed=0):
        super().__init__(self.readings, 1000.0)
        self.complete, self._share, self._lines = [], share, np.random.default_rng(seed)
        self._glued = False

    @staticmethod
    def readings(times):
        number = np.round(1000 * times)
        return np.column_stack([number, np.sin(number), -number])

    def _due(self, now):
        sent = []
        for line in super()._due(now).splitlines(keepends=True):
            if not self._glued and self._lines.random() < self._share:
                sent.append(torn(line, self._lines))
            else:
                sent.append(line)
                if not self._glued:
                    self.complete.append(int(float(line.split(b",")[0])))
            self._glued = not sent[-1].endswith(b"\n")
        return b"".join(sent)


def deliveries(share, seconds, bursts=()):
    """Bytes and arrivals (s) of a board read every 4 ms but in bursts, and the lines sent whole."""
    rng, decimals = np.random.default_rng(1), 3
    stream, sent_at, complete, glued = [], [], [], False
    for number in range(int(1000 * seconds)):
        line = f"{number:.{decimals}f},{np.sin(number):.{decimals}f}\r\n".encode()
        if number > 500 and not glued and rng.random() < share:
            line = torn(line, rng)
        elif not glued:
            complete.append(number)
        glued = not line.endswith(b"\n")
        stream.append(line)
        sent_at.append(number / 1000)
    reads = np.arange(0.004, seconds + 0.01, 0.004)
    for begin, length in bursts:
        reads = reads[(reads <= begin) | (reads >= begin + length)]
    read = zip(np.searchsorted(reads, sent_at).tolist(), stream, strict=True)
    for k, lines in groupby(read, itemgetter(0)):
        yield b"".join(line for _, line in lines), 100.0 + float(reads[k])
    yield None, complete


def gathered(share, seconds, bursts, tmp_path):
    parser, records = TextParser(), []
    for data, arrived in deliveries(share, seconds, bursts):
        if data is None:
            complete = arrived
            continue
        lines = parser.feed(data)
        if lines is not None:
            block = Block(np.full(len(lines), arrived), lines.numbers, lines.values)
            records.append(encode_record(RecordKind.BLOCK, encode_block(block), 0))
    device = {"name": "b", "channels": [["n", ""], ["s", ""]], "rate": 1000.0, "holds": False}
    header = {"name": "x", "task": "t", "author": "a", "cameras": []}
    header["devices"] = [device | {"counted": False}]
    return assemble(journal_of(encode_header(header) + b"".join(records)), tmp_path), complete


@pytest.mark.parametrize("bursts", [(), ((1.5, 0.3), (2.5, 0.3), (3.2, 0.3))])
@pytest.mark.parametrize("share", [0.0, 0.05])
def test_every_whole_line_is_stored_at_its_time(share, bursts, tmp_path):
    found, complete = gathered(share, 4.0, bursts, tmp_path)
    d = found.demonstration
    # The first line is not trusted, as the connection may have begun in its middle.
    assert complete[0] == 0
    np.testing.assert_array_equal(d.signals[:, 0], complete[1:])
    late = d.times - (d.signals[:, 0] - d.signals[0, 0]) / 1000
    off = np.abs(late - np.median(late)).max()
    assert off < 0.006
    assert off < 2 * found.precision + 0.002
    lost = complete[-1] - len(d.times)
    if share:
        assert found.remarks == (
            f"{lost} samples of b were in torn lines and lost; these are gaps.",
        )
    else:
        assert not found.remarks


def test_samples_of_one_delivery_are_spread_over_the_time_since_the_last_one():
    arrived = np.repeat([10.0, 10.1, 10.4, 10.5], [10, 10, 30, 10])
    host, bound = spread_deliveries(arrived, np.empty(0, np.int64))
    np.testing.assert_allclose(np.diff(host), 0.01, atol=1e-9)
    assert host[-1] == 10.5
    assert bound == pytest.approx(0.3)


def test_a_device_that_was_silent_did_not_take_its_samples_meanwhile():
    arrived = np.repeat([10.0, 10.1, 20.0, 20.1], 10)
    host, _ = spread_deliveries(arrived, np.empty(0, np.int64))
    assert host[20] > 19.7
    assert (np.diff(host) > 0).all()


def test_lines_torn_where_no_number_ends_are_known_by_their_decimals():
    parser = TextParser()
    good = b"".join(b"%d.000,0.125\n" % k for k in range(400))
    assert len(parser.feed(good)) == 399
    lines = parser.feed(b"400.000,0.1\n401.000,0.125\n")
    np.testing.assert_array_equal(lines.values[:, 0], [401])
    assert parser.torn_lines == 1
    np.testing.assert_array_equal(lines.numbers, [400])


def test_a_board_that_leaves_out_zeros_at_the_end_is_believed():
    parser, rng = TextParser(), np.random.default_rng(2)
    values = np.round(rng.normal(size=5000), 3)
    lines = parser.feed(b"".join(f"{v},{v + 1:.3f}\n".encode() for v in values))
    assert len(lines) == 4999
    assert parser.torn_lines == 0


def test_other_words_between_the_lines_are_no_lost_samples():
    parser = TextParser()
    data = b"".join(b"%d,1\n# tare done 5\n" % k for k in range(20))
    lines = parser.feed(data)
    np.testing.assert_array_equal(np.diff(lines.numbers), 1)


def test_what_three_tearing_boards_print_is_stored_and_told(project):
    boards = [TearingBoard(share, seed) for seed, share in enumerate((0.005, 0.01, 0.05))]
    try:
        for board in boards:
            board.open()
        devices = [TextDevice(board.port, rate=1000, ports=lambda: ()) for board in boards]
        with Recorder(project, devices) as recorder:
            recorder.start("tear")
            eventually(lambda: recorder.state().devices[0].samples > 150)
            boards[0].stall(0.2)
            eventually(lambda: recorder.state().devices[0].samples > 450)
            boards[0].unplug()
            eventually(lambda: not recorder.state().devices[0].plugged)
            boards[0].replug()
            eventually(lambda: recorder.state().devices[0].plugged)
            before = recorder.state().devices[0].samples
            eventually(lambda: recorder.state().devices[0].samples > before + 150)
            state = recorder.state().devices[0]
            saved = recorder.stop()
    finally:
        for board in boards:
            board.close()
    with Project.open(project) as opened:
        stored = opened.demonstrations.load(saved.added.id)
    numbers = stored.signals[:, 0].astype(int)
    np.testing.assert_array_equal(stored.signals[:, 2], -numbers)
    sent = np.array(boards[0].complete)
    # Nothing is missing but what is told: the moments at the ends and while it was unplugged.
    expected = sent[(sent >= numbers[0]) & (sent <= numbers[-1])]
    missing = np.setdiff1d(expected, numbers)
    assert not np.setdiff1d(numbers, expected).size
    assert len(np.unique(numbers)) == len(numbers)
    assert (np.diff(numbers) > 0).all()
    assert missing.size == 0 or np.ptp(missing) <= 1.5 * 1000  # all while it was away
    (about,) = [remark for remark in saved.remarks if "unplugged" in remark]
    assert "in torn lines and lost" in about
    assert state.lost > 0


def test_lost_samples_are_counted_by_the_stamps():
    counting = SampleCounter(0.01)
    assert counting.feed(np.array([5.0, 5.01, 5.04, 5.05])).tolist() == [0, 1, 4, 5]
    assert counting.feed(np.array([5.06])).tolist() == [6]


@pytest.mark.parametrize("nonsense", [np.nan, np.inf, -np.inf])
def test_a_stamp_that_is_no_number_costs_no_count(nonsense):
    counting = SampleCounter(0.01)
    found = counting.feed(np.array([0.0, 0.01, nonsense, 0.03, 0.06]))
    assert found.tolist() == [0, 1, 2, 3, 6]
    assert counting.period == pytest.approx(0.01)


@pytest.mark.parametrize("late", [1e9, 1e300])
def test_a_clock_that_was_set_anew_goes_on_counting(late):
    counting = SampleCounter(0.01)
    found = counting.feed(np.array([0.0, 0.01, late, late + 1e-2, 0.0, 0.01]))
    assert found.tolist() == [0, 1, 2, 3, 4, 5]
    assert counting.period == pytest.approx(0.01, rel=1e-3)
