"""A project from a stranger: nothing beside it is touched, and each fault is one sentence."""

from __future__ import annotations

import os
import sqlite3
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from forcelab.cli import main
from forcelab.clock import ClockMap
from forcelab.demonstration import VideoReference
from forcelab.errors import InputError
from forcelab.project import Project, Provenance
from forcelab.project.files import remove
from forcelab.project.track_editor import TrackEditor
from forcelab.text import natural_order

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links need rights there")


@pytest.fixture
def canaries(tmp_path):
    """A file and folders beside the project; that all of it is as before is checked at the end."""
    folder = tmp_path / "canaries"
    for name in ("victim", ".incoming-0123456789abcdef", "f" * 32):
        (folder / name).mkdir(parents=True)
        (folder / name / "canary.txt").write_text("untouched\n", "utf-8")
        (folder / name / "uncommitted").touch()
    (folder / "canary.mp4").write_bytes(b"untouched")
    for path in sorted(folder.rglob("*"), reverse=True):
        os.utime(path, (0, 0))
    before = contents(folder)
    yield folder
    assert contents(folder) == before


def contents(folder: Path):
    return {
        str(p): (p.lstat().st_mtime, p.read_bytes() if p.is_file() else None)
        for p in folder.rglob("*")
    }


@pytest.fixture
def stored(path, make, film):
    """A project with one filmed demonstration; gives its id."""
    with Project.create(path) as project:
        return project.demonstrations.add(make(1, videos=(VideoReference(film, ClockMap()),))).id


def change(path: Path, *statements: str) -> None:
    """Write into a store what its checks and triggers would refuse."""
    with closing(sqlite3.connect(path / "project.sqlite", isolation_level=None)) as store:
        store.execute("PRAGMA ignore_check_constraints = ON")
        for statement in statements:
            store.execute(statement)


def assert_refused(path: Path, match: str, capsys) -> None:
    """Opening is refused in one sentence, and the command that deletes is, too."""
    with pytest.raises(InputError, match=match) as refusal:
        Project.open(path).close()
    assert "\n" not in str(refusal.value)
    capsys.readouterr()
    assert main(["remove", str(path), "01", "--yes"]) == 1
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("video", ["{}/canary.mp4", "../../../canaries/canary.mp4", "signals.npy"])
def test_a_video_outside_its_folder_is_refused(path, stored, canaries, video, film, capsys):
    change(path, f"UPDATE video SET file = '{video.format(canaries)}'")
    assert_refused(path, "damaged", capsys)
    assert main(["attach", str(path), "01", str(film)]) == 1
    out = canaries.parent / "out.zip"
    assert main(["export", str(path), "--format", "archive", "--out", str(out)]) == 1
    assert not out.exists()


@pytest.mark.parametrize("name", ["demonstrations", "recognisers"])
def test_folders_that_are_links_are_not_followed(path, stored, canaries, name, capsys):
    (path / name).rename(path.with_name("aside"))
    (path / name).symlink_to(canaries)
    assert_refused(path, f"{name}' is a link", capsys)


@pytest.mark.parametrize("video", ["{}/canary.mp4", "../../../canaries/canary.mp4"])
@pytest.mark.parametrize("form", ["elan", "archive", "boris"])
def test_no_export_links_or_carries_a_file_of_elsewhere(
    path, stored, canaries, video, form, capsys
):
    out = canaries.parent / "out"
    change(path, f"UPDATE video SET file = '{video.format(canaries)}'")
    assert main(["export", str(path), "--format", form, "--out", str(out)]) == 1
    assert not list(out.rglob("*"))
    assert "canary" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("column", "text"),
    [
        ("settings", "[]"),
        ("settings", '{"a": 1e999}'),
        ("settings", '{"choice": [1]}'),
        ("settings", "{" * 10_000),
        ("labels", '[["a", "b", 1e999]]'),
        ("labels", "[1]"),
        ("labels", '[["a", 2, 3]]'),
        ("versions", "[]"),
        ("versions", '{"numpy": NaN}'),
        ("time", "soon"),
    ],
)
def test_how_a_run_was_made_is_read_with_suspicion(path, stored, column, text, capsys):
    with Project.open(path) as project:
        project.runs.add(
            "evaluate", Provenance(settings={}, seed=0, labels=(), versions={}), result={}
        )
    change(path, f"UPDATE run SET {column} = '{text}'")
    for command in (["runs", str(path)], ["runs", str(path), "--json"]):
        assert main(command) == 1
        printed = capsys.readouterr().err
        assert "damaged" in printed
        assert printed.count("\n") == 1


@pytest.mark.parametrize("name", ["project.sqlite", "project.sqlite-wal", "project.sqlite-shm"])
def test_a_store_that_is_a_link_is_not_followed(path, stored, canaries, name, capsys):
    (path / name).unlink(missing_ok=True)
    (path / name).symlink_to(canaries / "canary.mp4")
    assert_refused(path, "is a link", capsys)


