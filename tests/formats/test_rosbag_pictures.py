"""Pictures in ROS bags become videos whose frames are shown at the stamps of their headers."""

import os
import re

import cv2
import numpy as np
import pytest
from factories import VIDEO_WIDTH, frame_number, numbered_frame, read_single

pytest.importorskip("rosbags")

from forcelab.cli import main
from forcelab.errors import InputError
from forcelab.formats.recording import ReadOptions
from forcelab.formats.rosbag import preview
from forcelab.project import Project
from forcelab.video.reader import VideoReader
from tests.formats.rosbag_files import (
    BEGIN,
    COMPRESSED,
    IMAGE,
    WRENCH,
    compressed_image,
    image,
    wrenches,
    write_bag,
)

#: Places that are looked at; FORCELAB_BAG_PLACES=500 FORCELAB_BAG_SECONDS=60 for the whole proof.
PLACES = int(os.environ.get("FORCELAB_BAG_PLACES", "20"))
SECONDS = float(os.environ.get("FORCELAB_BAG_SECONDS", "2"))
FT = (WRENCH, wrenches(100))


def stamps(rate, seconds, seed, start):
    """When a camera takes its pictures: it drops some, and no two are the same time apart."""
    random = np.random.default_rng(seed)
    times = start + np.arange(int(seconds * rate)) / rate
    times = times + random.uniform(0, 0.6 / rate, times.size)
    return np.round(times[random.random(times.size) < 0.9], 9)


def topic_of(kind, messages, late=0.03):
    """Messages that arrive a little later than the stamps of their headers."""
    stamps = [message["header"]["stamp"] for message in messages]
    times = [s["sec"] - BEGIN // 10**9 + s["nanosec"] / 1e9 + late for s in stamps]
    return kind, list(zip(times, messages, strict=True))


def videos_of(path, tmp_path, **options):
    """The recording of a bag, and its videos by topic."""
    unpack = tmp_path / "unpack"
    unpack.mkdir(exist_ok=True)
    recording = read_single(path, unpack=unpack, **options)
    return recording, {video.name: video for video in recording.demonstration.videos}


@pytest.mark.parametrize(
    ("name", "how"),
    [("a.bag", {}), ("b.bag", {"compression": "lz4"}), ("c", {"ros": 2}),
     ("d", {"ros": 2, "storage": "db3"})],
)  # fmt: skip
def test_every_time_shows_the_last_picture_taken_by_then(tmp_path, name, how):
    begin = -0.4  # the cameras begin before the forces
    taken = {"/left/image_raw/compressed": stamps(30, SECONDS, 1, begin)}
    taken["/right/image_raw"] = stamps(12.5, SECONDS, 2, begin + 0.2)
    left, right = taken.values()
    coded = [numbered_frame(n) for n in range(max(left.size, right.size))]
    topics = {
        "/wrist/ft": (WRENCH, wrenches(int(100 * SECONDS), 100)),
        "/table/ft": (WRENCH, wrenches(int(61 * SECONDS), 61, start=0.003)),
        "/left/image_raw/compressed": topic_of(
            COMPRESSED, [compressed_image(t, coded[n]) for n, t in enumerate(left)]
        ),
        "/right/image_raw": topic_of(
            IMAGE, [image(t, coded[n], padding=24) for n, t in enumerate(right)], late=0.3
        ),
    }
    project, bag = tmp_path / "p.forcelab", write_bag(tmp_path / name, topics, **how)
    assert main(["import", str(project), str(bag), "--task", "peg"]) == 0
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        demonstration = opened.demonstrations.load(info.id)
        assert len(demonstration.channels) == 12
        assert [video.name for video in demonstration.videos] == list(taken)
        for video in demonstration.videos:
            times = taken[video.name]
            random = np.random.default_rng(5)
            chosen = [*random.uniform(times[0], times[-1] + 0.2, PLACES), *times[:PLACES]]
            with VideoReader(video.path, cache=1) as reader:
                assert len(reader) == times.size
                for time in chosen:
                    number = reader.index_at(float(video.clock.to_device(time)))
                    assert number == np.flatnonzero(times <= time)[-1]
                    assert frame_number(reader.frame(number)) == number
                assert reader.index_at(float(video.clock.to_device(times[0] - 1e-5))) == -1


def test_jpeg_is_not_encoded_again_and_what_came_is_told(tmp_path, capsys):
    jpegs = [cv2.imencode(".jpg", numbered_frame(n))[1].tobytes() for n in range(20)]
    topics = {
        "/ft": FT,
        "/cam": topic_of(COMPRESSED, [compressed_image(n / 25, j) for n, j in enumerate(jpegs)]),
    }
    bag = write_bag(tmp_path / "a.bag", topics)
    recording, videos = videos_of(bag, tmp_path)
    content = videos["/cam"].path.read_bytes()
    assert all(jpeg in content for jpeg in jpegs)
    (remark,) = [text for text in recording.remarks if "video" in text]
    assert re.fullmatch(
        r"/cam became a video: 20 frames of 384 x 64 \(as in the bag\), \d+ kB\.", remark
    )
    assert main(["import", str(tmp_path / "p.forcelab"), str(bag), "--task", "peg"]) == 0
    assert remark in capsys.readouterr().out


def colours():
    """Four areas of different colours, (48, 64, 3), red, green, blue."""
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:24, :32], picture[:24, 32:] = (200, 40, 40), (40, 180, 60)
    picture[24:, :32], picture[24:, 32:] = (30, 60, 210), (128, 128, 128)
    return picture


