import subprocess
import sys

import pytest

from forcelab.gui import platform


def test_qt_starts_here_with_its_version_and_fonts():
    found = platform.probe()
    assert (found.trouble, found.cure) == ("", "")
    assert found.version.startswith("6.")
    assert found.fonts > 0


def test_without_pyside_the_cure_is_to_install_it():
    # Isolated and without site-packages, so that the words are those of a real import.
    child = subprocess.run(
        [sys.executable, "-I", "-S", "-c", platform._CHILD],
        capture_output=True,
        text=True,
        check=False,
    )
    assert child.returncode == 1
    found = platform._failure(child.stderr)
    assert found.trouble == "PySide6 is not installed"
    assert found.cure == 'pip install "PySide6-Essentials<6.12"'


@pytest.mark.parametrize(
    ("words", "trouble", "cure"),
    [
        (
            "ImportError: libGL.so.1: cannot open shared object file: No such file or directory",
            "the library libGL is missing",
            "apt-get install libgl1",
        ),
        (
            "ImportError: libxkbcommon-x11.so.0: cannot open shared object file: No such file",
            "the library libxkbcommon-x11 is missing",
            "apt-get install libxkbcommon-x11-0",
        ),
        (
            "ImportError: libodd.so.7: cannot open shared object file: No such file or directory",
            "the library libodd is missing",
            "install the package with libodd",
        ),
        ("first words\nlast words\n\n", "last words", ""),
        ("", "Qt ended without a word", ""),
    ],
)
def test_qts_last_words_become_a_trouble_and_a_cure(words, trouble, cure):
    assert platform._failure(words) == platform.QtPlatform(trouble=trouble, cure=cure)
