"""Recording with a recogniser that labels the stream as it comes, from virtual DAQs."""

import re
import sys
import threading
import time
from contextlib import ExitStack, contextmanager, suppress
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from factories import BAYES_SETTINGS, synthetic_set

from forcelab.capture.reader import RingBuffer
from forcelab.capture.replay import extract_sensors
from forcelab.capture.save import unfinished_journals
from forcelab.capture.stream_merger import StreamMerger
from forcelab.cli.commands.capture import LiveTrackRecorder
from forcelab.cli.output import quietly
from forcelab.formats.calibration import read_calibrations
from forcelab.labels import to_codes
from forcelab.live.recognition import LiveRecognition
from forcelab.project import Project
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.online import recognise_with_latency
from forcelab.recognition.storage import save_recogniser
from forcelab.recognition.training import train
from forcelab.resources import asset
from tests.capture.helpers import FakeDevice, FakeEncoder
from tests.capture.virtual_devices import VirtualOptoForce, table_source

CALIBRATION = asset("calibrations", "3-axis-40N.toml")
LATENCY = 0.3


@pytest.fixture(scope="module")
def three():
    return synthetic_set(3)


@pytest.fixture(scope="module")
def recogniser(three):
    # Without filters over time: where stamps differ by a sample they may keep or drop a segment.
    return train(
        [LabelledDemonstration(*performance) for performance in three[:2]],
        BAYES_SETTINGS.replace(stride=10, max_scale=512.0, median=None, drop=None),
    )


@pytest.fixture(scope="module")
def file(recogniser, tmp_path_factory):
    path = tmp_path_factory.mktemp("trained") / "tiny.skops"
    save_recogniser(recogniser, path)
    return path


@contextmanager
def tongs(demonstration):
    """Two virtual DAQs that play a demonstration; gives what capture is told of them."""
    with ExitStack() as stack:
        words = []
        for sensor in extract_sensors(demonstration, read_calibrations(CALIBRATION)):
            daq = VirtualOptoForce(table_source(sensor.counts, 1000.0), serial=sensor.serial)
            stack.enter_context(daq)
            words += ["--device", f"optoforce:{daq.port}?calibration={CALIBRATION}"]
        yield words


@contextmanager
def listening(name):
    """Gather the actions that a stream says, and when, while it is sent; with its option.

    Without pylsl there is neither.
    """
    try:
        import pylsl
    except ImportError:
        yield [], []
        return
    heard = []

    def listen():
        [info] = pylsl.resolve_byprop("name", name, timeout=20.0)
        inlet = pylsl.StreamInlet(info, recover=False)
        with suppress(pylsl.util.LostError):  # the recording has ended
            while True:
                action, stamp = inlet.pull_sample(20.0)
                heard.append((action[0], stamp + time.monotonic() - pylsl.local_clock()))

    listener = threading.Thread(target=listen)
    listener.start()
    yield heard, ["--lsl-out", name]
    listener.join()


def test_the_track_is_what_is_stated_for_the_latency_and_segments_are_told(
    forcelab, three, recogniser, file, tmp_path, monkeypatch
):
    def late(live, **options):  # the computer is busy just then
        time.sleep(0.3)
        begin(live, **options)

    begin = LiveRecognition.begin
    monkeypatch.setattr(LiveRecognition, "begin", late)
    project = tmp_path / "lab.forcelab"
    words = ["--task", "foam", "--seconds", "2.5", "--recogniser", file, "--latency", LATENCY]
    with tongs(three[2][0]) as devices, listening("spoken") as (heard, sending):
        result = forcelab("capture", project, *devices, *words, "--json", *sending)
    assert result.status == 0, result.err
    found = result.json["recognised"]
    with Project.open(project) as opened:
        d = opened.demonstrations.load("foam 01")
        (track,) = opened.tracks.of(d.id)
        (edit,) = opened.tracks.history(d.id, track.author)
        stated = recognise_with_latency(recogniser, d, LATENCY)
        start = float(opened.media.stamps(d.id)["start"])
    assert (track.author, edit.kind) == ("model tiny", "predict")
    assert found["segments"] == len(track.segments) >= 2
    assert found["labelled"] == pytest.approx(sum(s.duration for s in track.segments) / d.duration)
    assert found["after"]["p99"] >= found["after"]["median"] >= LATENCY
    assert found["cpu"] > 0
    # The stamps of the demonstration are made of all arrivals, those of the stream of the arrivals
    # until then, and the recording's last samples follow the stream's: edges may lie apart.
    codes = to_codes(track.segments, stated.times, recogniser.actions)
    assert np.mean(codes == stated.codes) >= 0.95
    # Without a terminal each segment is told as it ends, on the recording's clock.
    lines = re.findall(r"^ *(\d+\.\d\d) +(\d+\.\d\d)  (\w+)  (\d\.\d\d)$", result.err, re.M)
    assert [line[2] for line in lines] == [s.action for s in track.segments]
    for line, segment in zip(lines, track.segments, strict=True):
        assert float(line[1]) == pytest.approx(segment.end, abs=0.1)
        assert 0.5 < float(line[3]) <= 1
    # Other programs hear the labels meanwhile.
    spoken = [(action, at - start) for action, at in heard if action]
    assert spoken or not sending
    for action, at in spoken:
        begun = [segment.start for segment in track.segments if segment.action == action]
        assert min(abs(at - first) for first in begun) < 0.05


