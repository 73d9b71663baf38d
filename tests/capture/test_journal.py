"""The journal: what was written comes back, however the file ends and whatever the disk does."""

import errno
import os
import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.capture.device import Block
from forcelab.capture.journal import (
    READ_BYTES,
    JournalReader,
    JournalWriter,
    RecordKind,
    SampleBuffer,
    decode_json,
    encode_block,
    encode_header,
    encode_record,
    is_being_written,
    read_journal,
)
from forcelab.errors import InputError
from tests.capture.helpers import FullDisk, block_of, journal_of

HEADER = {"name": "LEGO 01", "devices": []}


def block(n=5, c=3, ticks=True, status=True, seed=0):
    rng = np.random.default_rng(seed)
    return Block(
        rng.random(n),
        np.arange(n) + seed if ticks else None,
        rng.normal(size=(n, c)),
        rng.integers(0, 65536, n).astype(np.uint16) if status else None,
    )


def same(first, second):
    for name in ("arrived", "ticks", "values"):
        a, b = getattr(first, name), getattr(second, name)
        assert (a is None) == (b is None)
        if a is not None:
            np.testing.assert_array_equal(a, b)
    return True


@given(n=st.integers(0, 30), c=st.integers(1, 6), ticks=st.booleans(), status=st.booleans())
def test_a_block_comes_back_as_it_was(n, c, ticks, status):
    whole = block(n, c, ticks, status)
    assert same(block_of(encode_block(whole)), whole)


def test_what_was_recorded_is_read_in_its_order(tmp_path):
    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    assert is_being_written(writer.path)
    writer.block(0, block())
    writer.note(RecordKind.MARK, at=1.5, action="grab", down=True)
    writer.block(1, block(seed=7))
    writer.close()
    assert not is_being_written(writer.path)
    reader = read_journal(writer.path)
    assert reader.header == HEADER
    assert reader.torn == 0
    assert [(r.kind, r.device) for r in reader] == [
        (RecordKind.BLOCK, 0), (RecordKind.MARK, 0), (RecordKind.BLOCK, 1),
    ]  # fmt: skip
    assert decode_json(list(reader)[1]) == {"at": 1.5, "action": "grab", "down": True}
    assert same(block_of(list(reader)[2].payload), block(seed=7))


def test_the_header_is_on_the_disk_before_anything_is_recorded(tmp_path):
    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    try:
        assert read_journal(writer.path).header == HEADER
    finally:
        writer.close()


def test_a_journal_torn_at_any_byte_gives_all_whole_records():
    pieces = [encode_header(HEADER)]
    pieces += [encode_record(RecordKind.BLOCK, encode_block(block(i, seed=i)), i) for i in range(4)]
    ends = np.cumsum([len(piece) for piece in pieces])
    data = b"".join(pieces)
    for cut in range(len(data) + 1):
        whole = int(np.searchsorted(ends, cut, side="right"))
        if whole == 0:
            with pytest.raises(InputError, match="journal"):
                journal_of(data[:cut])
            continue
        reader = journal_of(data[:cut])
        assert len(list(reader)) == whole - 1
        assert reader.torn == cut - ends[whole - 1]


@pytest.mark.parametrize("size", [1, 7, 100, 10_000])
def test_records_are_whole_wherever_the_pieces_end_that_are_read(size):
    records = [encode_block(block(1 + 5 * i, seed=i)) for i in range(4)]
    data = encode_header(HEADER) + b"".join(
        encode_record(RecordKind.BLOCK, record) for record in records
    )
    data += b"\2\0torn"
    reader = JournalReader(lambda: (data[i : i + size] for i in range(0, len(data), size)), "a")
    assert [record.payload for record in reader] == records
    assert reader.torn == 6


def test_what_follows_a_damaged_record_is_counted_and_never_held_in_memory(peak_memory):
    damage, pieces = bytes(12), 64

    def source():
        yield encode_header(HEADER) + damage
        for _ in range(pieces):
            yield bytes(READ_BYTES)

    torn, peak = peak_memory(lambda: JournalReader(source, "a").torn)
    assert torn == len(damage) + pieces * READ_BYTES
    assert peak < 8 * READ_BYTES


@settings(max_examples=200)
@given(st.data())
def test_flipped_bytes_are_never_taken_for_samples(data):
    pieces = [encode_header(HEADER)]
    pieces += [
        encode_record(RecordKind.BLOCK, encode_block(block(i + 1, seed=i)), i) for i in range(3)
    ]
    whole = bytearray(b"".join(pieces))
    at = data.draw(st.integers(len(pieces[0]), len(whole) - 1))
    whole[at] ^= data.draw(st.integers(1, 255))
    reader = journal_of(bytes(whole))
    assert len(list(reader)) < 3
    assert reader.torn > 0
    for i, record in enumerate(reader):
        assert same(block_of(record.payload), block(i + 1, seed=i))


@given(st.binary(max_size=200))
def test_any_bytes_are_a_journal_or_one_sentence(data):
    for start in (b"", encode_header(HEADER), b"forcelab journal "):
        try:
            journal_of(start + data)
        except InputError as error:
            assert str(error).endswith(".")


def test_another_version_is_refused_with_the_cure():
    with pytest.raises(InputError, match="version 9.*newer forcelab"):
        journal_of(encode_header(HEADER).replace(b"journal 1", b"journal 9"))


@pytest.mark.parametrize("payload", [b"", b"\x01", encode_block(block())[:-1]])
def test_a_block_of_a_wrong_length_is_refused(payload):
    with pytest.raises(InputError, match="block"):
        SampleBuffer(block().values.shape[1]).add(payload)