def test_links_within_the_folders_are_not_followed(path, stored, canaries, film):
    demonstrations = path / "demonstrations"
    (demonstrations / ("e" * 32)).symlink_to(canaries / ("f" * 32))
    (demonstrations / ".incoming-fedcba9876543210").symlink_to(canaries / "victim")
    home = demonstrations / stored
    (home / "uncommitted").symlink_to(canaries / "canary.mp4")
    with Project.open(path) as project:
        assert project.demonstrations.load(stored).video is not None
        project.demonstrations.remove_all({stored: {}})
    assert not home.exists()


def test_a_demonstration_whose_folder_is_a_link_is_neither_read_nor_deleted(path, stored, canaries):
    home = path / "demonstrations" / stored
    home.rename(path.with_name("aside"))
    home.symlink_to(canaries / "victim")
    with Project.open(path) as project:
        with pytest.raises(InputError, match="is a link"):
            project.demonstrations.load(stored)
        with pytest.raises(InputError, match="is a link"):
            project.demonstrations.remove_all({stored: {}})
        with pytest.raises(InputError, match="is a link"):
            project.media.attach_stamps(stored, {"start": np.zeros(1)})


def test_a_video_that_is_a_link_is_not_read(path, stored, canaries):
    (video,) = (path / "demonstrations" / stored).glob("video-*")
    video.unlink()
    video.symlink_to(canaries / "canary.mp4")
    with Project.open(path) as project, pytest.raises(InputError, match="is a link"):
        project.demonstrations.load(stored)


def test_only_folders_of_demonstrations_are_ever_deleted(canaries):
    with pytest.raises(InputError, match="was not deleted"):
        remove(canaries / "victim")


TRIGGER = "CREATE TRIGGER gone AFTER INSERT ON segment BEGIN DELETE FROM segment; END"
ENDLESS = (
    "CREATE VIEW many AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
    "SELECT i FROM n"
)


@pytest.mark.parametrize(
    "statement",
    [
        TRIGGER,
        ENDLESS,
        "DROP TRIGGER edit_is_not_deleted",
        "DROP INDEX edit_of_track",
        "CREATE INDEX more ON segment (action)",
        "CREATE TABLE more (x)",
        "ALTER TABLE note ADD COLUMN more",
        "DROP TABLE note",
        "ALTER TABLE note RENAME TO notes",
    ],
)
def test_other_tables_triggers_and_views_are_refused(path, stored, statement, capsys):
    change(path, statement)
    assert_refused(path, "other tables, views or triggers|is damaged", capsys)


def test_a_version_below_zero_runs_no_migration_backwards(path, stored, capsys):
    change(path, "PRAGMA user_version = -1")
    assert_refused(path, "damaged .version -1", capsys)
    change(path, "PRAGMA user_version = 2")
    assert_refused(path, "other tables, views or triggers", capsys)


@pytest.mark.parametrize(
    "change_of",
    [
        "demonstration SET id = '../../canaries/victim'",
        "demonstration SET id = '../canaries'",
        "demonstration SET id = '..'",
        "demonstration SET id = ''",
        "demonstration SET name = x'ff00'",
        "demonstration SET period = 0.0",
        "demonstration SET period = -1.0",
        "demonstration SET period = 9e999",
        "demonstration SET grid_rate = 9e999",
        "demonstration SET grid_rate = x'00'",
        "demonstration SET duration = 'long'",
        "demonstration SET samples = 'many'",
        "demonstration SET samples = -5",
        "demonstration SET channels = x'5b5d'",
        "demonstration SET source = x'00'",
        "demonstration SET video = 'video-0123456789abcdef'",
        "demonstration SET video_rate = 1.0",
        "video SET offset = 9e999",
        "video SET offset = 'soon'",
        "video SET rate = 0.0",
        "video SET file = x'00'",
        "video SET name = x'00'",
        "video SET position = -1",
        "video SET position = 9e999",
        f"demonstration SET id = '{'ABCDEF' * 6}'",
        f"video SET demonstration = '{'0' * 32}'",
    ],
)
def test_values_that_no_forcelab_writes_are_refused(path, stored, canaries, change_of, capsys):
    change(path, f"UPDATE {change_of}")
    assert_refused(path, "damaged", capsys)


