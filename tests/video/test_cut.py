"""Stretches of videos that are cut out as they are: every frame stays, at its time."""

import av
import numpy as np
import pytest
from factories import GOP_250, even_frame_times, frame_number, uneven_frame_times, write_video

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.video.cut import cut_video
from forcelab.video.index import indexing
from forcelab.video.reader import VideoReader

OPEN_GOP = {**GOP_250, "g": "12", "keyint_min": "12", "x264-params": "open-gop=1"}


def stamps_of(path):
    """What a file itself calls the times of its frames, s."""
    with av.open(str(path)) as container:
        (stream,) = container.streams.video
        packets = [packet for packet in container.demux(stream) if packet.pts is not None]
        return np.sort([float(packet.pts * stream.time_base) for packet in packets])


@pytest.mark.parametrize(
    ("codec", "options", "times"),
    [
        ("libx264", GOP_250, even_frame_times(60)),
        ("libx264", {**GOP_250, "g": "10", "keyint_min": "10"}, uneven_frame_times(60)),
        ("libx264", OPEN_GOP, even_frame_times(60)),
        ("libsvtav1", {"g": "2", "crf": "30", "preset": "12"}, even_frame_times(60)),
    ],
    ids=["one key frame", "uneven", "open groups", "AV1"],
)
@pytest.mark.parametrize(("first", "end"), [(0, 20), (17, 41), (40, 60)])
def test_the_frames_of_a_stretch_are_those_of_the_video(
    tmp_path, codec, options, times, first, end
):
    whole = write_video(tmp_path / "whole.mp4", codec, times, options)
    times = stamps_of(whole)  # where the first is not 0, MP4 has it by the millisecond
    stop = times[end] if end < len(times) else np.inf
    # What a file of metadata says of a time may be rounded.
    cut = cut_video(whole, times[first] + 1e-5, stop - 1e-5, tmp_path / "cut.mp4")
    np.testing.assert_allclose(cut.times, times[first:end], atol=1e-5)
    index = finish(indexing(tmp_path / "cut.mp4"))
    shown = index.times + cut.first
    with VideoReader(tmp_path / "cut.mp4", index) as reader:
        for number in range(first, end):
            (place,) = np.flatnonzero(np.abs(shown - times[number]) < 1e-4)
            assert frame_number(reader.frame(int(place))) == number
    if end < len(times):
        assert (tmp_path / "cut.mp4").stat().st_size < whole.stat().st_size


def test_what_is_no_video_or_has_no_such_stretch_is_refused(tmp_path):
    whole = write_video(tmp_path / "whole.mp4", "libx264", even_frame_times(10), GOP_250)
    playlist = tmp_path / "list.mp4"
    playlist.write_text(f"ffconcat version 1.0\nfile {whole}\n", "utf-8")
    for source, start, why in (
        (tmp_path / "none.mp4", 0.0, "none.mp4' is missing"),
        (playlist, 0.0, "is damaged or no MP4 file"),
        (whole, 5.0, "has no frame between 5 s and 6 s"),
    ):
        with pytest.raises(InputError, match=why):
            cut_video(source, start, 6.0, tmp_path / "cut.mp4")
