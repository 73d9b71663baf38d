"""``forcelab train`` and ``forcelab predict``."""

import csv
import io
import shutil

import pytest
from factories import FAST_OPTIONS

from forcelab.cli import main
from forcelab.labels import UNLABELLED, to_codes
from forcelab.project import Project
from forcelab.segment_edits import paint

SETTINGS = [word for word in FAST_OPTIONS if word not in ("--jobs", "1")]


@pytest.fixture(scope="module")
def trained(imported, tmp_path_factory):
    """A folder with a recogniser and the project that it was trained on."""
    folder = tmp_path_factory.mktemp("trained")
    project, file = folder / "lab.forcelab", folder / "foam.skops"
    shutil.copytree(imported, project)
    assert main(["train", str(project), "--task", "foam", *SETTINGS, "--out", str(file)]) == 0
    return folder


@pytest.fixture
def recogniser(trained, project, tmp_path):
    """A copy of the recogniser; the project knows of it."""
    shutil.copytree(trained, tmp_path, dirs_exist_ok=True)
    return tmp_path / "foam.skops"


def test_a_recogniser_labels_a_recording_it_has_not_seen(forcelab, recogniser, recordings, project):
    result = forcelab("predict", recogniser, recordings / "sponge-11.csv")
    rows = list(csv.DictReader(io.StringIO(result.out)))
    assert list(rows[0]) == ["start", "end", "action", "author"]
    assert {row["author"] for row in rows} == {"model foam"}
    with Project.open(project) as opened:
        demonstration = opened.demonstrations.load("sponge-11")
        human = opened.tracks.get(demonstration.id, "coder")
    actions = ["still", "grab", "hold", "release"]
    truth = to_codes(human.segments, demonstration.times, actions)
    right = 0
    for row in rows:
        first, last = demonstration.times.searchsorted([float(row["start"]), float(row["end"])])
        inside = slice(first, last)
        right += int((truth[inside] == actions.index(row["action"])).sum())
    assert right > 0.7 * (truth != UNLABELLED).sum()


def test_forces_in_another_unit_than_the_learnt_one_are_remarked_on(
    forcelab, recogniser, recordings, tmp_path
):
    known = recordings / "sponge-11.csv"
    assert "learnt" not in forcelab("predict", recogniser, known).err
    counts = tmp_path / "counts.csv"
    counts.write_text(known.read_text().replace(" [N]", ""))
    result = forcelab("predict", recogniser, counts)
    assert result.status == 0
    assert "counts: The channel 'tangential 1' is without a unit, but the recogniser" in result.err


def test_the_project_keeps_a_copy_that_works(forcelab, recogniser, project, recordings):
    with Project.open(project) as opened:
        (stored,) = opened.runs.recognisers()
        path = opened.runs.recogniser_path(stored.id)
    assert stored.name == "foam"
    assert len(stored.demonstrations) == 4
    assert path.read_bytes() == recogniser.read_bytes()


def test_several_demonstrations_are_printed_with_their_names_and_no_track_changes(
    forcelab, recogniser, project
):
    with Project.open(project) as opened:
        before = [opened.tracks.of(info.id) for info in opened.demonstrations.infos()]
    rows = list(csv.DictReader(io.StringIO(forcelab("predict", recogniser, project).out)))
    assert {row["demonstration"] for row in rows} == {
        "foam-01", "foam-02", "foam-03", "foam-04", "sponge-11", "sponge-12"
    }  # fmt: skip
    with Project.open(project) as opened:
        assert [opened.tracks.of(info.id) for info in opened.demonstrations.infos()] == before


def test_several_demonstrations_are_written_into_a_folder(forcelab, recogniser, project, tmp_path):
    out = tmp_path / "predicted"
    words = ["--out", out, "--format", "audacity"]
    assert forcelab("predict", recogniser, project, *words).status == 0
    files = sorted(path.name for path in out.iterdir())
    assert files[0] == "foam-01.predicted.txt"
    assert len(files) == 6
    start, end, action = (out / "foam-01.predicted.txt").read_text().splitlines()[0].split("\t")
    assert float(start) < float(end)
    assert action == "still"


def test_training_tells_what_was_learnt_and_what_scales_mean_at_the_rate_of_the_recordings(
    forcelab, project, tmp_path
):
    words = ["train", project, "--task", "foam", *SETTINGS, "--out", tmp_path / "r", "--json"]
    learnt = forcelab(*words).json
    assert learnt["actions"] == ["still", "grab", "hold", "release"]
    assert (learnt["demonstrations"], learnt["remarks"]) == (4, [])
    (remark,) = forcelab(*words, "--max-scale", "16").json["remarks"]
    assert remark.startswith("At 100 Hz the largest scale, 16 samples, lasts 0.16 s only")


def test_other_channels_are_refused(forcelab, recogniser, tmp_path):
    file = tmp_path / "other.csv"
    file.write_text("time,a\n" + "".join(f"{i / 100},{i % 7}\n" for i in range(50)))
    assert "'other': There is no recognition channel 'tangential 1'" in (
        forcelab("predict", recogniser, file).sentence
    )


def test_what_is_no_recogniser_is_refused(forcelab, recordings, tmp_path):
    table = recordings / "foam-01.csv"
    assert "is not a recogniser" in forcelab("predict", table, table).sentence
    assert "no recogniser" in forcelab("predict", tmp_path / "none", table).sentence


def test_a_recogniser_that_cannot_be_written_leaves_no_trace(forcelab, project, tmp_path):
    nowhere = tmp_path / "missing" / "r.skops"
    words = ["train", project, "--task", "foam", *SETTINGS, "--out", nowhere]
    assert "folder does not exist" in forcelab(*words).sentence
    with Project.open(project) as opened:
        assert opened.runs.recognisers() == ()


