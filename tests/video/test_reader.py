import os
import struct
import subprocess
import sys

import av
import numpy as np
import pytest
from factories import (
    GOP_250,
    VIDEO_HEIGHT,
    VIDEO_WIDTH,
    even_frame_times,
    frame_number,
    uneven_frame_times,
    write_opencv_video,
    write_video,
)

from forcelab.errors import InputError
from forcelab.jobs import Progress, finish
from forcelab.video.codecs import opencv
from forcelab.video.index import Index, indexing, open_video
from forcelab.video.motion import measuring_motion
from forcelab.video.reader import LEAD, Decoder, DecoderPool, Thumbnails, VideoReader

#: Steps in each direction; FORCELAB_VIDEO_STEPS=500 for the whole proof.
STEPS = int(os.environ.get("FORCELAB_VIDEO_STEPS", "40"))
COUNT = max(STEPS + 60, 270)
#: So few frames are kept that most have to be decoded again.
SMALL = 24 * VIDEO_WIDTH * VIDEO_HEIGHT * 3
EVEN, ODD = even_frame_times(COUNT), uneven_frame_times(COUNT)
AV1 = {"preset": "8", "crf": "20", "g": "90", "svtav1-params": "lp=1"}
VP9 = {"g": "128", "deadline": "realtime", "cpu-used": "8"}
#: How each good video is made, and the times its frames must have, to the file's own resolution.
FILMS = {
    "h264.mp4": (lambda path: write_video(path, "libx264", EVEN, GOP_250), EVEN, 1e-6),
    "h264-vfr.mp4": (lambda path: write_video(path, "libx264", ODD, GOP_250), ODD, 1e-6),
    "h264-vfr.mkv": (lambda path: write_video(path, "libx264", ODD, GOP_250), ODD, 1.1e-3),
    "h264-open.mp4": (
        lambda path: write_video(
            path, "libx264", EVEN, GOP_250 | {"g": "40", "x264-params": "open-gop=1"}
        ),
        EVEN,
        1e-6,
    ),
    "mp4v.mp4": (lambda path: write_opencv_video(path, "mp4v", COUNT), EVEN, 1e-6),
    "vp9.webm": (lambda path: write_video(path, "libvpx-vp9", EVEN, VP9), EVEN, 1.1e-3),
    "vp8.webm": (
        lambda path: write_video(
            path, "libvpx", EVEN, {"auto-alt-ref": "1", "lag-in-frames": "16", "cpu-used": "8"}
        ),
        EVEN,
        1.1e-3,
    ),
    "av1-vfr.mp4": (lambda path: write_video(path, "libsvtav1", ODD, AV1), ODD, 1e-6),
    # As LeRobot writes it: every other frame is a key frame.
    "av1.mkv": (lambda path: write_video(path, "libsvtav1", EVEN, AV1 | {"g": "2"}), EVEN, 1.1e-3),
}


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("films")


@pytest.fixture(scope="session")
def film(folder):
    def created(name):
        path = folder / name
        return path if path.exists() else FILMS[name][0](path)

    return created


def wrong(reader, numbers):
    return [number for number in numbers if frame_number(reader.frame(number)) != number]


@pytest.mark.parametrize("name", FILMS)
def test_no_frame_is_ever_another_one(film, name):
    random = np.random.default_rng(1)
    with VideoReader(film(name), cache=SMALL) as reader:
        np.testing.assert_allclose(
            reader.times, FILMS[name][1] - FILMS[name][1][0], rtol=0, atol=FILMS[name][2]
        )
        assert np.all(np.diff(reader.times) > 0)
        assert not reader.remark
        start = int(random.integers(COUNT - STEPS))
        assert wrong(reader, range(start, start + STEPS)) == []
        assert wrong(reader, range(COUNT - 1, COUNT - 1 - STEPS, -1)) == []
        assert wrong(reader, random.integers(0, COUNT, STEPS).tolist()) == []


def test_av1_is_decoded_as_pyav_decodes_it_from_the_beginning(film):
    with av.open(str(film("av1-vfr.mp4"))) as file:
        shown = [frame.to_ndarray(format="rgb24") for frame in file.decode(video=0)]
    with VideoReader(film("av1-vfr.mp4"), cache=SMALL) as reader:
        assert len(shown) == len(reader) == COUNT
        numbers = np.random.default_rng(6).permutation(COUNT)[:STEPS].tolist()
        assert [n for n in numbers if not np.array_equal(reader.frame(n), shown[n])] == []


