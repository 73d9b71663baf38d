"""Devices read through real pyserial on real ptys."""

import re
import time
from contextlib import ExitStack

import numpy as np
import pytest

from forcelab.capture import encoder, optoforce
from forcelab.capture.device import MessageQueue, UnpluggedError
from forcelab.capture.device_names import parse_device, parse_devices, quote_value
from forcelab.capture.discovery import FoundPort
from forcelab.capture.emulator import build_packets
from forcelab.capture.encoder import Encoder
from forcelab.capture.optoforce import OptoForce
from forcelab.capture.reader import DeviceReader
from forcelab.capture.text_device import TextDevice
from forcelab.errors import InputError
from tests.capture.helpers import eventually, numbered
from tests.capture.virtual_devices import (
    Faults,
    FaultyOptoForce,
    VirtualEncoder,
    VirtualOptoForce,
    VirtualTextDevice,
    table_source,
)

SHEET = """
[ISE123AB.sensor1]
fx = { capacity = 40.0, counts = 16000 }
fy = { capacity = 40.0, counts = [8000, 4000] }
fz = { capacity = 100.0, counts = 1000 }
"""


@pytest.fixture
def answers_are_awaited_less(monkeypatch):
    """For devices that never answer: less is waited for what does not come."""
    monkeypatch.setattr(optoforce, "ANSWER_SECONDS", 0.15)
    monkeypatch.setattr(encoder, "ANSWER_SECONDS", 0.15)


@pytest.fixture
def opened():
    """Open a device, and close it when the test has ended."""
    with ExitStack() as stack:

        def open_device(device):
            device.open()
            stack.callback(device.close)
            return device

        yield open_device


def nothing():
    return ()


def steady(*counts):
    return table_source(np.tile(counts, (60_000, 1)), 1000.0)


def collect(device, number, seconds=15.0):
    """Blocks until there are so many samples; fails if they never come."""
    blocks, until = [], time.monotonic() + seconds
    while sum(map(len, blocks)) < number:
        assert time.monotonic() < until
        block = device.read(0.1)
        if block is not None:
            blocks.append(block)
    return blocks


def join_blocks(blocks, what):
    return np.concatenate([getattr(block, what) for block in blocks])


def collect_until_gone(device):
    """Read until the device is known to be gone; the samples until then."""
    blocks, until = [], time.monotonic() + 15
    while True:
        assert time.monotonic() < until
        try:
            block = device.read(0.1)
        except UnpluggedError as error:
            return blocks, str(error)
        if block is not None:
            blocks.append(block)


def back(device):
    until = time.monotonic() + 15
    while True:
        try:
            return device.reopen()
        except UnpluggedError:
            assert time.monotonic() < until


def remarked(device, words, seconds=15.0):
    """Read until a remark has these words."""
    until = time.monotonic() + seconds
    remarks = ()
    while not any(words in sentence for sentence in remarks):
        assert time.monotonic() < until, remarks
        device.read(0.05)
        remarks += device.remarks()
    return remarks


def test_every_sample_comes_once_with_its_tick_and_the_stamp_of_its_read(opened):
    with VirtualOptoForce(numbered, step=10) as virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        assert virtual.configured == [(1, 4, 0)]
        assert device.serial == "ISE123AB"
        assert [c.name for c in device.channels] == ["fx1", "fy1", "fz1"]
        assert {c.unit for c in device.channels} == {""}
        blocks = collect(device, 200)
    truth = virtual.truth()
    values, ticks = join_blocks(blocks, "values"), join_blocks(blocks, "ticks")
    assert ticks[0] == 0
    assert (np.diff(ticks) == 1).all()
    assert (np.diff(values[:, 0]) == 1).all()
    places = np.searchsorted(truth.values[:, 0], values[:, 0])
    np.testing.assert_array_equal(truth.values[places], values)
    assert (join_blocks(blocks, "arrived") >= truth.times[places]).all()
    for block in blocks[1:]:
        assert len(set(block.arrived)) == 1
    assert device.remarks() == ()


