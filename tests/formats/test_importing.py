"""Importing: everything is read before anything is written; bad files are left out and named."""

import errno
import os
import pickle
import signal
import subprocess
import sys
import tempfile

import numpy as np
import pytest

from forcelab.demonstration import Channel, Demonstration, VideoReference
from forcelab.errors import InputError
from forcelab.formats.archive import write_archive
from forcelab.formats.importing import import_files, importing
from forcelab.formats.recording import ReadOptions
from forcelab.jobs import Progress, finish
from forcelab.labels import Segment, Track
from forcelab.project import LabelsUsed, Project, Provenance
from forcelab.project import files as store_files

GRAB = (Segment(0.0, 0.1, "grab"),)


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
        return [(info.name, info.task, info.id) for info in opened.demonstrations.infos()]


def test_a_new_project_holds_what_the_files_hold(tmp_path, project):
    files = [table(tmp_path / f"{name}.csv", seed) for seed, name in enumerate(["b", "a"])]
    report = import_files(project, files, ReadOptions(task="LEGO"))
    assert [(item.file, item.added.name, item.added.status) for item in report.demonstrations] == [
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
        (track,) = opened.tracks.of(before[0][2])
    assert (track.author, track.segments) == ("Ada", (Segment(0.1, 0.2, "grab"),))


@pytest.mark.parametrize("labelled", [False, True])
def test_a_file_that_is_read_with_other_columns_is_told_to_be_there_twice(
    tmp_path, project, labelled
):
    file = table(tmp_path / "a.csv", 1)
    import_files(project, [file], ReadOptions(task="foam"))
    if labelled:
        with Project.open(project) as opened:
            opened.tracks.edit(opened.demonstrations.load("a").id, "Ann", (), GRAB, "painted")
    report = import_files(project, [file], ReadOptions(task="foam", leave_out=("fx",)))
    its = "with its labels" if labelled else "not labelled yet"
    result = (
        f"The same file was in the project as 'a', {its}, with other columns, units or times; "
        f"read anew it is 'a (2)'. Remove the one that is not wanted, by its menu in the list of "
        f"demonstrations or 'forcelab remove'."
    )
    assert result in report.remarks[file]
    (tmp_path / "other").mkdir()
    alike = table(tmp_path / "other" / "a.csv", 2)  # as long, and called as it is
    report = import_files(project, [alike], ReadOptions(task="foam"))
    (output,) = [remark for remark in report.remarks[alike] if "'a (3)'" in remark]
    assert output == "Another recording of task 'foam' is called 'a'; this one is now 'a (3)'."


def test_units_are_given_where_the_file_states_none(tmp_path, project):
    file = tmp_path / "pull.csv"
    file.write_text("t,fx,fz [mN]\n" + "".join(f"{n / 50},{n % 7},{n % 5}\n" for n in range(99)))
    units = ("fx", "kN"), ("fx", "N"), ("fz", "N"), ("fy", "N")
    report = import_files(project, [file], ReadOptions(units=units))
    with Project.open(project) as opened:
        (info,) = opened.demonstrations.infos()
        assert [(channel.name, channel.unit) for channel in info.channels] == [
            ("fx", "N"),
            ("fz", "mN"),
        ]
    remarks = report.remarks[file]
    assert "'fz' is in mN, as the file states, not in N." in remarks
    assert "No channel is called 'fy', so that its unit was not used." in remarks
    assert not any("'fx'" in remark for remark in remarks)
    (remark,) = import_files(project, [file]).remarks[file]
    assert "not labelled yet, with other columns, units or times; read anew" in remark


def test_a_labels_file_named_beside_its_recording_is_read_with_it(tmp_path, project):
    recording = table(tmp_path / "a.csv", 1)
    labels = tmp_path / "a.labels.csv"
    labels.write_text("start,end,action\n0.1,0.2,grab\n")
    report = import_files(project, [labels, recording, str(recording)])
    assert [item.file for item in report.demonstrations] == [recording]


def test_where_no_file_can_be_read_no_project_is_left_behind(tmp_path, project):
    with pytest.raises(InputError, match=r"missing\.csv' does not exist"):
        import_files(project, [tmp_path / "missing.csv"])
    with pytest.raises(InputError, match=r"2 of 2 files cannot be read"):
        import_files(project, [tmp_path / "missing.csv", tmp_path / "gone.csv"])
    assert list(project.parent.iterdir()) == []


@pytest.mark.parametrize("name", ["README.md", "notes.txt", "LICENSE"])
def test_a_text_without_rows_of_numbers_is_no_table(tmp_path, project, name):
    text = tmp_path / name
    text.write_text(
        "# Recordings\n\n| task | people |\n|---|---|\n| foam | 3 |\n| stylus | 12 |\n\n"
        "Recorded in 2024 with 2 sensors; version 1.2\n\n1. plug them in\n2. press F9\n3 4\n"
    )
    report = import_files(project, [table(tmp_path / "a.csv", 1), text])
    assert "looks like" in report.unread[text]


def test_a_repaired_import_leaves_no_foreign_actions_in_the_wrong_task(tmp_path, project):
    def labelled(name, seed, actions):
        rows = "".join(f"0.{i},0.{i + 1},{action}\n" for i, action in enumerate(actions, 1))
        (tmp_path / f"{name}.labels.csv").write_text(f"start,end,action\n{rows}")
        return table(tmp_path / f"{name}.csv", seed)

    import_files(project, [labelled("foam", 1, ["grab", "hold"])], ReadOptions(task="foam"))
    with Project.open(project) as opened:
        opened.actions.add("foam", ["squeeze"])  # by hand, and not painted yet
    pull = labelled("pull", 2, ["grab", "pull", "slip"])
    import_files(project, [pull], ReadOptions(task="foam"))
    report = import_files(project, [pull], ReadOptions(task="stylus"))
    with Project.open(project) as opened:
        assert opened.actions.vocabulary("foam").names == ("grab", "hold", "squeeze")
        assert opened.actions.vocabulary("stylus").names == ("grab", "pull", "slip")
        assert any("no longer lists pull, slip" in remark for remark in report.remarks[pull])
        opened.demonstrations.set_task(opened.demonstrations.load("pull").id, "foam")
        names = ("grab", "hold", "squeeze", "pull", "slip")
        assert opened.actions.vocabulary("foam").names == names
        opened.demonstrations.set_task(opened.demonstrations.load("pull").id, "stylus")
        assert opened.actions.vocabulary("foam").names == ("grab", "hold", "squeeze")
        # The last one of a task leaves it as it is, for those that are still to come.
        assert opened.actions.vocabulary("stylus").names == ("grab", "pull", "slip")


def test_what_is_remarked_on_several_files_is_told_once(tmp_path, project):
    def counting(name, button):
        rows = [f"{i},{np.sin(i):.3f},{button(i)}" for i in range(40 + len(name))]
        (tmp_path / name).write_text("\n".join(["packet,fz,button", *rows]) + "\n")
        return tmp_path / name

    files = [counting(f"{n:03}{'x' * n}.csv", lambda i: i % 2) for n in range(5)]
    files.append(counting("odd.csv", lambda i: i % 3))
    output = import_files(project, files, ReadOptions(rate=100.0)).remark_lines()
    first = "000.csv, 001x.csv, 002xx.csv and"
    assert output == (
        f"{first} 3 more: 'packet' counts the samples and places the rows: none was lost.",
        f"{first} 2 more: Column button holds nothing but 0 and 1, as of a button, and became a "
        "signal; leave out what measures nothing.",
    )


def test_a_strict_import_takes_all_files_or_none_and_counts_the_bad_ones(tmp_path, project):
    import_files(project, [table(tmp_path / "z.csv", 2)])
    before = contents(project)
    files = [table(tmp_path / "a.csv", 1), tmp_path / "x.csv", tmp_path / "y.csv"]
    with pytest.raises(InputError) as refusal:
        import_files(project, files, ReadOptions(strict=True))
    assert contents(project) == before
    assert str(refusal.value) == (
        f"2 of 3 files cannot be read (x.csv, y.csv), so nothing was imported; first: "
        f"'{tmp_path / 'x.csv'}' does not exist; check its spelling and folder."
    )
    assert refusal.value.files == (files[1], files[2])


def test_progress_tells_each_file_before_it_is_read(tmp_path, project):
    files = [table(tmp_path / "a.csv", 1), table(tmp_path / "b.csv", 2)]
    output = []
    report = finish(importing(project, files), output.append)
    assert list(dict.fromkeys(output)) == [
        Progress(0, 3, "reading a.csv"),
        Progress(1, 3, "reading b.csv"),
        Progress(2, 3, "writing p.forcelab"),
    ]
    assert report.count("new") == 2


def test_to_stop_while_reading_writes_nothing(tmp_path, project):
    job = importing(project, [table(tmp_path / "a.csv", 1), table(tmp_path / "b.csv", 2)])
    for _ in range(3):
        next(job)
    job.close()
    assert list(project.parent.iterdir()) == []


def test_a_project_that_may_only_be_read_is_told_before_the_files_are(
    tmp_path, project, monkeypatch
):
    Project.create(project).close()
    monkeypatch.setattr("forcelab.project.database.os.access", lambda *_: False)
    broken = tmp_path / "broken.csv"
    broken.write_bytes(b"")
    job = importing(project, [broken])
    with pytest.raises(InputError, match="may only be read here; copy it to where you may write"):
        next(job)


@pytest.fixture
def full(monkeypatch):
    """A disk that is full once three demonstrations were moved to their place."""
    move, moved = store_files.move_into, []

    def moving(home, staged):
        moved.append(home)
        if len(moved) > 3:
            raise OSError(errno.ENOSPC, "No space left on device")
        move(home, staged)

    with monkeypatch.context() as patch:
        patch.setattr(store_files, "move_into", moving)
        yield patch


def test_a_disk_that_fills_up_leaves_no_new_project_behind(tmp_path, project, full):
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abcde"]
    with pytest.raises(InputError) as refusal:
        import_files(project, files)
    assert str(refusal.value) == (
        f"'d' was not added to '{project}', and neither were the others: No space left on device; "
        "make room on the disk."
    )
    assert list(project.parent.iterdir()) == []


def test_a_disk_that_fills_up_leaves_a_project_as_it_was(tmp_path, project, full):
    import_files(project, [table(tmp_path / "z.csv", 1)])
    before = contents(project)
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abcde"]
    with pytest.raises(InputError, match="'c' was not added .*, and neither were the others: No"):
        import_files(project, files)
    assert contents(project) == before
    assert len(list((project / "demonstrations").iterdir())) == 1
    full.undo()
    assert import_files(project, files).count("new") == 5


KILLED = """
import os, signal, sys
from forcelab.formats.importing import import_files
from forcelab.project import files

move, moved = files.move_into, []

def moving(home, staged):
    move(home, staged)
    moved.append(home)
    if len(moved) == 2:
        os.kill(os.getpid(), signal.SIGKILL)

files.move_into = moving
import_files(sys.argv[1], sys.argv[2:])
"""


@pytest.mark.skipif(os.name != "posix", reason="signals as POSIX has them")
def test_an_import_that_is_killed_while_it_writes_changes_nothing(tmp_path, project):
    import_files(project, [table(tmp_path / "z.csv", 1)])
    before = contents(project)
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abc"]
    code = [sys.executable, "-c", KILLED, project, *files]
    assert subprocess.run(code, check=False).returncode == -signal.SIGKILL
    assert contents(project) == before
    homes = {entry.name for entry in (project / "demonstrations").iterdir()}
    assert {name for name in homes if not name.startswith(".incoming-")} == {before[0][2]}
    assert import_files(project, files).count("new") == 3


def test_an_import_that_is_interrupted_while_it_writes_changes_nothing(
    tmp_path, project, monkeypatch
):
    def interrupted(home, staged):
        move(home, staged)
        moved.append(home)
        if len(moved) == 2:
            raise KeyboardInterrupt

    import_files(project, [table(tmp_path / "z.csv", 1)])
    before, homes = contents(project), [*(project / "demonstrations").iterdir()]
    files = [table(tmp_path / f"{name}.csv", ord(name)) for name in "abc"]
    move, moved = store_files.move_into, []
    monkeypatch.setattr(store_files, "move_into", interrupted)
    with pytest.raises(KeyboardInterrupt):
        import_files(project, files)
    assert (contents(project), [*(project / "demonstrations").iterdir()]) == (before, homes)


def test_importing_again_without_saying_it_once_more_keeps_task_and_rate(tmp_path, project):
    file = table(tmp_path / "a.csv", 1)
    import_files(project, [file], ReadOptions(task="foam", rate=250.0))
    assert import_files(project, [file]).count("unchanged") == 1
    assert task_and_rate(project) == ("foam", 250.0)
    assert import_files(project, [file], ReadOptions(task="")).count("updated") == 1
    assert import_files(project, [file], ReadOptions(rate=100.0)).count("updated") == 1
    assert task_and_rate(project) == ("", 100.0)


def task_and_rate(project):
    with Project.open(project) as opened:
        demonstration = opened.demonstrations.load("a")
        return demonstration.task, demonstration.grid_rate


@pytest.fixture
def archive(tmp_path):
    """An archive of a project with a video, edits, a vocabulary, a recogniser and a run."""
    film = tmp_path / "film.mp4"
    film.write_bytes(bytes(range(256)) * 20)
    with Project.create(tmp_path / "old.forcelab") as old:
        times = np.arange(40) / 100
        signals = np.random.default_rng(1).normal(size=(40, 1))
        d = Demonstration("a", "", times, signals, (Channel("fx"),), (VideoReference(film),))
        id_ = old.demonstrations.add(d, [Track("Ada", GRAB)]).id
        old.tracks.edit(id_, "Ada", GRAB, (), "erased")
        old.tracks.undo(id_, "Ada")
        old.tracks.edit(id_, "mlp", (), GRAB, "predicted", kind="predict")
        old.actions.set_vocabulary("", old.actions.vocabulary("").rebound("grab", "q"))
        used = [LabelsUsed(id_, "Ada", old.tracks.head(id_, "Ada"))]
        created = Provenance(settings={}, seed=1, labels=used, versions={})
        old.runs.add_recogniser("mlp", b"opaque", created)
        old.runs.add("evaluate", created, result={"accuracy": 0.5})
        write_archive(old, tmp_path / "old.zip")
    return tmp_path / "old.zip"


def test_an_archive_alone_comes_back_whole_in_a_new_project(archive, project):
    report = import_files(project, [archive])
    assert [(item.added.name, item.added.status) for item in report.demonstrations] == [
        ("a", "new")
    ]
    assert report.remarks == {}
    write_archive_of(project, archive.with_name("again.zip"))
    assert archive.with_name("again.zip").read_bytes() == archive.read_bytes()


def write_archive_of(project, path):
    with Project.open(project) as opened:
        write_archive(opened, path)


def test_an_archive_in_an_existing_project_brings_labels_and_says_what_stayed(
    archive, tmp_path, project, monkeypatch
):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    import_files(project, [table(tmp_path / "z.csv", 1)])
    report = import_files(project, [archive])
    (remark,) = report.remarks[archive]
    assert "stayed in the archive" in remark
    assert "into a new project brings everything" in remark
    with Project.open(project) as opened:
        (id_,) = [info.id for info in opened.demonstrations.infos() if info.name == "a"]
        assert opened.tracks.of(id_) == (Track("Ada", GRAB),)
        assert opened.runs.all() == ()
        assert opened.demonstrations.load(id_).video.path.read_bytes() == bytes(range(256)) * 20
    assert list(scratch.iterdir()) == []


def test_an_archive_that_brings_nothing_new_is_listed_by_name_without_a_word_on_what_stayed(
    tmp_path, project
):
    names = [f"t{number}" for number in (10, 2, 1, 7, 3)]
    import_files(project, [table(tmp_path / f"{name}.csv", n) for n, name in enumerate(names)])
    write_archive_of(project, tmp_path / "all.zip")
    again = import_files(project, [tmp_path / "all.zip"])
    assert [item.added.name for item in again.demonstrations] == ["t1", "t2", "t3", "t7", "t10"]
    assert (again.count("unchanged"), again.remarks) == (5, {})


def test_a_task_for_an_archive_that_is_unpacked_whole_is_told_to_be_unused(archive, project):
    report = import_files(project, [archive], ReadOptions(task="foam"))
    (remark,) = report.remarks[archive]
    assert "task, author and the other options were not used" in remark


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
        import_files(project, [table(tmp_path / "a.csv", 2), odd], ReadOptions(strict=True))
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
