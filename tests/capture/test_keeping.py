"""What is half kept is told, whatever it was that kept the rest away."""

import pytest
from fake_devices import FakeDevice, eventually

from forcelab.capture.recorder import Recorder
from forcelab.capture.save import PartialSaveError
from forcelab.errors import InputError
from forcelab.project import Project
from forcelab.project.demonstrations import DemonstrationStore
from forcelab.project.media import MediaStore


@pytest.mark.parametrize(
    ("first", "told"),
    [
        (InputError("The disk is full."), "The disk is full. 'LEGO 01' is in the project without"),
        (OSError("torn"), "It ended early (OSError('torn')). 'LEGO 01' is in the project without"),
        (KeyboardInterrupt(), "It ended early (KeyboardInterrupt()). 'LEGO 01' is in the project"),
    ],
)
def test_what_is_neither_whole_nor_taken_back_is_told_and_can_be_mended(
    project, monkeypatch, first, told
):
    def fail(error):
        def failing(*_):
            raise error

        return failing

    with Recorder(project, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        eventually(lambda: recorder.state().devices[0].samples >= 100)
        with monkeypatch.context() as patch:
            patch.setattr(MediaStore, "attach_stamps", fail(first))
            patch.setattr(DemonstrationStore, "discard", fail(InputError("It is kept busy.")))
            with pytest.raises(PartialSaveError) as caught:
                recorder.stop()
        assert told in str(caught.value)
        assert str(caught.value).endswith("taken back either: It is kept busy.")
        assert caught.value.__cause__ is first
        recorder.discard()  # as it knows that a part is in the project
    with Project.open(project) as opened:
        assert opened.demonstrations.infos() == ()
