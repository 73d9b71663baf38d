"""What the program says of itself, and its manual."""

import re

import PySide6
import pytest
from PySide6.QtCore import QUrl, qVersion
from PySide6.QtWidgets import QApplication, QLabel
from window_helpers import status_messages

from forcelab.gui import dialogs, settings
from forcelab.gui import help as help_module
from forcelab.gui.document import Document
from forcelab.gui.exception_hook import log_file
from forcelab.gui.help import AboutDialog, ManualDialog
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


def test_the_manual_is_the_installed_one_without_pictures_that_are_not(app):
    shown = ManualDialog(help_module.manual())
    text = shown.pages.toPlainText()
    assert text.startswith("forcelab\n")
    assert "Ctrl+" in text
    assert "\N{OBJECT REPLACEMENT CHARACTER}" not in text
    assert not re.findall(r"\]\((?!#|http).*?\)", help_module.manual())  # files that are not there
    assert "](#" in help_module.manual()
    shown.deleteLater()


def test_a_link_within_the_manual_leads_to_its_heading(app):
    shown = ManualDialog("[there](#what-it-is)\n\n" + "Words.\n\n" * 200 + "## What (it) is\n")
    shown.resize(400, 300)
    shown.show()
    bar = shown.pages.verticalScrollBar()
    assert bar.value() == 0
    shown.pages.setSource(QUrl("#what-it-is"))  # as a click does
    assert bar.value() > bar.maximum() / 2
    assert shown.pages.toPlainText().startswith("there")
    shown.close()
    shown.deleteLater()


def test_wide_output_is_broken_and_tables_stand_apart(app):
    table = "| a | b |\n|---|---|\n| c | d |\n\n"
    shown = ManualDialog(f"```\n{'wide ' * 90}\n```\n\n{2 * table}")
    shown.resize(400, 300)
    shown.show()
    assert shown.pages.horizontalScrollBar().maximum() == 0
    document = shown.pages.document()
    layout = document.documentLayout()
    upper, lower = document.rootFrame().childFrames()[-2:]
    above = layout.blockBoundingRect(upper.lastCursorPosition().block())
    below = layout.blockBoundingRect(lower.firstCursorPosition().block())
    assert below.top() - above.bottom() > below.height()
    shown.close()
    shown.deleteLater()


def test_where_no_manual_is_installed_it_is_said(app, monkeypatch):
    monkeypatch.setattr(help_module, "manual", lambda: "")
    document = Document("Ada")
    messages = status_messages(document)
    dialogs.show_manual(document, None)
    assert messages == [("The user guide is not installed here.", True)]
