"""ROS bags as a stranger might send them: definitions, counts, metadata and bytes changed.

Run by hand: ``python tests/fuzz/ros_bags.py --count 5000 --seed 0``.
"""

import random
import shutil
import sqlite3
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from campaign import Campaign, run
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import TypesysError

import forcelab.formats.importing  # noqa: F401 - so that no child has to
from tests.formats.rosbag_files import (
    BEGIN,
    COMPRESSED,
    IMAGE,
    WRENCH,
    compressed_image,
    digest,
    image,
    wrenches,
    write_bag,
)

DEFINITIONS = (
    "odd_msgs/Odd[] inner\nfloat64 force",
    "odd_msgs/Odd inner\nfloat64 force",
    "std_msgs/Empty[] parts\nfloat64[3] force\nstring label\n",
    "std_msgs/Empty[2147483647] parts\nfloat64 force",
    "float64[2147483647] force",
    "string[1000000000] label",
    "geometry_msgs/Wrench[100000000] wrench",
    "\n".join(f"float64 f{i}" for i in range(20_000)),
    "float64[] force\nuint8[] picture\ntime stamp\nduration length",
    "int32 A=1\nint32 A=2\nint32 label",
    "float64 force\n" * 3,
    "float64 __class__\nfloat64 force",
    "float64 def\nfloat64 lambda",
    "missing_msgs/Missing force",
    "float64 fo\u00efrce",
    "\0",
    "",
    "x" * 100_000,
    "[" * 10_000,
)
WORDS = (
    "-1", "0", "1", "4294967295", "9223372036854775807", "1e999", "null", "[]", "{}", "''",
    "../../canaries/canary.mp4", "/etc/passwd", "&a [*a]", "zstd", "FILE", "MESSAGE", "x" * 100_000,
)  # fmt: skip
TEXT = (
    ("std_msgs/Empty", "\n" + "=" * 80 + "\nMSG: std_msgs/Empty\n"),
    ("geometry_msgs/Wrench", "\n" + "=" * 80 + "\nMSG: geometry_msgs/Wrench\nfloat64 x\n"),
)


def whole_bags(folder: Path) -> list[Path]:
    """A ROS 1 bag, plain and packed, and ROS 2 bags of both kinds of data; some with pictures."""
    topics = {
        "/wrist": (WRENCH, wrenches(20)),
        "/label": ("std_msgs/msg/String", [(i / 100, {"data": "grab"}) for i in range(20)]),
    }
    seen = topics | picture_topics()
    return [
        write_bag(folder / "a.bag", topics),
        write_bag(folder / "b.bag", topics, compression="bz2"),
        write_bag(folder / "c", topics, ros=2),
        write_bag(folder / "d", topics, ros=2, storage="db3"),
        write_bag(folder / "e.bag", seen),
        write_bag(folder / "f", seen, ros=2),
        write_bag(folder / "g", seen, ros=2, storage="db3"),
    ]


def picture_topics() -> dict[str, tuple[str, list[tuple[float, dict[str, Any]]]]]:
    """Small pictures of each kind."""
    shown = np.arange(12 * 16 * 3, dtype=np.uint8).reshape(12, 16, 3)
    times = [i / 50 for i in range(8)]
    return {
        "/raw": (IMAGE, [(t, image(t, shown)) for t in times]),
        "/jpeg": (COMPRESSED, [(t, compressed_image(t, shown)) for t in times]),
        "/png": (COMPRESSED, [(t, compressed_image(t, shown, "png")) for t in times]),
    }


ENCODINGS = (
    "rgb8",
    "bgra16",
    "mono16",
    "bayer_rggb8",
    "yuv422",
    "16UC1",
    "8UC3",
    "",
    "x" * 100_000,
)
SIZES = (0, 1, 2, 3, 12, 16, 17, 48, 65535, 2**31 - 1, 2**32 - 1)
NAMES = (
    "/raw",
    "/jpeg",
    "",
    "/",
    "//",
    "/../../canaries/canary",
    "/a\nb",
    "/\u00e9",
    "/" + "x" * 300,
)


def odd_pictures(place: Path, chance: random.Random) -> Path:
    """A bag whose pictures state what they are not."""
    topics: dict[str, Any] = {"/wrist": (WRENCH, wrenches(20))}
    for name, (kind, messages) in picture_topics().items():
        for _, message in messages:
            if chance.random() < 0.7:
                change_picture(message, chance)
        topics[chance.choice(NAMES) if chance.random() < 0.3 else name] = kind, messages
    ros = chance.choice((1, 2))
    return write_bag(place / ("odd.bag" if ros == 1 else "odd"), topics, ros=ros)


def change_picture(message: dict[str, Any], chance: random.Random) -> None:
    """Another size, encoding, stamp or content."""
    field = chance.choice(list(message))
    if field == "header":
        second = chance.choice((0, 1, 2**31 - 1, 1_700_000_000))
        message["header"] = {"stamp": {"sec": second, "nanosec": chance.choice((0, 999_999_999))}}
    elif field in ("encoding", "format"):
        message[field] = chance.choice(ENCODINGS)
    elif field != "data":
        message[field] = chance.choice(SIZES)
    else:
        content = bytearray(message["data"].tobytes())
        for _ in range(chance.choice((1, 3))):
            at = chance.randrange(min(chance.choice((30, 700)), len(content)))
            content[at : at + 2] = chance.choice((chance.randbytes(2), b"\xff\xff", b"\0\0", b""))
        del content[chance.choice((0, 4, len(content), len(content))) :]
        message["data"] = np.frombuffer(bytes(content), np.uint8)


