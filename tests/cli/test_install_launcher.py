"""The launcher: a desktop entry that other programs read, and its icon; both can be taken back."""

import os
import re
import shutil
import subprocess
import sys
from configparser import RawConfigParser

import pytest

from forcelab.cli.commands.install_launcher import exec_value

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux only")

#: The manual page and the completion of each shell.
BESIDE = (
    "man/man1/forcelab.1",
    "bash-completion/completions/forcelab",
    "fish/vendor_completions.d/forcelab.fish",
    "zsh/site-functions/_forcelab",
)


@pytest.fixture(autouse=True)
def data(tmp_path, monkeypatch):
    """Where this user's applications are; a folder whose name is awkward."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data of Ann"))
    return tmp_path / "data of Ann"


def entry_of(data):
    return data / "applications" / "forcelab.desktop"


def icon_of(data):
    return data / "icons" / "hicolor" / "scalable" / "apps" / "forcelab.svg"


def fields(path):
    """The keys of a desktop entry, read by a parser that knows nothing of forcelab."""
    parser = RawConfigParser(delimiters=["="], comment_prefixes=["#"], strict=True)
    parser.optionxform = str
    parser.read_string(path.read_text("utf-8"))
    assert parser.sections() == ["Desktop Entry"]
    return dict(parser["Desktop Entry"])


def command_of(value):
    """The words of the key Exec, step by step as the Desktop Entry Specification describes."""
    escapes = {"s": " ", "n": "\n", "t": "\t", "r": "\r", "\\": "\\"}
    text = re.sub(r"\\(.)", lambda match: escapes[match[1]], value)
    words = re.findall(r'"((?:[^"\\`$]|\\["\\`$])*)"(?: |$)', text)
    assert " ".join(f'"{word}"' for word in words) == text
    words = [re.sub(r"\\(.)", r"\1", word) for word in words]
    assert not any(re.search(r"%(?!%)", word.replace("%%", "")) for word in words)
    return [word.replace("%%", "%") for word in words]


def test_a_launcher_is_written_and_taken_back(forcelab, data, monkeypatch, tmp_path):
    script = tmp_path / "my programs" / "forcelab"
    script.parent.mkdir()
    script.touch()
    monkeypatch.setattr("sys.argv", [str(script), "install-launcher"])
    result = forcelab("install-launcher")
    assert (result.status, result.err) == (0, "")
    files = [icon_of(data), entry_of(data), *(data / path for path in BESIDE)]
    listed = "".join(f"  {path}\n" for path in files)
    assert result.out == f"Wrote\n{listed}"
    found = fields(entry_of(data))
    assert (found["Type"], found["Name"], found["Terminal"]) == ("Application", "forcelab", "false")
    assert command_of(found["Exec"]) == [str(script)]
    assert icon_of(data).stem == found["Icon"]
    assert icon_of(data).read_bytes().startswith(b"<svg")
    again = forcelab("install-launcher", "--json")
    assert again.json == {"written": [str(path) for path in files]}
    removed = forcelab("install-launcher", "--remove")
    assert removed.out == f"Removed\n{listed}"
    assert not [path for path in data.rglob("*") if path.is_file()]
    nothing = forcelab("install-launcher", "--remove")
    assert (nothing.status, nothing.out) == (0, f"There is no launcher in {data}.\n")


def test_man_and_fish_find_what_is_installed(forcelab, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_DATA_HOME")
    monkeypatch.delenv("MANPATH", raising=False)
    program = tmp_path / ".local" / "bin" / "forcelab"  # where pipx puts it
    program.parent.mkdir(parents=True)
    program.touch(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    assert forcelab("install-launcher").status == 0
    data = tmp_path / ".local" / "share"
    for command, answer in {
        ("man", "-w", "forcelab"): f"{data}/man/man1/forcelab.1\n",
        ("fish", "-c", "complete -C 'forcelab doc'"): "doctor\tCheck this machine and say",
    }.items():
        if shutil.which(command[0]) is not None:
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.stdout.startswith(answer)


def test_what_was_started_without_a_script_is_started_so_again(forcelab, data, monkeypatch):
    monkeypatch.setattr("sys.argv", ["/somewhere/forcelab/__main__.py"])
    forcelab("install-launcher")
    assert command_of(fields(entry_of(data))["Exec"]) == [sys.executable, "-m", "forcelab"]


@pytest.mark.parametrize(
    "path",
    ["/opt/forcelab", "/my programs/it's", '/a"b', "/50 %f", "/a\\b", "/$HOME/`id`", "/é", "/a\nb"],
)
def test_any_path_is_quoted_as_the_specification_says(path):
    assert command_of(exec_value([path, "-m"])) == [path, "-m"]
    assert "\n" not in exec_value([path])


def test_quoting_is_that_of_the_specifications_own_example():
    # "a literal dollar sign in a quoted string ... is unambiguously represented with \\$", and
    # "a literal backslash character ... with four successive backslash characters".
    assert exec_value(["/a $b\\c"]) == '"/a \\\\$b\\\\\\\\c"'


def test_the_entry_is_valid(forcelab, data):
    validator = shutil.which("desktop-file-validate")
    if validator is None:
        pytest.skip("desktop-file-validate is not installed")
    forcelab("install-launcher")
    done = subprocess.run([validator, entry_of(data)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "")


def test_without_a_folder_of_its_own_the_data_lie_in_the_home(forcelab, monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    for folder in ("", "relative"):
        monkeypatch.setenv("XDG_DATA_HOME", folder)
        forcelab("install-launcher")
        assert entry_of(tmp_path / ".local" / "share").is_file()
        forcelab("install-launcher", "--remove")


def test_a_folder_that_cannot_be_made_is_one_sentence(data):
    data.write_text("a file")
    command = [sys.executable, "-m", "forcelab", "install-launcher"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert str(data) in done.stderr


def test_elsewhere_there_are_no_desktop_entries(forcelab, data, monkeypatch):
    monkeypatch.setattr("sys.platform", "darwin")
    assert "can be installed on Linux only" in forcelab("install-launcher").sentence
    assert not data.exists()


def test_the_icon_is_that_of_every_window(tmp_path):
    script = """
from PySide6.QtCore import QSize, QTimer
from PySide6.QtWidgets import QApplication
from forcelab.gui.app import run
from forcelab.gui.launch_options import LaunchOptions
application = QApplication([])
def look():
    [window] = [w for w in QApplication.topLevelWidgets() if type(w).__name__ == "Window"]
    icon = window.windowIcon()
    sides = [icon.pixmap(QSize(side, side)).toImage() for side in (16, 256)]
    alphas = [image.pixelColor(image.rect().center()).alpha() for image in sides]
    print(application.desktopFileName(), alphas)
    window.close()
QTimer.singleShot(0, look)
run(LaunchOptions(project=None, author="Ann"))
"""
    done = subprocess.run(
        [sys.executable, "-c", script],
        env={**os.environ, "HOME": str(tmp_path), "FORCELAB_SETTINGS": str(tmp_path / "ini")},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.stdout.split() == ["forcelab", "[255,", "255]"], done.stderr
