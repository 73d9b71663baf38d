"""What is recorded is kept, whatever fails around it."""

import pytest
from fake_devices import FakeDevice, eventually

from forcelab.capture.recorder import Recorder
from forcelab.capture.save import unfinished
from forcelab.capture.stream_merger import StreamMerger
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

    def begin(self, **_):
        self._do("begin")

    def renewed(self):
        self._do("renewed")
        return self

    def look(self):
        self._do("look")

    def finish(self):
        self._do("finish")

    def keep(self, _path, _kept):
        self._do("keep")
        return {"author": "model", "segments": 0, "labelled": 0.0}

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
        return [one.name for one in project.demonstrations.infos()]


def lost(step):
    """What is said of a track that is lost."""
    return (
        f"The recogniser failed (ArithmeticError: {step}): the recording is kept without its track."
    )


@pytest.mark.parametrize("step", ["finish", "keep"])
def test_a_recogniser_that_fails_at_the_end_costs_its_track_and_not_the_recording(
    recording, study, step
):
    recording.track.begin(Broken(step), keeping=True)
    kept = finish(recording.stopping())
    assert kept.samples > 100
    assert kept.remarks[-1] == lost(step)
    assert not recording.holding
    assert names(study) == ["LEGO 01"]
    assert finish(recording.starting("LEGO", "", "Ann")) == "LEGO 02"
    finish(recording.discarding())  # its track could not be kept either


@pytest.mark.parametrize("step", ["finish", "keep"])
def test_a_recogniser_that_fails_while_the_window_closes_stops_nothing(recording, study, step):
    recording.track.begin(Broken(step), keeping=True)
    recorder = recording.recorder
    assert recording.let_go() == ""
    assert names(study) == ["LEGO 01"]
    assert unfinished(study) == ()
    with pytest.raises(IndexError):
        recorder.since(0, 0)  # the devices are let go of


def test_a_fault_while_it_is_kept_stops_no_closing_and_leaves_the_recording_to_be_recovered(
    recording, study, monkeypatch
):
    def fault(*_):
        raise ArithmeticError("fault")

    monkeypatch.setattr("forcelab.capture.recorder.keep", fault)
    assert recording.let_go() == "ArithmeticError: fault"
    assert recording.recorder is None
    assert len(unfinished(study)) == 1


def test_the_track_sees_the_last_sample_of_a_recording_and_none_after_it(recording, study):
    """Whatever came between the last look and the end counts, as in the demonstration."""

    class Follower(Broken):
        """A recogniser that keeps what it follows."""

        following = StreamMerger([FakeDevice()], recording.recorder.since)

        def finish(self):
            eventually(lambda: recorder.latest(0.0)[0][0] > recorder.ends[0] + 50)
            self.values = self.following.read(recorder.ends)[1]

    recorder, follower = recording.recorder, Follower("")
    follower.following.start(recorder.firsts)
    recording.track.begin(follower, keeping=True, firsts=recorder.firsts)
    kept = finish(recording.stopping())
    assert len(follower.values) == kept.samples
    with Project.open(study) as project:
        values = project.demonstrations.load("LEGO 01").signals
    assert follower.values[-1, 0] == values[-1, 0]


@pytest.mark.parametrize("step", ["begin", "renewed", "look", "finish", "keep"])
def test_a_recogniser_that_failed_once_follows_the_next_recording(recording, study, step):
    recogniser = Broken("")
    recording.track.begin(recogniser, keeping=True)
    recogniser.step = step
    finish(recording.stopping())
    recogniser.step = ""
    finish(recording.starting("LEGO", "", "Ann"))
    recording.track.look(True)
    eventually(lambda: recording.recorder.state().devices[0].samples > 100)
    kept = finish(recording.stopping())
    assert kept.remarks == ("Recognised by 'model': 0 segments, 0 % labelled.",)


def test_a_recogniser_that_fails_while_it_is_recorded_is_told_of_with_what_is_kept(recording):
    with pytest.raises(ArithmeticError):
        finish(recording.recognising(lambda *_: Broken("look"), lambda: True))
    kept = finish(recording.stopping())
    assert kept.remarks == (lost("look"),)
    finish(recording.starting("LEGO", "", "Ann"))
    eventually(lambda: recording.recorder.state().devices[0].samples > 100)
    assert finish(recording.stopping()).remarks == ()


@pytest.mark.parametrize("step", ["renewed", "begin"])
def test_a_recogniser_that_cannot_begin_anew_stops_no_recording(recording, step):
    recording.track.begin(Broken(""), keeping=True)
    recording.track._live.step = step
    assert finish(recording.stopping()).samples > 100
    recording.track.begin(Broken(""), keeping=True)
    recording.track._live.step = step
    assert finish(recording.starting("LEGO", "", "Ann")) == "LEGO 02"
    eventually(lambda: recording.recorder.state().devices[0].samples > 100)
    kept = finish(recording.stopping())
    assert kept.remarks[-1] == lost(step)


def test_what_could_not_be_kept_is_kept_when_the_window_closes(recording, study):
    away = study.with_suffix(".away")
    study.rename(away)
    with pytest.raises(InputError):
        finish(recording.stopping())
    away.rename(study)
    recording.let_go()
    assert names(study) == ["LEGO 01"]
    assert unfinished(study) == ()