def test_av1_whose_tags_are_of_an_old_alphabet_is_shown(film, tmp_path):
    content = film("av1.mkv").read_bytes()
    assert content.count(b"Lavf") > 2  # in a tag, too
    (tmp_path / "a.mkv").write_bytes(content.replace(b"Lavf", b"L\xe4vf"))
    with VideoReader(tmp_path / "a.mkv") as reader:
        assert frame_number(reader.frame(30)) == 30


@pytest.mark.parametrize("turn", [(0, 1, -1, 0), (-1, 0, 0, -1), (0, -1, 1, 0)])
def test_av1_is_turned_as_other_videos_are(tmp_path, turn):
    """By the matrix of the track (ISO/IEC 14496-12, tkhd), as telephones write it."""
    a, b, c, d = (65536 * number for number in turn)
    matrix = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)
    upright = struct.pack(">9i", 65536, 0, 0, 0, 65536, 0, 0, 0, 1 << 30)
    shown = []
    for name, codec, options in (("h264.mp4", "libx264", {}), ("av1.mp4", "libsvtav1", AV1)):
        path = write_video(tmp_path / name, codec, EVEN[:6], options)
        content = path.read_bytes()
        track = content.index(b"tkhd")
        path.write_bytes(content[:track] + content[track:].replace(upright, matrix, 1))
        with VideoReader(path) as reader:
            shown.append(reader.frame(5).astype(int))
    assert shown[0].shape == shown[1].shape
    assert np.abs(shown[0] - shown[1]).mean() < 5


def test_a_frame_of_av1_that_cannot_be_converted_is_none(film, monkeypatch):
    class Unconvertible:
        def to_ndarray(self, **_):
            raise av.error.InvalidDataError(1, "no picture")

    capture = open_video(film("av1.mkv"))
    assert capture.grab()
    monkeypatch.setattr(capture, "_frame", Unconvertible())
    assert capture.retrieve() == (False, None)
    capture.release()


def test_thumbnails_and_motion_of_av1_are_of_its_frames(film):
    path = film("av1-vfr.mp4")
    thumbnails = Thumbnails(path, finish(indexing(path)))
    finish(thumbnails.making())
    assert [frame_number(thumbnails.get(number)) for number in range(COUNT)] == list(range(COUNT))
    motion = finish(measuring_motion(path))
    np.testing.assert_array_equal(motion.times, thumbnails.index.times)
    assert np.all(motion.energy[1:] > 0)  # each shows another number


def test_av1_that_is_cut_gives_what_is_whole(film, tmp_path):
    with VideoReader(cut(film("av1.mkv"), tmp_path / "cut.mkv", 0.7)) as reader:
        assert 50 < len(reader) < COUNT
        assert "cut short" in reader.remark
        numbers = np.random.default_rng(7).permutation(len(reader))[:STEPS].tolist()
        assert wrong(reader, numbers) == []


def test_a_frame_is_the_last_at_or_before_a_time(film):
    with VideoReader(film("h264-vfr.mp4")) as reader:
        times = reader.times
        for time in np.random.default_rng(2).uniform(0, times[-1] + 1, 200):
            assert reader.index_at(time) == np.flatnonzero(times <= time)[-1]
        # A frame's own time gives that frame, also after a journey through another clock.
        indices = [reader.index_at((time * 1.00003 + 7.1 - 7.1) / 1.00003) for time in times]
        assert indices == list(range(len(reader)))
        assert reader.index_at(-0.001) == -1
        assert reader.index_at(1e9) == len(reader) - 1


