"""A Net F/T over UDP: read from a box that was written by its manual, with what a network does."""

import numpy as np
import pytest

from forcelab.capture import netft
from forcelab.capture.device_names import parse_device
from forcelab.capture.recorder import Recorder
from forcelab.cli import main
from forcelab.demonstration import Channel
from forcelab.errors import InputError
from forcelab.project import Project
from tests.capture.helpers import eventually
from tests.capture.netft_box import START_STREAM, STOP_STREAM, Box, counts_of, newtons

#: Seconds that a stamp may be off on a machine that does other things as well.
STAMPED = 0.01


@pytest.fixture
def boxed(monkeypatch):
    """Let the reader find a box at its ports."""

    def at(box):
        monkeypatch.setattr(netft, "RDT_PORT", box.rdt_port)
        monkeypatch.setattr(netft, "HTTP_PORT", box.http_port)
        return parse_device("netft:127.0.0.1")

    return at


def record(project, device, count=300):
    """Record so many samples; gives the demonstration, its start, the state and the remarks."""
    with Recorder(project, [device]) as recorder:
        recorder.start("hold")
        eventually(lambda: recorder.state().devices[0].samples >= count)
        state = recorder.state().devices[0]
        saved = recorder.stop()
        remarks = [*saved.remarks, *recorder.remarks()]
    with Project.open(project) as opened:
        demonstration = opened.demonstrations.load(saved.added.id)
        start = float(opened.media.stamps(demonstration.id)["start"])
    return demonstration, start, state, remarks


def numbers_of(demonstration):
    """Which records of the box a demonstration has, by their first count."""
    return np.rint(demonstration.signals[:, 0] * 1e6).astype(int)


@pytest.mark.parametrize("batch", [1, 5])
def test_newtons_and_times_are_those_of_the_box_while_its_counters_turn(project, boxed, batch):
    turning = {"sequence": 2**32 - 7 * 200, "rdt": 2**32 - 120}
    with Box(**turning, batch=batch) as box:
        device = boxed(box)
        demonstration, start, state, remarks = record(project, device)
        eventually(lambda: box.commands == [START_STREAM, STOP_STREAM])
    assert device.rate == pytest.approx(1000.0)
    assert demonstration.channels == tuple(
        Channel(f"{kind}{axis}1", unit)
        for kind, unit in (("f", "N"), ("t", "Nm"))
        for axis in "xyz"
    )
    numbers = numbers_of(demonstration)
    assert numbers[0] < 120
    assert numbers[-1] > 200
    assert set(np.diff(numbers)) == {1}
    assert demonstration.signals == pytest.approx(np.array([newtons(k) for k in numbers]))
    assert np.abs(demonstration.times + start - box.taken(numbers)).max() < STAMPED
    assert state.lost == 0
    assert remarks == []


def test_what_is_lost_is_a_gap_and_what_came_in_disorder_is_none(project, boxed):
    fates = {30: 0, 31: 0, 60: "later", 90: 2, 120: 17, 150: 35}
    with Box(fate=lambda k: fates.get(k % 200, 1)) as box:
        demonstration, start, _, remarks = record(project, boxed(box))
    numbers = numbers_of(demonstration)
    inside = np.arange(numbers[0], numbers[-1])
    # Behind the next one is in time only if both were read together.
    late = {k for k in inside if k % 200 == 60} - set(numbers)
    lost = {k for k in inside if k % 200 in (30, 31, 120, 150)} | late
    assert set(inside) - set(numbers) == lost
    assert (np.diff(numbers) > 0).all()
    assert f"{len(lost)} samples of netft:127.0.0.1 were lost; these are gaps." in remarks
    assert any("sent 17 bytes, which are no whole records of 36" in remark for remark in remarks)
    assert np.abs(demonstration.times + start - box.taken(numbers)).max() < STAMPED


def test_the_status_is_told_and_saturation_counted(project, boxed):
    words = {40: 0x80020000, 41: 0x80020000, 80: 0x00010000, 120: 0x80000200}
    with Box(status=lambda k: words.get(k % 200, 0)) as box:
        _, _, state, remarks = record(project, boxed(box))
    assert state.saturated >= 2
    reports = [remark for remark in remarks if "reports status" in remark]
    assert (
        "netft:127.0.0.1 reports status 0x80020000: transducer saturated, or A/D error." in reports
    )
    assert "netft:127.0.0.1 reports status 0x80000200: bit 9." in reports
    assert not any("0x00010000" in remark for remark in reports)
    with Box(product="Ethernet Axia", status=lambda _: 0x88000000) as box:
        _, _, state, remarks = record(project, boxed(box), 50)
    assert state.saturated == state.samples
    assert "netft:127.0.0.1 reports status 0x88000000: gage out of range." in remarks