def test_counts_become_newtons_by_axis_sign_and_serial_number(opened, tmp_path):
    sheet = tmp_path / "sheet.toml"
    sheet.write_text(SHEET)
    with VirtualOptoForce(steady(400, -400, 10)) as virtual:
        device = opened(
            parse_device(f"optoforce:{virtual.port}?calibration={sheet}&rate=500&filter=0")
        )
        values = collect(device, 20)[-1].values
    assert virtual.configured == [(2, 0, 0)]
    assert values[-1] == pytest.approx([1.0, -4.0, 1.0])
    assert {c.unit for c in device.channels} == {"N"}


def test_a_daq_that_the_sheet_does_not_know_is_refused_and_its_port_let_go(tmp_path):
    sheet = tmp_path / "sheet.toml"
    sheet.write_text(SHEET)
    with VirtualOptoForce(numbered, serial="ISE999ZZ") as virtual:
        device = OptoForce(virtual.port, calibration=sheet, ports=nothing)
        with pytest.raises(InputError, match="ISE999ZZ"):
            device.open()
        other = OptoForce(virtual.port, ports=nothing)
        other.open()
        other.close()


@pytest.mark.parametrize("axes", [6, 12])
def test_other_kinds_tell_their_channels_by_themselves(axes):
    source = table_source(np.tile(np.arange(axes), (60_000, 1)), 1000.0)
    with VirtualOptoForce(source) as virtual:
        device = OptoForce(virtual.port, ports=nothing)
        assert device.channels == ()
        device.open()
        assert device.number_sensors(3) == (7 if axes == 12 else 4)
        values = collect(device, 20)[-1].values
        device.close()
    assert len(device.channels) == axes
    assert device.channels[0].name == "fx3"
    np.testing.assert_array_equal(values[-1], np.arange(axes))


def test_zeroing_takes_the_present_readings_and_survives_the_cable(opened, tmp_path):
    with VirtualOptoForce(steady(400, -400, 10)) as virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        collect(device, 20)
        device.zero()
        values = collect(device, 50)
        assert virtual.configured[-2:] == [(1, 4, 0), (1, 4, 255)]
        assert not join_blocks(values, "values").any()
        virtual.unplug()
        collect_until_gone(device)
        virtual.replug()  # the DAQ has forgotten its zero
        back(device)
        assert join_blocks(collect(device, 50), "values") == pytest.approx(0.0)
        device.zero()
        assert not join_blocks(collect(device, 50), "values").any()


def test_lost_packets_are_gaps_in_the_ticks(opened):
    faults = Faults(lost=0.05, corrupted=0.001, doubled=0.001)
    with FaultyOptoForce(numbered, step=3) as virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        virtual.faults = faults
        blocks = collect(device, 250)
    values, ticks = join_blocks(blocks, "values"), join_blocks(blocks, "ticks")
    # Each tick is one sample of the device, whatever was lost.
    np.testing.assert_array_equal(ticks - ticks[0], values[:, 0] - values[0, 0])
    assert ticks[-1] - ticks[0] + 1 > len(ticks)


def test_unplugged_and_plugged_in_again_it_is_one_stream_with_a_gap(opened):
    with VirtualOptoForce(numbered, first=500) as virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        blocks = collect(device, 100)
        virtual.unplug()
        more, remarks = collect_until_gone(device)
        assert virtual.port in remarks
        with pytest.raises(UnpluggedError, match="not plugged in again yet"):
            device.reopen()
        time.sleep(0.1)
        virtual.replug()
        back(device)
        blocks += more + collect(device, 100)
    assert device.connections == 2
    assert virtual.configured == [(1, 4, 0)] * 2  # told again
    ticks, values = join_blocks(blocks, "ticks"), join_blocks(blocks, "values")
    steps = np.diff(ticks)
    assert (steps > 0).all()
    (gap,) = np.flatnonzero(steps != 1)
    # The host's clock says how long it was away: to within a delivery or two, and by as much more
    # as a busy machine read what came before and after too late.
    truth = values[gap + 1, 0] - values[gap, 0]
    assert truth > 100
    taken = virtual.truth()
    places = np.searchsorted(taken.values[:, 0], values[[gap, gap + 1], 0])
    late = join_blocks(blocks, "arrived")[[gap, gap + 1]] - taken.times[places]
    assert abs(steps[gap] - truth) < 20 + 1000 * late.max()


