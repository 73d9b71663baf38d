import subprocess
import sys
from pathlib import Path

import PySide6
import pytest

from forcelab.cli import main
from forcelab.errors import InputError
from forcelab.gui import qt_check

#: What the copies of Qt's files ask for in place of libraries that are there.
LACKING = {b"libxkbcommon.so.0": b"libxkbcommun.so.0", b"libxcb-icccm.so.4": b"libxcb-acccm.so.4"}


@pytest.fixture
def lame_qt(tmp_path, monkeypatch):
    """A copy of PySide6's folder whose libraries ask for some that no machine has."""
    real = Path(PySide6.__file__).parent
    lame = tmp_path / "PySide6"
    (lame / "Qt" / "plugins" / "platforms").mkdir(parents=True)
    (lame / "Qt" / "lib").symlink_to(real / "Qt" / "lib")
    (tmp_path / "shiboken6").symlink_to(real.parent / "shiboken6")
    for file in real.glob("*.so*"):
        (lame / file.name).symlink_to(file)
    for name in ("libqoffscreen.so", "libqxcb.so"):
        data = (real / "Qt" / "plugins" / "platforms" / name).read_bytes()
        for existing, lacking in LACKING.items():
            data = data.replace(existing, lacking)
        (lame / "Qt" / "plugins" / "platforms" / name).write_bytes(data)
    monkeypatch.setattr(qt_check, "_folder", lambda: lame)
    monkeypatch.setitem(qt_check.PACKAGES, "libxkbcommun", "libxkbcommun0")
    monkeypatch.setitem(qt_check.PACKAGES, "libxcb-acccm", "libxcb-acccm4")


def test_nothing_is_missing_here(monkeypatch):
    assert qt_check.missing_libraries() == []
    qt_check.require_qt()
    monkeypatch.delenv("QT_QPA_PLATFORM")
    monkeypatch.setenv("DISPLAY", ":7")
    assert qt_check.missing_libraries() == []
    qt_check.require_qt()


def test_all_libraries_that_a_window_lacks_are_named_at_once(lame_qt, monkeypatch):
    monkeypatch.setenv("QT_QPA_PLATFORM", "xcb")
    lacking = qt_check.missing_libraries()
    assert lacking == ["libxcb-acccm.so.4", "libxkbcommun.so.0"]
    with pytest.raises(InputError) as caught:
        qt_check.require_qt()
    sentence = (
        "the libraries libxcb-acccm.so.4, libxkbcommun.so.0 are missing; "
        "apt-get install libxcb-acccm4 libxkbcommun0"
    )
    assert str(caught.value) == f"Qt cannot start: {sentence}."
    found = qt_check.probe()
    assert f"{found.trouble}; {found.cure}" == sentence


@pytest.mark.parametrize("words", [["gui", "--screenshot", "w.png"], ["gui"]])
def test_the_window_and_its_picture_end_in_one_sentence_without_them(
    lame_qt, monkeypatch, capsys, words
):
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    assert main(words) == 1
    assert capsys.readouterr().err == (
        "forcelab: Qt cannot start: the library libxkbcommun.so.0 is missing; "
        "apt-get install libxkbcommun0.\n"
    )


def test_a_drawing_module_that_cannot_import_qt_ends_in_one_sentence(capsys, monkeypatch):
    text = "libEGL.so.1: cannot open shared object file: No such file or directory"

    def fail(arguments):
        raise ImportError(text)

    def refuse():
        raise InputError("Qt cannot start: all of them.")

    monkeypatch.setattr(qt_check, "require_qt", refuse)
    monkeypatch.setattr("forcelab.cli.commands.list.run", fail)
    assert main(["list", "p"]) == 1
    assert capsys.readouterr().err == "forcelab: Qt cannot start: all of them.\n"


def test_qt_is_taken_by_the_first_plugin_that_loads(lame_qt, monkeypatch):
    real = Path(PySide6.__file__).parent / "Qt" / "plugins" / "platforms" / "libqminimal.so"
    broken = qt_check._plugins()[0]
    monkeypatch.setattr(qt_check, "_plugins", lambda: [broken, real])
    qt_check.require_qt()


def test_qt_starts_here_with_its_version_and_fonts():
    found = qt_check.probe()
    assert (found.trouble, found.cure) == ("", "")
    assert found.version.startswith("6.")
    assert found.fonts > 0


def test_without_pyside_the_cure_is_to_install_it():
    # Isolated and without site-packages, so that the words are those of a real import.
    child = subprocess.run(
        [sys.executable, "-I", "-S", "-c", qt_check._CHILD],
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.returncode == 1
    found = qt_check.failure(child.stderr)
    assert found.trouble == "PySide6 is not installed"
    assert found.cure == 'pip install "PySide6-Essentials<6.12"'


@pytest.mark.parametrize(
    ("words", "trouble", "cure"),
    [
        (
            "ImportError: libGL.so.1: cannot open shared object file: No such file or directory",
            "the library libGL.so.1 is missing",
            "apt-get install libgl1",
        ),
        (
            "ImportError: libxkbcommon-x11.so.0: cannot open shared object file: No such file",
            "the library libxkbcommon-x11.so.0 is missing",
            "apt-get install libxkbcommon-x11-0",
        ),
        (
            "ImportError: libodd.so.7: cannot open shared object file: No such file or directory",
            "the library libodd.so.7 is missing",
            "install the package with libodd.so.7",
        ),
        ("first words\nlast words\n\n", "last words", ""),
        ("", "Qt ended without a word", ""),
    ],
)
def test_qts_last_words_become_a_trouble_and_a_cure(words, trouble, cure):
    assert qt_check.failure(words) == qt_check.QtPlatform(trouble=trouble, cure=cure)