def mosaic(pattern):
    """What a sensor sees of :func:`colours` through filters in that order."""
    picture, seen = colours(), np.zeros((48, 64), np.uint8)
    for place, letter in enumerate(pattern):
        row, column = divmod(place, 2)
        seen[row::2, column::2] = picture[row::2, column::2, "rgb".index(letter)]
    return seen


GREY = np.asarray(cv2.cvtColor(colours(), cv2.COLOR_RGB2GRAY))
FULL = np.dstack([colours(), np.full((48, 64), 9, np.uint8)])
RAW = {
    "rgb8": colours(),
    "bgr8": colours()[:, :, ::-1],
    "rgba8": FULL,
    "bgra8": FULL[:, :, [2, 1, 0, 3]],
    "rgb16": colours().astype("<u2") * 256 + 3,
    "mono8": GREY,
    "mono16": GREY.astype("<u2") * 256 + 200,
    "8UC3": colours()[:, :, ::-1],
    "yuv422": cv2.cvtColor(colours(), cv2.COLOR_RGB2YUV_UYVY),
    "yuv422_yuy2": cv2.cvtColor(colours(), cv2.COLOR_RGB2YUV_YUY2),
} | {f"bayer_{pattern}8": mosaic(pattern) for pattern in ("rggb", "bggr", "gbrg", "grbg")}


def middles(picture):
    """Colours in the middle of each area."""
    return picture[[12, 12, 36, 36], [16, 48, 16, 48]].astype(int)


def test_every_encoding_keeps_its_colours_and_its_rows(tmp_path):
    topics = {"/ft": FT}
    for encoding, picture in RAW.items():
        messages = [image(n / 10, picture, encoding, padding=3) for n in range(2)]
        topics[f"/{encoding}"] = topic_of(IMAGE, messages)
    topics["/png"] = topic_of(COMPRESSED, [compressed_image(n, colours(), "png") for n in (0, 1)])
    big = image(0.1, RAW["mono16"].byteswap(), "mono16", is_bigendian=1)
    topics["/big"] = topic_of(IMAGE, [big, image(0.2, RAW["mono16"], "mono16")])
    recording, videos = videos_of(write_bag(tmp_path / "a", topics, ros=2), tmp_path)
    assert videos.keys() == topics.keys() - {"/ft"}
    for topic, video in videos.items():
        grey = "mono" in topic or topic == "/big"
        expected = np.repeat(GREY[:, :, None], 3, axis=2) if grey else colours()
        with VideoReader(video.path) as reader:
            for number in range(2):
                shown = middles(reader.frame(number))
                np.testing.assert_allclose(shown, middles(expected), atol=6, err_msg=topic)
    assert any("(bayer_rggb8 encoded as JPEG)" in remark for remark in recording.remarks)