def test_sensors_too_slow_for_the_recogniser_are_told_of(forcelab, three, file, tmp_path):
    project = tmp_path / "lab.forcelab"
    with tongs(three[2][0]) as devices:
        slow = [word + "&rate=50" * word.startswith("optoforce") for word in devices]
        words = ["--task", "foam", "--seconds", "1.5", "--recogniser", file]
        result = forcelab("capture", project, *slow, *words)
    assert result.status == 0, result.err
    assert re.search(r"come at 50 Hz, and .* learnt at 1000 Hz: \d of its \d scales", result.err)


def test_on_a_terminal_the_line_shows_the_action_and_how_sure_it_is(
    forcelab_on_terminal, three, file, tmp_path
):
    words = [tmp_path / "lab.forcelab", "--task", "foam", "--seconds", "0.8", "--recogniser", file]
    with tongs(three[2][0]) as devices:
        result = forcelab_on_terminal("capture", *words, *devices)
    assert result.status == 0, result.err
    assert re.search(r"still \d\.\d\d  \|  \d\.\d s  \|  \d+ samples", result.err)
    first, second = result.out.splitlines()
    assert first.startswith("'foam 01'")
    assert re.fullmatch(
        r"Recognised by 'model tiny': \d+ segments?, \d+ % labelled, labels \d\.\d\d s after the "
        r"force \(99 %: \d\.\d\d s\), [\d.]+ % of a core\.",
        second,
    )


def test_on_a_terminal_that_is_to_be_quiet_segments_are_printed_as_they_end(
    terminal, capsys, monkeypatch
):
    ended = SimpleNamespace(start=1.0, end=2.5, action="grab", probability=0.9)
    live = SimpleNamespace(begun=0.5, look=lambda: [ended])
    monkeypatch.setattr(sys, "stderr", terminal)
    for quiet, printed in ((False, ""), (True, "   0.50    2.00  grab  0.90\n")):
        with quietly(quiet):
            LiveTrackRecorder(live, sys.stdout).look()
        assert capsys.readouterr().out == printed


@pytest.mark.parametrize("step", ["look", "finish", "keep"])
def test_a_recogniser_that_fails_costs_its_track_and_not_the_recording(
    forcelab, three, file, tmp_path, monkeypatch, step
):
    def fail(*_):
        raise ArithmeticError(step)

    monkeypatch.setattr(LiveRecognition, step, fail)
    project = tmp_path / "lab.forcelab"
    words = ["--task", "foam", "--seconds", "0.6", "--json", "--recogniser", file]
    with tongs(three[2][0]) as devices:
        result = forcelab("capture", project, *devices, *words)
    assert result.status == 1
    assert (
        f"The recogniser failed (ArithmeticError: {step}): the recording is kept without its track."
        in result.err
    )
    assert result.json["name"] == "foam 01"
    assert "recognised" not in result.json
    assert unfinished_journals(project) == ()
    with Project.open(project) as opened:
        assert opened.demonstrations.load("foam 01").duration > 0.2


def test_who_has_seen_enough_segments_ends_no_recording(
    forcelab, three, file, tmp_path, monkeypatch
):
    class Closed(StringIO):
        def write(self, _):
            raise BrokenPipeError

    project = tmp_path / "lab.forcelab"
    words = ["--task", "foam", "--seconds", "1", "--recogniser", file]
    with tongs(three[2][0]) as devices, monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", Closed())
        patch.setattr("forcelab.cli._drop_output", lambda: None)
        result = forcelab("capture", project, *devices, *words)
    assert result.status == 0, result.err
    with Project.open(project) as opened:
        d = opened.demonstrations.load("foam 01")
        assert d.duration > 0.8
        assert opened.tracks.of(d.id)[0].segments


