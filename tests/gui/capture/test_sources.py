"""The list of devices: what is written is checked, what was added is removed, calibrations kept."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QPalette
from PySide6.QtTest import QTest

from forcelab.capture.discovery import FoundPort
from forcelab.gui import settings, theme
from forcelab.gui.capture.controller import CaptureState
from forcelab.gui.figures.text import contrast
from forcelab.resources import asset

FILE = asset("calibrations", "3-axis-40N.toml")


@pytest.fixture
def page(window):
    return window.capture.workspace


def write(page, name):
    page.sources.entry.setText(name)
    QTest.keyClick(page.sources.entry, Qt.Key.Key_Return)


def test_a_name_that_means_nothing_is_told_at_once_and_not_added(page):
    for name, said in {
        "tongs": "optoforce:PORT",
        "optoforce:/dev/x?speed=3": "speed=3",
        "optoforce:/dev/x?calibration=/nowhere.toml": "nowhere.toml",
        "camera:": "is no camera",
        "camera:abc": "'abc' is no camera",
        "camera:-1": "'-1' is no camera",
    }.items():
        write(page, name)
        assert page.sources.rows.count() == 0
        assert page.sources.entry.text() == name
        assert said in page.standing.sentences.text()
        write(page, "optoforce:/dev/x")
        assert page.sources.devices == ("optoforce:/dev/x",)
        assert page.standing.sentences.text() == ""
        page.sources.rows.clear()


def test_where_nothing_is_found_the_way_without_devices_is_told(page, until):
    until(page.sources.nothing.isVisible)
    assert "'forcelab replay'" in page.sources.nothing.text()


def test_an_old_failure_is_not_told_beside_a_new_one(page, until):
    for port in ("/dev/one", "/dev/two"):
        page.sources.rows.clear()
        page.sources.add(f"optoforce:{port}")
        page.connect_button.click()
        until(lambda: page.session.phase is CaptureState.APART)
        assert port in page.standing.sentences.text()
        assert "plug the device in, and press Look again." in page.standing.sentences.text()
    assert "/dev/one" not in page.standing.sentences.text()


def test_delete_and_the_menu_remove_what_was_added(page):
    for name in ("text:/dev/x", "text:/dev/y"):
        page.sources.add(name)
    rows = page.sources.rows
    rows.setCurrentRow(0)
    rows.setFocus()
    QTest.keyClick(rows, Qt.Key.Key_Delete)
    assert rows.names() == ["text:/dev/y"]
    rows.setCurrentRow(0)
    [remove] = [one for one in page.sources.menu().actions() if one.text() == "Remove"]
    remove.trigger()
    assert rows.names() == []
    assert not settings.strings("capture/by hand")


def test_a_device_that_is_plugged_in_gets_a_calibration_and_keeps_it(page, monkeypatch, until):
    port = FoundPort("/dev/ttyACM7", "optoforce", "OptoForce DAQ", None, None, True)
    monkeypatch.setattr("forcelab.capture.discovery.find_ports", lambda: (port,))
    monkeypatch.setattr("PySide6.QtWidgets.QFileDialog.getOpenFileName", lambda *_: (str(FILE), ""))
    sources = page.sources
    sources.look()
    until(lambda: sources.rows.count() == 1)
    sources.rows.setCurrentRow(0)
    assert "not calibrated" in sources.rows.item(0).text()
    sources.calibration_button.click()
    [name] = sources.devices
    assert name == f"optoforce:/dev/ttyACM7?calibration={FILE}"
    assert "not calibrated" not in sources.rows.item(0).text()
    sources.rows.item(0).setText("before")
    sources.look()
    until(lambda: "OptoForce DAQ" in sources.rows.item(0).text())
    assert sources.rows.names() == [name]
    assert sources.rows.currentRow() == 0
    QTest.keyClick(sources.rows, Qt.Key.Key_Delete)
    assert sources.rows.names() == [name]
    [_, bare, remove] = sources.menu().actions()
    assert not remove.isEnabled()
    bare.trigger()
    assert sources.devices == ("optoforce:/dev/ttyACM7",)


def test_counts_are_warned_of_as_long_as_the_device_is_connected(connected):
    assert "is not calibrated" in connected.standing.alarms.text()
    assert "raw counts" in connected.standing.alarms.text()
    assert connected.standing.alarms.isVisible()


def test_the_names_of_connected_devices_can_be_read(app, connected):
    rows = connected.sources.rows
    assert not rows.isEnabled()
    for choice in ("dark", "light"):
        theme.use_theme(app, choice)
        ink = rows.palette().color(QPalette.ColorRole.Text)
        assert contrast(ink, rows.palette().color(QPalette.ColorRole.Base)) >= 4.5


def test_what_is_found_after_connecting_shows_only_what_is_connected(connected):
    page = connected
    ticked = page.sources.devices
    page.sources._list(((FoundPort("/dev/x", "text", "a scale", None, None, True),), ()))
    rows = page.sources.rows
    shown = [rows.said(item) for item in rows.items_here() if not item.isHidden()]
    assert shown == list(ticked)
