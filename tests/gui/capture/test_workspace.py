"""The Capture workspace in the whole window, with virtual devices on real pseudo-terminals."""

from types import SimpleNamespace

import numpy as np
import pytest
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox, QVBoxLayout, QWidget

from forcelab.capture.camera import CameraState
from forcelab.capture.journal import encode_header
from forcelab.capture.recorder import Recorder
from forcelab.capture.save import CAPTURES
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.capture.workspace import CameraView
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import Window
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary


def start_recording(window, page, until, samples=50):
    """Press the key and wait until so many samples are in the recording."""
    window.commands["record"].trigger()
    until(lambda: page.controller.recording)
    until(lambda: page.controller.recorder.state().devices[0].samples > samples)


def keep(window, page, until):
    """Press the key that ends a recording and wait until it is kept."""
    window.commands["record"].trigger()
    until(lambda: page.controller.phase is CaptureState.READY)


def shown_on(button, controller):
    """What is written on a button from now on."""
    texts = []
    controller.changed.connect(lambda: texts.append(button.text().partition("  (")[0]))
    return texts


def test_a_recording_with_a_live_mark_is_in_the_project_without_the_mouse(
    window, connected, until, study
):
    page = connected
    assert page.next_recording.name.placeholderText() == "LEGO 01"
    start_recording(window, page, until, 100)
    assert window.focusWidget() is page.live_view or not window.isActiveWindow()
    QTest.keyPress(page.live_view, Qt.Key.Key_2)
    QTest.keyPress(page.live_view, Qt.Key.Key_X)  # marks nothing
    before = page.controller.recorder.state().devices[0].samples
    until(lambda: page.controller.recorder.state().devices[0].samples > before + 100)
    assert page.controller.marks.track(1e12)[-1].action == "pull"
    QTest.keyRelease(page.live_view, Qt.Key.Key_2)
    keep(window, page, until)
    assert [info.name for info in window.document.infos] == ["LEGO 01"]
    assert "'LEGO 01' is kept" in page.status.messages.text()
    assert page.next_recording.name.placeholderText() == "LEGO 02"
    window.commands["show_recording"].trigger()
    assert window.label.isVisible()
    assert window.document.demonstration.name == "LEGO 01"
    window.show_workspace("capture")
    start_recording(window, page, until)
    texts = shown_on(page.record_button, page.controller)
    window.commands["discard_recording"].trigger()
    until(lambda: page.controller.phase is CaptureState.READY)
    assert texts[0] == "Discarding…"
    assert "Keeping…" not in texts
    assert page.next_recording.name.placeholderText() == "LEGO 02"
    assert not list((study / CAPTURES).iterdir())
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        [track] = project.tracks.of(info.id)
        assert info.task == "LEGO"
        assert track.author == "Ann"
        [segment] = track.segments
        assert segment.action == "pull"
        assert segment.start > 0.05
        assert segment.duration > 0.05


def test_the_last_one_is_discarded_when_asked_for_twice_and_not_once_it_is_labelled(
    window, connected, until, study
):
    page, discard = connected, window.commands["discard_recording"]
    discard.trigger()
    assert "nothing was recorded" in page.status.messages.text()
    start_recording(window, page, until)
    keep(window, page, until)
    assert "Discard 'LEGO 01'" in page.discard_button.text()
    assert page.discard_button.isEnabled()
    [saved] = window.document.infos
    window.document.open_demonstration(saved.id)
    page.discard_button.click()
    assert "Really discard 'LEGO 01'" in page.discard_button.text()
    assert "once more" in page.status.messages.text()
    page.controller.last_recording._timer.timeout.emit()  # its time is over
    page.controller.last_recording._timer.stop()
    page.controller.last_recording.changed.emit()
    assert "Really" not in page.discard_button.text()
    discard.trigger()
    discard.trigger()
    until(lambda: page.controller.phase is CaptureState.READY)
    assert window.document.infos == ()
    assert window.document.demonstration is None
    assert page.next_recording.name.placeholderText() == "LEGO 01"
    assert not page.discard_button.isEnabled()
    assert not list((study / "demonstrations").iterdir())
    start_recording(window, page, until)
    keep(window, page, until)
    with Project.open(study) as project:
        id_ = project.demonstrations.infos()[0].id
        project.tracks.edit(id_, "Ann", (), (Segment(0.0, 0.05, "grab"),), "painted")
    discard.trigger()
    discard.trigger()
    until(lambda: page.controller.phase is CaptureState.READY)
    assert "was labelled since it was recorded; it stays" in page.status.messages.text()
    with Project.open(study) as project:
        assert len(project.demonstrations.infos()) == 1


