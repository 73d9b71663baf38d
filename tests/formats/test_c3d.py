"""C3D files: analog channels, points where they are asked for, events as labels."""

import random
import struct

import numpy as np
import pytest
from factories import read_single, rounded_segments

pytest.importorskip("ezc3d")

import ezc3d

from forcelab.errors import InputError
from forcelab.formats import identify, preview, read
from forcelab.formats.recording import ReadOptions
from tests.formats.column_files import forces, whole_c3d, write_c3d

POINTS = np.random.default_rng(2).normal(size=(30, 2, 3)).astype(np.float32)


def test_analog_channels_come_out_as_they_went_in(tmp_path):
    values = forces(300).astype(np.float32)
    path = write_c3d(tmp_path / "walk.c3d", values, points=POINTS)
    assert identify(path).name == "c3d"
    recording = read_single(path)
    demonstration = recording.demonstration
    np.testing.assert_array_equal(demonstration.signals, values)
    np.testing.assert_allclose(demonstration.times, np.arange(300) / 1000, atol=1e-9)
    assert [(c.name, c.unit) for c in demonstration.channels] == [
        ("Fx1", "N"), ("Fy1", "N"), ("Fz1", "N"),
    ]  # fmt: skip
    assert recording.remarks == ("Others can be read as signals (--signal): points.",)


