"""Commands on mutated projects: rows, tables, bytes and files as a stranger might send them.

Run by hand: ``python tests/fuzz/stores.py --count 5000 --seed 0``.
"""

import os
import random
import shutil
import sqlite3
import sys
from contextlib import closing
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from campaign import Campaign, run

from forcelab.clock import ClockMap
from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.labels import Segment, Track
from forcelab.project import Project

VALUES = (
    "NULL", "-1", "0", "1", "0.0", "-0.5", "9e999", "-9e999", "1e300", "1e-300",
    "9223372036854775807", "-9223372036854775808", "x'00ff'", "x'5b5d'", "zeroblob(100000)", "''",
    "' '", "'..'", "'../../canaries/victim'", "'../../../canaries/canary.mp4'",
    "'{canaries}/canary.mp4'", "'{canaries}/victim'", "'[]'", "'{{}}'", "'[[1,2]]'",
    "'[[0, 1e999, \"grab\"]]'", "'[' || replace(hex(zeroblob(50000)), '00', '[') || ']'",
    "replace(hex(zeroblob(3000)), '0', '9')", "replace(hex(zeroblob(200000)), '0', 'x')",
    "'a' || char(0) || 'b'", "char(27) || '[2J'", "CAST(x'ff' AS TEXT)", "'model'", "'undo'",
    "'=1+1'",
)  # fmt: skip
SCHEMAS = (
    "CREATE TRIGGER gone AFTER INSERT ON edit BEGIN DELETE FROM segment; END",
    "CREATE TRIGGER more AFTER UPDATE ON demonstration BEGIN UPDATE author SET name = 'x'; END",
    "CREATE VIEW many AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
    "SELECT i FROM n",
    "ALTER TABLE note RENAME TO notes",
    "ALTER TABLE note ADD COLUMN more",
    "ALTER TABLE segment DROP COLUMN action",
    "CREATE TABLE more (x)",
    "CREATE INDEX more ON segment (action)",
    "DROP TABLE vocabulary",
    "DROP TABLE verdict",
    "DROP TRIGGER edit_is_not_deleted",
    "DROP TRIGGER note_is_not_changed",
    "PRAGMA application_id = 7",
    *(f"PRAGMA user_version = {n}" for n in (-1, -(2**31), 0, 1, 2, 3, 4, 6, 2**31 - 1)),
)


def make_project(folder: Path) -> None:
    """Two demonstrations, one of them filmed twice and labelled by two coders."""
    film = folder.with_name("film.avi")
    for file, shade in ((film, 0), (film.with_name("other.avi"), 99)):
        writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*"MJPG"), 50.0, (32, 32))
        for number in range(10):
            writer.write(np.full((32, 32, 3), shade + number, np.uint8))
        writer.release()
    times, signals = np.arange(200) / 1000, np.random.default_rng(0).normal(size=(200, 2))
    channels = (Channel("fx", "N"), Channel("fz", "N"))
    with Project.create(folder) as project:
        videos = (VideoReference(film, ClockMap()), VideoReference(film, ClockMap(0.5), "left"))
        first = Demonstration("01", "LEGO", times, signals, channels, videos)
        labels = (Segment(0.0, 0.05, "grab"), Segment(0.06, 0.1, "hold"))
        id_ = project.demonstrations.add(
            first, [Track("anna", labels), Track("ben", labels[:1])]
        ).id
        project.tracks.edit(id_, "anna", labels, labels[:1], "hold deleted")
        project.demonstrations.add(Demonstration("02", "LEGO", times, signals + 1, channels))


def change_row(folder: Path, chance: random.Random) -> str:
    """Put an odd value into one column of a table."""
    with closing(sqlite3.connect(folder / "project.sqlite", isolation_level=None)) as store:
        tables = [
            table
            for (table,) in store.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")
            if store.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
        ]
        table = chance.choice(tables)
        column = chance.choice(list(store.execute(f"PRAGMA table_info({table})")))[1]
        value = chance.choice(VALUES).format(canaries=folder.parents[1] / "canaries")
        store.execute("PRAGMA ignore_check_constraints = ON")
        triggers = list(
            store.execute(
                "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger' AND tbl_name = ?",
                (table,),
            )
        )
        try:
            for name, _ in triggers:
                store.execute(f"DROP TRIGGER {name}")
            which = "" if chance.random() < 0.5 else f" WHERE rowid = {chance.randint(1, 3)}"
            store.execute(f"UPDATE {table} SET {column} = {value}{which}")
        except sqlite3.DatabaseError:  # the table's own bounds: another case then
            pass
        finally:
            for _, sql in triggers:
                store.execute(sql)
    return f"{table}.{column} = {value[:50]}{which}"


