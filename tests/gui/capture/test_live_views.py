"""Live recognition and the live scalogram in the window, with virtual tongs on a real pty."""

import numpy as np
import pytest
from factories import BAYES_SETTINGS, synthetic_set
from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QGuiApplication, QImage, QPainter

from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.capture.live_plot import GUTTER
from forcelab.gui.capture.live_scalogram import DRAWING
from forcelab.gui.capture.recognition_controller import (
    RECOGNISING,
    LoadedRecogniser,
    RecogniserSelection,
)
from forcelab.gui.capture.recognition_panel import latency_budget_text
from forcelab.live.recognition import LiveRecognition, latency_budget
from forcelab.project import Project, Provenance
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import preset
from forcelab.recognition.storage import dump, save_recogniser
from forcelab.recognition.training import train
from tests.capture.virtual_devices import VirtualOptoForce
from tests.gui.capture.conftest import connect, make_study, open_window, source

#: Every step gets a label, whatever it is: what comes is no foam.
SETTINGS = BAYES_SETTINGS.replace(stride=10, threshold=None, median=None, drop=None)


def trained(channels):
    return train(
        [LabelledDemonstration(*performance) for performance in synthetic_set(2)],
        SETTINGS.replace(channels=channels),
    )


@pytest.fixture(scope="module")
def recogniser():
    return trained(("tangential 1", "normal 1"))


@pytest.fixture(scope="module", autouse=True)
def _few_frequencies():
    """To make the wavelets of forty takes most of a second."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("forcelab.gui.capture.live_scalogram.ROWS", 6)
        yield


@pytest.fixture(scope="module")
def study(tmp_path_factory, recogniser):
    """The project with a recogniser in it."""
    path = make_study(tmp_path_factory.mktemp("live") / "study.forcelab")
    with Project.open(path) as project:
        project.runs.add_recogniser(
            "tiny", dump(recogniser), Provenance(settings={}, seed=0, labels=[], versions={})
        )
    return path


@pytest.fixture(scope="module")
def tongs():
    with VirtualOptoForce(source) as device:
        yield device


@pytest.fixture(scope="module")
def window(app, study, until):
    """One window for all tests here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FORCELAB_SETTINGS", str(study.with_name("settings.ini")))
        with open_window(study, until) as window:
            yield window


@pytest.fixture(scope="module")
def page(window, tongs, until):
    """The workspace with the tongs connected, which they stay."""
    return connect(window, tongs, until)


@pytest.fixture
def connected(window, page, until):
    """The same; afterwards it is as it was before."""
    latency = page.recogniser.latency.value()
    yield page
    if page.controller.recording:
        window.commands["record"].trigger()
        until(lambda: page.controller.phase is CaptureState.READY)
    page.recogniser.latency.setValue(latency)
    choose(page, 0)
    page.scalogram.choose("")
    window.show_workspace("capture")
    until(lambda: not {RECOGNISING, DRAWING} & set(window.jobs.busy))


def choose(page, row):
    page.recogniser.which.setCurrentIndex(row)
    page.recogniser.which.activated.emit(row)


def labelled(page):
    snapshot = page.controller.recognition.track.snapshot
    return snapshot is not None and snapshot.until == snapshot.until


def test_a_recorded_demonstration_is_labelled_while_it_plays(window, until, tmp_path):
    performed, _ = synthetic_set(2)[0]
    other = make_study(tmp_path / "other.forcelab")
    with Project.open(other) as project:
        project.demonstrations.add(performed)
    page = window.capture.workspace
    page.device_list.add(f"replay:{other}?demonstration={performed.name}")
    page.connect_button.click()
    until(lambda: page.controller.phase is CaptureState.READY)
    choose(page, 1)
    until(lambda: labelled(page))
    live = page.controller.recognition
    until(lambda: {s.action for s in live.track.snapshot.segments} >= {"grab", "hold"})
    choose(page, 0)
    page.connect_button.click()
    until(lambda: page.controller.phase is CaptureState.DISCONNECTED)
    page.device_list.rows.clear()