def test_frames_are_contiguous_pictures_in_rgb_that_cannot_be_written_to(tmp_path):
    red = np.zeros((64, 96, 3), np.uint8)
    red[:, :, 2] = 255  # OpenCV writes blue, green, red
    cv2 = opencv()
    writer = cv2.VideoWriter(
        str(tmp_path / "red.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30, (96, 64)
    )
    for _ in range(3):
        writer.write(red)
    writer.release()
    with VideoReader(tmp_path / "red.avi") as reader:
        frame = reader.frame(1)
        assert frame.shape == (64, 96, 3)
        assert frame.dtype == np.uint8
        assert frame.flags.c_contiguous
        assert not frame.flags.writeable
        assert reader.size == (96, 64)
        assert frame[32, 48, 0] > 230
        assert frame[32, 48, 1:].max() < 30


def count_decoding(monkeypatch):
    """What grows by one for each frame that is decoded from now on."""
    decoded, step = [], Decoder.step
    monkeypatch.setattr(Decoder, "step", lambda self: decoded.append(None) or step(self))
    return decoded


def test_what_is_kept_is_bounded_and_going_back_decodes_a_stretch_once(film, monkeypatch):
    with VideoReader(film("h264.mp4"), cache=SMALL) as reader:
        reader.frame(200)
        decoded = count_decoding(monkeypatch)
        for number in range(199, 139, -1):
            reader.frame(number)
            assert len(reader._cache) <= 24
        # 60 steps, a stretch of 12 kept each time: never once per step.
        assert len(decoded) < 7 * 200


def test_a_jump_ahead_goes_on_from_where_the_decoder_is(film, monkeypatch):
    with VideoReader(film("h264.mp4"), cache=SMALL) as reader:
        assert reader.index.keys.tolist()[:2] == [0, 250]
        reader.frame(200)
        decoded = count_decoding(monkeypatch)
        assert wrong(reader, [230, 255]) == []  # the latter behind a key frame that is too near
        assert len(decoded) == 55


def test_requests_that_are_given_up_anywhere_do_not_mislead_the_next(film):
    random = np.random.default_rng(4)
    with VideoReader(film("h264.mp4"), cache=SMALL) as reader:
        for _ in range(40):
            reaching = reader.reaching(int(random.integers(COUNT)))
            for _ in range(int(random.integers(6))):
                if next(reaching, "reached") == "reached":
                    break
            reaching.close()
            if random.random() < 0.3:
                assert wrong(reader, random.integers(0, COUNT, 1).tolist()) == []


def test_the_index_is_a_job_that_tells_how_far_it_is(folder):
    path = write_opencv_video(folder / "long.mp4", "mp4v", 1200)
    steps = list(indexing(path))
    assert steps
    assert all(isinstance(step, Progress) and step.done <= step.total == 1200 for step in steps)


def test_there_is_no_frame_beyond_the_ends(film):
    with VideoReader(film("mp4v.mp4")) as reader:
        for number in (-1, COUNT):
            with pytest.raises(IndexError):
                reader.frame(number)


def cut(source, target, share):
    content = source.read_bytes()
    target.write_bytes(content[: int(share * len(content))])
    return target


def test_a_truncated_file_gives_what_is_there_and_says_where_it_ends(film, tmp_path):
    path = cut(film("h264-vfr.mkv"), tmp_path / "cut.mkv", 0.6)
    with VideoReader(path) as reader:
        assert 80 < len(reader) < COUNT - 20
        assert "cut.mkv' is cut short: it ends at" in reader.remark
        assert wrong(reader, range(len(reader))) == []


def test_a_truncated_mp4_with_its_index_in_front_too(tmp_path):
    plain = write_video(tmp_path / "plain.mp4", "libx264", EVEN[:300], GOP_250)
    with (
        av.open(str(plain)) as source,
        av.open(str(tmp_path / "front.mp4"), "w", options={"movflags": "faststart"}) as target,
    ):
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                target.mux(packet)
    with VideoReader(cut(tmp_path / "front.mp4", tmp_path / "cut.mp4", 0.7)) as reader:
        assert 50 < len(reader) < 290
        assert "cut short" in reader.remark
        assert wrong(reader, range(len(reader))) == []


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("missing.mp4", "is not there; put it back"),
        ("text.mp4", "cannot be read as a video"),
        ("empty.mp4", "cannot be read as a video"),
        ("cut.mp4", "cannot be read as a video"),
        ("none.avi", "frame|cannot be read as a video"),
        ("av1.mp4", r"\(AV1\) needs the package av; install it with .*'forcelab\[video\]'"),
    ],
)
def test_what_cannot_be_shown_is_told_in_one_sentence(film, tmp_path, monkeypatch, name, sentence):
    path = tmp_path / name
    if name == "text.mp4":
        path.write_text("no video at all")
    elif name == "empty.mp4":
        path.touch()
    elif name == "cut.mp4":
        cut(film("h264.mp4"), path, 0.5)
    elif name == "none.avi":
        write_opencv_video(path, "MJPG", 0)
    elif name == "av1.mp4":
        write_video(path, "libsvtav1", EVEN[:5], AV1)
        monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(InputError, match=sentence) as refusal:
        VideoReader(path)
    assert name in str(refusal.value)
    assert str(refusal.value).endswith(".")