def test_what_cannot_be_recognised_is_one_sentence_and_makes_no_project(
    forcelab, three, file, tmp_path
):
    project = tmp_path / "lab.forcelab"
    words = ["capture", project, "--task", "foam", "--seconds", "1"]
    with tongs(three[2][0]) as devices:
        result = forcelab(*words, *devices, "--recogniser", tmp_path / "none.skops")
        assert "none.skops" in result.sentence
        result = forcelab(*words, *devices, "--latency", "1")
        assert "--recogniser" in result.wrong_word
        result = forcelab(*words, *devices, "--recogniser", file, "--latency", "-1")
        assert "latency" in result.sentence
        result = forcelab(*words, *devices, "--lsl-out", "x")
        assert "--lsl-out sends what a recogniser says" in result.wrong_word
        result = forcelab(*words, *devices[:2], "--recogniser", file)
        assert "tangential 2" in result.sentence
    assert not project.exists()


class Rings:
    """Devices whose samples a test gives."""

    def __init__(self, *devices):
        self.devices = devices
        self.rings = [RingBuffer(10_000, len(device.channels)) for device in devices]
        self.following = StreamMerger(devices, lambda i, number: self.rings[i].since(number))

    def give(self, device, times, values):
        columns = len(self.devices[device].channels)
        values = np.broadcast_to(np.asarray(values, dtype=float)[..., None], (len(times), columns))
        self.rings[device].extend(np.asarray(times, dtype=float), values)


def test_samples_of_two_devices_are_joined_as_far_as_both_have_told():
    rings = Rings(FakeDevice("a"), FakeDevice("b"))
    t = np.arange(200) / 1000
    rings.give(0, t, t)
    rings.give(1, t[:100] + 4e-4, t[:100] + 4e-4)
    times, values = rings.following.read()
    assert times[-1] == pytest.approx(0.099)
    rings.give(1, t[100:] + 4e-4, t[100:] + 4e-4)
    later, more = rings.following.read()
    times, values = np.concatenate([times, later]), np.concatenate([values, more])
    np.testing.assert_allclose(times, t, atol=1e-12)
    np.testing.assert_array_equal(values[:, 0], t)
    np.testing.assert_allclose(values[1:, 3], t[1:], atol=1e-12)


def test_a_device_that_is_silent_is_not_waited_for_and_one_that_holds_never_is():
    encoder = FakeEncoder()
    rings = Rings(FakeDevice("a"), FakeDevice("b"), encoder)
    rings.give(2, [-5.0], [7.0])
    rings.following.skip([ring.latest(0.0) for ring in rings.rings])
    t = np.arange(1000) / 1000
    rings.give(0, t, t)
    times, values = rings.following.read()
    assert times[-1] == pytest.approx(0.749)
    assert np.isnan(values[:, 3:6]).all()
    assert (values[:, 6] == 7).all()
    times, _ = rings.following.read([None] * 3)
    assert times[-1] == t[-1]


def test_a_first_device_that_is_away_for_long_costs_no_memory_and_goes_on_when_it_is_back():
    encoder = FakeEncoder()
    rings = Rings(FakeDevice("a"), FakeDevice("b"), encoder)
    rings.give(2, [0.0], [7.0])
    t = np.arange(1000) / 1000
    for second in range(100):
        rings.give(1, second + t, t)
        assert len(rings.following.read()[0]) == 0
    waiting = sum(len(times) for times in rings.following._times)
    assert waiting < 65_000
    rings.give(0, 100 + t, t)
    rings.give(1, 100 + t, t)
    times, values = rings.following.read()
    assert len(times) == 1000
    assert np.isfinite(values).all()


def test_stamps_increase_when_the_clock_is_set_back_and_no_sample_is_left_out():
    rings = Rings(FakeDevice("a"))
    t = np.arange(100) / 1000
    rings.give(0, t, t)
    first, _ = rings.following.read()
    rings.give(0, t + 0.095, t)
    second, _ = rings.following.read()
    times = np.concatenate([first, second])
    assert len(times) == 200
    assert (np.diff(times) > 0).all()
    assert times[-1] == pytest.approx(0.194)