def test_the_stream_is_labelled_and_the_track_is_kept_as_a_prediction(
    window, connected, until, study
):
    page = connected
    assert [page.recogniser.which.itemText(i) for i in range(3)] == [
        "none",
        "tiny",
        "From a file…",
    ]
    assert page.recogniser.nothing.isHidden()
    assert page.recognition.isHidden()
    height = page.live_view.minimumSizeHint().height()
    page.recogniser.latency.setValue(120)
    choose(page, 1)
    until(lambda: labelled(page))
    assert page.recognition.isVisible()
    assert page.live_view.minimumSizeHint().height() > height  # a row for what is predicted
    until(lambda: len(page.controller.recognition.delays) > 5)
    # No label is there sooner than was asked for; when samples came is not known better at first.
    assert np.median(page.controller.recognition.delays) >= 0.12 - 0.04
    window.commands["record"].trigger()
    until(lambda: page.controller.recording)
    assert not page.recogniser.which.isEnabled()
    until(lambda: page.controller.recorder.state().devices[0].samples > 600)
    window.grab()  # draws rows, bars and texts
    text = page.recognition.current_action.accessibleName().removeprefix("Current action: ")
    assert text in ("still", "grab", "hold", "release")
    snapshot = page.controller.recognition.track.snapshot
    assert sum(snapshot.probabilities) == pytest.approx(1.0)
    window.commands["record"].trigger()
    until(lambda: page.controller.phase is CaptureState.READY)
    text = " ".join(sentence for sentence, _ in page.controller.messages)
    assert "Recognised by 'model tiny'" in text
    with Project.open(study) as project:
        (info,) = project.demonstrations.infos()
        (track,) = project.tracks.of(info.id)
        (edit,) = project.tracks.history(info.id, track.author)
        seconds = project.demonstrations.load(info.id).duration
    assert (track.author, edit.kind) == ("model tiny", "predict")
    covered = sum(segment.duration for segment in track.segments)
    assert covered >= 0.9 * seconds
    # It goes on for the eye, and the last recording can still be discarded as a whole.
    until(lambda: labelled(page))
    window.commands["discard_recording"].trigger()
    window.commands["discard_recording"].trigger()
    until(lambda: page.controller.phase is CaptureState.READY)
    with Project.open(study) as project:
        assert project.demonstrations.infos() == ()


def test_a_recogniser_that_learnt_newtons_says_so_of_raw_counts(window, connected, until):
    choose(connected, 1)
    until(lambda: connected.controller.recognition.loaded is not None)
    until(lambda: "learnt it in N" in connected.status.alarms.text())
    choose(connected, 0)
    until(lambda: "learnt it in N" not in connected.status.alarms.text())


def test_without_a_recogniser_or_unseen_nothing_is_computed(window, connected, until):
    page, track = connected, connected.controller.connection.track
    assert RECOGNISING not in window.jobs.busy
    assert track.snapshot is None
    assert DRAWING not in window.jobs.busy
    choose(page, 1)
    page.scalogram.choose("normal 1")
    until(lambda: labelled(page) and page.scalogram.strip is not None)
    window.show_workspace("label")
    until(lambda: DRAWING not in window.jobs.busy)
    until(lambda: track._paused)
    before = track.snapshot
    samples = page.controller.recorder.state().devices[0].samples
    until(lambda: page.controller.recorder.state().devices[0].samples > samples + 200)
    assert track.snapshot is before
    window.commands["record"].trigger()  # what is recorded is recognised, seen or not
    until(lambda: page.controller.recording and track.snapshot is not before)
    until(lambda: labelled(page))
    before = page.scalogram.strip
    window.show_workspace("capture")
    assert page.scalogram.strip is not None  # the last picture, until there is a new one
    until(lambda: page.scalogram.strip is not before)
    choose(page, 0)
    page.scalogram.choose("")
    until(lambda: not {RECOGNISING, DRAWING} & set(window.jobs.busy))
    assert track.snapshot is None
    assert page.scalogram.isHidden()
    assert page.recognition.isHidden()


def test_a_recording_begins_with_a_recogniser_that_was_made_before(
    window, connected, until, monkeypatch
):
    page, track = connected, connected.controller.connection.track
    choose(page, 1)
    until(lambda: labelled(page) and track.without_spare is None)

    def late(_):
        raise AssertionError("made while somebody waits for the recording to begin")

    with monkeypatch.context() as patched:
        patched.setattr(LiveRecognition, "renewed", late)
        window.commands["record"].trigger()
        until(lambda: page.controller.recording)
    assert track.without_spare is not None  # none is made while a recording runs
    window.commands["record"].trigger()
    until(lambda: page.controller.phase is CaptureState.READY)
    until(lambda: track.without_spare is None)
    before = track._spare
    page.recogniser.latency.setValue(page.recogniser.latency.value() + 50)
    until(lambda: track._spare not in (None, before))
    assert track.take_fresh().latency == pytest.approx(before.latency + 0.05)


def test_the_scalogram_grows_with_its_channel_on_the_same_axis(window, connected, until):
    page = connected
    names = [page.scalogram_channel.itemText(i) for i in range(page.scalogram_channel.count())]
    assert names == ["not shown", "tangential 1", "normal 1", "fx1", "fy1", "fz1"]
    page.scalogram_channel.setCurrentIndex(2)
    page.scalogram_channel.activated.emit(2)
    assert page.scalogram.isVisible()
    until(lambda: page.scalogram.strip is not None)
    first = page.scalogram.strip
    until(lambda: page.scalogram.strip.end > first.end + 0.3)
    assert np.isfinite(page.scalogram.strip.values).any()
    page.scalogram.grab()
    page.scalogram.choose("fx1")
    until(lambda: page.scalogram.strip is not None)