def test_points_that_are_asked_for_are_interpolated_at_the_analog_times(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", forces(300), points=POINTS)
    recording = read_single(path, signals=("points.P1",), leave_out=("analog.Fy1", "analog.Fz1"))
    channels = [(c.name, c.unit) for c in recording.demonstration.channels]
    assert channels == [("Fx1", "N"), ("P1.x", "mm"), ("P1.y", "mm"), ("P1.z", "mm")]
    np.testing.assert_array_equal(recording.demonstration.signals[::10, 1:], POINTS[:, 1])
    rows = {row.name: row.use for row in preview(path, ReadOptions())}
    assert (rows["analog.Fx1"], rows["points.P0.x"]) == ("signal", "left out")


def test_events_last_until_the_next_one_of_their_context(tmp_path):
    events = [
        ("Left", "Foot Strike", 0.05), ("Left", "Foot Off", 0.15), ("Right", "Foot Strike", 0.1),
    ]  # fmt: skip
    recording = read_single(write_c3d(tmp_path / "a.c3d", forces(300), events=events))
    assert rounded_segments(recording) == {
        "coder (Left)": [(0.05, 0.15, "Foot Strike"), (0.15, 0.3, "Foot Off")],
        "coder (Right)": [(0.1, 0.3, "Foot Strike")],
    }
    assert "Labels were read from Left: each lasts until the next one." in recording.remarks
    assert list(rounded_segments(read_single(tmp_path / "a.c3d", label="Left"))) == ["coder"]


def test_an_event_without_a_time_ends_no_label(tmp_path):
    events = [("Left", "grab", 0.05), ("Left", "hold", float("nan"))]
    recording = read_single(write_c3d(tmp_path / "a.c3d", forces(300), events=events))
    assert rounded_segments(recording) == {"coder": [(0.05, 0.3, "grab")]}


def by_hand(values, processor, scale, real, first=1, unsigned=False):
    """A file of one analog channel with two samples a frame, of a processor of one's choice."""
    order = ">" if processor == 86 else "<"

    def floats(numbers):
        data = np.asarray(numbers, order + "f4")
        if processor != 85:
            return data.tobytes()
        halves = (data * 4).view("<u2").reshape(-1, 2)[:, ::-1]
        return np.ascontiguousarray(halves).tobytes()

    def entry(number, name, content):
        return (
            struct.pack("<bb", len(name), number)
            + name
            + struct.pack(order + "H", 2 + len(content))
            + content
        )

    def parameter(name, kind, data, *shape, group=1):
        head = struct.pack("<bB", kind, len(shape)) + bytes(shape)
        return entry(group, name, head + data + b"\0")

    def integers(number):
        return np.asarray([number], order + "i2").tobytes()

    parts = entry(-1, b"ANALOG", b"\0") + entry(-2, b"POINT", b"\0")
    parts += parameter(b"GEN_SCALE", 4, floats([scale]))
    parts += parameter(b"SCALE", 4, floats([2.0]), 1)
    parts += parameter(b"OFFSET", 2, integers(100), 1)
    parts += parameter(b"LABELS", -1, b"Force ", 6, 1)
    parts += parameter(b"FORMAT", -1, b"UNSIGNED" if unsigned else b"SIGNED  ", 8, 1)
    parts += parameter(b"USED", 2, integers(1)) + parameter(b"RATE", 4, floats([100.0]))
    for name, number in ((b"USED", 0), (b"FRAMES", len(values) // 2), (b"DATA_START", 3)):
        parts += parameter(name, 2, integers(number), group=2)
    parts += parameter(b"RATE", 4, floats([50.0]), group=2)
    parts += parameter(b"SCALE", 4, floats([-1.0 if real else 1.0]), group=2)
    block = bytes([1, 80, 1, processor]) + parts
    frames = len(values) // 2
    words = np.zeros(256, order + "u2")
    words[[0, 1, 2, 3, 4, 8, 9]] = 0x5002, 0, 2, first, first + frames - 1, 3, 2
    header = bytearray(words.tobytes())
    header[:2] = b"\x02\x50"
    header[12:16] = floats([-1.0 if real else 1.0])
    header[20:24] = floats([50.0])
    kind = "u2" if unsigned else "i2"
    data = floats(values) if real else np.asarray(values, order + kind).tobytes()
    return bytes(header) + block.ljust(512, b"\0") + data


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize(("real", "unsigned"), [(True, False), (False, False), (False, True)])
def test_numbers_of_any_processor_are_scaled(tmp_path, processor, real, unsigned):
    counts = np.array([0, 100, 300, 60_000 if unsigned else -500, 7, 8] * 5)
    path = tmp_path / "a.c3d"
    path.write_bytes(by_hand(counts, processor, 0.5, real, unsigned=unsigned))
    demonstration = read_single(path).demonstration
    assert [c.name for c in demonstration.channels] == ["Force"]
    np.testing.assert_array_equal(demonstration.signals[:, 0], (counts - 100) * 2 * 0.5)
    np.testing.assert_allclose(demonstration.times, np.arange(30) / 100, atol=1e-9)
    if processor == 84 and not unsigned:
        peer = ezc3d.c3d(str(path))["data"]["analogs"][0, 0]
        np.testing.assert_array_equal(demonstration.signals[:, 0], peer)


def test_an_offset_may_be_unsigned_beside_float_samples(tmp_path):
    """As Vicon writes them, whose counts are around 32,768."""
    content = by_hand([32_768, 32_868] * 5, 84, 0.5, True, unsigned=True)
    offset = b"OFFSET" + struct.pack("<HbBB", 8, 2, 1, 1)
    assert offset + b"\x64\0" in content
    path = tmp_path / "a.c3d"
    path.write_bytes(content.replace(offset + b"\x64\0", offset + b"\0\x80"))
    signals = read_single(path).demonstration.signals[:, 0]
    np.testing.assert_array_equal(signals, [0, 100] * 5)
    np.testing.assert_array_equal(signals, ezc3d.c3d(str(path))["data"]["analogs"][0, 0])


def test_the_rate_is_that_of_the_header_where_parameters_have_none(tmp_path):
    content = by_hand(np.arange(10), 84, 0.5, True)
    path = tmp_path / "a.c3d"
    path.write_bytes(content.replace(b"RATE", b"RITE"))
    times = read_single(path).demonstration.times
    np.testing.assert_allclose(times, np.arange(10) / 100, atol=1e-9)


def test_a_header_that_counts_channels_is_read_as_what_is_in_a_frame(tmp_path):
    """As The MotionMonitor writes it; by the format it counts the samples of a frame."""
    path = write_c3d(tmp_path / "a.c3d", forces(300))
    whole = read_single(path).demonstration.signals
    content = bytearray(path.read_bytes())
    assert struct.unpack_from("<H", content, 4) == (30,)
    struct.pack_into("<H", content, 4, 3)
    path.write_bytes(content)
    np.testing.assert_array_equal(read_single(path).demonstration.signals, whole)


def test_a_part_that_was_cut_out_keeps_its_events(tmp_path):
    """Both count from the first frame that was captured."""
    path = write_c3d(tmp_path / "a.c3d", forces(300), events=[("General", "grab", 4.0)])
    content = bytearray(path.read_bytes())
    content[6:10] = struct.pack("<HH", 391, 420)  # frames from 3.9 s on
    path.write_bytes(content)
    assert rounded_segments(read_single(path)) == {"coder": [(0.1, 0.3, "grab")]}


def test_frames_that_are_cut_off_are_told_or_refused(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", forces(300))
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) - len(whole) % 512 - 1024])
    recording = read_single(path)
    assert recording.demonstration.times.size < 300
    assert recording.remarks[0].startswith("The file ends after ")
    with pytest.raises(InputError, match="ends after .* of its 30 frames"):
        read(path, ReadOptions(strict=True))
    path.write_bytes(whole + bytes(1024))
    assert "says that it has 30 frames, and has room for more" in read_single(path).remarks[0]


@pytest.mark.parametrize("seed", range(60))
def test_damage_is_one_sentence(tmp_path, seed):
    """Read by a library in the same process, some of these would end it."""
    dice = random.Random(seed)
    path = dice.choice(whole_c3d(tmp_path)) if seed % 20 == 0 else tmp_path / "a.c3d"
    if seed % 20:
        path.write_bytes(by_hand(np.arange(200) % 90, 84, 0.5, real=dice.random() < 0.5))
    content = bytearray(path.read_bytes())
    for _ in range(dice.choice((1, 4, 16))):
        content[2 + dice.randrange(min(1022, len(content) - 2))] = dice.choice((0, 127, 255, 7))
    path.write_bytes(content)
    try:
        read(path)
    except InputError as error:
        assert "\n" not in str(error)


def test_a_file_without_forces_says_what_there_is(tmp_path):
    path = write_c3d(tmp_path / "a.c3d", forces(0), points=POINTS)
    with pytest.raises(
        InputError, match=r"no signals; read others as signals \(--signal\): points"
    ):
        read_single(path)
