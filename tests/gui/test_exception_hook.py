import logging
import sys
import threading
from pathlib import Path

import pytest
import shiboken6
from PySide6.QtCore import QTimer, qWarning
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication, QLabel, QPlainTextEdit, QPushButton, QWidget

from forcelab.errors import InputError
from forcelab.gui import exception_hook
from forcelab.gui.exception_hook import FaultDialog
from forcelab.gui.label.picture_view import PictureView


@pytest.fixture
def messages():
    return []


@pytest.fixture
def watching(app, messages):
    window = QWidget()
    yield exception_hook.ExceptionHook(window, messages.append)
    shiboken6.delete(window)


@pytest.fixture
def shown(app):
    """The dialogs that are open."""

    def dialogs():
        for _ in range(3):
            app.processEvents()
        return [w for w in QApplication.topLevelWidgets() if isinstance(w, FaultDialog)]

    yield dialogs
    for dialog in dialogs():
        shiboken6.delete(dialog)


def log():
    return exception_hook.log_file().read_text("utf-8")


def in_a_slot(function):
    """Raise where the window would: from an event that Qt delivers."""
    button = QPushButton()
    button.clicked.connect(function)
    button.click()


def divide():
    return 1 / 0


def text_of(dialog):
    return " ".join(label.text() for label in dialog.findChildren(QLabel))


empty = []


def press(dialog, name):
    [button] = [b for b in dialog.findChildren(QPushButton) if b.text() == name]
    button.click()


def test_an_error_in_a_slot_is_logged_and_shown_and_the_program_goes_on(watching, shown):
    in_a_slot(divide)
    [dialog] = shown()
    assert "Your labels are safe: every stroke was stored when it was made." in text_of(dialog)
    assert str(exception_hook.log_file()) in text_of(dialog)
    assert "ZeroDivisionError: division by zero" in log()
    assert "in divide" in log()
    later_slots = []
    in_a_slot(lambda: later_slots.append(1))
    assert later_slots == [1]


def test_an_error_in_a_thread_is_shown_too(watching, shown):
    thread = threading.Thread(target=divide, name="forcelab scalogram")
    thread.start()
    thread.join()
    [dialog] = shown()
    assert dialog.thread() is QGuiApplication.instance().thread()
    assert "forcelab scalogram" in log()


def test_an_error_while_drawing_fills_neither_screen_nor_disk(app, watching, shown, until):
    class Broken(QWidget):
        def paintEvent(self, event):  # noqa: N802, ARG002
            divide()

    widget = Broken()
    widget.show()

    def drawn():
        for _ in range(50):
            widget.update()
            app.processEvents()
        return sum(watching.counts.values()) >= 600

    # Not widget.grab(): where Python calls Qt and Qt calls Python again, PySide 6.11 on Python 3.10
    # and 3.11 ends the process if the interpreter itself raised the error, as it does for 1 / 0.
    until(drawn)
    [dialog] = shown()
    assert log().count("Traceback") == 1
    assert len(log().splitlines()) < 40
    assert "met 512 times" in log()
    dialog.accept()
    widget.update()
    assert shown() == []


def test_a_painter_ends_where_drawing_fails_though_the_error_is_kept(watching, until):
    """Qt crashes if one ends when what it drew on is no longer being drawn."""
    painters = []

    class Failing(PictureView):
        message = "nothing"

        def _paint_message(self, painter, *_):
            painters.append(painter)
            raise LookupError("a fault")

    view = Failing()
    view.show()
    until(lambda: painters)
    assert not painters[0].isActive()
    view.hide()


def test_another_error_while_one_is_shown_opens_nothing(watching, shown):
    in_a_slot(divide)
    in_a_slot(lambda: empty[0])
    in_a_slot(lambda: {}["key"])
    [dialog] = shown()
    assert "in the same file: 2" in text_of(dialog)
    assert "IndexError" in log()
    assert "KeyError" in log()


def test_after_it_was_closed_an_error_elsewhere_is_shown(watching, shown):
    in_a_slot(divide)
    shown()[0].accept()
    assert shown() == []
    in_a_slot(divide)
    assert shown() == []
    in_a_slot(lambda: empty[0])
    assert len(shown()) == 1


def test_details_can_be_seen_and_copied(watching, shown):
    in_a_slot(divide)
    [dialog] = shown()
    details = dialog.findChild(QPlainTextEdit)
    assert details.isHidden()
    press(dialog, "Show details")
    assert details.isVisible()
    press(dialog, "Copy details")
    copied = QGuiApplication.clipboard().text()
    assert copied == details.toPlainText()
    assert copied.startswith("forcelab ")
    assert "Python 3." in copied
    assert "ZeroDivisionError" in copied
    press(dialog, "Hide details")
    assert details.isHidden()


def test_a_sentence_for_the_coder_is_no_fault(watching, shown, messages):
    def refuse():
        raise InputError("'a < b' is no name; choose another.")

    in_a_slot(refuse)
    assert shown() == []
    assert messages == ["'a < b' is no name; choose another."]
    assert not watching.counts
    assert "Traceback" not in log()


def test_what_qt_says_is_in_the_log_only(watching, shown):
    qWarning("a plug-in is missing")
    assert "Qt: a plug-in is missing" in log()
    assert shown() == []


def test_everything_is_put_back(app):
    before = sys.excepthook, threading.excepthook, list(logging.getLogger("forcelab").handlers)
    window = QWidget()
    exception_hook.ExceptionHook(window, print)
    assert sys.excepthook is not before[0]
    shiboken6.delete(window)
    after = sys.excepthook, threading.excepthook, logging.getLogger("forcelab").handlers
    assert after == before


def test_an_interrupt_is_passed_on(watching, monkeypatch):
    passed = []
    monkeypatch.setattr(watching, "_before", (lambda *what: passed.append(what[0]), None))
    sys.excepthook(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert passed == [KeyboardInterrupt]


def test_without_a_folder_for_the_log_the_rest_works(app, tmp_path, monkeypatch, shown, capsys):
    (tmp_path / "occupied").write_text("a file, not a folder")
    monkeypatch.setenv("FORCELAB_SETTINGS", str(tmp_path / "occupied" / "settings.ini"))
    window = QWidget()
    exception_hook.ExceptionHook(window, print)
    in_a_slot(divide)
    assert len(shown()) == 1
    assert "ZeroDivisionError" in capsys.readouterr().err
    shiboken6.delete(window)


def test_the_log_is_cut_before_it_grows_large(watching):
    logger = logging.getLogger("forcelab.gui")
    for _ in range(5):
        logger.warning("x" * 400_000)
    pieces = list(exception_hook.log_file().parent.glob("forcelab.log*"))
    assert len(pieces) > 1
    assert all(piece.stat().st_size <= exception_hook.LARGEST for piece in pieces)


def test_the_log_lies_in_the_platforms_folder_for_state(monkeypatch, tmp_path):
    monkeypatch.delenv("FORCELAB_SETTINGS")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert exception_hook.log_file() == Path(tmp_path) / "forcelab" / "forcelab.log"


def test_an_error_in_a_timer_comes_once_however_often_it_fires(watching, shown, until):
    timer = QTimer(interval=0)
    timer.timeout.connect(divide)
    timer.start()
    until(lambda: sum(watching.counts.values()) > 20)
    timer.stop()
    assert len(shown()) == 1
