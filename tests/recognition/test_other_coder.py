"""Another coder's labels are learnt from where the coder has none, and never tested."""

from dataclasses import replace

import numpy as np
import pytest
from factories import synthetic_set

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.label_map import MergeMap
from forcelab.labels import Segment, Track
from forcelab.project import Project
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.dataset import DataSelection
from forcelab.recognition.presets import preset
from forcelab.recognition.project_runs import evaluate_tasks_job, train_tasks_job
from forcelab.review.held_out import train_held_out
from forcelab.review.run_result import edits_since, load_run
from forcelab.review.training import review_job

QUICK = preset("fast").replace(classifier="logistic", changes=False)
BOTH = DataSelection(("foam",), author="Ann", also_from="Ben")


@pytest.fixture
def path(tmp_path):
    """Ann labelled 1 to 3, Ben 3 to 6 and a rounded copy of 1; nobody labelled 7."""
    path = tmp_path / "lab.forcelab"
    with Project.create(path) as project:
        for number, (demonstration, segments) in enumerate(synthetic_set(7, 200.0), start=1):
            tracks = [Track("Ann", segments)] if number <= 3 else []
            tracks += [Track("Ben", segments)] if 3 <= number <= 6 else []
            project.demonstrations.add(demonstration, tracks)
            if number == 1:
                copy = replace(
                    demonstration, name="copy", signals=np.round(demonstration.signals, 2)
                )
                project.demonstrations.add(copy, [Track("Ben", segments)])
    return path


@pytest.fixture
def project(path):
    with Project.open(path) as project:
        yield project


def names(items):
    return [item.demonstration.name for item in items]


def test_own_labels_come_first_and_copies_of_own_recordings_teach_nothing(project):
    dataset = BOTH.load(project, ["foam"], QUICK)
    own = [item for item in dataset.labelled if not item.added]
    assert names(item for item in own if item.segments) == ["foam 01", "foam 02", "foam 03"]
    assert names(item for item in own if not item.segments) == ["copy", "foam 07"]
    added = [item for item in dataset.labelled if item.added]
    assert names(added) == ["foam 04", "foam 05", "foam 06"]
    assert [used.author for used in dataset.labels] == ["Ann"] * 5 + ["Ben"] * 3
    for item, used in zip(dataset.labelled, dataset.labels, strict=True):
        assert used.demonstration == item.demonstration.id
        assert (used.edit > 0) == bool(item.segments)


def test_what_the_own_labels_alone_teach_stands_beside(project):
    labelled = BOTH.load(project, ["foam"], QUICK).labelled
    own = [item for item in labelled if not item.added]
    both, alone = (finish(leave_one_out_job(items, QUICK)) for items in (labelled, own))
    assert [item.name for item in both.tested] == ["foam 01", "foam 02", "foam 03"]
    for with_both, without in zip(both.tested, alone.tested, strict=True):
        assert np.array_equal(with_both.ablations["alone"], without.filtered)
        assert not np.array_equal(with_both.filtered, without.filtered)
    assert both.kinds == ("raw", "unaided", "alone", "filtered")
    assert set(both.trained_on) == {item.demonstration.id for item in labelled if item.segments}
    right = [100 * (each.scores("filtered")[0].accuracy or 0) for each in (both, alone)]
    (remark,) = [remark for remark in both.remarks if remark.startswith("Also learnt")]
    assert remark.startswith(
        f"Also learnt from 3 demonstrations that another coder labelled: {right[0]:.1f} % right, "
        f"with the own labels alone {right[1]:.1f} %."
    )
    assert ("hurt" in remark) == (right[0] < right[1])


def test_it_is_said_when_the_other_coders_labels_hurt_and_which_actions_are_theirs(project):
    for info in project.demonstrations.infos():
        track = project.tracks.get(info.id, "Ben").segments
        other = {"still": "hold", "hold": "still", "grab": "take"}
        swapped = tuple(Segment(s.start, s.end, other.get(s.action, s.action)) for s in track)
        project.tracks.edit(info.id, "Ben", track, swapped, "swapped")
    (_, evaluation), *_ = finish(evaluate_tasks_job(project, QUICK, BOTH)).evaluations
    assert any("They hurt here" in remark for remark in evaluation.remarks)
    remarks = finish(train_tasks_job(project, QUICK, BOTH, "both")).remarks
    assert any(remark.startswith("Of the added labels alone: take") for remark in remarks)
    mapped = QUICK.replace(merge=MergeMap({"take": "grab"}))
    remarks = finish(train_tasks_job(project, mapped, BOTH, "both")).remarks
    assert not any("take" in remark for remark in remarks)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"also_from": "Ann"}, "the labels used anyway"),
        ({"also_from": "Zoe"}, "no such coder"),
        ({"author": "Ben", "also_from": "Ann"}, None),
        ({"test_task": "foam"}, "left out in turn"),
    ],
)
def test_who_can_be_learnt_from(project, changes, sentence):
    job = evaluate_tasks_job(project, QUICK, replace(BOTH, **changes))
    if sentence is None:
        (_, evaluation), *_ = finish(job).evaluations
        assert len(evaluation.tested) == 5
    else:
        with pytest.raises(InputError, match=sentence):
            finish(job)
    with pytest.raises(InputError, match="no other coder"):
        finish(evaluate_tasks_job(project, QUICK, BOTH, latency=0.1))


def test_a_coder_who_labelled_nothing_else_adds_nothing(project):
    for name in ("foam 04", "foam 05", "foam 06"):
        info = next(info for info in project.demonstrations.infos() if info.name == name)
        track = project.tracks.get(info.id, "Ben").segments
        project.tracks.edit(info.id, "Ben", track, (), "cleared")
    with pytest.raises(InputError, match="labelled nothing here that Ann has not"):
        BOTH.load(project, ["foam"], QUICK)


def test_a_run_keeps_whose_labels_it_learnt_and_can_be_explained(path):
    number = finish(review_job(path, QUICK, BOTH, "both"))
    with Project.open(path) as project:
        run = load_run(project, number)
        assert (run.author, run.also_from) == ("Ann", "Ben")
        assert [item.name for item in run.tested] == ["foam 01", "foam 02", "foam 03"]
        # What was learnt from another coder's labels is no proposal.
        assert sorted(item.name for item in run.proposals) == ["copy", "foam 07"]
        stored = project.runs.get(number)
        assert stored.settings["choice"]["also_from"] == "Ben"
        assert stored.result["alone"]["pooled"]["accuracy"] > 0.5
        assert edits_since(project, run) == 0
        theirs = next(used for used in run.labels if used.author == "Ben")
        track = project.tracks.get(theirs.demonstration, "Ben").segments
        project.tracks.edit(theirs.demonstration, "Ben", track, track[1:], "removed")
        assert edits_since(project, run) == 1
    model = finish(train_held_out(path, run, run.tested[0].id))
    assert model.same_share == 1.0
    assert theirs.demonstration in {place.demonstration for place in model.training.places}
