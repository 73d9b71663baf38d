"""The registry: formats are told by content, and what cannot be read is told in a sentence."""

import os
import subprocess
import sys
import zipfile
from importlib import import_module

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.extras import PACKAGES
from forcelab.formats import all_formats, format_names, identify, read
from forcelab.formats.recording import ReadOptions
from forcelab.project import Project
from tests.formats import column_files

TABLE = b"t,fx,fy\n" + b"".join(b"%.3f,%d.5,%d.25\n" % (i / 100, i, -i) for i in range(50))


@pytest.mark.parametrize("name", ["a.csv", "a.pdl", "a.zip", "a.jpg", "a"])
def test_a_table_is_a_table_whatever_it_is_called(tmp_path, name):
    (tmp_path / name).write_bytes(TABLE)
    assert identify(tmp_path / name).name == "table"
    (recording,) = read(tmp_path / name)
    assert recording.demonstration.times.size == 50


def test_options_reach_the_format(tmp_path):
    (tmp_path / "a.csv").write_bytes(TABLE)
    (recording,) = read(str(tmp_path / "a.csv"), ReadOptions(task="LEGO"))
    assert recording.demonstration.task == "LEGO"


def test_names_are_unique_and_every_module_can_tell_and_read_its_format(tmp_path):
    names = [known.name for known in all_formats()]
    assert len(set(names)) == len(names)
    for known in all_formats():
        module = import_module(known.module)
        assert module.sniff(tmp_path / "a", b"\x00") is False
        assert callable(module.read)


def test_the_registry_imports_no_format_and_reading_a_table_no_other_one(tmp_path):
    (tmp_path / "a.csv").write_bytes(TABLE)
    code = "import sys; from forcelab.formats import read; print(*sys.modules)"
    code += "; read(sys.argv[1]); print(*sys.modules)"
    words = [sys.executable, "-c", code, tmp_path / "a.csv"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    before, after = (set(line.split()) for line in done.stdout.splitlines())
    known = {known.module for known in all_formats()}
    assert not before & known
    assert after & known == {"forcelab.formats.table"}
    assert not after & set(PACKAGES)


def whole_bag(folder):
    from tests.formats.rosbag_files import WRENCH, wrenches, write_bag

    return [write_bag(folder / "a.bag", {"/ft": (WRENCH, wrenches())})]


@pytest.mark.parametrize(
    ("package", "extra", "write"),
    [
        ("pyarrow", "parquet", column_files.whole_arrow),
        ("openpyxl", "excel", column_files.whole_workbooks),
        ("pyxdf", "xdf", column_files.whole_xdf),
        ("nptdms", "tdms", column_files.whole_tdms),
        ("rosbags", "rosbag", whole_bag),
    ],
)
def test_without_its_library_a_file_says_how_to_install_it(
    tmp_path, monkeypatch, package, extra, write
):
    pytest.importorskip(package)
    path = write(tmp_path)[0]
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf"-m pip install .forcelab\[{extra}\]"):
        read(path)


UNKNOWN = {
    "a PNG picture": b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + bytes(range(256)),
    "a JPEG picture": b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + bytes(range(256)),
    "a pointer of Git LFS (git lfs pull fetches the file)": b"version https://git-lfs.github.com\n",
    "a PDF document": b"%PDF-1.7\n%\xe2\xe3\xcf\xd3\n1 0 obj\n",
    "an old Excel or Word file, whose tables can be saved as .xlsx or CSV": (
        b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600)
    ),
    "a Feather file of version 1 (pandas writes it again by to_feather or to_parquet)": (
        b"FEA1" + bytes(80) + b"FEA1"
    ),
    "a TRC file, which holds markers only (forces are in a MOT, STO or C3D)": (
        b"PathFileType\t4\t(X/Y/Z)\twalk.trc\nDataRate\tNumFrames\n60.00\t2\n"
        b"Frame#\tTime\tASIS\n\t\tX1\tY1\tZ1\n\n1\t0\t1.5\t2.5\t3.5\n2\t0.1\t1.5\t2.5\t3.5\n"
    ),
    "a web page": b"<!DOCTYPE html>\n<title>404</title>\n1,2,3\n4,5,6\n",
    "a WAV recording": b"RIFF\x24\x08\x00\x00WAVEfmt \x10\x00\x00\x00" + bytes(64),
    "a gzip file, which must be unpacked first": b"\x1f\x8b\x08\x00" + bytes(range(64)),
    "an SQLite database": b"SQLite format 3\x00\x10\x00\x01\x01" + bytes(80),
    "a file of zeros, as a failed copy leaves it": bytes(5000),
    "unknown binary data": bytes(range(1, 256)) * 4,
}


@pytest.mark.parametrize("name", ["a.bin", "a.csv"])
@pytest.mark.parametrize(("kind", "data"), UNKNOWN.items(), ids=UNKNOWN)
def test_a_foreign_file_is_told_by_what_it_is(tmp_path, kind, data, name):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError) as refusal:
        read(tmp_path / name)
    readable = ", ".join(known.description for known in all_formats())
    assert str(refusal.value) == (
        f"'{tmp_path / name}' looks like {kind}; what can be read: {readable}."
    )


