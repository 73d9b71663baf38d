"""A board whose lines are torn: what came whole is stored, what is missing is known and told."""

import time

import numpy as np
import pytest
from fake_devices import eventually
from read_back import parsed

from forcelab.capture.assemble import gather
from forcelab.capture.clock_smoother import spread
from forcelab.capture.device import Block
from forcelab.capture.emulator import VirtualTextLine
from forcelab.capture.journal import Kind, block_bytes, encoded, header_bytes
from forcelab.capture.recorder import Recorder
from forcelab.capture.text_device import TextLine, TextParser
from forcelab.project import Project


def torn(line, rng):
    """A line that lost its tail: with its end, it grows together with the next one.

    Two such in a row can be made of the very parts of a whole one, which nobody can tell.
    """
    least = line.index(b".") + 2
    cut = int(rng.integers(least, len(line) - 2))
    return line[:cut] + (b"\r\n" if rng.random() < 0.5 else b"")


class TearingBoard(VirtualTextLine):
    """Prints its sample's number and what goes with it; tears a share of the lines."""

    def __init__(self, share, seed=0, burst=0.004):
        super().__init__(self.readings, 1000.0, burst=burst)
        self.whole, self._share, self._lines = [], share, np.random.default_rng(seed)
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
                    self.whole.append(int(float(line.split(b",")[0])))
            self._glued = not sent[-1].endswith(b"\n")
        return b"".join(sent)


def deliveries(share, seconds, bursts=()):
    """Bytes and arrivals (s) of a board read every 4 ms but in bursts, and the lines sent whole."""
    rng, decimals = np.random.default_rng(1), 3
    stream, sent_at, whole, glued = [], [], [], False
    for number in range(int(1000 * seconds)):
        line = f"{number:.{decimals}f},{np.sin(number):.{decimals}f}\r\n".encode()
        if number > 500 and not glued and rng.random() < share:
            line = torn(line, rng)
        elif not glued:
            whole.append(number)
        glued = not line.endswith(b"\n")
        stream.append(line)
        sent_at.append(number / 1000)
    reads = np.arange(0.004, seconds + 0.01, 0.004)
    for begin, length in bursts:
        reads = reads[(reads <= begin) | (reads >= begin + length)]
    place = np.searchsorted(reads, sent_at)
    for k in np.unique(place):
        data = b"".join(line for line, at in zip(stream, place, strict=True) if at == k)
        yield data, 100.0 + float(reads[k])
    yield None, whole


def gathered(share, seconds, bursts, tmp_path):
    parser, records = TextParser(), []
    for data, arrived in deliveries(share, seconds, bursts):
        if data is None:
            whole = arrived
            continue
        lines = parser.feed(data)
        if lines is not None:
            block = Block(np.full(len(lines), arrived), lines.numbers, lines.values)
            records.append(encoded(Kind.BLOCK, block_bytes(block), 0))
    device = {"name": "b", "channels": [["n", ""], ["s", ""]], "rate": 1000.0, "holds": False}
    header = {"name": "x", "task": "t", "author": "a", "cameras": []}
    header["devices"] = [device | {"counted": False}]
    return gather(parsed(header_bytes(header) + b"".join(records)), tmp_path), whole


@pytest.mark.parametrize("bursts", [(), ((3.0, 0.3), (5.0, 0.3), (6.5, 0.3))])
@pytest.mark.parametrize("share", [0.0, 0.005, 0.01, 0.05])
def test_every_whole_line_is_stored_at_its_time(share, bursts, tmp_path):
    found, whole = gathered(share, 10.0, bursts, tmp_path)
    d = found.demonstration
    # The first line is not trusted, as the connection may have begun in its middle.
    assert whole[0] == 0
    np.testing.assert_array_equal(d.signals[:, 0], whole[1:])
    late = d.times - (d.signals[:, 0] - d.signals[0, 0]) / 1000
    off = np.abs(late - np.median(late)).max()
    assert off < 0.006
    assert off < 2 * found.precision + 0.002
    lost = 10_000 - 1 - len(d.times) - (9_999 - whole[-1])
    if share:
        assert found.remarks == (
            f"{lost} samples of b were in torn lines and lost; these are gaps.",
        )
    else:
        assert not found.remarks


def test_samples_of_one_delivery_are_spread_over_the_time_since_the_last_one():
    arrived = np.repeat([10.0, 10.1, 10.4, 10.5], [10, 10, 30, 10])
    host, bound = spread(arrived, np.empty(0, np.int64))
    np.testing.assert_allclose(np.diff(host), 0.01, atol=1e-9)
    assert host[-1] == 10.5
    assert bound == pytest.approx(0.3)


def test_a_device_that_was_silent_did_not_take_its_samples_meanwhile():
    arrived = np.repeat([10.0, 10.1, 20.0, 20.1], 10)
    host, _ = spread(arrived, np.empty(0, np.int64))
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
        devices = [TextLine(board.port, ports=lambda: ()) for board in boards]
        with Recorder(project, devices) as recorder:
            recorder.start("tear")
            eventually(lambda: recorder.state().devices[0].samples > 400)
            boards[0].stall(0.3)
            time.sleep(0.1)
            eventually(lambda: recorder.state().devices[0].samples > 1200)
            boards[0].unplug()
            eventually(lambda: not recorder.state().devices[0].plugged)
            boards[0].replug()
            eventually(lambda: recorder.state().devices[0].plugged)
            before = recorder.state().devices[0].samples
            eventually(lambda: recorder.state().devices[0].samples > before + 400)
            state = recorder.state().devices[0]
            kept = recorder.stop()
    finally:
        for board in boards:
            board.close()
    with Project.open(project) as opened:
        stored = opened.demonstrations.load(kept.added.id)
    numbers = stored.signals[:, 0].astype(int)
    np.testing.assert_array_equal(stored.signals[:, 2], -numbers)
    sent = np.array(boards[0].whole)
    # Nothing is missing but what is told: the moments at the ends and while it was unplugged.
    expected = sent[(sent >= numbers[0]) & (sent <= numbers[-1])]
    missing = np.setdiff1d(expected, numbers)
    assert not np.setdiff1d(numbers, expected).size
    assert len(np.unique(numbers)) == len(numbers)
    assert (np.diff(numbers) > 0).all()
    assert missing.size == 0 or np.ptp(missing) <= 1.5 * 1000  # all while it was away
    (about,) = [remark for remark in kept.remarks if "unplugged" in remark]
    assert "in torn lines and lost" in about
    assert state.lost > 0