def test_a_recogniser_that_does_not_fit_says_so_and_one_from_a_file_does(
    window, connected, recogniser, until, tmp_path, monkeypatch
):
    page = connected
    save_recogniser(trained(("normal 2",)), tmp_path / "other.skops")
    monkeypatch.setattr(
        "PySide6.QtWidgets.QFileDialog.getOpenFileName",
        lambda *_: (str(tmp_path / "other.skops"), ""),
    )
    choose(page, 2)
    until(lambda: "no recognition channel 'normal 2'" in page.recognition.budget_label.text())
    assert page.recogniser.which.currentText() == "other"
    (tmp_path / "other.skops").write_bytes(b"nothing of the kind")
    choose(page, 3)
    until(lambda: "other.skops" in page.recognition.budget_label.text())
    save_recogniser(recogniser, tmp_path / "other.skops")
    choose(page, 3)
    until(lambda: labelled(page))
    assert page.recognition.measurements.text()


def test_a_project_without_a_recogniser_says_how_to_get_one_and_offers_it_once_trained(
    app, tmp_path
):
    from forcelab.gui.launch_options import LaunchOptions
    from forcelab.gui.window import Window

    Project.create(tmp_path / "bare.forcelab").close()
    window = Window("Ann", remembering=False)
    window.show()
    window.begin(LaunchOptions(project=tmp_path / "bare.forcelab", workspace="capture"))
    try:
        choice = window.capture.workspace.recogniser
        assert choice.nothing.isVisible()
        assert "train one in Review" in choice.nothing.text()
        assert not choice.latency.isEnabled()
        window.document.review.set_training(True)  # while one looks
        window.document.project.runs.add_recogniser(
            "tiny", b"tiny", Provenance(settings={}, seed=0, labels=[], versions={})
        )
        window.document.review.set_training(False)
        assert not choice.nothing.isVisible()
        assert choice.which.itemText(1) == "tiny"
    finally:
        window.close()


def test_what_a_latency_leaves_to_be_estimated_is_said(recogniser):
    choice = RecogniserSelection("tiny", None)
    hasty = LoadedRecogniser(choice, recogniser, latency_budget(recogniser, 0.02))
    # 32 samples at 1 kHz take 0.16 s to pass.
    assert "of 5 scales are estimated early" in latency_budget_text(hasty)
    assert "25 Hz ±" in latency_budget_text(hasty)
    patient = LoadedRecogniser(choice, recogniser, latency_budget(recogniser, 0.6))
    assert latency_budget_text(patient) == "600 ms are enough for all 5 scales of the wavelets."


def test_what_a_latency_costs_a_recogniser_that_looks_in_windows_is_said():
    choice = RecogniserSelection("tiny", None)
    items = [LabelledDemonstration(*item) for item in synthetic_set(2, rate=250.0)]
    fast = train(items, preset("fast"))
    slow, hasty = (
        LoadedRecogniser(choice, fast, latency_budget(fast, seconds)) for seconds in (0.3, 0.0)
    )
    sentence = "Windows see 150 ms ahead, the decoder waits for 140 ms more."
    assert latency_budget_text(slow) == sentence
    assert "points of accuracy" in latency_budget_text(hasty)


def test_a_filter_that_contradicts_what_is_likeliest_is_named(window, connected, until):
    page = connected
    choose(page, 1)
    until(lambda: page.controller.recognition.loaded is not None)
    present, recognition = page.recognition.current_action, page.controller.recognition
    actions = recognition.loaded.recogniser.actions
    known = (0.1, 0.85, *[0.0] * (len(actions) - 2))
    assert present.decision_note(actions[0], known) == "as the filters decide"
    assert present.decision_note("", known) == "as the filters decide"
    assert present.decision_note(actions[1], known) == ""
    assert present.decision_note(actions[0], (0.3, 0.45, *known[2:])) == ""  # none is likely
    assert present.decision_note(actions[0], ()) == ""  # of a classifier that tells none
    assert "before the filters" in present.toolTip()


def test_of_long_sentences_the_last_one_is_whole_and_the_others_have_a_line_each(connected):
    page, status = connected, connected.status
    page.resize(1024, 600)
    messages = [f"{which}: " + "the disk is full; " * 20 for which in ("first", "second", "third")]
    for sentence in messages:
        page.controller.add_message(sentence)
    shown = status.messages.text().split("\n")
    assert shown[2] == messages[2]
    wide = status.messages.width()
    for short, sentence in zip(shown[:2], messages[:2], strict=True):
        assert short.startswith(sentence[:20])
        assert status.fontMetrics().horizontalAdvance(short) <= wide
    assert status.messages.toolTip().split("\n") == messages


