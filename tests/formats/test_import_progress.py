"""How far a large file has been read is shown, and an import that is cancelled leaves nothing."""

import tempfile

import numpy as np
import pytest
from factories import numbered_frame

from forcelab.cli import main
from forcelab.formats import importing as imports
from forcelab.formats import reading
from forcelab.formats.archive import write_archive
from forcelab.formats.importing import import_files, importing
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import finish
from forcelab.project import Project


@pytest.fixture(autouse=True)
def shown_at_once(monkeypatch):
    monkeypatch.setattr(imports, "SLOW", 0.0)
    monkeypatch.setattr("forcelab.formats.recording._UNIT", 1)


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """Where temporary files go."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def project(tmp_path):
    """A project that holds a recording."""
    table, path = tmp_path / "first.csv", tmp_path / "p.forcelab"
    table.write_text("time,fx\n" + "".join(f"{n / 100},{n % 5}\n" for n in range(50)))
    import_files(path, [table])
    return path


def snapshot(folder):
    """Every file below a folder and what it holds, but for what SQLite has beside its database."""
    files = [p for p in folder.rglob("*") if p.is_file() and not p.name.endswith(("-shm", "-wal"))]
    return {path: path.read_bytes() for path in files}


FRAMES, WRENCHES = 40, 200


@pytest.fixture
def bag(tmp_path):
    """A bag with forces, and pictures of 1.4 MB in all."""
    rosbag_files = pytest.importorskip("tests.formats.rosbag_files")
    frames = [(n / 25, rosbag_files.image(n / 25, numbered_frame(n))) for n in range(FRAMES)]
    wrenches = rosbag_files.wrenches(WRENCHES)
    topics = {"/ft": (rosbag_files.WRENCH, wrenches), "/cam": (rosbag_files.IMAGE, frames)}
    return rosbag_files.write_bag(tmp_path / "peg.bag", topics)


def test_the_messages_of_a_bag_are_counted_by_their_bytes(tmp_path, bag):
    output = []
    assert finish(importing(tmp_path / "n.forcelab", [bag]), output.append).count("new") == 1
    own = [step for step in output if step.total > 2]
    (total,) = {step.total for step in own}
    # Pictures are read for their times, and again to be written.
    assert 1.9 < total / bag.stat().st_size < 2.1
    assert {step.text for step in own} == {"reading peg.bag"}
    done = [step.done for step in own]
    assert done == sorted(done)
    assert done[-1] == total


def test_of_several_files_it_is_told_which_one_is_read(tmp_path, bag, project):
    other = tmp_path / "other.bag"
    other.write_bytes(bag.read_bytes())
    output = []
    finish(importing(project, [other, bag]), output.append)
    texts = {step.text for step in output if step.total > 3}
    assert texts == {"reading other.bag, file 1 of 2", "reading peg.bag, file 2 of 2"}


# While forces are read, and while a video is written.
@pytest.mark.parametrize("share", [0.005, 0.7])
def test_a_bag_that_is_cancelled_half_way_leaves_the_project_as_it_was(
    project, bag, scratch, share
):
    before = snapshot(project)
    job = importing(project, [bag])
    step = next(step for step in job if step.total > 2 and step.done >= share * step.total)
    assert step.done < step.total
    assert any(scratch.rglob("*.mkv")) == (share > 0.5)
    job.close()
    assert snapshot(project) == before
    assert list(scratch.iterdir()) == []


def test_an_import_that_is_cancelled_while_it_writes_leaves_the_project_as_it_was(
    project, bag, scratch
):
    before = snapshot(project)
    job = importing(project, [bag])
    steps = (step for step in job if step.text == "writing p.forcelab")
    for _ in range(3):
        next(steps)
    assert len(snapshot(project)) > len(before)
    job.close()
    assert snapshot(project) == before
    assert list(scratch.iterdir()) == []
    assert import_files(project, [bag]).count("new") == 1


def test_ctrl_c_half_way_is_a_sentence_and_leaves_no_project(
    tmp_path, bag, scratch, monkeypatch, capsys
):
    shown = []

    def watch(_, progress):
        shown.append(progress)
        if progress.total > 2 and 2 * progress.done >= progress.total:
            raise KeyboardInterrupt

    monkeypatch.setattr("forcelab.cli.output.shows_progress", lambda: True)
    monkeypatch.setattr("forcelab.cli.output._Bar.update", watch)
    project = tmp_path / "n.forcelab"
    assert main(["import", str(project), str(bag)]) == 130
    assert "stopped; nothing was left half done." in capsys.readouterr().err
    assert shown[-1].text == "reading peg.bag"
    assert not project.exists()
    assert list(scratch.iterdir()) == []


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_a_long_table_is_read_by_its_letters(tmp_path, encoding):
    path, letters = tmp_path / "long.csv", "time,fx\n"
    letters += "".join(f"{n / 1000:.3f},{n % 7}\n" for n in range(300_000))
    path.write_text(letters, encoding=encoding)
    steps = list(reading(path, ReadOptions()))
    (total,) = {step.total for step in steps}
    assert total - len(letters) == (encoding == "utf-16")  # the mark of the byte order
    assert 0.2 < steps[0].done / total < 0.6 < steps[-1].done / total < 1


def test_a_parquet_table_is_read_by_its_rows(tmp_path):
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    path, rows = tmp_path / "long.parquet", 200_000
    pq.write_table(pa.table({"time": np.arange(rows) / 1000, "fx": np.ones(rows)}), path)
    steps = list(reading(path, ReadOptions()))
    assert len(steps) > 1
    assert {step.total for step in steps} == {rows}
    assert steps[-1].done == rows


@pytest.fixture
def archive(tmp_path):
    """An archive of three recordings."""
    path = tmp_path / "study.forcelab"
    for number in range(3):
        table = tmp_path / f"{number}.csv"
        table.write_text("time,fx\n" + "".join(f"{n / 100},{n * number}\n" for n in range(1, 50)))
        import_files(path, [table])
    with Project.open(path) as opened:
        write_archive(opened, tmp_path / "study.zip")
    return tmp_path / "study.zip"


@pytest.mark.parametrize("vacant", [True, False])
def test_an_archive_is_unpacked_recording_by_recording(tmp_path, project, archive, vacant):
    into = tmp_path / "n.forcelab" if vacant else project
    before = snapshot(tmp_path)
    job = importing(into, [archive])
    step = next(step for step in job if step.total == 3 and step.done == 2)
    assert step.text == f"{'unpacking' if vacant else 'reading'} study.zip"
    job.close()
    assert snapshot(tmp_path) == before
    assert finish(importing(into, [archive])).count("new") == 3


def hdf5_file(path, rows=400_000):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file["t"] = np.arange(rows) / 1000
        file.create_dataset("force", data=np.ones((rows, 3), "f4"), chunks=(4096, 3))
    return path, rows * (8 + 3 * 4)


def test_arrays_are_read_by_their_bytes_in_a_process_that_ends_with_the_import(tmp_path, project):
    path, size = hdf5_file(tmp_path / "a.h5")
    before = snapshot(project)
    job = importing(project, [path])
    step = next(step for step in job if step.total == size // 10**6 and step.done)
    assert step.done < step.total
    job.close()
    assert snapshot(project) == before
    with Project.open(project) as opened:
        assert len(opened.demonstrations.infos()) == 1


def test_of_many_demonstrations_in_a_file_each_is_a_step(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "many.h5", "w") as file:
        for number in range(5):
            file[f"demo_{number}/t"] = np.arange(50) / 100
            file[f"demo_{number}/force"] = np.random.default_rng(number).normal(size=(50, 3))
    steps = list(reading(tmp_path / "many.h5", ReadOptions()))
    assert {step.total for step in steps} <= {1, 5}  # 1: until the process runs
