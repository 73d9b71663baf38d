"""What the program says of itself."""

import PySide6
import pytest
from PySide6.QtCore import qVersion
from PySide6.QtWidgets import QApplication, QLabel

from forcelab.gui import settings
from forcelab.gui.exception_hook import log_file
from forcelab.gui.help import AboutDialog
from forcelab.resources import versions
from forcelab.version import full_version


@pytest.fixture
def dialog(app):
    created = AboutDialog()
    yield created
    created.close()
    created.deleteLater()


def test_it_tells_versions_and_where_settings_and_log_lie(dialog):
    messages = {label.text() for label in dialog.findChildren(QLabel)}
    assert f"forcelab {full_version()}" in messages
    known = versions()
    expected = {known["python"], known["numpy"], PySide6.__version__, qVersion(), str(log_file())}
    assert expected | {settings.settings().fileName()} <= messages


def test_all_of_it_can_be_copied_for_a_report(dialog):
    dialog.copy_button.click()
    copied = QApplication.clipboard().text().splitlines()
    assert f"forcelab: {full_version()}" in copied
    assert f"log: {log_file()}" in copied
