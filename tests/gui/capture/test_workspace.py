"""The Capture workspace in the whole window, with virtual devices on real pseudo-terminals."""

import errno
import sys
from subprocess import run

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox

from forcelab.capture.journal import header_bytes
from forcelab.capture.recorder import Recorder
from forcelab.capture.save import CAPTURES, unfinished
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.launch_options import LaunchOptions
from forcelab.gui.window import Window
from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.vocabulary import Vocabulary


def recorded(window, page, until, samples=150):
    """Press the key and wait until so many samples are in the recording."""
    window.commands["record"].trigger()
    until(lambda: page.session.recording)
    until(lambda: page.session._recorder.state().devices[0].samples > samples)


def keep(window, page, until):
    """Press the key that ends a recording and wait until it is kept."""
    window.commands["record"].trigger()
    until(lambda: page.session.phase is CaptureState.READY)


def shown_on(button, session):
    """What is written on a button from now on."""
    said = []
    session.changed.connect(lambda: said.append(button.text().partition("  (")[0]))
    return said


def test_a_recording_with_a_live_mark_is_in_the_project_without_the_mouse(
    window, connected, until, study
):
    page = connected
    assert page.fields.name.placeholderText() == "LEGO 01"
    recorded(window, page, until, 100)
    assert window.focusWidget() is page.live or not window.isActiveWindow()
    QTest.keyPress(page.live, Qt.Key.Key_2)
    QTest.keyPress(page.live, Qt.Key.Key_X)  # marks nothing
    before = page.session._recorder.state().devices[0].samples
    until(lambda: page.session._recorder.state().devices[0].samples > before + 100)
    assert page.session.marks.track(1e12)[-1].action == "pull"
    QTest.keyRelease(page.live, Qt.Key.Key_2)
    keep(window, page, until)
    assert [info.name for info in window.document.infos] == ["LEGO 01"]
    assert "'LEGO 01' is kept" in page.standing.sentences.text()
    assert page.fields.name.placeholderText() == "LEGO 02"
    window.commands["show_recording"].trigger()
    assert window.label.isVisible()
    assert window.document.demonstration.name == "LEGO 01"
    window.show_workspace("capture")
    recorded(window, page, until)
    said = shown_on(page.record_button, page.session)
    window.commands["discard_recording"].trigger()
    until(lambda: page.session.phase is CaptureState.READY)
    assert said[0] == "Discarding…"
    assert "Keeping…" not in said
    assert page.fields.name.placeholderText() == "LEGO 02"
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
    assert "nothing was recorded" in page.standing.sentences.text()
    recorded(window, page, until)
    keep(window, page, until)
    assert "Discard 'LEGO 01'" in page.discard_button.text()
    assert page.discard_button.isEnabled()
    [kept] = window.document.infos
    window.document.open_demonstration(kept.id)
    page.discard_button.click()
    assert "Really discard 'LEGO 01'" in page.discard_button.text()
    assert "once more" in page.standing.sentences.text()
    page.session.last._patience.timeout.emit()  # its time is over
    page.session.last._patience.stop()
    page.session.last.changed.emit()
    assert "Really" not in page.discard_button.text()
    discard.trigger()
    discard.trigger()
    until(lambda: page.session.phase is CaptureState.READY)
    assert window.document.infos == ()
    assert window.document.demonstration is None
    assert page.fields.name.placeholderText() == "LEGO 01"
    assert not page.discard_button.isEnabled()
    assert not list((study / "demonstrations").iterdir())
    recorded(window, page, until)
    keep(window, page, until)
    with Project.open(study) as project:
        id_ = project.demonstrations.infos()[0].id
        project.tracks.edit(id_, "Ann", (), (Segment(0.0, 0.05, "grab"),), "painted")
    discard.trigger()
    discard.trigger()
    until(lambda: page.session.phase is CaptureState.READY)
    assert "was labelled since it was recorded; it stays" in page.standing.sentences.text()
    with Project.open(study) as project:
        assert len(project.demonstrations.infos()) == 1


def test_unplugging_is_an_alarm_and_what_could_not_be_kept_can_be_kept_later(
    window, connected, tongs, until
):
    page = connected
    page.fields.countdown.setCurrentIndex(1)
    window.commands["record"].trigger()
    assert page.session.phase is CaptureState.COUNTING
    assert page.session.left == 3
    window.commands["discard_recording"].trigger()
    assert page.session.phase is CaptureState.READY
    page.fields.countdown.setCurrentIndex(0)
    recorded(window, page, until, 10)
    tongs.unplug()
    until(lambda: "is unplugged" in page.standing.alarms.text())
    assert page.standing.alarms.isVisible()
    tongs.replug()
    until(lambda: "is unplugged" not in page.standing.alarms.text())
    window.document.project.path.rename(window.document.project.path.with_suffix(".away"))
    window.commands["record"].trigger()
    until(lambda: page.session.phase is CaptureState.STUCK)
    assert page.record_button.isEnabled()
    window.document.project.path.with_suffix(".away").rename(window.document.project.path)
    keep(window, page, until)
    assert len(window.document.infos) == 1