def test_it_is_found_again_at_another_port_by_its_serial_number(opened, tmp_path):
    ports = []
    with (
        VirtualOptoForce(numbered, serial="ISE00001") as virtual,
        VirtualOptoForce(steady(1, 2, 3), serial="ISE00002") as other,
    ):
        ports[:] = [other.port]
        device = opened(OptoForce(virtual.port, ports=lambda: ports))
        old = device.name
        virtual.unplug()
        collect_until_gone(device)
        with pytest.raises(UnpluggedError):
            device.reopen()  # another DAQ is not taken for it
        virtual.replug(virtual.path.with_name("ttyACM7"))
        ports.append(virtual.port)
        back(device)
        assert device.name == f"optoforce:{virtual.port}" != old
        assert join_blocks(collect(device, 50), "values")[-1, 0] > 50
        assert other.configured == []


def test_one_that_is_wanted_by_its_serial_number_is_not_mixed_up():
    with VirtualOptoForce(numbered) as virtual:
        device = OptoForce(virtual.port, serial="ISE00007", ports=nothing)
        with pytest.raises(InputError, match="is ISE123AB, not OptoForce DAQ ISE00007"):
            device.open()


@pytest.mark.usefixtures("answers_are_awaited_less")
def test_one_that_does_not_answer_is_read_and_remarked(opened):
    virtual = VirtualOptoForce(numbered)
    virtual.answers = False
    with virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        collect(device, 30)
        remarks = device.remarks()
    assert device.serial is None
    assert any("does not tell its serial number" in remark for remark in remarks)
    assert any("did not confirm" in remark for remark in remarks)


@pytest.mark.usefixtures("answers_are_awaited_less")
def test_one_with_other_sensors_is_not_taken_for_the_one_that_was_unplugged(opened):
    virtual, other = VirtualOptoForce(steady(1, 2, 3)), VirtualOptoForce(steady(*range(12)))
    virtual.answers = other.answers = False  # no serial number tells them apart
    with virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        virtual.unplug()
        other.path, other._homeless = virtual.path, False
        with other, pytest.raises(UnpluggedError):
            device.reopen()
        virtual.replug()
        device.reopen()
        assert collect(device, 30)[0].values.shape[1] == 3


@pytest.mark.usefixtures("answers_are_awaited_less")
def test_what_is_no_daq_is_refused_in_a_sentence():
    with VirtualTextDevice(lambda t: t[:, None], 100) as virtual:
        device = OptoForce(virtual.port, ports=nothing)
        with pytest.raises(InputError, match="sends no OptoForce packets"):
            device.open()


def test_overload_is_remarked_once_and_marks_its_samples(opened):
    with VirtualOptoForce(numbered) as virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        virtual.status = 1 << 9  # Fx
        remarks = remarked(device, "overloaded in Fx")
        blocks = collect(device, 100)
        remarks += device.remarks()
        virtual.status = 1 << 10 | 2
        remarks += remarked(device, "absent")
    assert sum("overloaded" in remark for remark in remarks) == 1
    assert any("Sensor 2 is absent" in remark for remark in remarks)
    assert (blocks[-1].status == 1 << 9).any()


def test_a_daq_that_falls_silent_is_remarked_once(opened, monkeypatch):
    monkeypatch.setattr(optoforce, "SILENCE_SECONDS", 0.15)
    with VirtualOptoForce(numbered) as virtual:
        device = opened(OptoForce(virtual.port, ports=nothing))
        collect(device, 30)
        virtual.stall(0.3)
        remarks = remarked(device, "has sent no valid packet")
        collect(device, 50)
        remarks += device.remarks()
    assert sum("no valid packet" in remark for remark in remarks) == 1


