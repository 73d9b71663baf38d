"""Broken files of every kind: each is one sentence, and nothing is written or executed.

What each reader refuses, and with what words, is tested beside that reader.
"""

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

CANARY = "canary"


def record(**changed):
    """A record of the authors' databases, twenty samples long."""
    signals = [[] if place in (0, 1, 4, 5, 6) else [place / 8] * 20 for place in range(11)]
    created = {"name": "a", "timestamps": [i / 100 for i in range(20)], "labels": ["grab"] * 20}
    return created | {"signals": signals} | changed


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
        for i in range(5):
            yield f"cut-{protocol}-{i}.pdl", whole[: 1 + i * (len(whole) - 2) // 4]


def noise():
    for seed in range(32):
        dice = random.Random(seed)
        suffix = (".csv", ".pdl", ".zip", ".bin")[seed % 4]
        start = (b"", b"\x80\x02", b"PK\x03\x04", b"\x80\x02]q\x00(")[seed // 4 % 4]
        yield f"noise-{seed}{suffix}", start + dice.randbytes(dice.choice([7, 100, 5000, 200_000]))


def attacks():
    call = Call(os.system, f"touch {CANARY}")
    for protocol in (0, 2, 4):
        yield f"system-{protocol}.pdl", pickle.dumps(call, protocol)
        yield f"inside-{protocol}.pdl", database({0: record(name=call)}, protocol)
    yield "module.pdl", b"\x80\x02ccanary_module\nx\n."


def bombs():
    yield "floods.pdl", b"\x80\x02" + b"]" * 2_000_000


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
            "t,label\n0,a\n0.01,b\n0.02,b\n",
            "t,fx\n" + "0.5,1\n" * 1000,
            "t,fx\n0,1\n" + "9" * 2_000_000 + "\n",
            "t,fx\n0,1\n0.01,2\n0.02,\x003\n",
            "word\n" * 50,
            "some, words\nand, more\n" * 20,
            "# only a comment\n",
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
    yield "quotes.csv", b'"' * 10_000_000
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
    with zipfile.ZipFile(stream, "w") as created:
        created.writestr("../" + CANARY, "x")
    yield "escape.zip", stream.getvalue()


KINDS = (truncated_databases, noise, attacks, bombs, tables, huge, foreign)
GENERATED = [file for kind in KINDS for file in kind()]


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


@pytest.mark.parametrize(("name", "data"), GENERATED, ids=[name for name, _ in GENERATED])
def test_a_broken_file_is_one_sentence_and_nothing_is_written_or_executed(room, capsys, name, data):
    (room / name).write_bytes(data)
    before = snapshot(room)
    started = time.process_time()
    status = main(["import", "p.forcelab", name])
    assert time.process_time() - started < 2
    assert snapshot(room) == before
    result = capsys.readouterr()
    assert (status, result.out) == (1, "")
    assert result.err.startswith("forcelab: ")
    assert result.err.endswith("\n")
    sentence = result.err.removeprefix("forcelab: ").removesuffix("\n")
    assert name in sentence
    assert sentence.isprintable()
    assert len(sentence) < 400
    assert sentence[-1] in ".?"
    assert not re.search(r"[.!?] +[A-Z]", sentence)