def test_an_output_never_replaces_what_is_read(forcelab, recogniser, recordings, project, tmp_path):
    table = tmp_path / "mine.csv"
    table.write_bytes((recordings / "foam-01.csv").read_bytes())
    assert "what is read here" in forcelab("predict", recogniser, table, "--out", table).sentence
    # Into the folder of the recording: beside it, under a name that is no recording's or label's.
    before = table.read_bytes()
    result = forcelab("predict", recogniser, table, "--out", tmp_path, "--format", "audacity")
    assert result.out == f"{tmp_path / 'mine.predicted.txt'}\n"
    assert table.read_bytes() == before
    assert "read here" in forcelab("predict", recogniser, project, "--out", project / "x").sentence
    inside = project / "r.skops"
    words = ["train", project, "--task", "foam", *SETTINGS, "--out", inside]
    assert "what is read here" in forcelab(*words).sentence


def test_several_demonstrations_do_not_fit_into_one_file(forcelab, recogniser, project, tmp_path):
    out = tmp_path / "all.csv"
    assert "need a folder" in forcelab("predict", recogniser, project, "--out", out).sentence
    assert not out.exists()


def test_recordings_without_stamps_and_remarks_are_told(forcelab, recogniser, recordings, tmp_path):
    lines = (recordings / "foam-01.csv").read_text().splitlines()
    bare = tmp_path / "bare.csv"
    bare.write_text("\n".join(line.split(",", 1)[1] for line in lines) + "\n")
    assert forcelab("predict", recogniser, bare).status == 1
    assert forcelab("predict", recogniser, bare, "--rate", "100").out.startswith("start,")
    twice = tmp_path / "twice.csv"
    twice.write_text("\n".join([*lines[:50], lines[49], *lines[50:]]) + "\n")
    assert forcelab("predict", recogniser, twice).err.startswith("twice: 1 row repeats")


def test_predictions_never_come_back_as_a_coders_labels(forcelab, recogniser, recordings, tmp_path):
    lines = (recordings / "foam-01.csv").read_text().splitlines()
    table = tmp_path / "take.csv"
    table.write_text("\n".join(line.rsplit(",", 1)[0] for line in lines) + "\n")
    forcelab("predict", recogniser, table, "--out", tmp_path / "take.labels.csv")
    project = tmp_path / "p.forcelab"
    assert forcelab("import", project, table).status == 0
    with Project.open(project) as opened:
        (author,) = opened.coding.authors()
    assert (author.name, author.kind) == ("model foam", "model")


def test_training_on_several_tasks_is_never_by_accident(forcelab, project, tmp_path):
    words = ["train", project, *SETTINGS, "--out", tmp_path / "r.skops"]
    assert "foam, sponge" in forcelab(*words).sentence
    assert forcelab(*words, "--task", "foam", "--task", "sponge").status == 0


def test_names_cannot_steer_the_terminal(forcelab, project, recordings, tmp_path):
    (merge := tmp_path / "merge.json").write_text('{"grab": "gr\\u001bab"}')
    recogniser = tmp_path / "r.skops"
    words = ["--task", "foam", "--merge", merge, *SETTINGS, "--out", recogniser]
    result = forcelab("train", project, *words)
    assert r"gr\x1bab" in result.out
    assert "\x1b" not in result.out
    counts = tmp_path / "foam\x1b[31m.csv"
    counts.write_text((recordings / "foam-01.csv").read_text().replace(" [N]", ""))
    result = forcelab("predict", recogniser, counts).err
    assert r"foam\x1b[31m: The channel" in result
    assert "\x1b" not in result


def test_actions_without_a_sample_are_not_said_to_be_learnt(forcelab, project, tmp_path):
    with Project.open(project) as opened:
        id_ = opened.demonstrations.infos("foam")[0].id
        before = opened.tracks.get(id_, "coder").segments
        after = paint(before, 1.0001, 1.0002, "blink")
        opened.tracks.edit(id_, "coder", before, after, "blink")
    words = ["train", project, "--task", "foam", *SETTINGS, "--out", tmp_path / "r.skops", "--json"]
    content = forcelab(*words).json
    assert "blink" not in content["actions"]
    assert content["remarks"] == ["No sample to train on at this stride: blink."]


def test_a_recording_at_a_lower_rate_is_told_what_the_recogniser_cannot_see(
    forcelab, recogniser, recordings, tmp_path
):
    lines = (recordings / "foam-01.csv").read_text("utf-8").splitlines(keepends=True)
    slow = tmp_path / "slow.csv"
    slow.write_text("".join([lines[0], *lines[1::4]]), "utf-8")
    assert forcelab("predict", recogniser, recordings / "foam-01.csv").err == ""
    output = forcelab("predict", recogniser, slow).err
    assert output.count("\n") == 1
    assert "sampled at 25 Hz, and the recogniser learnt at 100 Hz: " in output
    assert "look above 12.5 Hz" in output
    assert "--rate 25" in output


def test_times_are_printed_with_no_digits_that_mean_nothing(forcelab, recogniser, recordings):
    output = forcelab("predict", recogniser, recordings / "foam-01.csv")
    times = [cell for row in output.out.splitlines()[1:] for cell in row.split(",")[:2]]
    assert times
    assert all(len(time.partition(".")[2]) <= 2 for time in times)
    (plain,) = forcelab("predict", recogniser, recordings / "foam-01.csv", "--json").json
    assert plain["demonstration"] == "foam-01"
    assert set(plain["segments"][0]) == {"start", "end", "action"}
    shown = [str(s[edge]) for s in plain["segments"] for edge in ("start", "end")]
    assert shown == times
