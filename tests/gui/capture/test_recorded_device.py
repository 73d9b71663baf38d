"""A recorded demonstration among the devices: chosen with mouse and keys, seen, recorded, kept."""

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from window_helpers import answer_dialog

from forcelab.demonstration import Channel, Demonstration
from forcelab.gui import settings
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.capture.device_list import RecordedDeviceDialog
from forcelab.project import Project

CHANNELS = (Channel("fx1", "N"), Channel("fy1", "N"), Channel("fz1", "N"))
LEFT = Qt.MouseButton.LeftButton
SAMPLES = 120


def add(path, *names, task="pull", begin=0):
    """Add recordings of 0.6 s, whose first channel counts their samples."""
    times = np.arange(SAMPLES) / 200
    with Project.open(path) as project:
        for shift, name in enumerate(names, begin):
            signals = np.column_stack(
                [np.arange(SAMPLES), np.sin(5 * times + shift), np.cos(times)]
            )
            project.demonstrations.add(Demonstration(name, task, times, signals, CHANNELS))


@pytest.fixture
def page(window, study, until):
    add(study, "pull-01", "pull-02")
    window.document.refresh()
    until(lambda: len(window.document.infos) == 2)
    return window.capture.workspace


def click(widget, where=None):
    QTest.mouseClick(widget, LEFT, Qt.KeyboardModifier.NoModifier, where or QPoint())


def open_dialog(page, use):
    """Press the button, and do something with the dialog that it opens."""
    button = page.device_list.recorded_button
    answer_dialog(page, RecordedDeviceDialog, lambda: click(button), use)


def rows(dialog):
    found = [dialog.demonstrations.topLevelItem(i) for i in range(99)]
    return [[row.text(column) for column in range(4)] for row in found if row is not None]


def test_it_is_chosen_seen_live_recorded_and_kept(page, until, study):
    def choose(dialog):
        assert rows(dialog) == [
            ["pull-01", "pull", "0.6 s", "3 at 200 Hz"],
            ["pull-02", "pull", "0.6 s", "3 at 200 Hz"],
        ]
        QTest.keyClicks(dialog.search, "02")
        assert len(rows(dialog)) == 1
        QTest.keyClick(dialog.search, Qt.Key.Key_Return)

    open_dialog(page, choose)
    [name] = page.device_list.devices
    assert name == f"replay:{study}?demonstration=pull-02"
    lines = page.device_list.rows.item(0).text().split("\n")
    assert lines == ["pull-02", "plays as recorded in study.forcelab", "begins again at its end"]

    click(page.connect_button)
    until(lambda: page.controller.phase is CaptureState.READY)
    until(lambda: page.controller.recorder.latest(9.0)[0][2].shape[0] > SAMPLES)  # begun again
    assert page.controller.connection.channels == CHANNELS
    before = page.live_view.grab().toImage()
    until(lambda: page.live_view.grab().toImage() != before)

    page.next_recording.task.setFocus()
    QTest.keyClicks(page.next_recording.task, "again")
    click(page.record_button)
    until(lambda: page.controller.recording)
    until(lambda: page.controller.recorder.state().devices[0].samples > 100)
    click(page.record_button)
    until(lambda: page.controller.phase is CaptureState.READY)
    assert "'again 01' is kept" in page.status.messages.text()
    with Project.open(study) as project:
        [info] = project.demonstrations.infos("again")
        recorded = project.demonstrations.load(info.id)
        counts = recorded.signals[:, 0]
    assert recorded.channels == CHANNELS
    assert set(np.diff(counts)) <= {1.0, 1.0 - SAMPLES}


def test_played_once_the_end_is_told_and_nothing_can_be_recorded(page, until):
    def choose(dialog):
        click(dialog.loop, QPoint(8, dialog.loop.height() // 2))
        click(dialog.add_button)

    open_dialog(page, choose)
    assert page.device_list.devices[0].endswith("?demonstration=pull-01&loop=no")
    assert page.device_list.rows.item(0).text().endswith("stops at its end")
    page.next_recording.task.setCurrentText("again")
    click(page.connect_button)
    until(lambda: "'pull-01' has been played to its end" in page.status.messages.text())
    until(lambda: not page.record_button.isEnabled())


def test_one_of_another_project_can_be_played(page, tmp_path, monkeypatch):
    other, third = tmp_path / "other.forcelab", tmp_path / "third.forcelab"
    for path in (other, third):
        Project.create(path).close()
        add(path, "same", task="a")
        add(path, "same", task="b", begin=1)
    settings.remember_project(other)
    answers = iter(["", str(third)])
    monkeypatch.setattr(
        "PySide6.QtWidgets.QFileDialog.getExistingDirectory", lambda *_: next(answers)
    )

    def choose(dialog):
        texts = [dialog.project.itemText(i) for i in range(dialog.project.count())]
        others = [f"other.forcelab in {tmp_path}", "", "Another project…"]
        assert texts == ["This project (study.forcelab)", *others]
        dialog.project.setFocus()
        QTest.keyClick(dialog.project, Qt.Key.Key_Down)
        dialog.project.activated.emit(dialog.project.currentIndex())
        assert [row[:2] for row in rows(dialog)] == [["same", "a"], ["same", "b"]]
        assert "other.forcelab" in dialog.device
        dialog.project.setCurrentIndex(3)
        dialog.project.activated.emit(3)  # cancelled
        assert "other.forcelab" in dialog.device
        dialog.project.activated.emit(3)
        click(dialog.add_button)

    open_dialog(page, choose)
    with Project.open(third) as project:
        first = project.demonstrations.infos()[0].id  # two have this name
    assert page.device_list.devices == (f"replay:{third}?demonstration={first}",)


def test_where_there_is_nothing_to_play_nothing_can_be_added(window):
    page = window.capture.workspace

    def look(dialog):
        assert rows(dialog) == []
        assert not dialog.add_button.isEnabled()
        assert dialog.device == ""

    open_dialog(page, look)
    assert page.device_list.devices == ()
