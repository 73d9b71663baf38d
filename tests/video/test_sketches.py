import films
import pytest

from forcelab.jobs import finish
from forcelab.video.index import indexing
from forcelab.video.reader import Thumbnails

TIMES = films.odd_times(120)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("films")
    return films.write(folder / "film.mp4", "libx264", TIMES, films.GOP_250)


def test_each_sketch_is_of_its_frame(path):
    thumbnails = Thumbnails(path, finish(indexing(path)))
    assert thumbnails.worthwhile
    assert thumbnails.get(3) is None
    finish(thumbnails.making())
    assert [films.number_of(thumbnails.get(number)) for number in range(120)] == list(range(120))


def test_they_end_where_the_room_does(path):
    thumbnails = Thumbnails(path, finish(indexing(path)), room=20_000)
    finish(thumbnails.making())
    assert 1 < len(thumbnails) < 60


def test_the_more_frames_share_the_room_the_smaller_they_are(tmp_path):
    path = films.write(tmp_path / "film.mp4", "libx264", TIMES[:40], {"g": "250"}, (960, 128))
    index = finish(indexing(path))
    for room, width in ((2**27, 960), (40 * 960 * 128 // 16, 480), (40 * 960 * 128 // 35, 320)):
        thumbnails = Thumbnails(path, index, room)
        finish(thumbnails.making())
        assert thumbnails.get(0).shape == (128 * width // 960, width, 3)


def test_where_key_frames_are_near_none_are_needed(tmp_path):
    path = films.write_with_opencv(tmp_path / "film.mp4", "mp4v", 60)
    assert not Thumbnails(path, finish(indexing(path))).worthwhile


def test_a_large_frame_becomes_smaller(tmp_path):
    path = films.write(tmp_path / "wide.mp4", "libx264", TIMES[:3], {"g": "250"}, (1600, 400))
    thumbnails = Thumbnails(path, finish(indexing(path)))
    finish(thumbnails.making())
    assert thumbnails.get(0).shape == (200, 800, 3)
