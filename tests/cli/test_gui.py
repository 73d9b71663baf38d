"""The window from the command line: which words open it, and pictures of it."""

import os
import subprocess
import sys

import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from forcelab.capture.journal import encode_header
from forcelab.capture.save import CAPTURES
from forcelab.cli import _for_the_window
from forcelab.project import Project


@pytest.fixture(autouse=True)
def settings_of_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("FORCELAB_SETTINGS", str(tmp_path / "settings.ini"))


def drawn(*words, **environment):
    """A picture drawn by a program of its own, as from a shell without a display."""
    clean = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "QT_QPA_PLATFORM")}
    return subprocess.run(
        [sys.executable, "-m", "forcelab", *map(str, words)],
        env={**clean, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        ([], ["gui"]),
        (["study.forcelab"], ["gui", "study.forcelab"]),
        (["data/study", "--theme", "dark"], ["gui", "data/study", "--theme", "dark"]),
        (["list", "study.forcelab"], ["list", "study.forcelab"]),
        (["--version"], ["--version"]),
        (["fly"], ["fly"]),
    ],
)
def test_a_project_or_nothing_means_the_window(words, meant):
    assert _for_the_window(words) == meant


def words_for(project, out, theme, size):
    place = ["--demo", "foam-01", "--at", "1.5", "--span", "2"]
    looks = ["--theme", theme, "--size", size]
    return ["gui", project, *place, *looks, "--screenshot", out]


def looks_of(picture):
    """Width, height and whether the ground is light."""
    image = QImage(str(picture))
    light = image.pixelColor(5, image.height() // 2).lightness() > 128
    return image.width(), image.height(), light


def test_a_picture_has_the_size_and_theme_asked_for_and_leaves_no_settings(
    forcelab, project, tmp_path
):
    out = tmp_path / "window.png"
    result = forcelab(*words_for(project, out, "light", "1280x800"))
    assert (result.status, result.out, result.err) == (0, f"{out}\n", "")
    assert looks_of(out) == (1280, 800, True)
    assert not (tmp_path / "settings.ini").exists()


def test_a_dialog_is_drawn_whether_the_window_waits_for_it_or_not(forcelab, project, tmp_path):
    for name in ("keys", "preferences"):
        out = tmp_path / f"{name}.png"
        words = ["gui", project, "--theme", "dark", "--size", "500x300", "--dialog", name]
        assert forcelab(*words, "--screenshot", out).status == 0
        assert looks_of(out) == (500, 300, False)


def test_a_dialog_that_cannot_be_opened_is_refused_with_the_reason(forcelab, project, tmp_path):
    picture = ["--screenshot", tmp_path / "a.png"]
    refused = forcelab("gui", project, "--dialog", "synchronise", *picture)
    assert "There is no video to synchronise here." in refused.sentence
    unknown = forcelab("gui", project, "--dialog", "key", *picture)
    assert "There is no dialog 'key'; did you mean 'keys'?" in unknown.wrong_word
    swallowed = forcelab("gui", "--dialog", "keys", project, *picture)
    assert f"write '{project}' before --dialog" in swallowed.wrong_word
    assert "add --screenshot" in forcelab("gui", project, "--dialog", "keys").wrong_word
    assert not (tmp_path / "a.png").exists()


def test_from_a_shell_without_a_display_a_picture_at_200_percent_has_twice_the_pixels(
    project, tmp_path
):
    out = tmp_path / "large.png"
    done = drawn(*words_for(project, out, "dark", "1024x700"), QT_SCALE_FACTOR="2")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"{out}\n", "")
    assert looks_of(out) == (2048, 1400, False)
    assert not (tmp_path / "settings.ini").exists()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--screenshot", "window.jpg"], "'window.jpg'; change the suffix."),
        (["--demo", "foam-99", "--screenshot", "w.png"], "There is no demonstration 'foam-99'"),
        (["--screenshot", "no/such/folder/w.png"], "no/such/folder"),
    ],
)
def test_a_picture_that_cannot_be_drawn_is_one_sentence(
    forcelab, project, tmp_path, monkeypatch, words, sentence
):
    monkeypatch.chdir(tmp_path)
    assert sentence in forcelab("gui", project, *words).sentence
    assert not list(tmp_path.glob("**/*.png"))


def test_a_picture_is_drawn_of_a_project_with_a_recording_that_a_crash_ended(forcelab, tmp_path):
    with Project.create(tmp_path / "lab.forcelab") as created:
        captures = created.path / CAPTURES
    captures.mkdir()
    (captures / "pull 01.journal").write_bytes(encode_header({"name": "pull 01"}))
    out = tmp_path / "w.png"
    result = forcelab("gui", created.path, "--screenshot", out)
    assert (result.status, result.out) == (0, f"{out}\n")


def test_no_project_and_no_display_are_one_sentence_each(forcelab, tmp_path, monkeypatch):
    nothing = tmp_path / "nothing.forcelab"
    result = forcelab("gui", nothing, "--screenshot", tmp_path / "w.png")
    assert "nothing.forcelab" in result.sentence
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(QApplication, "exec", lambda *_: 0)  # a window would wait for its user
    assert "no display" in forcelab(nothing).sentence


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--at", "nan"), "'nan' is no time in seconds"),
        (("--at", "soon"), "'soon' is no time in seconds"),
        (("--span", "inf"), "'inf' is no time in seconds"),
        (("--span", "0"), "'0' is no length of time above 0 s"),
        (("--size", "large"), "'large' is no size such as 1280x800"),
        (("--size", "99999x800"), "'99999x800' is too large; 8192 pixels are the most"),
    ],
)
def test_what_no_window_can_show_is_a_wrong_command_line(forcelab, words, complaint):
    assert complaint in forcelab("gui", *words).wrong_word
