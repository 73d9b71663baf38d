"""Two hundred broken files: each is one sentence, and nothing is written or executed."""

import io
import os
import pickle
import random
import re
import time
import zipfile

import numpy as np
import pytest

from forcelab.cli import main
from forcelab.demonstration import Channel, Demonstration
from forcelab.formats.archive import write_archive
from forcelab.labels import Segment, Track
from forcelab.project import Project

CANARY = "canary"


def record(**changed):
    """A record of the authors' databases, twenty samples long."""
    signals = [[] if place in (0, 1, 4, 5, 6) else [place / 8] * 20 for place in range(11)]
    made = {"name": "a", "timestamps": [i / 100 for i in range(20)], "labels": ["grab"] * 20}
    return made | {"signals": signals} | changed


def database(records, protocol=2):
    parts = (["name", "signals"], 1, records)
    return b"".join(pickle.dumps(part, protocol) for part in parts)


class Call:
    """Pickles as a call."""

    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


def truncated_databases():
    for protocol in (0, 1, 2):
        whole = database({0: record()}, protocol)
        for i in range(12):
            yield f"cut-{protocol}-{i}.pdl", whole[: 1 + i * (len(whole) - 2) // 11]


def noise():
    for seed in range(32):
        dice = random.Random(seed)
        suffix = (".csv", ".pdl", ".zip", ".bin")[seed % 4]
        start = (b"", b"\x80\x02", b"PK\x03\x04", b"\x80\x02]q\x00(")[seed // 4 % 4]
        yield f"noise-{seed}{suffix}", start + dice.randbytes(dice.choice([7, 100, 5000, 200_000]))


def damaged_databases():
    """Some byte of a database is an opcode that its neighbours do not go with."""
    whole = database({0: record()})
    for seed in range(20):
        at = random.Random(seed).randrange(2, 40)
        yield f"damaged-{seed}.pdl", whole[:at] + b"\x93\xff" + whole[at + 2 :]


def wrong_types():
    for number, records in enumerate(
        [
            {},
            {0: None},
            {0: [1.0]},
            {"a": record()},
            {0: record(timestamps=None)},
            {0: record(timestamps=["0"] * 20)},
            {0: record(timestamps=[float("nan")] * 20)},
            {0: record(timestamps=[1e300 * (-1) ** i for i in range(20)])},
            {0: record(timestamps=[0.0] * 20)},
            {0: record(timestamps=[0.0])},
            {0: record(signals={})},
            {0: record(signals=[])},
            {0: record(signals=[[None] * 20] * 11)},
            {0: record(signals=[[[0.5]] * 20] * 11)},
            {0: record(signals=[[2**62] * 19] * 11)},
            {0: record(labels=["grab"])},
            {0: record(labels=[b"grab".decode(), 3] * 10)},
            {0: record(labels=["two\nlines"] * 20)},
            {0: record(labels={})},
            {0: record(), 1: record(signals=[])},
        ]
    ):
        yield f"types-{number}.pdl", database(records)
    yield "one-value.pdl", pickle.dumps(5, 2)
    yield "text.pdl", pickle.dumps("x" * 1000, 2)


def attacks():
    touch = f"open({CANARY!r}, 'w')"
    shell = f"touch {CANARY}"
    for protocol in (0, 2, 4):
        for name, call in {
            "system": Call(os.system, shell),
            "eval": Call(eval, touch),
            "exec": Call(exec, touch),
            "open": Call(open, CANARY, "w"),
        }.items():
            yield f"{name}-{protocol}.pdl", pickle.dumps(call, protocol)
            yield f"{name}-inside-{protocol}.pdl", database({0: record(name=call)}, protocol)
    quoted = shell.encode()
    for name, data in {
        "inst": b"(S'" + quoted + b"'\nios\nsystem\n.",
        "obj": b"(cos\nsystem\nS'" + quoted + b"'\no.",
        "newobj": b"\x80\x02csubprocess\nPopen\n((lS'touch'\naS'canary'\natt\x81.",
        "stack-global": b"\x80\x02U\x02osU\x06system\x93U\x0c" + quoted + b"\x85R.",
        "ext1": b"\x80\x02\x82\x01)R.",
        "ext4": b"\x80\x02\x84\xff\xff\xff\x7f)R.",
        "persid": b"\x80\x02P" + quoted + b"\n.",
        "build": b"\x80\x02}}U\x0c__setstate__cos\nsystem\nsb.",
        "bundle": b"\x80\x02clabelSelectedData\nSignalBundle\n(S'x'\ntR)R.",
        "bundle-attribute": b"\x80\x02clabelSelectedData\nSignalBundle.__init__\n)R.",
        "module": b"\x80\x02ccanary_module\nx\n.",
        "getattr": b"\x80\x02c__builtin__\ngetattr\n(cos\npath\nS'os'\ntR.",
    }.items():
        yield f"{name}.pdl", data


def bombs():
    yield "long4.pdl", b"\x80\x02\x8b\xff\xff\xff\x7f"
    yield "string.pdl", b"\x80\x02T\xff\xff\xff\x7fabc"
    yield "deep-lists.pdl", b"\x80\x02" + b"]" * 100_000 + b"a" * 99_999 + b"."
    yield "deep-marks.pdl", b"\x80\x02" + b"(" * 100_000 + b"l" * 100_000 + b"."
    yield "deep-tuples.pdl", b"\x80\x02)" + b"\x85" * 100_000 + b"."
    yield "itself.pdl", b"\x80\x02]q\x00h\x00a."
    laughs = b"".join(b"](h%ch%ceq%c" % (i, i, i + 1) for i in range(60))
    yield "laughs.pdl", b"\x80\x02(]q\x00" + laughs + b"l."
    keys = b"".join(b"h%ch%c\x86q%c" % (i, i, i + 1) for i in range(60))
    yield "laughing-key.pdl", b"\x80\x02(K\x01\x85q\x00" + keys + b"}h\x3cNs."
    yield "floods.pdl", b"\x80\x02" + b"]" * 2_000_000
    yield "long-digits.pdl", b"(lp0\nI" + b"7" * 3_000_000 + b"\na."


def tables():
    for number, text in enumerate(
        [
            "t,fx\n",
            "t,fx\n0,1\n",
            "t,fx\n0,1\n0.01,up\n0.02,3\n",
            "t,fx\n0,1\n0.01\n",
            "t,fx\nup,down\nleft,right\n",
            "t,fx\n1,1\n1,2\n1,3\n",
            "t,fx\nnan,1\nnan,2\nnan,3\n",
            "t\n0\n0.01\n0.02\n",
            "fx,fy\n0.5,0.25\n0.5,0.75\n0.25,0.125\n",
            "start,end,action\n0,1,grab\n1,2,slip\n",
            '{"t": [0, 1, 2], "fx": [1, 2, 3]}\n',
            "[0, 1, 2]\n",
            "<table><tr><td>0</td></tr></table>\n",
            "Dear all,\nplease find the data attached.\nAda\n",
            "\n\n\n\n",
            ",,,,\n,,,,\n",
            '"t,fx\n0,1\n0.01,2\n',
            "t,fx\n0,1\n0.01,2\n".encode("utf-16")[:21],
            b"t,fx\n0,1\n0.01,\xff\xfe\x00\x00\n0.02,3\n",
            b"t,fx\n0,1\n0.01,2\n" + bytes(4096),
            "<!DOCTYPE html>\n<title>404 not found</title>\n1,2\n3,4\n",
        ]
    ):
        yield f"table-{number}.csv", text if isinstance(text, bytes) else text.encode()
    whole = b"time,force left,force right\n0.000,1.5,2.5\n0.010,1.25,2.25\n"
    for i in range(14):
        yield f"cut-{i}.csv", whole[: 1 + 2 * i]


def huge():
    yield "letters.csv", b"x" * 10_000_000
    yield "digits.csv", b"7" * 10_000_000
    yield "commas.csv", b"," * 10_000_000
    yield "row.csv", b"0.5," * 2_500_000
    yield "quote.csv", b'"' + b"0,1" * 3_300_000
    yield "blanks.txt", b" " * 10_000_000
    yield "zeros.csv", bytes(10_000_000)


def foreign():
    yield "empty.csv", b""
    yield "empty.pdl", b""
    yield "empty.zip", b""
    yield "picture.csv", b"\x89PNG\r\n\x1a\n" + bytes(range(256))
    yield "paper.pdf", b"%PDF-1.7\n1 0 obj\n<< >>\nendobj\n"
    yield "music.wav", b"RIFF\x24\x08\x00\x00WAVEfmt " + bytes(64)
    yield "packed.csv.gz", b"\x1f\x8b\x08\x00" + bytes(range(64))
    yield "array.npy", b"\x93NUMPY\x01\x00v\x00{'descr': '|O'}" + bytes(64)
    yield "store.sqlite", b"SQLite format 3\x00" + bytes(84)
    yield "object.npy", pickle.dumps(np.arange(3), 2)
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as made:
        made.writestr("../" + CANARY, "x")
    yield "escape.zip", stream.getvalue()


GENERATED = [
    *truncated_databases(),
    *noise(),
    *damaged_databases(),
    *wrong_types(),
    *attacks(),
    *bombs(),
    *tables(),
    *huge(),
    *foreign(),
]


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """A small project as an archive."""
    folder = tmp_path_factory.mktemp("archive")
    times = np.arange(50) / 100
    demonstration = Demonstration(
        "LEGO 01", "LEGO", times, np.cos(times)[:, None], (Channel("fx", "N"),)
    )
    with Project.create(folder / "p.forcelab") as project:
        project.add(demonstration, [Track("Ada", (Segment(0.1, 0.2, "grab"),))])
        write_archive(project, folder / "p.zip")
    return (folder / "p.zip").read_bytes()


@pytest.fixture
def room(tmp_path, monkeypatch):
    """A folder to work in; a module that would be noticed if it were imported lies in it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "canary_module.py").write_text(f"open({CANARY!r}, 'w')\nx = 1\n")
    return tmp_path


def snapshot(folder):
    """Every path below a folder, and the content of the files."""
    return {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")}


def assert_refused(room, capsys, name, data):
    """The file is refused in one short sentence in good time, and nothing else happens."""
    (room / name).write_bytes(data)
    before = snapshot(room)
    started = time.process_time()
    status = main(["import", "p.forcelab", name])
    assert time.process_time() - started < 2
    assert snapshot(room) == before
    said = capsys.readouterr()
    assert (status, said.out) == (1, "")
    assert said.err.startswith("forcelab: ")
    assert said.err.endswith("\n")
    sentence = said.err.removeprefix("forcelab: ").removesuffix("\n")
    assert name in sentence
    assert sentence.isprintable()
    assert len(sentence) < 400
    assert sentence[-1] in ".?"
    assert not re.search(r"[.!?] +[A-Z]", sentence)


@pytest.mark.parametrize(("name", "data"), GENERATED, ids=[name for name, _ in GENERATED])
def test_a_broken_file_is_one_sentence_and_nothing_is_written_or_executed(room, capsys, name, data):
    assert_refused(room, capsys, name, data)


@pytest.mark.parametrize("part", range(1, 16))
def test_a_truncated_archive_is_one_sentence(room, capsys, archive, part):
    assert_refused(room, capsys, "cut.zip", archive[: len(archive) * part // 16])


@pytest.mark.parametrize(
    "member",
    ["../canary", "../../canary", "/canary", "demonstrations/../../canary", "..\\canary", "C:\\x"],
)
def test_an_archive_whose_files_would_escape_is_one_sentence(room, capsys, archive, member):
    stream = io.BytesIO(archive)
    with zipfile.ZipFile(stream, "a") as made:
        made.writestr(member, "x")
    assert_refused(room, capsys, "escape.zip", stream.getvalue())


def test_an_archive_that_unpacks_to_gigabytes_is_one_sentence(room, capsys, archive):
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(archive)) as old, zipfile.ZipFile(stream, "w") as made:
        for member in old.namelist():
            content = old.read(member)
            if member.endswith("signals.npy"):
                content += bytes(200_000_000)
            made.writestr(member, content, zipfile.ZIP_DEFLATED, 1)
    assert_refused(room, capsys, "bomb.zip", stream.getvalue())


def test_there_are_two_hundred_of_them():
    assert len({data for _, data in GENERATED}) + 15 + 6 + 1 >= 200