def test_esc_ends_a_countdown_and_forgets_the_mark_that_a_tap_began(
    window, connected, until, study
):
    page, cancel = connected, window.commands["cancel"]
    assert "Esc forgets it" in page.legend.text()
    page.fields.countdown.setCurrentIndex(1)
    window.commands["record"].trigger()
    cancel.trigger()
    assert page.session.phase is CaptureState.READY
    page.fields.countdown.setCurrentIndex(0)
    window.document.set_action("grab")  # the brush of another workspace
    recorded(window, page, until, 60)
    QTest.keyClick(page.live, Qt.Key.Key_2)
    assert page.held.begun == "pull"
    cancel.trigger()
    assert page.held.begun is None
    assert page.session.marks.track(1e12) == []
    assert "'pull' is forgotten" in page.standing.sentences.text()
    assert page.session.recording
    assert window.document.action == "grab"
    cancel.trigger()
    assert page.session.recording, "Esc ends no recording"
    keep(window, page, until)
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        assert project.tracks.of(info.id) == ()


def test_record_can_be_pressed_in_a_window_that_is_too_low_for_all_fields(
    window, connected, until, monkeypatch
):
    page = connected
    frame = 1.0, np.zeros((48, 64, 3), np.uint8)
    monkeypatch.setattr(page.session, "frame", lambda: frame)
    until(page.picture.isVisible)
    window.resize(960, 540)
    until(lambda: window.height() == 540)
    for button in (page.record_button, page.discard_button):
        assert button.mapTo(window, button.rect().bottomLeft()).y() < 540
        assert not button.visibleRegion().isEmpty()
    for field in (page.fields.task, page.fields.name, page.fields.countdown):
        assert field.height() >= field.sizeHint().height(), "squeezed"


@pytest.mark.parametrize(("answer", "task"), [(0, "L e g o"), (1, "L E G O")])
def test_a_task_that_is_nearly_one_there_is_is_asked_about_once(window, monkeypatch, answer, task):
    page, asked = window.capture.workspace, []
    window.document.project.actions.set_vocabulary("L e g o", Vocabulary())

    def press(box):
        asked.append(box.text())
        page.fields.task.lineEdit().editingFinished.emit()  # the question takes the keyboard
        box.buttons()[answer].click()

    monkeypatch.setattr(QMessageBox, "exec", press)
    page.fields.task.setCurrentText(" L E G O ")
    page.fields.task.lineEdit().editingFinished.emit()
    assert asked == ["'L e g o' already exists."]
    assert (page.session.task, page.fields.task.currentText()) == (task, task)
    page.fields.task.lineEdit().editingFinished.emit()
    assert len(asked) == 1


@pytest.mark.parametrize("trouble", ["away", "full"])
def test_what_the_disk_refuses_is_an_alarm_and_is_kept(window, connected, until, study, trouble):
    page = connected
    recorded(window, page, until, 20)
    away = study.with_suffix(".away")
    file = page.session._recorder._journal._file

    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    if trouble == "away":
        study.rename(away)
    else:
        file.write = full
    until(lambda: "kept in memory" in page.standing.alarms.text())
    assert "goes on in memory" in page.standing.sentences.text()
    before = page.session._recorder.state().devices[0].samples
    until(lambda: page.session._recorder.state().devices[0].samples > before + 200)
    if trouble == "away":
        away.rename(study)
    else:
        del file.write
    until(lambda: "kept in memory" not in page.standing.alarms.text())
    assert "can be written again" in page.standing.sentences.text()
    keep(window, page, until)
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        d = project.demonstrations.load(info.id)
        assert len(d.times) > before + 200
        assert d.gaps == ()


def test_a_window_that_is_closed_while_recording_keeps_the_recording(
    window, connected, until, study
):
    recorded(window, connected, until)
    window.close()
    assert unfinished(study) == ()
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        assert len(project.demonstrations.load(info.id).times) > 100


