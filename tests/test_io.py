"""Files appear whole or not at all."""

import errno
import os
import stat

import pytest

from forcelab.errors import InputError
from forcelab.io import atomic_file, write_atomically


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_holds_exactly_the_bytes_and_nothing_lies_beside_it(tmp_path):
    write_atomically(tmp_path / "a.csv", b"\x00one\r\n")
    assert (tmp_path / "a.csv").read_bytes() == b"\x00one\r\n"
    write_atomically(str(tmp_path / "a.csv"), b"two")
    assert (tmp_path / "a.csv").read_bytes() == b"two"
    assert names(tmp_path) == ["a.csv"]


def test_nothing_takes_the_name_before_the_block_is_done(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"before")
    with atomic_file(path) as stream:
        stream.write(b"after")
        stream.flush()
        assert path.read_bytes() == b"before"
    assert path.read_bytes() == b"after"


def test_a_failure_in_the_block_leaves_what_was_there(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"before")

    def broken():
        yield b"half"
        raise KeyError

    with pytest.raises(KeyError), atomic_file(path) as stream:
        stream.writelines(broken())
    assert path.read_bytes() == b"before"
    assert names(tmp_path) == ["a.csv"]


@pytest.mark.parametrize("step", ["fsync", "replace"])
def test_a_full_disk_is_a_sentence_and_leaves_what_was_there(tmp_path, monkeypatch, step):
    def full(*args, **kwargs):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    path = tmp_path / "a.csv"
    path.write_bytes(b"before")
    owner = os if step == "fsync" else type(path)
    monkeypatch.setattr(owner, step, full)
    with pytest.raises(InputError, match=r"a\.csv' cannot be written \(No space left on device\)"):
        write_atomically(path, b"after")
    assert path.read_bytes() == b"before"
    assert names(tmp_path) == ["a.csv"]


def test_the_trouble_of_another_file_is_not_blamed_on_this_one(tmp_path):
    with pytest.raises(FileNotFoundError), atomic_file(tmp_path / "a.csv"):
        (tmp_path / "other").read_bytes()
    assert names(tmp_path) == []


def test_a_missing_folder_a_folder_and_a_device_are_refused(tmp_path):
    with pytest.raises(InputError, match="No such file or directory"):
        write_atomically(tmp_path / "missing" / "a.csv", b"")
    with pytest.raises(InputError, match="is a folder; name a file"):
        write_atomically(tmp_path, b"")
    with pytest.raises(InputError, match="is a device; name a file"):
        write_atomically(os.devnull, b"")
    assert names(tmp_path) == []


@pytest.mark.skipif(os.name != "posix", reason="rights and links as POSIX has them")
def test_rights_and_links_are_kept(tmp_path):
    path, link = tmp_path / "a.csv", tmp_path / "link.csv"
    write_atomically(path, b"new")
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask
    path.chmod(0o640)
    link.symlink_to(path)
    write_atomically(link, b"through the link")
    assert link.is_symlink()
    assert path.read_bytes() == b"through the link"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
