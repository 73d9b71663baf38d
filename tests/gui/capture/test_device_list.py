"""The list of devices: what is written is checked, what was added is removed, calibrations kept."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QPalette
from PySide6.QtTest import QTest

from forcelab.capture.discovery import FoundPort
from forcelab.capture.lsl import search_streams
from forcelab.gui import settings, theme
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.figures.text import contrast
from forcelab.project import Project
from forcelab.resources import asset

FILE = asset("calibrations", "3-axis-40N.toml")


@pytest.fixture
def page(window):
    return window.capture.workspace


def write(page, name):
    page.device_list.entry.setText(name)
    QTest.keyClick(page.device_list.entry, Qt.Key.Key_Return)


def test_a_name_that_means_nothing_is_told_at_once_and_not_added(page):
    for name, message in {
        "tongs": "optoforce:PORT",
        "optoforce:/dev/x?speed=3": "speed=3",
        "optoforce:/dev/x?calibration=/nowhere.toml": "nowhere.toml",
        "camera:": "is no camera",
        "camera:abc": "'abc' is no camera",
        "camera:-1": "'-1' is no camera",
    }.items():
        write(page, name)
        assert page.device_list.rows.count() == 0
        assert page.device_list.entry.text() == name
        assert message in page.status.messages.text()
        write(page, "optoforce:/dev/x")
        assert page.device_list.devices == ("optoforce:/dev/x",)
        assert page.status.messages.text() == ""
        page.device_list.rows.clear()


def test_where_nothing_is_found_the_way_without_devices_is_told(page, until):
    until(page.device_list.nothing.isVisible)
    assert "a recorded demonstration plays" in page.device_list.nothing.text()
    assert page.device_list.recorded_button.isVisible()


def test_an_old_failure_is_not_told_beside_a_new_one(page, until):
    for port in ("/dev/one", "/dev/two"):
        page.device_list.rows.clear()
        page.device_list.add(f"optoforce:{port}")
        page.connect_button.click()
        until(lambda: page.controller.phase is CaptureState.DISCONNECTED)
        assert port in page.status.messages.text()
        assert "plug the device in, and press Refresh." in page.status.messages.text()
    assert "/dev/one" not in page.status.messages.text()


def test_delete_and_the_menu_remove_what_was_added(page):
    for name in ("text:/dev/x", "text:/dev/y"):
        page.device_list.add(name)
    rows = page.device_list.rows
    rows.setCurrentRow(0)
    rows.setFocus()
    QTest.keyClick(rows, Qt.Key.Key_Delete)
    assert rows.names() == ["text:/dev/y"]
    rows.setCurrentRow(0)
    [remove] = [action for action in page.device_list.menu().actions() if action.text() == "Remove"]
    remove.trigger()
    assert rows.names() == []
    assert not settings.strings("capture/by hand")


def test_a_device_that_is_plugged_in_gets_a_calibration_and_keeps_it(page, monkeypatch, until):
    port = FoundPort("/dev/ttyACM7", "optoforce", "OptoForce DAQ", None, None, True)
    monkeypatch.setattr("forcelab.capture.discovery.find_ports", lambda: (port,))
    monkeypatch.setattr("PySide6.QtWidgets.QFileDialog.getOpenFileName", lambda *_: (str(FILE), ""))
    sources = page.device_list
    sources.refresh()
    until(lambda: sources.rows.count() == 1)
    sources.rows.setCurrentRow(0)
    assert "not calibrated" in sources.rows.item(0).text()
    sources.calibration_button.click()
    [name] = sources.devices
    assert name == f"optoforce:/dev/ttyACM7?calibration={FILE}"
    assert "not calibrated" not in sources.rows.item(0).text()
    sources.rows.item(0).setText("before")
    sources.refresh()
    until(lambda: "OptoForce DAQ" in sources.rows.item(0).text())
    assert sources.rows.names() == [name]
    assert sources.rows.currentRow() == 0
    QTest.keyClick(sources.rows, Qt.Key.Key_Delete)
    assert sources.rows.names() == [name]
    [_, bare, remove] = sources.menu().actions()
    assert not remove.isEnabled()
    bare.trigger()
    assert sources.devices == ("optoforce:/dev/ttyACM7",)


def test_only_what_is_connected_is_shown_to_be_read_and_counts_are_warned_of(app, connected):
    page = connected
    assert "is not calibrated" in page.status.alarms.text()
    assert "raw counts" in page.status.alarms.text()
    assert page.status.alarms.isVisible()
    rows, ticked = page.device_list.rows, page.device_list.devices
    page.device_list._show_found(((FoundPort("/dev/x", "text", "a scale", None, None, True),), ()))
    shown = [rows.name_of(item) for item in rows.all_items() if not item.isHidden()]
    assert shown == list(ticked)
    assert not rows.isEnabled()
    for choice in ("dark", "light"):
        theme.use_theme(app, choice)
        ink = rows.palette().color(QPalette.ColorRole.Text)
        assert contrast(ink, rows.palette().color(QPalette.ColorRole.Base)) >= 4.5


@pytest.fixture
def stream_ticked_last(settings_of_its_own, monkeypatch):
    pytest.importorskip("pylsl")
    monkeypatch.setattr("forcelab.capture.lsl.SEARCH_SECONDS", 0.2)
    settings.store("capture/ticked", ["lsl:forces", "lsl:cues"])


def test_a_stream_of_the_network_is_found_and_ticked_again_and_recorded(
    stream_ticked_last, page, monkeypatch, until, study
):
    import pylsl

    from tests.capture.lsl_streams import sending

    cues = pylsl.StreamOutlet(pylsl.StreamInfo("cues", "Markers", 1, 0.0, pylsl.cf_string, ""))
    monkeypatch.setattr("forcelab.capture.lsl.search_streams", search_streams)
    devices = page.device_list
    with sending("forces"):
        devices.refresh()
        until(lambda: devices.devices == ("lsl:cues", "lsl:forces"))
        assert "Markers, texts as labels" in devices.rows.item(0).text()
        assert "Force, 2 channels, 500 Hz" in devices.rows.item(1).text()
        page.next_recording.task.setCurrentText("LEGO")
        page.connect_button.click()
        until(lambda: page.controller.phase is CaptureState.READY)
        page.controller.record_or_stop()
        until(lambda: page.controller.recording)
        cues.push_sample(["pull"])
        until(lambda: page.controller.recorder.state().devices[1].samples > 20)
        until(lambda: "lsl:cues · 1 marker" in page.status.facts.text())
        page.controller.zero()
        page.controller.record_or_stop()
        until(lambda: page.controller.phase is CaptureState.READY)
    with Project.open(study) as project:
        [info] = project.demonstrations.infos()
        demonstration = project.demonstrations.load(info.id)
        [track] = project.tracks.of(info.id)
    assert [channel.name for channel in demonstration.channels] == ["fz1", "wave"]
    assert [segment.action for segment in track.segments] == ["pull"]
