"""Dumps become demonstrations, and what was lost or skipped is said."""

from pathlib import Path

import numpy as np
import pytest
from factories import read_single

from forcelab.errors import InputError
from forcelab.formats import identify
from forcelab.formats.optoforce import sniff
from forcelab.formats.optoforce_packets import KINDS
from forcelab.resources import asset
from tests.formats.optoforce_streams import CONFIGURED, packet, sealed, stream

AXES3, FOUR, AXES6 = KINDS


@pytest.fixture
def dump(tmp_path):
    """Writes bytes as a file."""

    def write(data, name="dump.bin"):
        (tmp_path / name).write_bytes(data)
        return tmp_path / name

    return write


@pytest.mark.parametrize("kind", KINDS, ids=[kind.name for kind in KINDS])
def test_a_dump_is_told_by_its_packets_wherever_they_start(dump, kind):
    data, values = stream(kind, range(100, 400))
    path = dump(data[7:], "dump.csv")
    assert identify(path).name == "optoforce"
    created = read_single(path).demonstration
    assert (created.signals == values[1:]).all()
    assert created.times == pytest.approx(np.arange(299) / 1000)
    assert tuple(channel.name for channel in created.channels) == kind.names()


def test_what_only_looks_like_a_dump_is_none(dump):
    data, _ = stream(AXES3, range(7))
    noise = np.random.default_rng(1).bytes(4_000)
    for other in (data, noise, stream(AXES3, range(50))[0] + noise, AXES3.header * 300):
        assert not sniff(Path("dump.bin"), other)
    assert read_single(dump(data), format="optoforce").statistics["packets"] == 7


@pytest.mark.parametrize(("step", "rate"), [(1, 1000), (2, 500), (10, 100)])
def test_the_rate_is_that_of_the_counter_unless_one_is_given(dump, step, rate):
    path = dump(stream(AXES3, range(65_000, 65_000 + 200 * step, step))[0])
    recording = read_single(path)
    assert recording.demonstration.rate == pytest.approx(rate)
    assert f"The rate was taken as {rate} Hz, as the counter goes on by {step}" in " ".join(
        recording.remarks
    )
    output = read_single(path, rate=250.0)
    assert output.demonstration.times[1] == pytest.approx(1 / 250)
    assert "The rate was taken" not in " ".join(output.remarks)


def test_missing_samples_leave_a_gap_and_are_counted(dump):
    counts = [*range(100), *range(140, 200), *range(201, 260)]
    recording = read_single(dump(stream(AXES3, counts)[0]))
    created = recording.demonstration
    assert created.gaps == (pytest.approx((0.100, 0.140)),)
    assert np.isfinite(created.signals).all()
    statistics = {"packets": 219, "bad_checksums": 0, "skipped_bytes": 0, "missing_samples": 41}
    assert recording.statistics == statistics
    assert "41 samples went missing in 2 places, at most 40 at once after 0.099 s" in " ".join(
        recording.remarks
    )


def test_wrong_and_stray_bytes_are_counted_and_what_they_cost_is_missing(dump):
    packets = [packet(AXES3, count, [count, 2, 3]) for count in range(60)]
    packets[10] = packets[10][:9] + b"\x00" + packets[10][10:]
    packets[20] = packets[20][:5] + b"xyz" + packets[20][5:]
    recording = read_single(dump(b"".join(packets)[3:] + packets[0][:5]))
    assert recording.statistics == {
        "packets": 57,
        "bad_checksums": 2,
        "skipped_bytes": 13 + 16 + 19 + 5,
        "missing_samples": 2,
    }
    assert recording.demonstration.signals[:, 0].tolist() == [
        count for count in range(1, 60) if count not in (10, 20)
    ]


def test_marks_of_a_careless_program_are_taken_out_only_where_they_are_none_of_the_data(dump):
    mark = int.from_bytes(b"'\n", "big"), int.from_bytes(b"b'", "big")
    packets = [packet(AXES3, count, [count, *mark]) for count in range(60)]
    cut = packet(AXES3, 30, [30, 5, 6])
    packets[30] = cut[:7] + b"'\nb'" + cut[7:]
    recording = read_single(dump(b"".join(packets)))
    assert recording.statistics["packets"] == 60
    assert (recording.statistics["bad_checksums"], recording.statistics["skipped_bytes"]) == (1, 4)
    assert set(map(tuple, recording.demonstration.signals[:, 1:])) == {mark, (5, 6)}
    assert "1 mark of the program that wrote the dump (27 0a 62 27) was taken out" in " ".join(
        recording.remarks
    )


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (
            lambda p: [*p[:10], p[10][:9] + b"\x07" + p[10][10:], *p[11:]],
            "byte 160: wrong checksum of 1 packet;",
        ),
        (lambda p: [*p[:10], *p[12:]], "2 samples went missing"),
        (lambda p: [*p[:10], *p[9:]], "1 sample came twice"),
    ],
)
def test_strict_refuses_a_dump_that_is_not_whole(dump, damage, complaint):
    packets = [packet(AXES3, count) for count in range(60)]
    assert read_single(dump(b"".join(packets)), strict=True).statistics["packets"] == 60
    with pytest.raises(InputError) as refused:
        read_single(dump(b"".join(damage(packets))), strict=True)
    assert complaint in str(refused.value)
    assert "dump.bin" in str(refused.value)


def test_calibrated_by_the_serial_number_that_the_daq_told(dump, tmp_path):
    calibration = tmp_path / "mine.toml"
    axes = "".join(f"{axis} = {{ capacity = 2.0, counts = 100 }}\n" for axis in ("fx", "fy", "fz"))
    calibration.write_text(f"[ISE012.sensor1]\n{axes}[any.sensor1]\n{axes.replace('100', '1')}")
    serial = sealed(bytes([170, 0, 18, 8]) + b"ISE012\0\0")
    data = serial + b"".join(packet(AXES3, count, [-100, 0, 50]) for count in range(50))
    created = read_single(dump(data), calibration=calibration).demonstration
    assert created.signals[0] == pytest.approx([-2.0, 0.0, 1.0])
    assert {channel.unit for channel in created.channels} == {"N"}
    plain = read_single(dump(CONFIGURED + data))
    assert {channel.unit for channel in plain.demonstration.channels} == {""}
    assert "serial number is ISE012" in plain.remarks[0]
    assert "counts" in plain.remarks[1]


def test_overload_and_errors_are_said_with_their_place(dump):
    status = [0] * 100
    status[20:25] = [0x0081] * 5
    status[60] = 0x0801
    data = b"".join(packet(AXES3, i, None, word) for i, word in enumerate(status))
    remarks = read_single(dump(data)).remarks
    assert "Sensor 1 is overloaded in Fz; press less (5 samples from 0.020 s)." in remarks
    assert "Sensor 1 has failed; it may have to be repaired (1 sample from 0.060 s)." in remarks


def test_what_holds_no_packets_is_refused_with_the_cure(dump):
    for data in (b"\x00" * 500, packet(AXES3, 1)):
        with pytest.raises(InputError, match=r"dump\.bin' holds [01] valid OptoForce packets"):
            read_single(dump(data), format="optoforce")


@pytest.mark.real
def test_a_real_dump_has_all_its_samples(real_file):
    path = real_file("optoforce/stream-3axis.bin")
    recording = read_single(path, calibration=asset("calibrations/3-axis-40N.toml"))
    created = recording.demonstration
    assert created.times.size == 34_374
    assert created.gaps == ()
    assert recording.statistics["missing_samples"] == 0
    assert recording.statistics["bad_checksums"] == 54
    assert np.abs(created.signals).max() < 40
