"""Arrays on the disk: as NumPy writes them, and one true sentence where the disk takes a part."""

import errno
import io
import sys

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.project.files import file_errors, write_array


@pytest.mark.parametrize("shape", [(0,), (7,), (3, 5), (0, 2)])
def test_an_array_is_what_numpy_saves(tmp_path, shape):
    array = np.random.default_rng(0).normal(size=shape)
    write_array(tmp_path / "a.npy", np.asfortranarray(array))
    plain = io.BytesIO()
    np.save(plain, array)
    assert (tmp_path / "a.npy").read_bytes() == plain.getvalue()


@pytest.mark.skipif(sys.platform == "win32", reason="files have no such limit there")
def test_a_disk_that_takes_a_part_is_told_as_the_system_tells_it(tmp_path):
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    try:
        with (
            pytest.raises(InputError, match="It was not written: File too large"),
            file_errors("It was not written"),
        ):
            write_array(tmp_path / "a.npy", np.zeros(10_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(
    ("number", "cure"),
    [
        (errno.ENOSPC, "make room on the disk"),
        (errno.EACCES, "look who may read and write there"),
        (errno.EROFS, "copy it to where you may write"),
        (errno.EIO, "look whether the disk is connected, and check it"),
        (errno.ENAMETOOLONG, "choose a shorter name"),
    ],
)
def test_what_the_system_refuses_is_told_with_the_cure(number, cure):
    with pytest.raises(InputError) as refusal, file_errors("It was not written"):
        raise OSError(number, "No", "a.npy")
    assert str(refusal.value) == f"It was not written: No ('a.npy'); {cure}."