def test_the_decoder_says_nothing_on_the_terminal(film, tmp_path):
    (tmp_path / "text.mp4").write_text("no video at all")
    cut(film("h264.mp4"), tmp_path / "cut.mp4", 0.5)
    write_video(tmp_path / "av1.mp4", "libsvtav1", EVEN[:20], AV1)
    content = (tmp_path / "av1.mp4").read_bytes()
    half = len(content) // 2
    (tmp_path / "av1.mp4").write_bytes(content[:100] + bytes(half - 100) + content[half:])
    # In a process of its own: FFmpeg is told once, when the first video of a process is opened.
    script = """
import sys
from forcelab.errors import InputError
from forcelab.video.reader import VideoReader
for path in sys.argv[1:]:
    try:
        reader = VideoReader(path)
        reader.frame(10)
    except InputError:
        continue
    sys.exit(f"{path} was read")
"""
    paths = sorted(map(str, tmp_path.glob("*.mp4")))
    assert len(paths) == 3
    command = [sys.executable, "-c", script, *paths]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_frame_that_cannot_be_decoded_is_told_and_the_rest_is_shown(film, tmp_path):
    content = bytearray(film("mp4v.mp4").read_bytes())
    with VideoReader(film("mp4v.mp4")) as reader:
        keys = reader.index.keys
    assert keys[3] == 36  # each twelfth frame begins anew
    places = _packet_places(film("mp4v.mp4"))
    start, size = places[30]
    content[start : start + size] = bytes(size)
    (tmp_path / "hurt.mp4").write_bytes(content)
    with VideoReader(tmp_path / "hurt.mp4", cache=SMALL) as reader:
        with pytest.raises(InputError, match=r"Frame 31 of .*hurt.mp4', at 1.000 s, cannot be dec"):
            reader.frame(30)
        assert wrong(reader, [29, 48, 20, 36]) == []


def _packet_places(path):
    with av.open(str(path)) as container:
        return [(packet.pos, packet.size) for packet in container.demux(video=0) if packet.size]


@pytest.mark.real
def test_a_real_video_gives_the_same_frames_whichever_way_one_comes(real_file):
    path = real_file("video/karma.mp4")
    with VideoReader(path) as reader:
        assert len(reader) == 362
        assert 1 / np.median(np.diff(reader.times)) == pytest.approx(30_000 / 1001)
        assert reader.size == (854, 480)
        ahead = {number: reader.frame(number).copy() for number in range(100, 116)}
    with VideoReader(path, cache=2**24) as reader:
        for number in np.random.default_rng(3).permutation(list(ahead)).tolist():
            np.testing.assert_array_equal(reader.frame(number), ahead[number])


@pytest.fixture
def path(film):
    return film("h264.mp4")


def jump(reader, number):
    assert frame_number(reader.frame(number)) == number


def test_who_jumps_to_and_fro_is_near_where_he_was(path, monkeypatch):
    with VideoReader(path) as reader:
        for number in (200, 120, 40):
            jump(reader, number)
        decoded = count_decoding(monkeypatch)
        for number, cost in ((130, 10), (70, 30), (230, 30), (135, 5)):
            before = len(decoded)
            jump(reader, number)
            assert len(decoded) - before == cost


def test_jumps_anywhere_decode_less_than_from_the_key_frame(path, monkeypatch):
    numbers = np.random.default_rng(3).integers(0, COUNT, 60).tolist()
    costs = {}
    for most in (1, 16):
        monkeypatch.setattr("forcelab.video.reader.MOST", most)
        with VideoReader(path, cache=24 * VIDEO_WIDTH * VIDEO_HEIGHT * 3) as reader:
            with monkeypatch.context() as patch:
                decoded = count_decoding(patch)
                for number in numbers:
                    jump(reader, number)
                costs[most] = len(decoded)
            assert len(reader._decoders) <= most
    assert costs[16] < 0.5 * costs[1]


def test_going_back_decodes_a_whole_stretch_although_another_decoder_is_near(path, monkeypatch):
    with VideoReader(path, cache=40 * VIDEO_WIDTH * VIDEO_HEIGHT * 3) as reader:
        for number in (180, 150, 30):
            jump(reader, number)
        decoded = count_decoding(monkeypatch)
        for number in range(179, 140, -1):
            jump(reader, number)
        assert len(decoded) < 4 * 180