def test_a_zero_holds_while_the_box_is_off_and_both_counters_begin_anew(project, boxed):
    with Box(rdt=5000) as box, Recorder(project, [boxed(box)]) as recorder:
        eventually(lambda: recorder.state().devices[0].samples > 50)
        recorder.zero()
        eventually(lambda: recorder.latest(0.0)[0][2][0, 5] == 0.0)
        recorder.start("hold")
        eventually(lambda: recorder.state().devices[0].samples > 50)
        box.switch_off()
        eventually(lambda: not recorder.state().devices[0].plugged)
        box.switch_on()
        eventually(lambda: recorder.state().devices[0].plugged)
        before = recorder.state().devices[0].samples
        eventually(lambda: recorder.state().devices[0].samples > before + 50)
        saved = recorder.stop()
        remarks = [*saved.remarks, *recorder.remarks()]
    with Project.open(project) as opened:
        signals = opened.demonstrations.load(saved.added.id).signals
    assert not signals[:, 5].any()  # stood still, and was zeroed
    assert STOP_STREAM in box.commands
    assert box.streams == 2
    assert any("sends nothing any more; check its cable" in remark for remark in remarks)
    assert any("was unplugged once" in remark for remark in remarks)


def test_units_are_those_of_its_page_or_counts_are_given(boxed):
    with Box(cpf="4448.2216152605", cpt="1000", fu="lbf", tu="lbf-in") as box:
        device = boxed(box)
        device.open()
        row = device.read(1.0).values[0]
        device.close()
        k = round(row[4 - 1] / 0.1129848290276167 * 1000)  # tx is 1000 - k counts
        torques = np.array(counts_of(1000 - k)[3:]) * 0.1129848290276167 / 1000
        assert row == pytest.approx([*np.array(counts_of(1000 - k)[:3]) / 1000, *torques])
        box.page = ""
        with pytest.raises(InputError, match="is no configuration page of a Net F/T"):
            device.open()
        device = parse_device("netft:127.0.0.1?force=1000&torque=500")
        device.open()
        row = device.read(1.0).values[0]
        device.close()
    assert row == pytest.approx(
        np.array(counts_of(round(row[0] * 1000))) / ([1000] * 3 + [500] * 3)
    )


def test_what_is_no_net_ft_is_refused_in_a_sentence(boxed, monkeypatch):
    monkeypatch.setattr(netft, "ANSWER_SECONDS", 0.2)
    with Box(fu="parsec") as box:
        device = boxed(box)
        with pytest.raises(
            InputError, match="says '1000000' counts a 'parsec', which means nothing"
        ):
            device.open()
        box.switch_off()
        silent = parse_device("netft:127.0.0.1?force=1&torque=1")
        with pytest.raises(InputError, match="sends no records; check the address, and that RDT"):
            silent.open()
    with pytest.raises(InputError, match="does not show its configuration"):
        device.open()  # nobody is there any more
    with pytest.raises(InputError, match="cannot be used|sends no records"):
        silent.open()
    for name, fault in {
        "netft:": "has no address",
        "netft:x?force=1": "both force and torque",
        "netft:x?rate=-1": "cannot have rate=-1",
        "netft:x?force=many&torque=1": "counts a newton, such as force=1000000",
    }.items():
        with pytest.raises(InputError, match=fault):
            parse_device(name)


def test_any_datagram_and_any_page_is_read_or_refused():
    rng = np.random.default_rng(3)
    page = Box().page
    for _ in range(100):
        stream = netft.RecordStream()
        data = [rng.bytes(36 * int(rng.integers(1, 6)) - int(rng.integers(2))) for _ in range(4)]
        if stream.learn(np.concatenate([netft.parse_records(piece) for piece in data[:2]])):
            for piece in data[2:]:
                fed = stream.feed(netft.parse_records(piece))
                assert fed is None or (np.diff(fed[0]) > 0).all()
        letters = np.array(list(page))
        letters[rng.integers(0, len(letters), 12)] = list("<>/0eN-xc f\n")
        try:
            read = netft.parse_page("".join(letters), "it")
            assert netft.scale(read, "cfgcpf", "scfgfu", netft.FORCES) > 0
        except InputError as error:
            assert str(error).count(".") >= 1


def test_the_command_records_it(project, boxed, capsys):
    with Box() as box:
        boxed(box)
        command = ["capture", str(project), "--task", "hold", "--seconds", "0.2"]
        assert main([*command, "--device", "netft:127.0.0.1"]) == 0
    assert "'hold 01': 0." in capsys.readouterr().out