def odd_bag(place: Path, chance: random.Random) -> Path:
    """A bag whose messages are of a definition that nobody would write."""
    text = chance.choice(DEFINITIONS)
    for name, more in TEXT:
        text += more if name in text and chance.random() < 0.9 else ""
    count = chance.choice((0, 1, 10, 5000))
    first = b"\xff\xff\xff\x7f" if chance.random() < 0.5 else b"\0\0\0\0"
    raw = first + chance.randbytes(chance.choice((0, 8, 64)))
    if chance.random() < 0.5:
        path = place / "odd.bag"
        writer = Writer1(path)
        with writer:
            connection = writer.add_connection(
                "/force", "odd_msgs/msg/Odd", msgdef=text, md5sum=known_digest(text)
            )
            for number in range(count):
                writer.write(connection, BEGIN + number, raw)
        return path
    path = place / "odd"
    plugin = chance.choice((StoragePlugin.MCAP, StoragePlugin.SQLITE3))
    with Writer2(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection(
            "/force",
            "odd_msgs/msg/Odd",
            msgdef=text,
            rihs01=f"RIHS01_{0:064x}",
        )
        for number in range(count):
            writer.write(connection, BEGIN + number, b"\0\1\0\0" + raw)
    return path


def known_digest(text: str) -> str:
    """The definition's own digest, or any where it has none."""
    try:
        return str(digest("odd_msgs/msg/Odd", text))
    except (TypesysError, KeyError, AssertionError):
        return "0" * 32


def change_bytes(file: Path, chance: random.Random) -> None:
    """Other bytes, numbers without end, or a piece less."""
    content = bytearray(file.read_bytes())
    for _ in range(chance.choice((1, 1, 4)) if content else 0):
        at = chance.randrange(min(chance.choice((256, 4096, len(content))), len(content)))
        kind = chance.random()
        if kind < 0.6:
            content[at] = chance.randrange(256)
        elif kind < 0.8:
            content[at : at + 4] = chance.choice((b"\xff\xff\xff\x7f", b"\xff" * 4, b"\0" * 4))
        elif kind < 0.9:
            del content[at : at + chance.randrange(1, 9)]
        else:
            content[at:at] = chance.randbytes(chance.randrange(1, 9))
    if chance.random() < 0.1 and content:
        del content[chance.randrange(len(content)) :]
    file.write_bytes(content)


def change_words(file: Path, chance: random.Random) -> None:
    """Another value in the metadata of a ROS 2 bag."""
    lines = file.read_text("utf-8").splitlines()
    number = chance.randrange(len(lines))
    name, colon, _ = lines[number].partition(":")
    kind = chance.random()
    if kind < 0.7:
        lines[number] = f"{name}{colon} {chance.choice(WORDS)}"
    elif kind < 0.85:
        del lines[number]
    else:
        lines.insert(number, lines[number])
    file.write_text("\n".join(lines), "utf-8")


def change_database(file: Path, chance: random.Random) -> None:
    """Other rows, or a view that never ends in place of them."""
    with closing(sqlite3.connect(file, isolation_level=None)) as store:
        if chance.random() < 0.3:
            store.execute("ALTER TABLE messages RENAME TO old")
            store.execute(
                "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 "
                "FROM n) SELECT i AS id, 1 AS topic_id, i AS timestamp, x'00' AS data FROM n"
            )
            return
        tables = [name for (name,) in store.execute("SELECT name FROM sqlite_schema") if name]
        table = chance.choice([name for name in tables if name in ("topics", "messages", "schema")])
        column = chance.choice(list(store.execute(f"PRAGMA table_info({table})")))[1]
        value = chance.choice(("NULL", "-1", "9223372036854775807", "'x'", "zeroblob(1000000)"))
        store.execute(f"UPDATE {table} SET {column} = {value}")


def mutate(whole: list[Path], place: Path, chance: random.Random) -> list[list[str]]:
    project, kind = place / "p.forcelab", chance.random()
    if kind < 0.3:
        path = odd_pictures(place, chance)
        # What was written is decoded, too.
        return [["import", str(project), str(path), "--task", "t"], ["sync", str(project), "odd"]]
    if kind < 0.5:
        path = odd_bag(place, chance)
    else:
        source = chance.choice(whole)
        path = place / source.name
        if source.is_file():
            shutil.copy(source, path)
        else:
            shutil.copytree(source, path)
    file = chance.choice([path] if path.is_file() else sorted(path.iterdir()))
    kind = chance.random()
    if file.suffix == ".yaml" and kind < 0.8:
        change_words(file, chance)
    elif file.suffix == ".db3" and kind < 0.5:
        try:
            change_database(file, chance)
        except sqlite3.DatabaseError:  # the table's own bounds
            change_bytes(file, chance)
    else:
        change_bytes(file, chance)
    return [["import", str(project), str(path), "--task", "t"]]


if __name__ == "__main__":
    run(__doc__, Campaign("bag", whole_bags, mutate))