def test_unplugging_is_an_alarm_and_what_could_not_be_kept_can_be_kept_later(
    window, connected, tongs, until
):
    page = connected
    page.next_recording.countdown.setCurrentIndex(1)
    window.commands["record"].trigger()
    assert page.controller.phase is CaptureState.COUNTDOWN
    assert page.controller.seconds_left == 3
    window.commands["discard_recording"].trigger()
    assert page.controller.phase is CaptureState.READY
    page.next_recording.countdown.setCurrentIndex(0)
    start_recording(window, page, until, 10)
    tongs.unplug()
    until(lambda: "is unplugged" in page.status.alarms.text())
    assert page.status.alarms.isVisible()
    tongs.replug()
    until(lambda: "is unplugged" not in page.status.alarms.text())
    window.document.project.path.rename(window.document.project.path.with_suffix(".away"))
    window.commands["record"].trigger()
    until(lambda: page.controller.phase is CaptureState.UNSAVED)
    assert page.record_button.isEnabled()
    window.document.project.path.with_suffix(".away").rename(window.document.project.path)
    keep(window, page, until)
    assert len(window.document.infos) == 1


def test_esc_ends_a_countdown_and_forgets_the_mark_that_a_tap_began(
    window, connected, until, study
):
    page, cancel = connected, window.commands["cancel"]
    assert "Esc forgets it" in page.legend.text()
    page.next_recording.countdown.setCurrentIndex(1)
    window.commands["record"].trigger()
    cancel.trigger()
    assert page.controller.phase is CaptureState.READY
    page.next_recording.countdown.setCurrentIndex(0)
    window.document.set_action("grab")  # the brush of another workspace
    start_recording(window, page, until, 60)
    QTest.keyClick(page.live_view, Qt.Key.Key_2)
    assert page.held_keys.tapped_action == "pull"
    cancel.trigger()
    assert page.held_keys.tapped_action is None
    assert page.controller.marks.track(1e12) == []
    assert "'pull' is forgotten" in page.status.messages.text()
    assert page.controller.recording
    assert window.document.action == "grab"
    cancel.trigger()
    assert page.controller.recording, "Esc ends no recording"
    keep(window, page, until)
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        assert project.tracks.of(info.id) == ()


def test_record_can_be_pressed_in_a_window_that_is_too_low_for_all_fields(window, connected, until):
    page = connected
    camera = SimpleNamespace(
        latest=lambda: (1.0, np.zeros((48, 64, 3), np.uint8)),
        state=lambda: CameraState("camera 0", 1, 0, 30.0, ()),
        remarks=lambda: (),
        close=lambda: None,
    )
    page.controller.recorder.cameras.append(camera)
    until(page.camera_view.isVisible)
    window.resize(960, 540)
    until(lambda: window.height() == 540)
    for button in (page.record_button, page.discard_button):
        assert button.mapTo(window, button.rect().bottomLeft()).y() < 540
        assert not button.visibleRegion().isEmpty()
    for field in (
        page.next_recording.task,
        page.next_recording.name,
        page.next_recording.countdown,
    ):
        assert field.height() >= field.sizeHint().height(), "squeezed"


