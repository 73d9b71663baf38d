"""What tests of the window need: one application, own settings, and nothing left behind."""

import gc
import sys
import threading
import time

import pytest
from window_helpers import PATIENCE, open_painted_document, painted_once, status_messages


@pytest.fixture(scope="session")
def app():
    from PySide6.QtWidgets import QApplication

    application = QApplication.instance() or QApplication(["forcelab"])
    yield application
    for window in application.topLevelWidgets():
        window.close()


@pytest.fixture(autouse=True)
def settings_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("FORCELAB_SETTINGS", str(tmp_path / "settings.ini"))


@pytest.fixture
def keys(app):
    """The keys of this test's coder."""
    from forcelab.gui.shortcuts import Keys

    return Keys()


@pytest.fixture
def jobs(app):
    from forcelab.gui.jobs import Jobs

    jobs = Jobs()
    yield jobs
    assert jobs.close(PATIENCE)


@pytest.fixture
def document(app, tmp_path):
    """Ada's track, painted; some files and rooms have a document of their own."""
    with open_painted_document(tmp_path) as document:
        yield document


@pytest.fixture
def messages(document):
    """What the status line says from now on, and whether that is trouble."""
    return status_messages(document)


@pytest.fixture
def answers(app, monkeypatch):
    """Press the button with a given text in every question; gives what was asked."""
    from PySide6.QtWidgets import QMessageBox

    def press(text):
        questions = []

        def exec_(box):
            questions.append(f"{box.text()} {box.informativeText()}".strip())
            [button] = [
                button for button in box.buttons() if button.text().replace("&", "") == text
            ]
            button.click()
            return 0

        monkeypatch.setattr(QMessageBox, "exec", exec_)
        return questions

    return press


@pytest.fixture
def chosen_picture(monkeypatch):
    """Choose where pictures are saved."""
    return lambda path: monkeypatch.setattr(
        "forcelab.gui.file_dialogs.ask_picture", lambda *_: path
    )


@pytest.fixture
def hovered(app):
    """What a tooltip says where the mouse rests on a control, or on an entry of a menu."""
    from PySide6.QtCore import QEvent
    from PySide6.QtGui import QHelpEvent
    from PySide6.QtWidgets import QApplication, QToolTip

    def rest(control, spot=None):
        spot = control.rect().center() if spot is None else spot
        QToolTip.showText(control.mapToGlobal(spot), "the tip before")  # to hide one takes time
        QApplication.sendEvent(
            control, QHelpEvent(QEvent.Type.ToolTip, spot, control.mapToGlobal(spot))
        )
        return "" if QToolTip.text() == "the tip before" else QToolTip.text()

    return rest


@pytest.fixture(scope="session")
def until(app):
    """Run the event loop until something holds."""

    def wait(holds):
        deadline = time.monotonic() + PATIENCE
        while not holds():
            assert time.monotonic() < deadline, f"not within {PATIENCE:.0f} s"
            app.processEvents()
            time.sleep(0.002)

    return wait


@pytest.fixture
def windows(app, until):
    """Start windows as the program does; they are closed at the end."""
    from forcelab.gui.launch_options import LaunchOptions
    from forcelab.gui.window import Window

    created = []

    def make(start=None, author="Ann", size=(1100, 700)):
        window = Window(author)
        created.append(window)
        with painted_once(window):
            window.resize(*size)
            window.restore_layout()
            window.show()
            window.begin(start or LaunchOptions())
            until(lambda: window.settled)
        return window

    yield make
    for window in created:
        window.close()


@pytest.fixture(scope="module")
def windows_of_file(app):
    """The windows of the tests of a file; see `window_of_file`."""
    created = []
    yield created
    for window in created:
        window.close()
        window.setProperty("of file", False)


@pytest.fixture
def window_of_file(windows_of_file, until):
    """Begin in the window of the test before, or in a new one where that was closed.

    It is as it was at first but for what hangs on the settings. For tests that leave no dialog.
    """
    from forcelab.gui.window import Window

    def begin(start, author="Ann", size=(1100, 700)):
        reused = bool(windows_of_file) and windows_of_file[-1].isVisible()
        window = windows_of_file[-1] if reused else Window(author)
        with painted_once(window):
            window.resize(*size)
            if not reused:
                window.setProperty("of file", True)
                windows_of_file.append(window)
                window.restore_layout()
                window.show()
            window.begin(start)
            if reused:
                window.commands["reset_layout"].trigger()
                window.document.set_author(author)
            until(lambda: window.settled)
        return window

    yield begin
    for window in [*windows_of_file]:
        window.setUpdatesEnabled(False)
        window.show_workspace("label")
        window.document.close()
        if any("capture" in job for job in window.jobs.busy):  # devices are searched for a second
            window.close()
        until(lambda window=window: not window.jobs.busy)
        if not window.isVisible():
            windows_of_file.remove(window)
            window.setProperty("of file", False)


@pytest.fixture(autouse=True)
def no_slot_raises(monkeypatch):
    """Qt goes on after an error in a slot, and the test would with it."""
    errors = []
    monkeypatch.setattr(sys, "excepthook", lambda _, error, __: errors.append(error))
    yield
    if errors:
        raise errors[0]


@pytest.fixture(autouse=True)
def no_thread_is_left_behind():
    before = set(threading.enumerate())
    yield
    deadline = time.monotonic() + PATIENCE
    while left := [t for t in set(threading.enumerate()) - before if t.is_alive()]:
        assert time.monotonic() < deadline, f"threads still run: {left}"
        time.sleep(0.005)


@pytest.fixture(scope="module", autouse=True)
def no_timer_is_left_running(request):
    yield
    from PySide6.QtCore import QCoreApplication

    if (application := QCoreApplication.instance()) is None:
        return
    deadline = time.monotonic() + PATIENCE
    while left := _running_timers():
        assert time.monotonic() < deadline, f"timers still run: {left}"
        del left  # a reference to what is about to be deleted
        application.processEvents()
        gc.collect()


def _running_timers():
    """Timers that nobody stopped; once per file, as it looks at every object there is.

    A single shot ends by itself, such as that of a message that is shown for some seconds.
    """
    from PySide6.QtCore import QTimer
    from shiboken6 import isValid

    timers = [t for t in gc.get_objects() if type(t) is QTimer and isValid(t)]
    return [(t, t.parent()) for t in timers if t.isActive() and not t.isSingleShot()]