def test_depths_and_formats_that_are_no_pictures_are_left_out_with_a_remark(tmp_path):
    deep = np.full((4, 4), 900, np.uint16)
    topics = {
        "/ft": FT,
        "/depth": topic_of(IMAGE, [image(n / 10, deep, "16UC1") for n in range(3)]),
        "/odd": topic_of(IMAGE, [image(n / 10, deep, "nv21x") for n in range(3)]),
        "/film": topic_of(COMPRESSED, [compressed_image(0.1, b"\0\0\0\1g", "h264")]),
        "/deep_png": topic_of(
            COMPRESSED, [compressed_image(0.1, cv2.imencode(".png", deep)[1].tobytes(), "png")]
        ),
    }
    bag = write_bag(tmp_path / "a.bag", topics)
    recording, videos = videos_of(bag, tmp_path, strict=True)
    assert videos == {}
    text = "\n".join(recording.remarks)
    assert "Pictures of /depth (16UC1, 4 x 4) were left out: its encoding '16UC1' holds" in text
    assert "Pictures of /odd (nv21x, 4 x 4) were left out: its encoding 'nv21x' is not" in text
    assert "Pictures of /film (h264) were left out: it is neither JPEG nor PNG." in text
    assert "Pictures of /deep_png (png) were left out: it is of 16 bits and one channel" in text
    # A script that names no folder gets the forces.
    assert "become a video when the bag is imported" in "\n".join(read_single(bag).remarks)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda m: m | {"data": m["data"][:-40]}, r"message 5: it ends too early"),
        (lambda m: m | {"data": m["data"][:0]}, r"message 5: it is empty"),
        (lambda m: m | {"data": np.array([0xFF, 0xD8, 0xFF, 0xD9], np.uint8)}, r"its headers are"),
        (
            lambda _: compressed_image(0.4, colours()),
            r"message 5: it is of 64 x 48, others 384 x 64",
        ),
    ],
)
def test_a_damaged_picture_is_left_out_and_told_and_refused_if_strict(tmp_path, change, sentence):
    messages = [compressed_image(n / 10, numbered_frame(n)) for n in range(9)]
    messages[4] = change(messages[4])
    bag = write_bag(tmp_path / "a.bag", {"/ft": FT, "/cam": topic_of(COMPRESSED, messages)})
    recording, videos = videos_of(bag, tmp_path)
    with VideoReader(videos["/cam"].path) as reader:
        assert [frame_number(reader.frame(n)) for n in range(8)] == [0, 1, 2, 3, 5, 6, 7, 8]
        np.testing.assert_allclose(reader.times, np.r_[0:4, 5:9] / 10, atol=1e-6)
    (remark,) = [text for text in recording.remarks if "left out" in text]
    assert re.search(f"^1 picture of /cam was left out; .*{sentence}", remark)
    with pytest.raises(InputError, match=rf"{sentence}.* \(--leave-out /cam\)"):
        videos_of(bag, tmp_path, strict=True)


def test_raw_pictures_with_too_few_bytes_are_no_frames(tmp_path):
    messages = [image(n / 10, numbered_frame(n)) for n in range(4)]
    messages[1]["step"] = 10
    messages[2]["height"] = 2**31
    bag = write_bag(tmp_path / "a.bag", {"/ft": FT, "/cam": topic_of(IMAGE, messages)})
    recording, videos = videos_of(bag, tmp_path)
    with VideoReader(videos["/cam"].path) as reader:
        assert [frame_number(reader.frame(n)) for n in range(2)] == [0, 3]
    assert "2 pictures of /cam were left out; message 2: it has 73,728 bytes in rows of 10" in (
        "\n".join(recording.remarks)
    )