@pytest.mark.parametrize(
    ("entries", "kind"),
    [
        (
            ["[Content_Types].xml", "xl/workbook.bin"],
            "an Excel workbook, which can be saved as CSV",
        ),
        (["[Content_Types].xml", "word/document.xml"], "an Office document"),
        (["holiday.jpg"], "a zip file"),
        (["a.npy", "holiday.jpg"], "a NumPy archive"),
    ],
)
def test_a_foreign_zip_is_told_by_what_is_in_it(tmp_path, entries, kind):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as created:
        for entry in entries:
            created.writestr(entry, "x")
    with pytest.raises(InputError, match=rf"a\.zip' looks like {kind}"):
        read(tmp_path / "a.zip")


def test_a_zip_that_is_cut_short_is_told_as_such(tmp_path):
    path = tmp_path / "a.xlsx"
    with zipfile.ZipFile(path, "w") as created:
        created.writestr("xl/workbook.xml", "x" * 1000)
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(InputError, match="an Excel workbook that is cut short or damaged; copy it"):
        read(path)


def test_of_a_project_it_is_said_how_its_recordings_are_imported(tmp_path):
    Project.create(tmp_path / "p").close()
    with pytest.raises(InputError, match="p' is a project; export it as an archive"):
        read(tmp_path / "p")


def test_of_a_video_it_is_said_how_one_is_attached(tmp_path):
    film = tmp_path / "karma.mp4"
    film.write_bytes(b"\x00\x00\x00\x20ftypisom\x00\x00\x02\x00" + bytes(64))
    with pytest.raises(InputError, match="an MP4 or QuickTime video, which .* attach") as refusal:
        read(film)
    assert "forcelab attach" in str(refusal.value)
    assert "Demonstration > Attach video" in str(refusal.value)


def test_what_is_no_file_is_refused_with_the_cure(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty.csv").touch()
    for name, what in [
        ("folder", r"is a folder; name the files in it, such as .*folder/\*\.csv"),
        ("missing.csv", "does not exist; check its spelling"),
        ("empty.csv", r"is empty \(0 bytes\)"),
    ]:
        with pytest.raises(InputError, match=rf"{name}' {what}"):
            read(tmp_path / name)


@pytest.mark.skipif(os.name != "posix", reason="pipes as POSIX has them")
@pytest.mark.timeout(20)
def test_a_pipe_is_refused_and_does_not_hang(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe' is a device or pipe"):
        read(tmp_path / "pipe")


def test_a_file_that_the_system_does_not_give_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_bytes(TABLE)

    def forbidden(*args, **kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(type(path), "open", forbidden)
    with pytest.raises(InputError, match=r"a\.csv' cannot be read: Permission denied"):
        read(path)


def test_the_sentence_names_the_file_and_stays_one_line(tmp_path):
    path = tmp_path / "two\nlines.pdl"
    path.write_bytes(b"\x80\x02K\x01.")
    with pytest.raises(InputError) as refusal:
        read(path)
    assert r"two\nlines.pdl" in str(refusal.value)
    assert str(refusal.value).isprintable()


BEATS = """
from pathlib import Path
import numpy as np
from forcelab.demonstration import Channel, Demonstration
from forcelab.formats import Format
from forcelab.formats.recording import Recording

FORMAT = Format("beats", "files of beats", "beats", starts=(b"BEATS",))

def sniff(path, head):
    return True

def read(path, options):
    values = np.frombuffer(path.read_bytes()[5:], dtype="<f8").reshape(-1, 1)
    times = np.arange(len(values)) / 100
    return [Recording(Demonstration(path.stem, "", times, values, (Channel("fz", "N"),)))]
"""


@pytest.fixture
def brought(tmp_path, monkeypatch):
    """Make another package bring a format; call it with what its entry point names."""

    def bring(value):
        info = tmp_path / "site" / "beats-1.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: beats\nVersion: 1\n")
        (info / "entry_points.txt").write_text(f"[forcelab.formats]\nbeats = {value}\n")
        (info.parent / "beats.py").write_text(BEATS)
        monkeypatch.syspath_prepend(info.parent)
        all_formats.cache_clear()

    yield bring
    monkeypatch.undo()
    all_formats.cache_clear()
    sys.modules.pop("beats", None)


def test_another_package_brings_a_format(brought, tmp_path):
    brought("beats:FORMAT")
    path = tmp_path / "drum.bts"
    path.write_bytes(b"BEATS" + np.arange(5.0).tobytes())
    assert "beats" in format_names()
    (recording,) = read(path)
    assert recording.demonstration.signals[:, 0].tolist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("value", ["beats:MISSING", "nowhere:FORMAT", "beats:sniff"])
def test_a_package_that_brings_none_is_named(brought, tmp_path, value):
    brought(value)
    path = tmp_path / "a.csv"
    path.write_text("time,fz\n0,1\n0.1,2\n")
    with pytest.raises(InputError, match="uninstall"):
        read(path)