def test_a_counter_that_stands_still_is_not_taken_for_a_loose_cable(monkeypatch):
    device = OptoForce("daq", ports=nothing)
    counters = np.r_[np.arange(300), np.full(3000, 299)]
    packets = build_packets(counters, np.zeros(3300, int), np.zeros((3300, 3), int))
    device._last_arrival = time.monotonic() - 10
    for first in range(0, 3300, 100):
        sent = packets[first : first + 100].tobytes(), time.monotonic()
        monkeypatch.setattr("forcelab.capture.serial_port.Port.read", lambda *_, sent=sent: sent)
        device.read(0.0)
    (remarks,) = device.remarks()
    assert "counter stands still" in remarks


def test_sensors_of_several_daqs_are_numbered_through():
    with VirtualOptoForce(steady(*range(12))) as first, VirtualOptoForce(steady(1, 2, 3)) as second:
        devices = [OptoForce(virtual.port, ports=nothing) for virtual in (first, second)]
        sensor = 1
        for device in devices:
            device.open()
            sensor = device.number_sensors(sensor)
        names = [channel.name for device in devices for channel in device.channels]
        for device in devices:
            device.close()
    assert len(set(names)) == 15
    assert names[-3:] == ["fx5", "fy5", "fz5"]


def test_text_with_a_clock_is_counted_by_it(opened):
    def source(times):
        return np.column_stack([times, np.sin(times)])

    with VirtualTextDevice(
        source, 200, names=("t", "s"), labelled=True, clock="time_ms"
    ) as virtual:
        device = opened(TextDevice(virtual.port, ports=nothing))
        assert [c.name for c in device.channels] == ["t", "s"]
        assert device.rate == pytest.approx(200, rel=0.01)
        assert not device.measured
        blocks = collect(device, 40)
        virtual.unplug()
        blocks += collect_until_gone(device)[0]
        virtual.replug()
        back(device)
        again = collect(device, 20)
    ticks, values = join_blocks(blocks, "ticks"), join_blocks(blocks, "values")
    np.testing.assert_array_equal(np.diff(ticks), np.round(np.diff(values[:, 0]) * 200))
    assert join_blocks(again, "ticks")[0] > ticks[-1]
    assert device.connections == 2


def test_text_without_a_clock_counts_its_lines_and_can_be_zeroed(opened):
    with VirtualTextDevice(lambda t: np.full((len(t), 1), 5.0), 200, junk=0.1) as virtual:
        device = opened(parse_device(f"text:{virtual.port}?baud=9600&rate=200"))
        blocks = collect(device, 40)
        device.zero()
        assert not collect(device, 5)[-1].values.any()
        assert device._parser.junk_lines > 0
    assert (device.rate, device.measured, device.counted) == (200, False, False)
    assert (np.diff(join_blocks(blocks, "ticks")) == 1).all()
    assert (join_blocks(blocks, "values") == 5.0).all()


class BusyPort:
    """A board's lines in bursts; every other one is read late, as by a busy computer."""

    def __init__(self, rate, burst):
        sent = burst * np.arange(1, int(9 / burst))
        lines = np.floor(rate * sent).astype(int)
        late = np.random.default_rng(0).exponential(0.004, len(sent)) * (np.arange(len(sent)) % 2)
        self.lines, self.read_at = lines.tolist(), np.maximum.accumulate(sent + late).tolist()
        self.next_line = 0

    def open(self):
        """It is always there."""

    def close(self):
        """Nobody else wants it."""

    def read(self, timeout):
        if not self.lines:
            time.sleep(timeout)
            return b"", time.monotonic()
        until, read = self.lines.pop(0), self.read_at.pop(0)
        data = b"".join(b"%d,%d\n" % (k, -k) for k in range(self.next_line, until))
        self.next_line = until
        return data, read