def test_a_window_that_is_closed_while_connecting_leaves_nothing_open(window, tongs):
    page = window.capture.workspace
    page.sources.add(f"optoforce:{tongs.port}")
    page.connect_button.click()
    assert page.session.phase is CaptureState.CONNECTING
    window.close()  # that no thread is left is looked at after every test
    assert not page.session.connected


def test_keys_are_no_text_once_the_devices_are_connected(window, tongs, until):
    page = window.capture.workspace
    page.sources.add(f"optoforce:{tongs.port}")
    page.fields.task.setCurrentText("LEGO")
    page.connect_button.setFocus()
    page.connect_button.click()
    until(lambda: page.session.phase is CaptureState.READY)
    QTest.keyClick(window.focusWidget(), Qt.Key.Key_2)
    assert page.fields.task.currentText() == "LEGO"


def test_a_project_that_is_left_while_recording_gets_the_recording(
    window, connected, until, study, tmp_path
):
    Project.create(tmp_path / "other.forcelab").close()
    recorded(window, connected, until)
    window.opening.open(tmp_path / "other.forcelab")
    until(lambda: connected.session.phase is CaptureState.APART)
    assert window.document.infos == ()
    with Project.open(study) as project:
        assert len(project.demonstrations.infos()) == 1


def test_what_cannot_be_opened_is_one_sentence_and_can_be_tried_again(window, until, tmp_path):
    page = window.capture.workspace
    window.commands["record"].trigger()
    assert "Connect the devices" in page.standing.sentences.text()
    page.connect_button.click()
    assert "Select a device" in page.standing.sentences.text()
    page.sources.add(f"optoforce:{tmp_path / 'none'}")
    page.connect_button.click()
    until(lambda: page.session.phase is CaptureState.APART)
    assert not window.capture.workspace.record_button.isEnabled()
    assert str(tmp_path / "none") in page.standing.sentences.text()
    assert page.connect_button.isEnabled()


def test_an_unfinished_recording_is_offered_and_recovered(app, study, tongs, until):
    from fake_devices import FakeDevice, eventually

    with Recorder(study, [FakeDevice()]) as recorder:
        recorder.start("LEGO")
        eventually(lambda: recorder.state().devices[0].samples > 100)
    (study / CAPTURES / "none.journal").write_bytes(header_bytes({"name": "none"}))
    window = Window("Ann", remembering=False)
    window.show()
    window.begin(LaunchOptions(project=study, workspace="label"))
    assert "2 recordings cut off by a crash" in window.statusBar().currentMessage()
    window.show_workspace("capture")
    page = window.capture.workspace
    try:
        until(page.recover_button.isVisible)
        said = shown_on(page.record_button, page.session)
        page.recover_button.click()
        until(lambda: page.session.phase is CaptureState.APART)
        assert said[0] == "Recovering…"
        assert not page.recover_button.isVisible()
        assert [info.name for info in window.document.infos] == ["LEGO 01"]
    finally:
        window.close()


def test_the_tab_loads_no_driver_before_it_is_shown():
    script = (
        "import sys, forcelab.gui.capture.tab;"
        "print(*{'serial', 'cv2', 'forcelab.capture.recorder'} & set(sys.modules))"
    )
    done = run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not done.stdout.split()


def test_long_names_of_tasks_and_actions_are_cut_where_that_is_seen(window, until):
    page, long = window.capture.workspace, "slip_transition_of_the_pen_against_the_paper_" * 3
    window.document.project.actions.set_vocabulary(long, Vocabulary().with_actions("grab", long))
    page.fields.list_tasks()
    page.fields.task.setCurrentText(long)
    page.fields.take_task()
    assert page.fields.task.lineEdit().cursorPosition() == 0  # its beginning is seen
    assert long in page.fields.task.toolTip()
    for width in (960, 1500):
        window.resize(width, 540)
        until(lambda: page.legend.width() > 0)
        words = page.legend.text().split(" ")
        metrics = page.legend.fontMetrics()
        assert max(map(metrics.horizontalAdvance, words)) <= page.legend.width()
        assert "…" in page.legend.text()
        assert long in page.legend.toolTip()


def test_nothing_can_be_recorded_while_every_device_is_unplugged(window, connected, tongs, until):
    page = connected
    assert page.record_button.isEnabled()
    tongs.unplug()
    until(lambda: not page.record_button.isEnabled())
    assert "No device is plugged in" in page.record_button.toolTip()
    assert page.session.obstacle
    page.session.record_or_stop()
    assert page.session.phase is CaptureState.READY
    assert "No device is plugged in" in page.session.sentences[-1][0]
    tongs.replug()
    until(page.record_button.isEnabled)
    assert not page.record_button.toolTip()