def bit_rot(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[10:70] = b"(" * 60
    file.write_bytes(content)


def folder_instead(file: Path) -> None:
    file.unlink()
    file.mkdir()


def pipe_instead(file: Path) -> None:
    file.unlink()
    os.mkfifo(file)


@pytest.mark.parametrize("name", ["times.npy", "signals.npy"])
@pytest.mark.parametrize(
    "damage",
    [
        bit_rot,
        folder_instead,
        pipe_instead,
        lambda file: np.save(file, np.zeros((3, 3))),
        lambda file: np.save(file, np.array([{}], dtype=object)),
        lambda file: np.save(file, np.zeros((500, 2), np.complex128)),
        lambda file: file.write_bytes(file.read_bytes() + b"more"),
        lambda file: file.write_bytes(b"PK\x03\x04" + file.read_bytes()),
    ],
)
def test_a_damaged_file_is_one_sentence_with_the_name(path, stored, name, damage, capsys):
    damage(path / "demonstrations" / stored / name)
    with Project.open(path) as project:
        with pytest.raises(InputError, match=f"'01' cannot be read: .*{name}") as refusal:
            project.demonstrations.load(stored)
        assert "\n" not in str(refusal.value)


def test_other_samples_and_channels_make_no_other_demonstration(path, stored, capsys):
    file = path / "demonstrations" / stored / "signals.npy"
    np.save(file, np.load(file) + 1.0)
    change(path, """UPDATE demonstration SET channels = replace(channels, '[["', '[["x')""")
    with Project.open(path) as project:
        assert project.demonstrations.load("01").id == stored
    assert main(["plan", str(path), "01"]) == 0
    archive = ["export", str(path), "--format", "archive", "--out", str(path.parent / "out")]
    assert main(archive) == 1
    assert "no longer what was recorded" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["stamps.npz", "truth.json"])
def test_a_pipe_beside_the_arrays_does_not_hang(path, stored, name):
    os.mkfifo(path / "demonstrations" / stored / name)
    with Project.open(path) as project:
        read = project.media.stamps if name == "stamps.npz" else project.demonstrations.truth
        with pytest.raises(InputError, match="is not a file"):
            read(stored)


def test_names_of_thousands_of_digits_sort():
    names = ["9" * 5000, "10", "2", "pen-10", "pen-2", "1" + "0" * 5000]
    assert sorted(names, key=natural_order) == [
        "2", "10", "9" * 5000, "1" + "0" * 5000, "pen-2", "pen-10",
    ]  # fmt: skip


@pytest.mark.parametrize("text", ["9" * 5000, "x" * 1001])
def test_names_and_tasks_have_a_bound(path, stored, make, text):
    with Project.open(path) as project:
        before = project.demonstrations.info(stored)
        for change in (
            lambda: project.demonstrations.rename(stored, text),
            lambda: project.demonstrations.set_task(stored, text),
            lambda: project.demonstrations.add(make(2, name=text)),
            lambda: project.demonstrations.add(make(2, task=text)),
        ):
            with pytest.raises(InputError, match="longer than 1000 characters") as refusal:
                change()
            assert len(str(refusal.value)) < 400
        assert project.demonstrations.infos() == (before,)


def test_a_file_name_of_250_bytes_is_imported(tmp_path, path):
    file = tmp_path / ("a" * 246 + ".csv")
    file.write_text("time,fx\n0,1\n0.001,2\n0.002,3\n0.003,4\n", "utf-8")
    assert main(["import", str(path), str(file)]) == 0
    with Project.open(path) as project:
        assert [info.name for info in project.demonstrations.infos()] == ["a" * 246]


def test_mutated_projects_end_in_a_sentence_and_touch_nothing_outside(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "fuzz")
    from campaign import findings
    from stores import STORES

    assert list(findings(STORES, 8, 0, tmp_path / "stores")) == []


def test_a_schema_with_bytes_that_are_no_text_is_one_sentence(path, stored, canaries):
    file = path / "project.sqlite"
    with closing(sqlite3.connect(file)) as store:
        store.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    content = file.read_bytes()
    for words in (b"CREATE TABLE demonstration", b"CREATE TABLE author", b"CREATE INDEX"):
        file.write_bytes(content.replace(words, b"\x8b" + words[1:], 1))
        with pytest.raises(InputError, match="damaged|not those|other tables"):
            Project.open(path)


def test_rows_that_refer_across_demonstrations_end_a_removal_in_a_sentence(path, make, capsys):
    with Project.create(path) as project:
        ids = [project.demonstrations.add(make(seed, f"0{seed}")).id for seed in (1, 2)]
        for id_ in ids:
            TrackEditor(project, id_, "ada").paint(0.0, 0.1, "grab")
    with closing(sqlite3.connect(path / "project.sqlite")) as store:
        (trigger,) = store.execute(
            "SELECT sql FROM sqlite_schema WHERE name = 'edit_is_not_changed'"
        ).fetchone()
    parent = "UPDATE edit SET parent = 1 WHERE id = 2"
    change(path, "DROP TRIGGER edit_is_not_changed", parent, trigger)
    capsys.readouterr()
    assert main(["remove", str(path), "01", "--yes"]) == 1
    assert "Traceback" not in capsys.readouterr().err