@pytest.mark.parametrize(("answer", "task"), [(0, "L e g o"), (1, "L E G O")])
def test_a_task_that_is_nearly_one_there_is_is_asked_about_once(window, monkeypatch, answer, task):
    page, questions = window.capture.workspace, []
    window.document.project.actions.set_vocabulary("L e g o", Vocabulary())

    def press(box):
        questions.append(box.text())
        page.next_recording.task.lineEdit().editingFinished.emit()  # it takes the keyboard
        box.buttons()[answer].click()

    monkeypatch.setattr(QMessageBox, "exec", press)
    page.next_recording.task.setCurrentText(" L E G O ")
    page.next_recording.task.lineEdit().editingFinished.emit()
    assert questions == ["'L e g o' already exists."]
    assert (page.controller.task, page.next_recording.task.currentText()) == (task, task)
    page.next_recording.task.lineEdit().editingFinished.emit()
    assert len(questions) == 1


def test_what_the_disk_refuses_is_an_alarm_and_is_kept(window, connected, until, study):
    page = connected
    start_recording(window, page, until, 20)
    away = study.with_suffix(".away")
    study.rename(away)
    until(lambda: "kept in memory" in page.status.alarms.text())
    assert "goes on in memory" in page.status.messages.text()
    before = page.controller.recorder.state().devices[0].samples
    until(lambda: page.controller.recorder.state().devices[0].samples > before + 200)
    away.rename(study)
    until(lambda: "kept in memory" not in page.status.alarms.text())
    assert "can be written again" in page.status.messages.text()
    keep(window, page, until)
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        d = project.demonstrations.load(info.id)
        assert len(d.times) > before + 200
        assert d.gaps == ()


def test_a_window_that_is_closed_while_connecting_leaves_nothing_open(window, tongs):
    page = window.capture.workspace
    page.device_list.add(f"optoforce:{tongs.port}")
    page.connect_button.click()
    assert page.controller.phase is CaptureState.CONNECTING
    window.close()  # that no thread is left is looked at after every test
    assert not page.controller.connected


def test_keys_are_no_text_once_the_devices_are_connected(window, tongs, until):
    page = window.capture.workspace
    page.device_list.add(f"optoforce:{tongs.port}")
    page.next_recording.task.setCurrentText("LEGO")
    page.connect_button.setFocus()
    page.connect_button.click()
    until(lambda: page.controller.phase is CaptureState.READY)
    QTest.keyClick(window.focusWidget(), Qt.Key.Key_2)
    assert page.next_recording.task.currentText() == "LEGO"


def test_a_project_that_is_left_while_recording_gets_the_recording(
    window, connected, until, study, tmp_path
):
    Project.create(tmp_path / "other.forcelab").close()
    start_recording(window, connected, until)
    window.opening.open(tmp_path / "other.forcelab")
    until(lambda: connected.controller.phase is CaptureState.DISCONNECTED)
    assert window.document.infos == ()
    with Project.open(study) as project:
        assert len(project.demonstrations.infos()) == 1


def test_what_cannot_be_opened_is_one_sentence_and_can_be_tried_again(window, until, tmp_path):
    page = window.capture.workspace
    window.commands["record"].trigger()
    assert window.statusBar().currentMessage() == "Connect devices before recording."
    page.connect_button.click()
    assert "Select a device" in page.status.messages.text()
    page.device_list.add(f"optoforce:{tmp_path / 'none'}")
    page.connect_button.click()
    until(lambda: page.controller.phase is CaptureState.DISCONNECTED)
    assert not window.capture.workspace.record_button.isEnabled()
    assert str(tmp_path / "none") in page.status.messages.text()
    assert page.connect_button.isEnabled()


