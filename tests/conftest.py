"""What every test needs: Qt draws off screen, wherever that is, and leaves nothing."""

import atexit
import gc
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import settings

#: The files that take longest, 8 s and more, begin first: no process is left with one in the end.
LONG = (
    "simulation/test_tasks.py",
    "measure/test_benchmarks.py",
    "gui/review/test_workspace.py",
    "recognition/test_cross_validation.py",
    "recognition/test_live.py",
    "capture/test_recorder.py",
    "test_cluster.py",
    "test_guide.py",
    "capture/test_lsl.py",
    "e2e/test_review.py",
    "recognition/test_classifiers.py",
    "gui/capture/test_live_views.py",
    "recognition/test_extremes.py",
    "capture/test_devices.py",
    "gui/capture/test_workspace.py",
    "recognition/test_training.py",
    "recognition/test_live_model.py",
    "e2e/test_labelling.py",
    "cli/test_capture.py",
)
#: Waits for what has gone on beside all others.
LAST = "test_types.py"

# Whoever starts the tests may sit before a screen, and have told Qt how to look there.
for name in [name for name in os.environ if name.startswith("QT_")]:
    del os.environ[name]
for name in ("DISPLAY", "WAYLAND_DISPLAY", "XDG_CURRENT_DESKTOP", "DESKTOP_SESSION"):
    os.environ.pop(name, None)
os.environ["QT_QPA_PLATFORM"] = "offscreen"
# The tests themselves share the processors; threads that wait for one another only heat them.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Many tests start the program: it is compiled once, also where a machine asks for no bytecode.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# What tests send and look for by the Lab Streaming Layer stays among themselves.
LSL_CONFIG = tempfile.NamedTemporaryFile("w", suffix=".cfg")  # noqa: SIM115 - until the tests end
LSL_CONFIG.write(
    Path(__file__).with_name("lsl_api.cfg").read_text().replace("PROCESS", str(os.getpid()))
)
LSL_CONFIG.flush()
atexit.register(LSL_CONFIG.close)
os.environ["LSLAPICFG"] = LSL_CONFIG.name
# A shell lets what it starts in the background ignore Ctrl+C, and so would what tests start.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
# Every commit waits for the disk, and no test can pull the plug: where there is room, folders of
# tests lie in memory.
MEMORY = Path("/dev/shm")
if os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > 2**30:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))
# How long an example takes tells of what else a machine does. The examples are the same each time,
# so that nobody is held up by an example that nobody has met. By hand other ones are tried:
# --hypothesis-seed, and --hypothesis-profile=long for ten times as many.
settings.register_profile("fixed", deadline=None, derandomize=True, max_examples=30)
settings.register_profile("random", deadline=None, derandomize=False, max_examples=100)
settings.register_profile("long", settings.get_profile("random"))
#: How many times as many examples the long profile has.
LONGER = 10


def pytest_configure(config):
    """A seed is no use where the examples are fixed."""
    if not config.getoption("--hypothesis-profile"):
        seeded = config.getoption("--hypothesis-seed") is not None
        settings.load_profile("random" if seeded else "fixed")


def _lengthen(items):
    """Also the tests that set a number of examples of their own."""
    tests = {getattr(item.obj, "__func__", item.obj) for item in items if hasattr(item, "obj")}
    for test in tests:
        if getattr(test, "is_hypothesis_test", False):
            own = test._hypothesis_internal_use_settings or settings.default
            longer = settings(own, max_examples=LONGER * own.max_examples)
            test._hypothesis_internal_use_settings = longer


def pytest_collection_modifyitems(config, items):
    if config.getoption("--hypothesis-profile") == "long":
        _lengthen(items)
    ranks = {f"tests/{name}": rank for rank, name in enumerate(LONG)}
    ranks[f"tests/{LAST}"] = len(LONG) + 1
    items.sort(key=lambda item: ranks.get(item.nodeid.partition("::")[0], len(LONG)))


def pytest_collection_finish(session):
    """Begin to check the types, where a test asks for the outcome."""
    if not session.config.option.collectonly and any(i.path.name == LAST for i in session.items):
        _start_type_check()


#: Where mypy's words are left: one place for all processes of a run of the tests.
MYPY_OUTPUT = Path(tempfile.gettempdir()) / (
    f"forcelab-types-{os.environ.get('PYTEST_XDIST_TESTRUNUID', str(os.getpid()))}"
)
#: It is no child of a test's process, which may look at its own. The file appears as a whole.
MYPY_SCRIPT = (
    '(nice "$@" >"$0.part" 2>&1; echo $? >>"$0.part"; mv "$0.part" "$0") >/dev/null 2>&1 &'
)


def _start_type_check():
    """Let mypy take what the tests leave idle; the first of the processes that share them does."""
    if os.environ.get("PYTEST_XDIST_WORKER", "gw0") == "gw0":
        root = Path(__file__).resolve().parents[1]
        MYPY_OUTPUT.unlink(missing_ok=True)  # of a run that was cut short, whose number came again
        subprocess.run(
            ["bash", "-c", MYPY_SCRIPT, MYPY_OUTPUT, Path(sys.executable).with_name("mypy")],
            cwd=root,
            env={**os.environ, "PYTHONPATH": str(root), "NO_COLOR": "1"},
            check=True,
        )


@pytest.fixture
def mypy_outcome():
    """The status of the check of the types, and what it said; waits for its end."""
    while not MYPY_OUTPUT.exists():
        time.sleep(0.05)
    *lines, status = MYPY_OUTPUT.read_text("utf-8").splitlines()
    MYPY_OUTPUT.unlink()
    return int(status), "\n".join(lines)


@pytest.fixture
def peak_memory():
    """What a call gives, and the bytes that Python and numpy held at the most meanwhile."""

    def measure(call):
        tracemalloc.start()
        try:
            return call(), tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    return measure


@pytest.fixture
def real_file():
    """The path of a real recording by its name; where it is missing, the test is skipped."""

    def find(name):
        path = Path(__file__).resolve().parents[2] / "shared/data" / name
        if not path.exists():
            pytest.skip("the real recordings are not here")
        return path

    return find


@pytest.fixture(scope="session", autouse=True)
def what_is_loaded_stays():
    """No search for garbage goes through it again: it would take longer than many a test."""
    gc.collect()
    gc.freeze()


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
    """Windows that stand for themselves, if any test has made some; but for those of its file."""
    widgets = sys.modules.get("PySide6.QtWidgets")
    if widgets is None or widgets.QApplication.instance() is None:
        return []
    top = widgets.QApplication.topLevelWidgets()
    return [widget for widget in top if not widget.parent() and not widget.property("of file")]


def _delete(windows):
    """Delete windows, and what was to be deleted later: that only happens in a running loop."""
    for window in windows:
        window.hide()
        window.deleteLater()
    core = sys.modules.get("PySide6.QtCore")
    if core is not None and core.QCoreApplication.instance() is not None:
        core.QCoreApplication.sendPostedEvents(None, core.QEvent.Type.DeferredDelete.value)
