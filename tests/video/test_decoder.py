import films
import numpy as np
import pytest

from forcelab.video.index import Index
from forcelab.video.reader import LEAD, Decoder, DecoderPool, VideoReader

COUNT = 300


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("films") / "h264.mp4"
    return films.write(path, "libx264", films.even_times(COUNT), films.GOP_250)


def decoding(monkeypatch):
    """What grows by one for each frame that is decoded from now on."""
    decoded, step = [], Decoder.step
    monkeypatch.setattr(Decoder, "step", lambda self: decoded.append(None) or step(self))
    return decoded


def jump(reader, number):
    assert films.number_of(reader.frame(number)) == number


def test_who_jumps_to_and_fro_is_near_where_he_was(path, monkeypatch):
    with VideoReader(path) as reader:
        for number in (200, 120, 40):
            jump(reader, number)
        decoded = decoding(monkeypatch)
        for number, cost in ((130, 10), (70, 30), (230, 30), (135, 5)):
            before = len(decoded)
            jump(reader, number)
            assert len(decoded) - before == cost


def test_jumps_anywhere_decode_less_than_from_the_key_frame(path, monkeypatch):
    numbers = np.random.default_rng(3).integers(0, COUNT, 60).tolist()
    costs = {}
    for most in (1, 16):
        with VideoReader(path, cache=24 * films.WIDTH * films.HEIGHT * 3) as reader:
            reader._decoders.most = most
            with monkeypatch.context() as patch:
                decoded = decoding(patch)
                for number in numbers:
                    jump(reader, number)
                costs[most] = len(decoded)
            assert len(reader._decoders) <= most
    assert costs[16] < 0.5 * costs[1]


def test_going_back_decodes_a_whole_stretch_although_another_decoder_is_near(path, monkeypatch):
    with VideoReader(path, cache=40 * films.WIDTH * films.HEIGHT * 3) as reader:
        for number in (180, 150, 30):
            jump(reader, number)
        decoded = decoding(monkeypatch)
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