@pytest.fixture
def full_disk(monkeypatch):
    """Whatever is written goes to that disk."""
    monkeypatch.setattr("forcelab.capture.journal.FileIO", FullDisk)


def brought(writer):
    """Make the writer try now, as its thread does some time."""
    writer._tried = -1e9
    writer._flush()


@pytest.fixture
def _calm(monkeypatch):
    """The writer's own thread sleeps, so that the test decides when it writes."""
    monkeypatch.setattr("forcelab.capture.journal.FLUSH_SECONDS", 1e6)


@pytest.mark.usefixtures("_calm", "full_disk")
def test_a_full_disk_costs_nothing_and_is_said_once(tmp_path, monkeypatch):
    monkeypatch.setattr(FullDisk, "room", 1000)
    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    for i in range(50):
        writer.block(0, block(20, seed=i))
        brought(writer)
    assert writer.in_memory > 10_000
    (remark,) = writer.remarks()
    assert "No space left" in remark
    assert "memory" in remark
    assert read_journal(writer.path).torn >= 0  # what is there is readable meanwhile
    monkeypatch.setattr(FullDisk, "room", 10**9)
    brought(writer)
    assert writer.in_memory == 0
    assert "again" in writer.remarks()[0]
    writer.close()
    reader = read_journal(writer.path)
    assert reader.torn == 0
    assert [int(block_of(r.payload).ticks[0]) for r in reader] == list(range(50))


@pytest.mark.usefixtures("_calm", "full_disk")
def test_what_a_full_disk_refused_to_the_end_is_still_there_to_be_used(tmp_path, monkeypatch):
    monkeypatch.setattr(FullDisk, "room", 300)
    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    for i in range(9):
        writer.block(0, block(20, seed=i))
    writer.finish()
    assert len(list(writer.contents())) == 9
    # Closed all the same, it is kept whole where there is room, and nowhere twice.
    existing = tmp_path / "there"
    existing.mkdir()
    places = (tmp_path / "nowhere", existing)
    monkeypatch.setattr("forcelab.capture.journal.fallback_folders", lambda: places)
    writer.close()
    writer.close()
    assert list(existing.iterdir()) == [writer.saved]
    assert not writer.path.exists()
    reader = read_journal(writer.saved)
    assert (reader.torn, len(list(reader)), reader.header) == (0, 9, HEADER)


@pytest.mark.usefixtures("_calm", "full_disk")
def test_a_journal_that_nobody_has_room_for_stays_as_far_as_it_came(tmp_path, monkeypatch):
    monkeypatch.setattr(FullDisk, "room", 1000)
    monkeypatch.setattr("forcelab.capture.journal.fallback_folders", lambda: (tmp_path / "no",))
    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    for i in range(9):
        writer.block(0, block(20, seed=i))
    writer.close()
    assert writer.saved is None
    assert read_journal(writer.path).header == HEADER


@pytest.mark.usefixtures("_calm")
def test_what_a_disk_takes_and_does_not_confirm_is_written_again(tmp_path, monkeypatch):
    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    writer.block(0, block(seed=1))
    brought(writer)
    size = writer.path.stat().st_size

    def full(number):
        os.truncate(number, size)  # as a share does that is full: it took all, and lost it
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("forcelab.capture.journal.os.fsync", full)
        writer.block(0, block(seed=2))
        brought(writer)
    assert writer.in_memory > 0
    writer.block(0, block(seed=3))
    brought(writer)
    writer.close()
    reader = read_journal(writer.path)
    assert reader.torn == 0
    assert [int(block_of(r.payload).ticks[0]) for r in reader] == [1, 2, 3]


@pytest.mark.usefixtures("_calm")
@pytest.mark.parametrize("how", ["moved", "empty"])
def test_a_folder_that_is_away_for_a_while_costs_nothing(tmp_path, how):
    home = tmp_path / "captures"
    home.mkdir()
    writer = JournalWriter(home / "a.journal", HEADER)
    writer.block(0, block(seed=1))
    brought(writer)
    home.rename(tmp_path / "away")
    writer.block(0, block(seed=2))
    brought(writer)
    (remark,) = writer.remarks()
    assert "memory" in remark
    if how == "moved":
        (tmp_path / "away").rename(home)
    else:
        shutil.rmtree(tmp_path / "away")
        home.mkdir()
    writer.block(0, block(seed=3))
    brought(writer)
    writer.close()
    reader = read_journal(home / "a.journal")
    assert [int(block_of(r.payload).ticks[0]) for r in reader] == [1, 2, 3]


@pytest.mark.usefixtures("full_disk")
def test_a_journal_that_cannot_be_begun_is_one_sentence(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="nothing is recorded"):
        JournalWriter(tmp_path / "nowhere" / "a.journal", HEADER)
    monkeypatch.setattr(FullDisk, "room", 10)
    with pytest.raises(InputError, match="nothing is recorded"):
        JournalWriter(tmp_path / "a.journal", HEADER)
    assert not (tmp_path / "a.journal").exists()


def test_the_thread_brings_records_to_the_disk_by_itself(tmp_path):
    import time

    writer = JournalWriter(tmp_path / "a.journal", HEADER)
    try:
        writer.block(0, block())
        limit = time.monotonic() + 20
        while not list(read_journal(writer.path)) and time.monotonic() < limit:
            time.sleep(0.02)
        assert list(read_journal(writer.path))
    finally:
        writer.close()
