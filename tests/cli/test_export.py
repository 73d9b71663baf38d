"""``forcelab export``: for statistics and other programs, all of it or what is asked for."""

import csv
from pathlib import Path

import pytest

from forcelab.formats import label_tables
from forcelab.labels import Segment
from forcelab.project import Project


def test_a_table_of_some_demonstrations(forcelab, project, tmp_path):
    result = forcelab(
        *("export", project, "--out", tmp_path / "out", "--format", "table"),
        *("--demo", "foam-02", "--demo", "foam-01", "--author", "coder"),
    )
    with Path(result.out.strip()).open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["demonstration"] for row in rows} == {"foam-01", "foam-02"}
    with Project.open(project) as opened:
        for name in ("foam-01", "foam-02"):
            segments = opened.tracks.get(opened.demonstrations.load(name).id, "coder").segments
            output = [float(row["start"]) for row in rows if row["demonstration"] == name]
            assert output == pytest.approx([segment.start for segment in segments])


def test_the_table_tells_what_was_proposed_with_times_to_the_microsecond(forcelab, project):
    with Project.open(project) as opened:
        first = opened.demonstrations.id_of("foam-01")
        labels = opened.tracks.get(first, "coder").segments
        opened.tracks.edit(first, "coder", labels, (), "erased")
        own, accepted = Segment(0.1, 1.987888107514004, "grab"), Segment(2.0, 2.25, "hold")
        opened.tracks.edit(first, "coder", (), (own,), "painted")
        opened.tracks.edit(
            first, "coder", (own,), (own, accepted), "accepted", proposed_by="model paper 1"
        )
    rows = forcelab("export", project, "--out", "-", "--format", "table", "--demo", "foam-01").out
    assert [line.split(",", 6)[6] for line in rows.splitlines()] == [
        "action,start,end,duration,proposed_by",
        "grab,0.1,1.987888,1.887888,",
        "hold,2.0,2.25,0.25,model paper 1",
    ]


def test_a_table_of_all_is_not_taken_for_labels_of_one_recording(forcelab, project, tmp_path):
    result = forcelab("export", project, "--out", tmp_path, "--format", "table")
    lab = tmp_path / "lab.csv"
    lab.write_text("time,fx\n" + "".join(f"{i / 100},{i % 7}\n" for i in range(50)))
    assert result.status == 0
    assert label_tables.labels_file_beside(lab) is None


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--task", "Foam"), "no task 'Foam'; did you mean 'foam'?"),
        (("--demo", "foam-99"), "foam-99"),
        (("--author", "Ben"), "Nobody called 'Ben' labelled here; choose from coder"),
    ],
)
def test_what_there_is_not_is_refused_and_nothing_is_written(
    forcelab, project, tmp_path, words, sentence
):
    result = forcelab("export", project, "--out", tmp_path / "out", *words)
    assert sentence in result.sentence
    assert not (tmp_path / "out").exists()


def test_a_task_and_names_narrow_each_other(forcelab, project, tmp_path):
    words = ("export", project, "--out", tmp_path / "out")
    both = forcelab(*words, "--task", "foam", "--demo", "foam-01").out
    assert [Path(line).name for line in both.splitlines()] == ["foam-01.labels.csv"]
    refused = forcelab(*words, "--task", "sponge", "--demo", "foam-01").sentence
    assert "'foam-01' is not of sponge; leave out --task, or choose its own." in refused
    with Project.open(project) as opened:
        sponge = opened.demonstrations.infos("sponge")[0]
        opened.demonstrations.rename(sponge.id, "foam-01")
    one = forcelab(*words, "--task", "sponge", "--demo", "foam-01").out
    assert [Path(line).name for line in one.splitlines()] == ["sponge - foam-01.labels.csv"]


def test_samples_of_what_has_no_labels_are_written_and_other_formats_tell(
    forcelab, project, recordings, tmp_path
):
    lines = (recordings / "foam-01.csv").read_text("utf-8").splitlines()
    (tmp_path / "bare.csv").write_text("\n".join(row.rpartition(",")[0] for row in lines[:99]))
    assert forcelab("import", project, tmp_path / "bare.csv", "--task", "foam").status == 0
    words = ("export", project, "--out", tmp_path / "out", "--task", "foam")
    samples = forcelab(*words, "--format", "samples", "--demo", "bare")
    assert Path(samples.out.strip()).name == "bare.samples.csv"
    assert "labels of" not in Path(samples.out.strip()).read_text("utf-8")
    told = "1 demonstration has no labels yet.\n"
    assert samples.err == told
    segments = forcelab(*words)
    assert (segments.err, "bare" in segments.out) == (told, False)
    printed = forcelab("export", project, "--out", "-", "--format", "table")
    assert (printed.err, "bare" in printed.out) == (told, False)
    by_author = forcelab(*words, "--author", "coder").err
    assert by_author == "1 demonstration has no labels by these authors yet.\n"
    assert forcelab(*words, "--demo", "foam-01").err == ""


def test_an_archive_is_always_whole(forcelab, project, tmp_path):
    words = ("export", project, "--out", tmp_path / "out", "--format", "archive")
    assert "whole project" in forcelab(*words, "--task", "foam").wrong_word


def test_a_single_file_is_printed(forcelab, project, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    forcelab("export", project, "--out", tmp_path / "labels", "--format", "table")
    (written,) = (tmp_path / "labels").iterdir()
    printed = forcelab("export", project, "--out", "-", "--format", "table")
    assert printed.out.encode() == written.read_bytes()
    table = forcelab("export", project, "--out", "-", "--demo", "foam-01").out
    assert table.startswith("start,end,action,author")
    several = forcelab("export", project, "--out", "-").wrong_word
    assert "files cannot be printed as one; name a folder" in several
    for words in (["--format", "elan"], ["--json"]):
        assert "name a folder" in forcelab("export", project, "--out", "-", *words).wrong_word
    assert [path.name for path in tmp_path.iterdir() if path.name in ("-", "labels")] == ["labels"]
