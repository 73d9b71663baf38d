from __future__ import annotations

import errno
import os
import time

import numpy as np
import pytest

from forcelab import io
from forcelab.demonstration import Channel, Demonstration
from forcelab.jobs import finish
from forcelab.signals import scalogram as module
from forcelab.signals.scalogram import keep, kept, row_scales, scalogram, survey
from forcelab.signals.scalogram_frames import Source
from forcelab.signals.wavelets import Morlet

RATE = 1000.0
N = 600_000
SCALES = row_scales(20, 2048.0)


def recorded(seed=3):
    random = np.random.default_rng(seed)
    x = 0.01 * random.standard_normal((N, 2))
    for at in random.integers(0, N - 300, 200).tolist():
        x[at : at + 200] += 3 * np.exp(-np.arange(200) / 20)[:, np.newaxis]
    x[250_000:260_000] = np.nan
    x[123_456, 1] = 1e16
    channels = (Channel("fx", "N"), Channel("fz", "N"))
    return Demonstration("foam 1", "foam", np.arange(N) / RATE, x, channels)


@pytest.fixture(scope="module")
def demonstration():
    return recorded()


@pytest.fixture(scope="module")
def complete(demonstration):
    view = finish(survey(demonstration, "fz", 2048.0))
    tiles = view.tiles(SCALES)
    finish(tiles.building(tiles.missing(0, N)))
    return view


@pytest.fixture
def file(tmp_path, complete):
    assert keep(tmp_path, complete, SCALES)
    (file,) = tmp_path.iterdir()
    return file


def again(folder, demonstration, channel="fz", scales=SCALES, wavelet=None):
    return kept(folder, demonstration, channel, scales, wavelet or Morlet())


def whole(view, columns=600, samples=N):
    return finish(scalogram(view, 0.0, samples / RATE, scales=SCALES, columns=columns))


def test_a_kept_scalogram_is_the_computed_one_to_within_what_is_stated(
    file, complete, demonstration, monkeypatch
):
    monkeypatch.setattr(Source, "read", None)  # nothing is read of the recording any more
    view = again(file.parent, demonstration)
    for columns, samples in ((600, N), (1200, 400_000)):
        found, expected = whole(view, columns, samples), whole(complete, columns, samples)
        assert not found.coarse
        np.testing.assert_array_equal(np.isnan(found.values), np.isnan(expected.values))
        ratio = 10.0 ** (2 * (found.values - expected.values).astype(np.float64))
        assert np.nanmax(np.abs(ratio - 1)) < 0.004
    for name in ("noise", "low", "high", "level", "wavelet"):
        assert getattr(view, name) == getattr(complete, name)
    assert view.source.left_out(0, N) == 1, "the glitch is still told"


def test_what_is_not_in_the_file_is_computed(file, complete, demonstration, monkeypatch):
    monkeypatch.setattr(module, "TILES_TOLD", 150_000)  # of cells of 256 samples and more
    assert keep(file.parent, complete, SCALES)
    view = again(file.parent, demonstration)
    tiles = view.tiles(SCALES)
    assert tiles.told_cell == 256
    assert not tiles.missing(0, N, 256)
    assert tiles.missing(0, N)
    found, expected = whole(view, 1000, 300_000), whole(complete, 1000, 300_000)
    np.testing.assert_array_equal(found.values, expected.values)
    assert len(tiles.missing(0, N)) == 5, "of what is not seen nothing is computed"


def test_only_the_very_same_channel_scales_and_wavelet_are_found(file, demonstration):
    assert again(file.parent, demonstration, channel="fx") is None
    assert again(file.parent, demonstration, scales=row_scales(21, 2048.0)) is None
    assert again(file.parent, demonstration, wavelet=Morlet(6.0)) is None
    shorter = Demonstration(
        "foam 1",
        "foam",
        demonstration.times[:-1],
        demonstration.signals[:-1],
        demonstration.channels,
    )
    assert again(file.parent, shorter) is None
    assert again(file.parent, demonstration) is not None


def test_a_damaged_file_counts_as_none(file, demonstration):
    content, expected = file.read_bytes(), whole(again(file.parent, demonstration)).values
    for place in range(0, len(content), len(content) // 23):
        file.write_bytes(content[:place])
        assert again(file.parent, demonstration) is None, f"cut after {place} bytes"
        damaged = bytearray(content)
        damaged[place + 200 : place + 210] = bytes(10)
        file.write_bytes(damaged)
        view = again(file.parent, demonstration)
        if view is not None:  # there were zeros, or what nobody reads
            np.testing.assert_array_equal(whole(view).values, expected)
    file.write_bytes(b"something else")
    assert again(file.parent, demonstration) is None


def test_a_full_disk_leaves_what_was_there(file, complete, demonstration, monkeypatch):
    before = file.read_bytes()

    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(io.os, "fsync", full)
    assert not keep(file.parent, complete, SCALES)
    assert file.read_bytes() == before
    assert list(file.parent.iterdir()) == [file]
    assert not keep(file.parent / "gone", complete, SCALES)


def test_what_a_killed_process_left_is_cleared_away_once_nobody_writes_it(file, complete):
    old, new = (file.with_name(f".forcelab-{digit * 16}.part") for digit in "ab")
    for part in (old, new):
        part.write_bytes(b"half")
    before = time.time() - module.ABANDONED - 1
    os.utime(old, (before, before))
    assert keep(file.parent, complete, SCALES)
    assert not old.exists()
    assert new.exists(), "another window may be at it"


def test_the_oldest_files_go_where_all_of_them_are_too_large(tmp_path, complete, monkeypatch):
    folders = [tmp_path / name for name in "abc"]
    for number, folder in enumerate(folders):
        folder.mkdir()
        (folder / "signals.npy").write_bytes(b"recorded")
        assert keep(folder, complete, SCALES)
        (file,) = folder.glob("scalogram-*")
        os.utime(file, (number, number))
    monkeypatch.setattr(module, "MOST_ON_DISK", int(2.5 * file.stat().st_size))
    assert keep(folders[0], complete, SCALES)
    assert [len(list(folder.glob("scalogram-*"))) for folder in folders] == [1, 0, 1]
    assert all((folder / "signals.npy").exists() for folder in folders)


def test_a_file_is_a_few_megabytes_however_long_the_recording_is():
    from dataclasses import replace

    from forcelab.signals.scalogram_frames import Level, open_source

    scales = row_scales(100, 2048.0)
    short = Demonstration("a", "a", np.arange(9.0), np.zeros((9, 1)), (Channel("fz"),))
    source = finish(open_source(short, "fz"))
    for count, cell in ((1_000_000, 64), (10_000_000, 256), (86_000_000, 2048)):
        tiles = module.Tiles(replace(source, count=count), 0.0, Level(0.0, 0), scales, Morlet())
        assert tiles.told_cell == cell
        assert tiles.told()["cells"].nbytes <= 10_000_000
