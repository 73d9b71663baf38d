import getpass
import logging
from pathlib import Path

import pytest

from forcelab.gui import settings


@pytest.fixture
def file(tmp_path):
    settings._opened.cache_clear()  # pytest names a folder anew after one that is gone
    return tmp_path / "settings.ini"


@pytest.fixture
def reopened(file):
    """What another run of the program would read."""

    def again():
        settings.settings().sync()
        settings._opened.cache_clear()

    return again


VALUES = {
    "text": ["", "grab", 'a, b; "c" = [d] \\ \n é ⌘', "@Variant(1)", "@Invalid()", "true"],
    "number": [0.0, -1.5, 1e-300, 0.1 + 0.2],
    "flag": [True, False],
    "strings": [(), ("one",), ("a, b", "", '"c"', "é"), ("@Variant(2)",)],
    "data": [b"", b"\x00\xff\nPK\x03\x04", bytes(range(256))],
}
READERS = {
    "text": settings.text,
    "number": lambda key: settings.number(key, 7.0),
    "flag": lambda key: settings.flag(key, None),
    "strings": lambda key: settings.strings(key, ["else"]),
    "data": lambda key: settings.data(key, b"else"),
}


@pytest.mark.parametrize(
    ("kind", "value"), [(kind, value) for kind, values in VALUES.items() for value in values]
)
def test_what_was_put_is_read_again_by_the_next_run(kind, value, reopened):
    settings.store("room/thing", value)
    assert READERS[kind]("room/thing") == value
    reopened()
    assert READERS[kind]("room/thing") == value


def test_nothing_but_plain_text_is_in_the_file(file, reopened):
    for kind, values in VALUES.items():
        settings.store(f"all/{kind}", values[-1])
    stored = file.read_text("utf-8")
    assert "@ByteArray" not in stored
    assert "\\x80\\x4" not in stored


@pytest.mark.parametrize(
    ("broken", "read", "default"),
    [
        ("n=many", lambda: settings.number("n", 3.0), 3.0),
        ("n=nan", lambda: settings.number("n", 3.0), 3.0),
        ("n=-5", lambda: settings.number("n", 3.0, lowest=0), 3.0),
        ("n=inf", lambda: settings.number("n", 3.0, highest=10), 3.0),
        ("f=perhaps", lambda: settings.flag("f", True), True),
        ("l=[1, 2]", lambda: settings.strings("l", ["x"]), ("x",)),
        ('l="{\\"a\\": 1}"', lambda: settings.strings("l", ["x"]), ("x",)),
        ("l=a, b", lambda: settings.strings("l", ["x"]), ("x",)),
        ("b=***", lambda: settings.data("b", b"x"), b"x"),
        ("b=ünicode", lambda: settings.data("b", b"x"), b"x"),
        ("t=a, b", lambda: settings.text("t", "x"), "x"),
        ("t=@Invalid()", lambda: settings.text("t", "x"), "x"),
    ],
)
def test_a_broken_value_gives_the_default_and_the_log_says_so(broken, read, default, file, caplog):
    file.write_text(f"[General]\n{broken}\n", "utf-8")
    with caplog.at_level(logging.WARNING):
        assert read() == default
    assert "is broken" in caplog.text
    assert file.name in caplog.text


def test_a_file_that_could_hold_a_pickle_is_put_aside_unread(file, caplog):
    file.write_text("[General]\nx=@Variant(\\0\\0\\x4\\0)\nlabel=1\n", "utf-8")
    assert settings.text("label", "default") == "default"
    assert file.with_name("settings.ini.refused").exists()
    assert "forcelab never writes" in caplog.text
    settings.store("label", "2")
    assert settings.text("label") == "2"


def test_a_folder_that_cannot_be_written_is_logged_and_survived(tmp_path, monkeypatch, caplog):
    (tmp_path / "occupied").write_text("a file, not a folder")
    monkeypatch.setenv("FORCELAB_SETTINGS", str(tmp_path / "occupied" / "settings.ini"))
    settings.store("label", "2")
    assert "cannot be written" in caplog.text
    assert settings.text("label") == "2"


def test_without_the_variable_they_lie_in_the_platforms_folder(monkeypatch, tmp_path):
    monkeypatch.delenv("FORCELAB_SETTINGS")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert settings._path().parts[-2:] == ("forcelab", "settings.ini")


def test_recent_projects_are_those_opened_last_and_stay_when_one_is_moved(tmp_path, reopened):
    folders = [tmp_path / f"p{i}" for i in range(12)]
    for folder in folders:
        folder.mkdir()
        settings.remember_project(folder)
    settings.remember_project(folders[5])
    folders[11].rmdir()
    reopened()
    names = [path.name for path in settings.recent_projects()]
    assert names == ["p5", "p11", "p10", "p9", "p8", "p7", "p6", "p4", "p3", "p2"]


def test_a_relative_project_is_remembered_as_what_it_was(tmp_path, monkeypatch):
    (tmp_path / "p").mkdir()
    monkeypatch.chdir(tmp_path)
    settings.remember_project(Path("p"))
    monkeypatch.chdir("/")
    assert settings.recent_projects() == ((tmp_path / "p").resolve(),)


def test_each_project_has_its_own_coder(monkeypatch, tmp_path):
    monkeypatch.setattr(getpass, "getuser", lambda: "ada")
    sample, study = tmp_path / "sample.forcelab", tmp_path / "study.forcelab"
    assert settings.coder() == settings.coder(sample) == "Ada"
    settings.remember_coder(sample, "Ines")
    assert settings.coder(sample, ("Ines", "Tomas")) == "Ines"
    assert settings.coder() == settings.coder(study, ("Bo",)) == "Ada"
    settings.remember_coder(study, "  ")
    assert settings.coder(study) == "Ada"


def test_a_coder_is_known_again_in_a_project_that_was_moved(monkeypatch, tmp_path):
    monkeypatch.setattr(getpass, "getuser", lambda: "ada")
    settings.remember_coder(tmp_path / "here.forcelab", "Grace Hopper")
    moved = tmp_path / "there.forcelab"
    assert settings.coder(moved, ("Bo", "Grace Hopper")) == "Grace Hopper"
    assert settings.coder(moved, ("Bo",)) == "Ada"
    settings.remember_coder(tmp_path / "another.forcelab", "Ines")
    assert settings.coder(moved, ("Bo", "Grace Hopper")) == "Grace Hopper"
    assert settings.coder(moved, ("Grace Hopper", "Ines")) == "Ines"  # the name given last


@pytest.mark.parametrize("error", [OSError, KeyError, ImportError])
def test_an_account_without_a_name_is_called_coder(monkeypatch, error):
    def nobody():
        raise error("no entry")

    monkeypatch.setattr(getpass, "getuser", nobody)
    assert settings.coder() == "Coder"


def test_what_is_forgotten_has_its_default_again():
    settings.store("thing/number", 400)
    settings.forget("thing/number")
    assert settings.number("thing/number", 250.0) == 250.0
