"""``forcelab train`` and ``forcelab predict``."""

import csv
import io

import pytest
from quick import FAST

from forcelab.labels import UNLABELLED, to_codes
from forcelab.project import Project

SETTINGS = [word for word in FAST if word not in ("--jobs", "1")]


@pytest.fixture
def recogniser(forcelab, project, tmp_path):
    file = tmp_path / "foam.skops"
    assert forcelab("train", project, "--task", "foam", *SETTINGS, "--out", file).status == 0
    return file


def test_a_recogniser_labels_a_recording_it_has_not_seen(forcelab, recogniser, recordings, project):
    said = forcelab("predict", recogniser, recordings / "sponge-11.csv")
    rows = list(csv.DictReader(io.StringIO(said.out)))
    assert list(rows[0]) == ["start", "end", "action", "author"]
    assert {row["author"] for row in rows} == {"foam"}
    with Project.open(project) as opened:
        demonstration = opened.load("sponge-11")
        human = opened.track(demonstration.id, "coder")
    actions = ["still", "grab", "hold", "release"]
    truth = to_codes(human.segments, demonstration.times, actions)
    right = 0
    for row in rows:
        inside = (demonstration.times >= float(row["start"])) & (
            demonstration.times < float(row["end"])
        )
        right += int((truth[inside] == actions.index(row["action"])).sum())
    assert right > 0.7 * (truth != UNLABELLED).sum()


def test_the_project_keeps_a_copy_that_works(forcelab, recogniser, project, recordings):
    with Project.open(project) as opened:
        (kept,) = opened.recognisers()
        path = opened.recogniser_path(kept.id)
    assert kept.name == "foam"
    assert len(kept.demonstrations) == 4
    assert path.read_bytes() == recogniser.read_bytes()


def test_several_demonstrations_are_printed_with_their_names(forcelab, recogniser, project):
    rows = list(csv.DictReader(io.StringIO(forcelab("predict", recogniser, project).out)))
    assert {row["demonstration"] for row in rows} == {
        "foam-01", "foam-02", "foam-03", "foam-04", "sponge-11", "sponge-12"
    }  # fmt: skip


def test_several_demonstrations_are_written_into_a_folder(forcelab, recogniser, project, tmp_path):
    out = tmp_path / "predicted"
    assert (
        forcelab("predict", recogniser, project, "--out", out, "--format", "audacity").status == 0
    )
    files = sorted(path.name for path in out.iterdir())
    assert files[0] == "foam-01.txt"
    assert len(files) == 6
    start, end, action = (out / "foam-01.txt").read_text().splitlines()[0].split("\t")
    assert float(start) < float(end)
    assert action == "still"


def test_predicting_changes_no_track_of_the_project(forcelab, recogniser, project):
    with Project.open(project) as opened:
        before = [opened.tracks(info.id) for info in opened.demonstrations()]
    forcelab("predict", recogniser, project)
    with Project.open(project) as opened:
        assert [opened.tracks(info.id) for info in opened.demonstrations()] == before


def test_json_tells_the_segments(forcelab, recogniser, recordings):
    (one,) = forcelab("predict", recogniser, recordings / "foam-01.csv", "--json").json
    assert one["demonstration"] == "foam-01"
    assert set(one["segments"][0]) == {"start", "end", "action"}


def test_train_tells_what_was_learnt_as_json(forcelab, project, tmp_path):
    said = forcelab(
        "train", project, "--task", "foam", *SETTINGS, "--out", tmp_path / "r", "--json"
    )
    assert said.json["actions"] == ["still", "grab", "hold", "release"]
    assert said.json["demonstrations"] == 4


def test_other_channels_are_refused(forcelab, recogniser, tmp_path):
    file = tmp_path / "other.csv"
    file.write_text("time,a\n" + "".join(f"{i / 100},{i % 7}\n" for i in range(50)))
    assert "tangential 1" in forcelab("predict", recogniser, file).sentence


def test_what_is_no_recogniser_is_refused(forcelab, recordings, tmp_path):
    table = recordings / "foam-01.csv"
    assert "is not a recogniser" in forcelab("predict", table, table).sentence
    assert "no recogniser" in forcelab("predict", tmp_path / "none", table).sentence


def test_a_recogniser_that_cannot_be_written_leaves_no_trace(forcelab, project, tmp_path):
    nowhere = tmp_path / "missing" / "r.skops"
    assert (
        "cannot be written"
        in forcelab("train", project, "--task", "foam", *SETTINGS, "--out", nowhere).sentence
    )
    with Project.open(project) as opened:
        assert opened.recognisers() == ()
