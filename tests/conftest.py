"""What every test needs: Qt draws off screen where there is no display, and leaves nothing."""

import os
import sys

import pytest
from hypothesis import settings

#: The files that take longest begin first, so that no process is left with one in the end.
LONG = (
    "recognition/test_evaluation.py",
    "test_house_rules.py",
    "test_readme.py",
    "simulation/test_tasks.py",
    "measure/test_simulated_beside_real.py",
    "gui/test_measuring.py",
    "recognition/test_extremes.py",
    "cli/test_commands.py",
    "review/test_suspicion.py",
    "recognition/test_storage.py",
    "measure/test_recognition_swapped.py",
    "cli/test_simulate.py",
    "cli/test_evaluate.py",
    "cli/test_stopping.py",
    "cli/test_capture.py",
    "cli/test_gui.py",
    "e2e/test_kills.py",
    "e2e/test_review.py",
    "formats/table/test_reader.py",
    "formats/archive/test_archive.py",
    "recognition/test_classifiers.py",
    "cli/test_capture_recogniser.py",
    "simulation/test_production.py",
    "gui/capture/test_live_views.py",
    "gui/review/test_workspace.py",
)

if not os.environ.get("DISPLAY"):
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
# The tests themselves share the processors; threads that wait for one another only heat them.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Many tests start the program: it is compiled once, also where a machine asks for no bytecode.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# How long an example takes tells of what else a machine does.
settings.register_profile("busy", deadline=None)
settings.load_profile("busy")


def pytest_collection_modifyitems(items):
    ranks = {f"tests/{name}": rank for rank, name in enumerate(LONG)}
    items.sort(key=lambda item: ranks.get(item.nodeid.partition("::")[0], len(LONG)))


@pytest.fixture(autouse=True)
def no_widget_outlives_its_test():
    """Delete what a test has left: each later change of theme would polish all of it again."""
    before = set(_windows())
    yield
    _delete([window for window in _windows() if window not in before])


@pytest.fixture(scope="module", autouse=True)
def no_widget_outlives_its_file():
    yield
    _delete(_windows())


def _windows():
    """Windows that stand for themselves, if any test has made some."""
    widgets = sys.modules.get("PySide6.QtWidgets")
    if widgets is None or widgets.QApplication.instance() is None:
        return []
    return [widget for widget in widgets.QApplication.topLevelWidgets() if not widget.parent()]


def _delete(windows):
    """Delete windows, and what was to be deleted later: that only happens in a running loop."""
    for window in windows:
        window.hide()
        window.deleteLater()
    core = sys.modules.get("PySide6.QtCore")
    if core is not None and core.QCoreApplication.instance() is not None:
        core.QCoreApplication.sendPostedEvents(None, core.QEvent.Type.DeferredDelete.value)
