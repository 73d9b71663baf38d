"""Videos of JPEG pictures: each is shown from the time on at which it was taken."""

import numpy as np
from factories import frame_number, numbered_frame

from forcelab.video.jpeg_writer import JpegVideoWriter, encode_jpeg
from forcelab.video.reader import VideoReader


def test_a_frame_is_shown_at_the_very_time_it_was_taken(tmp_path):
    random = np.random.default_rng(3)
    steps = random.choice([1e-5, 1 / 90, 1 / 30, 0.2, 40.0], 200)
    times = np.cumsum(steps + random.uniform(0, 1e-3, 200))
    times -= times[0]
    writer = JpegVideoWriter(tmp_path / "a.mkv", 384, 64)
    for number, time in enumerate(times):
        picture = numbered_frame(number)
        writer.write(encode_jpeg(picture if number % 2 else picture[:, :, 0]), time)
    writer.close()
    with VideoReader(tmp_path / "a.mkv", cache=1) as video:
        assert [video.index_at(time) for time in times] == list(range(200))
        assert [video.index_at(time - 2e-6) for time in times] == list(range(-1, 199))
        for number in random.permutation(200)[:50].tolist():
            assert frame_number(video.frame(number)) == number
