"""That something is recorded is said in the whole window, and asked about before it is closed."""

from functools import partial

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QCloseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMessageBox, QTabWidget
from window_helpers import status_messages

from forcelab.capture.journal import read_journal
from forcelab.capture.save import save, unfinished_journals
from forcelab.gui.capture.controller import CaptureState
from forcelab.project import Project


@pytest.fixture
def recording(window, connected, until):
    window.commands["record"].trigger()
    until(lambda: connected.controller.recording)
    # Of less than two samples nothing can be kept.
    until(lambda: connected.controller.recorder.state().devices[0].samples > 20)
    return connected


def tab_text(window):
    return window.findChild(QTabWidget).tabText(2)


def answer(monkeypatch, role):
    """Questions are answered by the button of a role; gives what was asked, two texts each."""
    texts = []

    def execute(box):
        texts.append(box.text())
        texts.append(box.informativeText())
        assert box.textFormat() == Qt.TextFormat.PlainText  # the name of a recording is no markup
        (button,) = (b for b in box.buttons() if box.buttonRole(b) == role)
        button.click()

    monkeypatch.setattr(QMessageBox, "exec", execute)
    return texts


def test_tab_title_and_status_bar_say_what_is_recorded_and_nobody_is_asked_after_it(
    window, recording, until, monkeypatch
):
    assert tab_text(window) == "● Capture"
    assert window.windowTitle().startswith("● recording 'LEGO 01'")
    line = window.capture.indicator
    assert line.isHidden()  # it is seen already
    window.show_workspace("label")
    until(line.isVisible)
    assert line.text().startswith("● Recording 'LEGO 01'")
    line.click()
    assert recording.isVisible()
    assert line.isHidden()
    window.show_workspace("review")
    window.commands["record"].trigger()
    until(lambda: recording.controller.phase is CaptureState.READY)
    until(line.isHidden)
    assert tab_text(window) == "Capture"
    assert "●" not in window.windowTitle()
    texts = answer(monkeypatch, QMessageBox.ButtonRole.RejectRole)
    window.commands["quit"].trigger()
    assert not texts
    assert not window.isVisible()


def test_who_closes_the_window_while_recording_is_asked(window, recording, study, monkeypatch):
    texts = answer(monkeypatch, QMessageBox.ButtonRole.RejectRole)
    window.commands["quit"].trigger()
    assert texts == [
        "'LEGO 01' is being recorded.",
        "If the window is closed, the recording ends and is kept.",
    ]
    assert window.isVisible()
    assert recording.controller.recording
    monkeypatch.setattr(QCloseEvent, "spontaneous", lambda _: True)  # by the window's own button
    window.close()
    assert len(texts) == 4
    assert window.isVisible()
    texts = answer(monkeypatch, QMessageBox.ButtonRole.AcceptRole)
    window.close()
    assert not window.isVisible()
    assert unfinished_journals(study) == ()
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        assert info.name == "LEGO 01"
        assert len(project.demonstrations.load(info.id).times) > 20


def test_who_closes_the_window_on_what_could_not_be_kept_is_told_so(
    window, recording, study, until, monkeypatch
):
    texts = answer(monkeypatch, QMessageBox.ButtonRole.RejectRole)
    away = study.with_suffix(".away")
    study.rename(away)
    until(lambda: recording.controller.state.in_memory > 0)
    window.commands["quit"].trigger()
    assert texts[0] == "'LEGO 01' is being recorded."
    assert "is kept" not in texts[1]
    assert "kB that the disk refuses are in memory: all of it is written elsewhere" in texts[1]
    window.commands["record"].trigger()
    until(lambda: recording.controller.phase is CaptureState.UNSAVED)
    assert "'LEGO 01' is not lost: mend that and press F9" in recording.status.messages.text()
    window.show_workspace("label")
    until(lambda: window.capture.indicator.text() == "● 'LEGO 01' is not kept yet")
    assert window.windowTitle().startswith("● 'LEGO 01' is not kept yet · ")
    window.commands["quit"].trigger()
    assert texts[2] == "'LEGO 01' was recorded and could not be kept."
    assert window.isVisible()
    away.rename(study)
    answer(monkeypatch, QMessageBox.ButtonRole.AcceptRole)
    window.commands["quit"].trigger()
    assert not window.isVisible()
    with Project.open(study) as project:
        assert [info.name for info in project.demonstrations.infos()] == ["LEGO 01"]


def test_who_closes_the_window_on_a_disk_that_stays_away_is_told_where_the_recording_is(
    window, recording, study, until, monkeypatch, tmp_path
):
    elsewhere, warnings = tmp_path / "elsewhere", []
    elsewhere.mkdir()
    monkeypatch.setattr("forcelab.capture.journal.fallback_folders", lambda: (elsewhere,))
    monkeypatch.setattr(QMessageBox, "warning", lambda *what: warnings.append(what[2]))
    answer(monkeypatch, QMessageBox.ButtonRole.AcceptRole)
    away = study.with_suffix(".away")
    study.rename(away)
    until(lambda: recording.controller.state.in_memory > 0)
    window.commands["quit"].trigger()
    assert not window.isVisible()
    (journal,) = elsewhere.iterdir()
    assert f"All of the recording is in '{journal}'" in warnings[0]
    away.rename(study)
    assert save(study, read_journal(journal)).samples > 20


def test_keys_for_what_capture_hides_do_nothing_while_it_is_in_front(window, recording, until):
    document, pressed = window.document, partial(QTest.keyClick, recording.live_view)
    window.commands["record"].trigger()
    until(lambda: recording.controller.phase is CaptureState.READY)
    window.commands["show_recording"].trigger()
    until(lambda: document.demonstration is not None)
    document.editor.paint(0.0, 0.01, "grab")
    window.show_workspace("capture")
    recording.live_view.setFocus()
    messages = status_messages(document)
    pressed(Qt.Key.Key_H, Qt.KeyboardModifier.ShiftModifier)
    pressed(Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert [segment.action for segment in document.editor.segments] == ["grab"]
    sentence = "This acts on the demonstration in view; go to Label or Review."
    assert messages == [(sentence, True)] * 2
    window.show_workspace("label")
    QTest.keyClick(window.label.tracks, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert not document.editor.segments
