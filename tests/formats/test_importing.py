"""Importing: everything is read before anything is written, and one bad file stops it all."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest

from forcelab.errors import InputError
from forcelab.formats.importing import import_files, importing
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment
from forcelab.project import Project

TONGS = Path(__file__).resolve().parents[2] / "../shared/data/tongs"
needs_tongs = pytest.mark.skipif(not TONGS.is_dir(), reason="the real recordings are not here")


def table(path, seed, rows=40):
    """A recording of two forces at 100 Hz."""
    forces = np.random.default_rng(seed).normal(size=(rows, 2))
    lines = ["time (s),fx (N),fz (N)"]
    lines += [f"{i / 100:.2f},{fx:.6f},{fz:.6f}" for i, (fx, fz) in enumerate(forces)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def project(tmp_path):
    """Where a project may be made; nothing is there yet."""
    folder = tmp_path / "projects"
    folder.mkdir()
    return folder / "p.forcelab"


def contents(project):
    """What a project holds: names, tasks and ids."""
    with Project.open(project) as opened:
        return [(info.name, info.task, info.id) for info in opened.demonstrations()]


def test_a_new_project_holds_what_the_files_hold(tmp_path, project):
    files = [table(tmp_path / f"{name}.csv", seed) for seed, name in enumerate(["b", "a"])]
    report = import_files(project, files, ReadOptions(task="LEGO"))
    assert [(one.file, one.added.name, one.added.status) for one in report.demonstrations] == [
        (files[0], "b", "new"),
        (files[1], "a", "new"),
    ]
    assert sorted(name for name, task, _ in contents(project) if task == "LEGO") == ["a", "b"]
    assert [path.name for path in project.parent.iterdir()] == ["p.forcelab"]


def test_the_same_files_again_change_nothing_and_new_labels_are_an_update(tmp_path, project):
    file = table(tmp_path / "a.csv", 1)
    import_files(project, [file])
    before = contents(project)
    assert import_files(project, [file]).count("unchanged") == 1
    (tmp_path / "a.labels.csv").write_text("start,end,action,author\n0.1,0.2,grab,Ada\n")
    report = import_files(project, [file])
    assert report.count("updated") == 1
    assert contents(project) == before
    with Project.open(project) as opened:
        (track,) = opened.tracks(before[0][2])
    assert (track.author, track.segments) == ("Ada", (Segment(0.1, 0.2, "grab"),))


def test_a_labels_file_named_beside_its_recording_is_read_with_it(tmp_path, project):
    recording = table(tmp_path / "a.csv", 1)
    labels = tmp_path / "a.labels.csv"
    labels.write_text("start,end,action\n0.1,0.2,grab\n")
    report = import_files(project, [labels, recording, str(recording)])
    assert [one.file for one in report.demonstrations] == [recording]


def test_one_bad_file_stops_it_all_and_no_project_is_left_behind(tmp_path, project):
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abc"]
    files[1].write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    with pytest.raises(InputError, match=r"b\.csv' looks like a PNG picture"):
        import_files(project, files)
    assert list(project.parent.iterdir()) == []


def test_one_bad_file_leaves_a_project_as_it_was(tmp_path, project):
    import_files(project, [table(tmp_path / "a.csv", 1)])
    before = contents(project)
    with pytest.raises(InputError, match=r"missing\.csv' does not exist"):
        import_files(project, [table(tmp_path / "b.csv", 2), tmp_path / "missing.csv"])
    assert contents(project) == before


def test_several_bad_files_are_one_sentence_that_counts_them(tmp_path, project):
    files = [table(tmp_path / "a.csv", 1), tmp_path / "x.csv", tmp_path / "y.csv"]
    with pytest.raises(InputError) as refusal:
        import_files(project, files)
    assert str(refusal.value) == (
        f"2 of 3 files cannot be read, so none was imported; first: '{tmp_path / 'x.csv'}' does "
        f"not exist; check its spelling and folder."
    )


def test_progress_tells_each_file_before_it_is_read(tmp_path, project):
    files = [table(tmp_path / "a.csv", 1), table(tmp_path / "b.csv", 2)]
    told = []
    report = finish(importing(project, files), told.append)
    assert told == [
        Progress(0, 3, "reading a.csv"),
        Progress(1, 3, "reading b.csv"),
        Progress(2, 3, "writing p.forcelab"),
        Progress(3, 3, "done"),
    ]
    assert report.count("new") == 2


def test_to_stop_while_reading_writes_nothing(tmp_path, project):
    job = importing(project, [table(tmp_path / "a.csv", 1), table(tmp_path / "b.csv", 2)])
    for _ in range(3):
        next(job)
    job.close()
    assert list(project.parent.iterdir()) == []


def failing(monkeypatch, after):
    """Make the project refuse what is added after so many demonstrations."""
    add, count = Project.add, [0]

    def refuse(self, demonstration, *args):
        count[0] += 1
        if count[0] > after:
            raise InputError(f"'{demonstration.name}' was not added to '{self.path}': no space.")
        return add(self, demonstration, *args)

    monkeypatch.setattr(Project, "add", refuse)


def test_a_disk_that_fills_up_leaves_no_new_project_behind(tmp_path, project, monkeypatch):
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abc"]
    failing(monkeypatch, after=2)
    with pytest.raises(InputError) as refusal:
        import_files(project, files)
    assert str(refusal.value) == f"'c' was not added to '{project}': no space."
    assert list(project.parent.iterdir()) == []


def test_a_disk_that_fills_up_keeps_a_project_whole_and_tells_how_far_it_got(
    tmp_path, project, monkeypatch
):
    import_files(project, [table(tmp_path / "z.csv", 1)])
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abc"]
    with monkeypatch.context() as patch:
        failing(patch, after=1)
        with pytest.raises(
            InputError, match=r"no space; 1 of 3 demonstrations were imported before"
        ):
            import_files(project, files)
    report = import_files(project, files)
    assert (report.count("unchanged"), report.count("new")) == (1, 2)


def test_a_folder_that_is_no_project_is_refused_and_stays_as_it_is(tmp_path):
    folder = tmp_path / "thesis"
    folder.mkdir()
    (folder / "chapter.txt").write_text("mine")
    with pytest.raises(InputError, match="is not a forcelab project"):
        import_files(folder, [table(tmp_path / "a.csv", 1)])
    assert [path.name for path in folder.iterdir()] == ["chapter.txt"]


def test_an_empty_folder_becomes_the_project(tmp_path, project):
    project.mkdir()
    import_files(project, [table(tmp_path / "a.csv", 1)])
    assert len(contents(project)) == 1


def test_folders_and_nothing_at_all_are_refused_with_the_cure(tmp_path, project):
    with pytest.raises(InputError, match="is a folder; name the files in it"):
        import_files(project, [tmp_path])
    with pytest.raises(InputError, match="is a folder; name the files in it"):
        import_files(project, ["."])
    with pytest.raises(InputError, match="name at least one"):
        import_files(project, [])
    assert list(project.parent.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="file names of any bytes are POSIX's")
def test_a_name_that_is_no_unicode_is_refused_before_anything_is_written(tmp_path, project):
    odd = table(tmp_path / os.fsdecode(b"gr\xe4b.csv"), 1)
    with pytest.raises(InputError, match="is not valid Unicode; rename") as refusal:
        import_files(project, [table(tmp_path / "a.csv", 2), odd])
    assert str(refusal.value).isprintable()
    assert list(project.parent.iterdir()) == []


def test_remarks_of_the_format_and_of_the_project_are_gathered_by_file(tmp_path, project):
    times = [i / 100 for i in range(4)]
    signals = [
        [] if place in (0, 1, 4, 5, 6) else [place + t for t in times] for place in range(11)
    ]
    records = {
        key: {"name": "", "timestamps": times, "signals": [[v + key for v in s] for s in signals]}
        for key in range(2)
    }
    path = tmp_path / "x.pdl"
    path.write_bytes(b"".join(pickle.dumps(part, 2) for part in (["name"], 2, records)))
    report = import_files(project, [path, table(tmp_path / "fine.csv", 1)])
    assert list(report.remarks) == [path]
    assert "missing or not unique" in report.remarks[path][0]
    assert report.count("new") == 3


@pytest.mark.real
@needs_tongs
def test_the_papers_databases_become_two_tasks_of_ten(project):
    import_files(project, [TONGS / "JPen_sig.pdl"], ReadOptions(task="stylus"))
    report = import_files(project, [TONGS / "soft_sig.pdl"], ReadOptions(task="foam"))
    assert (report.count("new"), report.remarks) == (10, {})
    with Project.open(project) as opened:
        infos = opened.demonstrations()
        assert [sum(info.task == task for info in infos) for task in ("stylus", "foam")] == [10, 10]
        for info in infos:
            assert info.rate == pytest.approx(1000, rel=1e-9)
            assert info.authors == ("coder",)
            assert 0.85 < info.labelled["coder"] / info.duration < 0.99
