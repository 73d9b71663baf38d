"""A damaged video is told of before anybody works with it, and a whole one never."""

import re
import sys

import av
import pytest
from factories import GOP_250, even_frame_times, uneven_frame_times, write_opencv_video, write_video

from forcelab.errors import InputError
from forcelab.video.validate import check_video

COUNT = 300


def damaged(path, first, last):
    """The same file with zeros over a share of its bytes."""
    content = path.read_bytes()
    a, b = (int(share * len(content)) for share in (first, last))
    path.write_bytes(content[:a] + bytes(b - a) + content[b:])
    return path


@pytest.fixture
def film(tmp_path):
    return write_opencv_video(tmp_path / "film.mp4", "mp4v", COUNT)


@pytest.mark.parametrize(
    ("name", "codec", "times", "options"),
    [
        ("a.mp4", "libx264", even_frame_times(COUNT), GOP_250),
        ("b.mkv", "libx264", uneven_frame_times(COUNT), {"bf": "3"}),
        ("c.webm", "libvpx", even_frame_times(20), {}),
        ("d.mp4", "libx264", even_frame_times(1), {}),
    ],
)
def test_nothing_is_said_of_a_whole_video(tmp_path, name, codec, times, options):
    path = write_video(tmp_path / name, codec, times, options)
    assert check_video(path, float(times[-1] - times[0])) == ""


def test_a_video_whose_codec_is_missing_here_can_be_attached_all_the_same(tmp_path, monkeypatch):
    path = write_video(tmp_path / "a.mp4", "libsvtav1", even_frame_times(3), {"preset": "10"})
    assert check_video(path, 0.1) == ""
    monkeypatch.setitem(sys.modules, "av", None)
    assert "(AV1) needs the package av; install it" in check_video(path, 0.1)


def test_a_hole_in_a_video_is_told(film):
    assert check_video(film, 10.0) == ""
    message = check_video(damaged(film, 0.4, 0.6), 10.0)
    assert message.startswith("'film.mp4' is damaged: of 9.97 s nothing can be shown around ")
    assert message.endswith("copy it again if there is a whole one.")


def test_a_video_cut_short_is_told(tmp_path):
    film = write_opencv_video(tmp_path / "film.avi", "MJPG", COUNT)
    assert "is cut short" in check_video(damaged(film, 0.4, 0.6), 10.0)


def without(path, first, last):
    """The same frames but for some, in a file that is whole in itself."""
    left = path.with_name(f"left {path.name}")
    with av.open(str(path)) as source, av.open(str(left), "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for number, packet in enumerate(source.demux(video=0)):
            if packet.size and not first <= number < last:
                packet.stream = stream
                target.mux(packet)
    return left


@pytest.mark.parametrize(
    ("name", "codec", "rate", "options"),
    [
        ("a.mkv", "libx264", 30, GOP_250),
        ("b.mkv", "libx264", 240, {"g": "20"}),  # whose times are rounded to 4 and 5 ms
        ("c.webm", "libvpx", 30, {"deadline": "realtime", "cpu-used": "8"}),
        ("d.mp4", "libx264", 30, {"g": "20"}),
    ],
)
def test_a_video_that_lacks_packets_is_told(tmp_path, name, codec, rate, options):
    path = write_video(tmp_path / name, codec, even_frame_times(COUNT, rate), options)
    assert check_video(path, 1.0) == ""
    assert check_video(without(path, 100, 100), 1.0) == ""
    message = check_video(without(path, 100, 220), 1.0)
    assert message.startswith(f"'left {name}' has no frame between ")
    begins, ends = (float(word) for word in re.findall(r"([\d.]+) s", message)[:2])
    assert begins == pytest.approx(99 / rate, abs=3 / rate)  # in a file frames stand out of order
    assert ends == pytest.approx(220 / rate, abs=3 / rate)


def test_a_damaged_matroska_video_is_told(tmp_path):
    path = write_video(tmp_path / "a.mkv", "libx264", even_frame_times(COUNT), {"g": "20"})
    assert "'a.mkv' has no frame between " in check_video(damaged(path, 0.4, 0.6), 10.0)


def test_a_video_much_shorter_than_its_recording_is_told(film):
    assert "lasts 9.97 s, its recording 25.00 s" in check_video(film, 25.0)


def test_what_is_no_video_is_refused(tmp_path):
    path = tmp_path / "film.mp4"
    with pytest.raises(InputError, match="There is no file"):
        check_video(path, 1.0)
    path.write_bytes(b"no film")
    with pytest.raises(InputError, match="cannot be read as a video"):
        check_video(path, 1.0)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("list.m3u8", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{film}\n#EXT-X-ENDLIST\n"),
        ("live.mp4", "#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\n{film}\n"),
        ("concat.mp4", "ffconcat version 1.0\nfile {film}\n"),
        ("dash.mkv", '<?xml version="1.0"?><MPD><BaseURL>{film}</BaseURL></MPD>'),
        ("session.mp4", "v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nm=video 5004 RTP/AVP 96\n"),
    ],
)
def test_what_only_names_a_video_is_not_opened(name, content, tmp_path, monkeypatch):
    monkeypatch.setattr("forcelab.video.index.opencv", lambda: pytest.fail("a decoder saw it"))
    file = tmp_path / name
    file.write_text(content.format(film=tmp_path / "film.mp4"), "utf-8")
    with pytest.raises(InputError, match="a playlist or another kind of file"):
        check_video(file, 1.0)


def test_a_name_that_stands_for_a_row_of_pictures_is_refused(tmp_path):
    (tmp_path / "img_%02d.png").write_bytes(b"\0\0\0\x18ftypmp42")
    with pytest.raises(InputError, match="without '%'"):
        check_video(tmp_path / "img_%02d.png", 1.0)