@pytest.mark.parametrize(("rate", "burst"), [(80, 0.016), (333.33, 0.004), (10, 0.016)])
def test_the_rate_of_text_is_measured_though_lines_come_in_bursts(rate, burst, monkeypatch):
    port = BusyPort(rate, burst)
    monkeypatch.setattr("forcelab.capture.serial_port.Port", lambda *_: port)
    device = TextDevice("bursts", ports=nothing)
    device.open()
    assert device.rate == pytest.approx(rate, rel=0.005)
    assert device.measured
    device.rate *= 1.01
    reader = DeviceReader(0, device, 5.0)
    eventually(lambda: not port.lines)
    state = reader.state()
    reader.close()
    # What was measured is no promise, so that no clock is said to break it.
    assert state.rate == pytest.approx(rate, rel=0.01)
    assert "drift" not in state.alarms
    assert np.isnan(state.clock_rate)


def test_stamps_in_whole_milliseconds_tell_the_rate_by_all_of_them(opened):
    def source(times):
        return np.column_stack([np.sin(times)])

    with VirtualTextDevice(source, 330, names=("s",), labelled=True, clock="time_ms") as virtual:
        device = opened(TextDevice(virtual.port, ports=nothing))
    assert device.rate == pytest.approx(330, rel=0.01)  # 1 / 3 ms is 333


def test_a_channel_without_a_reading_keeps_its_zero_when_a_text_device_is_zeroed(opened):
    present = []

    def source(times):
        second = 7.0 if present else np.nan
        return np.column_stack([np.full(len(times), 5.0), np.full(len(times), second)])

    with VirtualTextDevice(source, 200) as virtual:
        device = opened(TextDevice(virtual.port, rate=200, ports=nothing))
        first = collect(device, 5)
        assert np.isnan(first[-1].values[-1, 1])
        device.zero()
        present.append(True)
        values = join_blocks(collect(device, 30), "values")
    np.testing.assert_array_equal(values[-1], [0.0, 7.0])


def test_a_device_that_prints_no_numbers_is_told_with_the_cure(monkeypatch):
    monkeypatch.setattr("forcelab.capture.text_device.FIRST_LINES_SECONDS", 0.3)
    with (
        VirtualEncoder(lambda t: t[:, None]) as virtual,  # says nothing unasked
        pytest.raises(InputError, match=r"no lines of numbers at 115200 baud.*\?baud=9600"),
    ):
        TextDevice(virtual.port, ports=nothing).open()


@pytest.mark.parametrize("bang", [True, False])
def test_an_encoder_gives_its_count_when_it_changes_and_holds_it_in_between(opened, bang):
    def source(times):
        return np.floor(200 * np.clip(times, 0.0, 0.15))[:, None]

    with VirtualEncoder(source, bang=bang) as virtual:
        device = opened(parse_device(f"encoder:{virtual.port}?scale=0.5&unit=mm"))
        assert device.holds
        assert [(c.name, c.unit) for c in device.channels] == [("opening", "mm")]
        blocks = []
        until = time.monotonic() + 10
        while not blocks or blocks[-1].values[-1, 0] < 15.0:
            assert time.monotonic() < until
            block = device.read(0.1)
            if block is not None:
                blocks.append(block)
        assert device.read(0.05) is None  # it stands still
        device.zero()
        virtual.unplug()
        collect_until_gone(device)
        virtual.replug()
        back(device)
        assert any("lost its count" in remark for remark in device.remarks())
    values = join_blocks(blocks, "values")[:, 0]
    assert (np.diff(values) == 0.5).all()


def test_a_zero_holds_over_the_cable_and_is_forgotten_when_a_device_is_opened_anew():
    for name, virtual in {
        "text:%s?rate=200": VirtualTextDevice(lambda t: np.full((len(t), 1), 5.0), 200),
        "encoder:%s": VirtualEncoder(lambda t: np.floor(np.minimum(50 * t, 5.0))[:, None]),
    }.items():
        with virtual:
            device = parse_device(name % virtual.port)
            device.open()
            assert wait_for_value(device, 5.0), name
            device.zero()
            device.close()
            device.open()
            assert wait_for_value(device, 5.0), name
            device.zero()
            device.reopen()  # as after a loose cable; this one was never without power
            assert wait_for_value(device, 0.0), name
            device.close()