@pytest.mark.parametrize(("keys", "room"), [((0, 250), 0), (range(0, COUNT, 50), 2**30)])
def test_without_room_or_use_for_others_there_is_one(path, keys, room):
    index = Index(np.arange(COUNT) / 30, np.array(keys))
    decoders = DecoderPool(path, index, room)
    assert decoders.most == 1
    assert decoders.spare() is decoders[0]
    decoders.close()


def test_memory_bounds_their_number(path):
    index = Index(np.arange(COUNT) / 30, np.array([0, 250]))
    numbers = []
    for room in (2**20, 2**24, 2**27):
        decoders = DecoderPool(path, index, room)
        numbers.append(decoders.most)
        decoders.close()
    assert 1 <= numbers[0] < numbers[1] <= numbers[2] <= 16


def test_the_one_that_saves_least_is_sent_elsewhere(path):
    index = Index(np.arange(COUNT) / 30, np.array([0, 250]))
    decoders = DecoderPool(path, index)
    decoders.most = 4
    places = (5, 120, 200, 204)
    for place in places:
        decoder = decoders[0] if place == places[0] else decoders.spare()
        decoder.at = place
    assert len(decoders) == 4
    assert decoders.spare().at == 204  # the one at 200 does as well
    decoders[3].at = 100
    assert decoders.spare().at == 5  # the key frame does as well
    decoders[1].lost = True
    assert decoders.spare() is decoders[1]
    decoders.close()


def test_a_key_frame_that_is_nearer_is_preferred(path):
    index = Index(np.arange(COUNT) / 30, np.array([0, 250]))
    decoders = DecoderPool(path, index)
    only = decoders[0]
    only.at = 200
    assert decoders.near(255, only, 0) is only  # too near behind the key frame to be sent there
    assert decoders.near(250 + LEAD + 2, only, 0) is None
    assert decoders.near(190, only, 0) is None
    other = decoders.spare()
    other.at = 230
    assert decoders.near(235, only, 0) is other
    assert decoders.near(235, only, 6) is only
    decoders.close()


def test_a_video_that_is_gone_is_still_read_by_what_is_open(path, tmp_path):
    moved = tmp_path / "moved.mp4"
    moved.write_bytes(path.read_bytes())
    with VideoReader(moved) as reader:
        jump(reader, 200)
        moved.rename(tmp_path / "elsewhere.mp4")
        for number in (100, 260, 30):
            jump(reader, number)
        assert len(reader._decoders) < 4


TIMES = uneven_frame_times(120)


@pytest.fixture(scope="module")
def long_film(tmp_path_factory):
    folder = tmp_path_factory.mktemp("films")
    return write_video(folder / "film.mp4", "libx264", TIMES, GOP_250)


def test_each_sketch_is_of_its_frame(long_film):
    thumbnails = Thumbnails(long_film, finish(indexing(long_film)))
    assert thumbnails.worthwhile
    assert thumbnails.get(3) is None
    finish(thumbnails.making())
    assert [frame_number(thumbnails.get(number)) for number in range(120)] == list(range(120))


def test_they_end_where_the_room_does(long_film):
    thumbnails = Thumbnails(long_film, finish(indexing(long_film)), room=20_000)
    finish(thumbnails.making())
    assert 1 < len(thumbnails) < 60


def test_the_more_frames_share_the_room_the_smaller_they_are(tmp_path):
    long_film = write_video(tmp_path / "film.mp4", "libx264", TIMES[:40], {"g": "250"}, (960, 128))
    index = finish(indexing(long_film))
    for room, width in ((2**27, 960), (40 * 960 * 128 // 16, 480), (40 * 960 * 128 // 35, 320)):
        thumbnails = Thumbnails(long_film, index, room)
        finish(thumbnails.making())
        assert thumbnails.get(0).shape == (128 * width // 960, width, 3)


def test_where_key_frames_are_near_none_are_needed(tmp_path):
    long_film = write_opencv_video(tmp_path / "film.mp4", "mp4v", 60)
    assert not Thumbnails(long_film, finish(indexing(long_film))).worthwhile


def test_a_large_frame_becomes_smaller(tmp_path):
    long_film = write_video(tmp_path / "wide.mp4", "libx264", TIMES[:3], {"g": "250"}, (1600, 400))
    thumbnails = Thumbnails(long_film, finish(indexing(long_film)))
    finish(thumbnails.making())
    assert thumbnails.get(0).shape == (200, 800, 3)
