"""What is recorded is kept, whatever fails around it."""

import pytest
from fake_devices import FakeDevice, eventually

from forcelab.capture.recorder import Recorder
from forcelab.capture.unfinished import unfinished
from forcelab.errors import InputError
from forcelab.gui.capture.connection import Connection
from forcelab.jobs import finish
from forcelab.project import Project


class Broken:
    """A recogniser that fails at a step."""

    glimpse = recogniser = None
    latency = 0.1

    def __init__(self, step):
        self.step = step

    def begin(self, *, keeping, after, firsts):
        pass

    def renewed(self):
        return self

    def finish(self):
        self._do("finish")

    def keep(self, _path, _kept):
        self._do("keep")

    def _do(self, step):
        if step == self.step:
            raise ArithmeticError(step)


@pytest.fixture
def recording(study):
    """A connection that records."""
    connection = Connection()
    connection.recorder = recorder = Recorder(study, [FakeDevice()])
    recorder.open()
    finish(connection.starting("LEGO", "", "Ann"))
    eventually(lambda: recorder.state().devices[0].samples > 100)
    yield connection
    connection.let_go()


def names(study):
    with Project.open(study) as project:
        return [one.name for one in project.demonstrations()]


def test_a_recogniser_that_fails_at_the_end_costs_its_track_and_not_the_recording(recording, study):
    recording.track.begin(Broken("finish"), keeping=True)
    with pytest.raises(ArithmeticError):
        finish(recording.stopping())
    assert recording.holding
    assert finish(recording.stopping()).samples > 100
    assert not recording.holding
    assert names(study) == ["LEGO 01"]


def test_a_track_that_cannot_be_kept_leaves_nothing_to_be_stopped_again(recording, study):
    recording.track.begin(Broken("keep"), keeping=True)
    with pytest.raises(ArithmeticError):
        finish(recording.stopping())
    assert not recording.holding
    assert names(study) == ["LEGO 01"]
    assert finish(recording.starting("LEGO", "", "Ann")) == "LEGO 02"


def test_what_could_not_be_kept_is_kept_when_the_window_closes(recording, study):
    away = study.with_suffix(".away")
    study.rename(away)
    with pytest.raises(InputError):
        finish(recording.stopping())
    away.rename(study)
    recording.let_go()
    assert names(study) == ["LEGO 01"]
    assert unfinished(study) == ()
