import sys
import tempfile

import pytest

from forcelab.errors import InputError
from forcelab.video.codecs import CODECS, Codec, try_codec


@pytest.mark.parametrize("codec", CODECS[:2], ids=lambda codec: codec.name)
def test_codecs_of_every_wheel_give_back_what_they_are_given(codec):
    assert try_codec(codec)


def test_a_codec_that_does_not_exist_does_not_work():
    assert not try_codec(Codec("none", "ZZZZ", ".avi"))


def test_without_opencv_the_import_error_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "cv2", None)
    with pytest.raises(ImportError, match="cv2"):
        try_codec(CODECS[0])


def test_a_temporary_folder_that_cannot_be_made_is_told_with_its_cure(monkeypatch):
    def full(*arguments, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tempfile, "mkdtemp", full)
    with pytest.raises(InputError, match=r"No space left on device.*set TMPDIR"):
        try_codec(CODECS[0])