def test_stamps_that_repeat_or_run_backwards_cost_their_pictures_and_are_told(tmp_path):
    times = np.arange(40) / 20
    times[10], times[20] = times[9], times[15]
    messages = [compressed_image(t, numbered_frame(n)) for n, t in enumerate(times)]
    arriving = [(n / 20 + 0.01, message) for n, message in enumerate(messages)]
    bag = write_bag(tmp_path / "a.bag", {"/ft": FT, "/cam": (COMPRESSED, arriving)})
    recording, videos = videos_of(bag, tmp_path)
    left = [n for n in range(40) if n not in (10, 20)]
    with VideoReader(videos["/cam"].path) as reader:
        assert [frame_number(reader.frame(n)) for n in range(38)] == left
    text = "\n".join(recording.remarks)
    assert "/cam: 1 picture repeats the stamp before; the first picture of each stamp" in text
    assert "/cam: 1 picture whose stamp is out of order was dropped." in text
    with pytest.raises(InputError, match=r"/cam, message 11: 1 picture repeats the stamp"):
        videos_of(bag, tmp_path, strict=True)
    backwards = {"/ft": FT, "/cam": (COMPRESSED, list(zip(times[::-1], messages, strict=True)))}
    recording, videos = videos_of(write_bag(tmp_path / "b.bag", backwards), tmp_path)
    assert videos == {}
    assert "Pictures of /cam were left out: message " in "\n".join(recording.remarks)


def test_pictures_without_stamps_are_shown_when_they_arrived(tmp_path):
    messages = [(0.1 + n / 25, compressed_image(-1.7e9, numbered_frame(n))) for n in range(10)]
    bag = write_bag(
        tmp_path / "a.bag", {"/ft": (WRENCH, wrenches(100)), "/cam": (COMPRESSED, messages)}
    )
    recording, videos = videos_of(bag, tmp_path)
    assert videos["/cam"].clock.offset == pytest.approx(0.1, abs=1e-9)
    assert "/cam: its headers hold no times; those at which its messages arrived" in (
        "\n".join(recording.remarks)
    )


def test_topics_are_left_out_by_name_and_the_preview_says_what_becomes_a_video(tmp_path, capsys):
    frames = [compressed_image(n / 10, numbered_frame(n)) for n in range(3)]
    raw = [image(n / 10, numbered_frame(n)) for n in range(3)]
    topics = {
        "/ft": FT,
        "/cam": topic_of(IMAGE, raw),
        "/cam/compressed": topic_of(COMPRESSED, frames),
        "/depth": topic_of(IMAGE, [image(0.1, np.zeros((2, 2), np.uint16), "16UC1")]),
    }
    bag = write_bag(tmp_path / "a.bag", topics)

    def uses(*leave_out):
        rows = preview(bag, ReadOptions(leave_out=leave_out))
        return {row.name: row.use for row in rows if not row.name.startswith("/ft")}

    assert uses() == {"/cam": "video", "/cam/compressed": "video", "/depth": "left out"}
    assert uses("/cam") == {"/cam": "left out", "/cam/compressed": "video", "/depth": "left out"}
    assert uses("cam/compressed")["/cam/compressed"] == "left out"
    rows = {row.name: row for row in preview(bag, ReadOptions())}
    assert rows["/cam"].choices == ("video", "left out")
    assert rows["/cam"].cells == (f"rgb8, {VIDEO_WIDTH} x 64",)
    assert rows["/cam/compressed"].cells == (f"JPEG, {VIDEO_WIDTH} x 64",)
    command = ["import", str(tmp_path / "p.forcelab"), str(bag), "--task", "t"]
    assert main([*command, "--leave-out", "/cam"]) == 0
    assert "/cam became" not in (out := capsys.readouterr().out)
    assert "/cam/compressed became a video: 3 frames" in out
    assert "Nothing was read from /cam (sensor_msgs/Image)." in out