def lane_axes(view):
    """Those of the lanes that are shown, drawn."""
    view.grab()
    return [trace.axis for trace in view.traces if trace.axis.isVisible()]


def written(view):
    """What stands beside the lanes: a channel's name, then its latest value."""
    return [[line for line, *_ in axis.texts(view.readings)] for axis in lane_axes(view)]


def test_what_a_device_read_before_it_was_unplugged_is_not_shown_as_its_reading(
    connected, tongs, until
):
    names, values = zip(*written(connected.live_view), strict=True)
    assert names == ("fx1", "fy1", "fz1")
    assert "\N{EN DASH}" not in values
    tongs.unplug()
    until(lambda: "unplugged" in connected.controller.state.devices[0].alarms)
    assert [value for _, value in written(connected.live_view)] == ["\N{EN DASH}"] * 3
    tongs.replug()
    until(lambda: "unplugged" not in connected.controller.state.devices[0].alarms)


def test_the_lowest_lane_has_two_numbers_inside_of_it(connected):
    view = connected.live_view
    view.resize(600, view.minimumSizeHint().height())
    axes = lane_axes(view)
    assert len(axes) == 3
    image = QImage(600, 60, QImage.Format.Format_RGB32)
    with QPainter(image) as painter:
        for axis in axes:
            _, _, numbers = axis.generateDrawSpecs(painter)
            assert len(numbers) >= 2
            assert all(box.top() >= 0 and box.bottom() <= axis.lane.height for box, *_ in numbers)


def test_both_time_axes_agree(connected, until):
    page = connected
    page.scalogram.choose("normal 1")
    until(lambda: page.scalogram.strip is not None)
    for view in (page.live_view, page.scalogram):
        view.grab()
    boxes = (page.live_view.traces[0].box, page.scalogram.box)
    ends = [(box.scenePos().x(), box.rect().width(), box.viewRange()[0]) for box in boxes]
    assert ends[0] == ends[1]


def test_live_views_are_copied_from_their_menus(connected, until):
    page = connected
    page.scalogram.choose("normal 1")
    until(lambda: page.scalogram.strip is not None)
    for view in (page.live_view, page.scalogram):
        QGuiApplication.clipboard().clear()
        menu = view.plot_menu()
        menu.actions()[0].trigger()
        assert QGuiApplication.clipboard().image().size().width() >= view.width()


class PaintedFrom(QObject):
    """Where what a widget paints begins at the left."""

    def __init__(self, widget):
        super().__init__()
        self.lefts = []
        widget.installEventFilter(self)

    def eventFilter(self, _, event):  # noqa: N802 - Qt's name
        if event.type() == QEvent.Type.Paint:
            self.lefts.append(event.region().boundingRect().left())
        return False


def test_readings_stay_to_be_read_until_devices_are_asked_again(app, connected):
    view, controller = connected.live_view, connected.controller
    controller._timer.stop()
    for _ in range(10):  # what is drawn anew as a lane has grown
        app.processEvents()
    painted = PaintedFrom(view.viewport())
    for asked, left in ((False, GUTTER), (True, 0), (False, GUTTER)):
        if asked:
            controller.state = controller.recorder.state()
        painted.lefts.clear()
        controller.ticked.emit()
        app.processEvents()
        assert painted.lefts == [left]
    controller._timer.start()


def test_the_labels_are_heard_by_other_programs_while_that_is_asked_for(window, connected, until):
    pylsl = pytest.importorskip("pylsl")
    page = connected
    assert not page.recogniser.send.isEnabled()
    choose(page, 1)
    until(lambda: labelled(page))
    page.recogniser.send.setChecked(True)
    assert settings.flag("capture/send labels")
    found = []
    until(lambda: found.extend(pylsl.resolve_byprop("name", "forcelab", timeout=0.1)) or found)
    inlet = pylsl.StreamInlet(found[0], recover=False)
    inlet.open_stream(5.0)
    heard = []

    def lost():
        try:
            heard.append(inlet.pull_sample(0.0)[0])
        except pylsl.util.LostError:
            return True
        return False

    page.recogniser.send.setChecked(False)
    until(lost)
    assert {action[0] for action in heard if action} <= {"", "still", "grab", "hold", "release"}
    assert not settings.flag("capture/send labels")


def test_what_was_seen_goes_with_the_devices(window, page, until):
    page.scalogram.choose("fx1")
    until(lambda: page.scalogram.strip is not None)
    page.connect_button.click()
    until(lambda: page.controller.phase is CaptureState.DISCONNECTED)
    assert page.scalogram.isHidden()
    until(lambda: DRAWING not in window.jobs.busy)