def wait_for_value(device, value, seconds=10.0):
    """Whether a device comes to give a value, and nothing but what it had before on the way."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        block = device.read(0.1)
        if block is not None and block.values[-1, 0] == value:
            return True
    return False


def test_a_name_can_hold_what_would_end_its_parts(tmp_path):
    file = tmp_path / "50%26 of R&D?.toml"
    file.write_text("[any]\nfx = { capacity = 10.0, counts = 100 }\n")
    with pytest.raises(InputError, match=re.escape(str(file))):  # it is found, but lacks fy
        parse_device(f"optoforce:/dev/x?calibration={quote_value(str(file))}&rate=100")
    assert parse_device(f"text:{quote_value('/dev/a&b?c')}?baud=9600").name == "text:/dev/a&b?c"
    with pytest.raises(InputError, match="an & within a value is written as %26"):
        parse_device(f"optoforce:/dev/x?calibration={file}")


@pytest.mark.usefixtures("answers_are_awaited_less")
def test_what_does_not_answer_is_no_encoder():
    with (
        VirtualTextDevice(lambda t: t[:, None], 10) as virtual,
        pytest.raises(InputError, match="does not answer as a QSB does"),
    ):
        Encoder(virtual.port, ports=nothing).open()


def test_a_line_device_is_looked_for_by_its_usb_serial_number(opened):
    with VirtualTextDevice(lambda t: t[:, None], 1000) as virtual:
        ports = [FoundPort(virtual.port, "text", "", "A1", (1, 2), usable=True)]
        device = opened(TextDevice(virtual.port, rate=1000, ports=lambda: ports))
        virtual.unplug()
        collect_until_gone(device)
        ports.clear()
        with pytest.raises(UnpluggedError, match="not plugged in again yet"):
            device.reopen()
        virtual.replug(virtual.path.with_name("ttyUSB5"))
        ports.append(FoundPort(virtual.port, "text", "", "A1", (1, 2), usable=True))
        back(device)
        assert device.name.endswith("ttyUSB5")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("/dev/ttyACM0", "is no device; write optoforce:PORT"),
        ("daq:/dev/ttyACM0", "is no device"),
        ("optoforce:/dev/x?baud=9600", "'baud=9600' in .* means nothing; optoforce takes rate="),
        ("text:/dev/x?baud=fast", "does not say a baud"),
        ("text:/dev/x?baud=1&baud=2", "each once"),
        ("optoforce:/dev/x?rate=3000", "3000 samples a second"),
        ("optoforce:/dev/x?rate=0", "above zero"),
        ("optoforce:/dev/x?filter=7", "no filter of 7 Hz"),
        ("optoforce:/dev/x?calibration=/no/such.toml", "no/such.toml"),
        ("text:/dev/x?rate=fast", "does not say a rate; write a number, such as rate=80"),
        ("text:/dev/x?rate=-5", "cannot print -5 of them a second"),
        ("text:/dev/x?rate=nan", "cannot print nan of them a second"),
        ("encoder:/dev/x?reverse=perhaps", "does not say a reverse; write yes or no"),
        ("encoder:/dev/x?scale=nan", "cannot be read at nan units a count"),
        ("encoder:/dev/x?scale=0", "cannot be read at 0 units a count"),
    ],
)
def test_a_name_that_means_nothing_is_refused_in_a_sentence(name, words):
    with pytest.raises(InputError, match=words):
        parse_device(name)


def test_events_are_said_once_while_they_go_on():
    events = MessageQueue()
    for now in (0.0, 0.2, 0.6, 1.0, 2.0):
        events.put_once("hot", "It is hot.", now)
    events.put("All else is well.")
    assert events.take() == ("It is hot.", "It is hot.", "All else is well.")
    assert events.take() == ()
    for number in range(1000):
        events.put(str(number))
    assert len(events.take()) == 100


def test_two_devices_at_one_port_are_refused_before_it_seems_to_be_in_use_by_others():
    names = ["optoforce:/dev/ttyA", "text:/dev/ttyB", "optoforce:/dev/ttyA?rate=500"]
    with pytest.raises(InputError, match="Two devices are said to be at /dev/ttyA"):
        parse_devices(names)
    assert [device.name for device in parse_devices(names[:2])] == names[:2]