def test_an_unfinished_recording_is_offered_and_recovered(app, study, tongs, until):
    from tests.capture.helpers import FakeDevice, eventually

    with Recorder(study, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        eventually(lambda: recorder.state().devices[0].samples > 100)
    (study / CAPTURES / "none.journal").write_bytes(encode_header({"name": "none"}))
    window = Window("Ann", remembering=False)
    window.show()
    window.begin(LaunchOptions(project=study, workspace="label"))
    assert "2 recordings cut off by a crash" in window.statusBar().currentMessage()
    window.show_workspace("capture")
    page = window.capture.workspace
    try:
        until(page.recover_button.isVisible)
        texts = shown_on(page.record_button, page.controller)
        page.recover_button.click()
        until(lambda: page.controller.phase is CaptureState.DISCONNECTED)
        assert texts[0] == "Recovering…"
        assert not page.recover_button.isVisible()
        assert [info.name for info in window.document.infos] == ["LEGO 01"]
    finally:
        window.close()


def test_long_names_of_tasks_and_actions_are_cut_where_that_is_seen(window, until):
    page, long = window.capture.workspace, "slip_transition_of_the_pen_against_the_paper_" * 3
    window.document.project.actions.set_vocabulary(long, Vocabulary().with_actions("grab", long))
    page.next_recording.list_tasks()
    page.next_recording.task.setCurrentText(long)
    page.next_recording.take_task()
    assert page.next_recording.task.lineEdit().cursorPosition() == 0  # its beginning is seen
    assert long in page.next_recording.task.toolTip()
    for width in (960, 1500):
        window.resize(width, 540)
        until(lambda: page.legend.width() > 0)
        words = page.legend.text().split(" ")
        metrics = page.legend.fontMetrics()
        assert max(map(metrics.horizontalAdvance, words)) <= page.legend.width()
        assert "…" in page.legend.text()
        assert long in page.legend.toolTip()


def test_what_is_switched_off_during_a_recording_says_why(window, connected, until, hovered):
    page = connected
    form = page.next_recording
    assert not page.device_list.rows.isEnabled()
    assert hovered(page.device_list) == "Disconnect to choose other devices."
    for field in (form.task, form.name, form.countdown, page.recogniser.which):
        assert field.isEnabled()
    assert hovered(page.recogniser.latency) == "Choose a recogniser first."
    start_recording(window, page, until)
    for field in (form.task, form.name, form.countdown, page.recogniser.which):
        assert not field.isEnabled()
        assert hovered(field) == "End the recording first."
    window.commands["record"].trigger()
    assert page.controller.phase is CaptureState.SAVING
    for control in (form.task, page.record_button, page.discard_button, page.connect_button):
        assert hovered(control) == "Wait until this is done."
    until(lambda: page.controller.phase is CaptureState.READY)


def test_nothing_can_be_recorded_while_every_device_is_unplugged(
    window, connected, tongs, until, hovered
):
    page = connected
    assert page.record_button.isEnabled()
    tongs.unplug()
    until(lambda: not page.record_button.isEnabled())
    assert "No device is plugged in" in hovered(page.record_button)
    assert page.controller.obstacle
    page.controller.record_or_stop()
    assert page.controller.phase is CaptureState.READY
    assert "No device is plugged in" in page.controller.messages[-1][0]
    tongs.replug()
    until(page.record_button.isEnabled)
    assert not hovered(page.record_button)


class Filming(QObject):
    """What a picture asks of a controller."""

    ticked, changed = Signal(), Signal()
    alarms = ()

    recorder = SimpleNamespace(
        cameras=[SimpleNamespace(latest=lambda: (1.0, np.full((48, 64, 3), 200, np.uint8)))]
    )

    @property
    def state(self):
        return SimpleNamespace(cameras=(SimpleNamespace(alarms=self.alarms),))


@pytest.fixture
def filming(app):
    controller, room = Filming(), QWidget()
    picture = CameraView(controller)
    QVBoxLayout(room).addWidget(picture)
    room.resize(200, 160)
    room.show()
    controller.ticked.emit()
    yield controller, picture
    room.close()


def middle(picture):
    image = picture.grab().toImage()
    return image.pixelColor(image.width() // 2, image.height() // 5)


def test_a_picture_that_comes_no_more_is_veiled_until_it_comes_again(filming):
    controller, picture = filming
    live = middle(picture)
    controller.alarms = ("no picture",)
    controller.ticked.emit()
    assert middle(picture) != live
    controller.alarms = ("not written",)  # it is seen all the same
    controller.ticked.emit()
    assert middle(picture) == live
