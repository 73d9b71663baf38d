"""Motion energy of videos whose motion is known."""

import cv2
import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.video.motion import measuring_motion
from forcelab.video.reader import VideoReader

SIZE = (320, 180)


def film(path, pictures, rate=30.0):
    """Write grey pictures as a video that loses little."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate, SIZE)
    for picture in pictures:
        writer.write(np.repeat(picture[:, :, None], 3, axis=2))
    writer.release()
    return path


def ball(place, lamp=0):
    """A bright disc on a dark ground."""
    picture = np.full((SIZE[1], SIZE[0]), 60 + lamp, dtype=np.uint8)
    cv2.circle(picture, (int(place), 90), 30, 200 + lamp, -1)
    return picture


def test_motion_is_where_something_moves_and_nowhere_else(tmp_path):
    places = [80.0] * 10 + [80.0 + 8.0 * k for k in range(1, 11)] + [160.0] * 10
    path = film(tmp_path / "ball.avi", [ball(place) for place in places])
    motion = finish(measuring_motion(path))
    moved = np.diff(places, prepend=places[0]) > 0
    assert motion.energy.shape == motion.times.shape == (30,)
    assert motion.energy[moved].min() > 20 * motion.energy[~moved].max()
    assert motion.energy[0] == 0.0


def test_faster_motion_has_more_energy(tmp_path):
    energies = [
        finish(
            measuring_motion(
                film(tmp_path / f"{speed}.avi", [ball(60 + speed * k) for k in range(12)])
            )
        )
        .energy[1:]
        .mean()
        for speed in (2, 6, 12)
    ]
    assert energies == sorted(energies)


def test_a_lamp_is_no_motion(tmp_path):
    pictures = [ball(100, lamp=20 * (k >= 5)) for k in range(10)]
    motion = finish(measuring_motion(film(tmp_path / "lamp.avi", pictures)))
    assert motion.energy.max() < 0.05


def test_times_are_those_of_the_reader(tmp_path):
    path = film(tmp_path / "ball.avi", [ball(60 + 3 * k) for k in range(20)], rate=24.0)
    motion = finish(measuring_motion(path))
    with VideoReader(path) as reader:
        assert motion.times == pytest.approx(reader.times, abs=1e-9)
    assert motion.times == pytest.approx(np.arange(20) / 24.0, abs=1e-6)


def test_it_tells_how_far_it_is_and_can_be_stopped(tmp_path):
    path = film(tmp_path / "ball.avi", [ball(60 + 3 * k) for k in range(40)])
    job = measuring_motion(path)
    progress = next(job)
    assert 0 < progress.done < progress.total == 40
    job.close()
    path.unlink()  # the file was let go


@pytest.mark.parametrize("content", [b"", b"no video at all" * 100])
def test_what_is_no_video_is_told_in_one_sentence(tmp_path, content):
    path = tmp_path / "bad.mp4"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bad\.mp4"):
        finish(measuring_motion(path))


def test_one_frame_is_too_few(tmp_path):
    with pytest.raises(InputError, match="fewer than two frames"):
        finish(measuring_motion(film(tmp_path / "one.avi", [ball(100)])))