def change_schema(folder: Path, chance: random.Random) -> str:
    """Change tables, triggers, views or the version."""
    statement = chance.choice(SCHEMAS)
    with closing(sqlite3.connect(folder / "project.sqlite", isolation_level=None)) as store:
        try:
            store.execute(statement)
        except sqlite3.DatabaseError as error:
            return f"{statement} ({error})"
    return statement


def change_bytes(file: Path, chance: random.Random) -> str:
    """Change, cut or lengthen what is in a file."""
    content = bytearray(file.read_bytes())
    first = chance.choice((100, 4096, len(content)))
    for _ in range(chance.choice((1, 4, 64))):
        content[chance.randrange(min(first, len(content)))] = chance.randrange(256)
    if chance.random() < 0.2:
        del content[chance.randrange(len(content)) :]
    elif chance.random() < 0.1:
        content += bytes(1000)
    file.write_bytes(content)
    return f"bytes of {file.name}"


def change_file(folder: Path, chance: random.Random) -> str:
    """Put something odd in place of a file or a folder of the project."""
    canaries = folder.parents[1] / "canaries"
    places = sorted(folder.rglob("*"))
    homes = [path for path in places if path.parent.name == "demonstrations"]
    home = chance.choice(homes) if homes else folder
    odd = [
        home / name
        for name in ("uncommitted", "stamps.npz", "truth.json", "beside-0123456789abcdef.mp4")
    ]
    place = chance.choice(places + odd)
    # Through a link of an earlier change this hand would touch the canaries itself.
    if not place.parent.is_dir() or not place.parent.resolve().is_relative_to(folder.resolve()):
        return "nothing"
    if (
        place.is_file()
        and not place.is_symlink()
        and place.stat().st_size
        and chance.random() < 0.3
    ):
        return change_bytes(place, chance)
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    else:
        place.unlink(missing_ok=True)
    kind = chance.choice(("nothing", "folder", "pipe", "link", "array", "text"))
    if kind == "folder":
        place.mkdir()
    elif kind == "pipe":
        os.mkfifo(place)
    elif kind == "link":
        place.symlink_to(chance.choice((canaries, canaries / "victim", canaries / "canary.mp4")))
    elif kind == "array":
        shape = chance.choice(((200,), (3, 3), (200, 2), ()))
        with place.open("wb") as stream:
            np.save(stream, np.full(shape, chance.choice((np.nan, np.inf, 0.0, 1e308))))
    elif kind == "text":
        place.write_text(chance.choice(("", "[" * 100_000, "{}", "null")), "utf-8")
    return f"{kind} as {place.name}"


def prepare(folder: Path) -> Path:
    whole = folder / "whole.forcelab"
    make_project(whole)
    return whole


def mutate(whole: Path, place: Path, chance: random.Random) -> list[list[str]]:
    """Change a copy of the project once or twice."""
    folder = place / "p.forcelab"
    shutil.copytree(whole, folder)
    for _ in range(chance.choice((1, 1, 1, 2))):
        change = chance.choice((change_row, change_row, change_schema, change_file, None))
        store = folder / "project.sqlite"
        if store.is_symlink() or not store.is_file():
            break
        try:
            if change is None:
                change_bytes(store, chance)
            else:
                change(folder, chance)
        except (sqlite3.DatabaseError, UnicodeDecodeError):  # it is beyond SQLite already
            break
    p, out = str(folder), str(place / "out")
    formats = ("archive", "elan", "csv", "boris")
    return [
        ["list", p],
        ["list", p, "--json"],
        ["agree", p],
        ["plan", p, "01"],
        ["runs", p],
        ["export", p, "--format", chance.choice(formats), "--out", out],
        ["attach", p, "01", str(whole.with_name("other.avi"))],
        ["remove", p, "01", "--yes"],
    ]


STORES = Campaign("store", prepare, mutate)

if __name__ == "__main__":
    run(__doc__, STORES)
