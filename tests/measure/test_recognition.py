"""Recognition against run time: the same scores as an evaluation, each thing computed once."""

import dataclasses

import pytest
from factories import labelled_set, make_labelled_project

from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.label_map import MergeMap
from forcelab.labels import Segment
from forcelab.measure import recognition
from forcelab.measure.recognition import (
    KIND,
    QUICK,
    VARIANTS,
    Variant,
    load_measured,
    main_coder,
    measure_and_store,
    measure_tasks,
    measure_variants,
    same_method,
    sharing_features,
    sharing_fit,
    with_data_of,
)
from forcelab.project import Project, Provenance
from forcelab.recognition.cross_validation import leave_one_out_job
from forcelab.recognition.examples import LabelledDemonstration
from forcelab.recognition.presets import PRESETS, preset

PLAIN = preset("paper").replace(classifier="naive-bayes", max_scale=32.0)
OPEN = PLAIN.replace(threshold=None, median=None, drop=None)
DECODED = OPEN.replace(decoder="semi-markov")
TREE = PLAIN.replace(classifier="decision-tree", stride=3)
FEW = (
    Variant("filters", "all", PLAIN),
    Variant("filters", "none", OPEN),
    Variant("decoder", "order", DECODED),
    Variant("classifier", "decision-tree", TREE),
)


@pytest.fixture(scope="module")
def labelled():
    return labelled_set(3, 100.0)


@pytest.fixture(scope="module")
def rows(labelled):
    return finish(measure_variants(labelled, FEW, "foam"))


@pytest.mark.parametrize("number", range(len(FEW)))
def test_scores_are_those_of_leaving_one_out(labelled, rows, number):
    pooled, _ = finish(leave_one_out_job(labelled, FEW[number].settings)).scores("filtered")
    row = rows[number]
    assert row.error == pytest.approx(1 - pooled.f1["50"])
    expected = {
        "accuracy": pooled.accuracy,
        "balanced": pooled.balanced_accuracy,
        "edit": pooled.edit,
        "F1@50, labelled time": pooled.f1_labelled["50"],
        "boundaries found": pooled.boundaries_found,
        "boundary (ms)": pooled.boundary_ms["median"],
        "boundary p90 (ms)": pooled.boundary_ms["p90"],
    }
    assert {name: row.further[name] for name in expected} == pytest.approx(expected)


def test_rows_hold_what_they_cost(rows):
    for row in rows:
        assert row.seconds > 0
        assert row.peak_bytes > 1000
        parts = row.further["features (s/min)"], row.further["predict (s/min)"]
        assert max(parts) <= row.seconds * 4
    # What shares its classifier shares the time of its fit.
    assert len({row.further["fit (s/min)"] for row in rows[:3]}) == 1
    assert [row for row in rows if row.pareto]
    assert rows[0].reference.startswith("the coder's labels of 3 demonstrations, one left out")


def test_features_and_fits_are_shared(labelled, monkeypatch):
    prepared, fitted = [], []

    def counting(calls, real):
        def called(*args, **named):
            calls.append(args)
            return real(*args, **named)

        return called

    monkeypatch.setattr(
        recognition, "prepare_examples", counting(prepared, recognition.prepare_examples)
    )
    monkeypatch.setattr(recognition, "fit_examples", counting(fitted, recognition.fit_examples))
    finish(measure_variants(labelled, FEW, "foam"))
    assert len(prepared) == len(labelled) + 1  # the first one once more, for its memory
    assert len(fitted) == 2 * len(labelled)  # two classifiers


def test_only_what_comes_after_the_classifier_is_shared():
    assert [len(group) for group in sharing_features(FEW)] == [4]
    assert [len(group) for group in sharing_fit(FEW)] == [3, 1]
    svm = PLAIN.replace(classifier="svm")
    pair = [Variant("a", "", svm), Variant("b", "", svm.replace(threshold=None))]
    assert len(sharing_fit(pair)) == 2  # with probabilities it decides otherwise
    for change in ({"stride": 7}, {"seed": 1}, {"phase": False}, {"max_scale": 16.0}):
        pair = [Variant("a", "", PLAIN), Variant("b", "", PLAIN.replace(**change))]
        assert len(sharing_fit(pair)) == 2, change


def test_settings_that_cannot_be_trained_are_refused_and_the_others_measured(labelled):
    short = [
        LabelledDemonstration(
            item.demonstration,
            tuple(Segment(s.start, s.start + 0.02, s.action) for s in item.segments[:2]),
        )
        for item in labelled[:2]
    ]
    sparse = PLAIN.replace(stride=10_000)
    wrong = PLAIN.replace(channels=("nothing",))
    request = [Variant("stride", "all", PLAIN), Variant("stride", "none", sparse),
             Variant("channels", "wrong", wrong)]  # fmt: skip
    steps = []
    fine, none, lacking = finish(measure_variants(short, request, "foam"), steps.append)
    assert fine.point is not None
    assert "Training needs samples of two actions" in none.refusal
    assert "nothing" in lacking.refusal
    assert all(0 <= p.done <= p.total for p in steps)
    assert [p.done for p in steps] == sorted(p.done for p in steps)


def test_one_labelled_demonstration_is_too_few(labelled):
    bare = [LabelledDemonstration(item.demonstration) for item in labelled[1:]]
    with pytest.raises(InputError, match="two labelled demonstrations; there is 1"):
        finish(measure_variants([labelled[0], *bare], FEW, "foam"))


def test_the_usual_variants_are_distinct_and_hold_every_preset():
    names = [(v.name, v.setting) for v in VARIANTS]
    assert len(set(names)) == len(names)
    for i, first in enumerate(VARIANTS):
        assert not any(same_method(first.settings, other.settings) for other in VARIANTS[:i]), first
    assert {v.setting: v.settings for v in VARIANTS if v.name == "preset"} == PRESETS
    assert set(QUICK) < set(VARIANTS)
    assert len(QUICK) >= 4


def test_what_belongs_to_the_data_is_kept():
    merge = MergeMap({"grap": "grab"})
    data = preset("best").replace(channels=("fz1",), rate=50.0, merge=merge)
    with_data = with_data_of(preset("fast"), data)
    assert (with_data.channels, with_data.rate, with_data.merge) == (("fz1",), 50.0, merge)
    assert dataclasses.replace(with_data, channels=None, rate=None, merge=MergeMap()) == preset(
        "fast"
    )


def test_a_measurement_is_kept_in_the_project_and_read_again(tmp_path):
    path = make_labelled_project(tmp_path / "study.forcelab")
    own = PLAIN.replace(spacing=0.5)
    number = finish(measure_and_store(path, "foam", None, own, FEW[:2]))
    with Project.open(path) as project:
        found = load_measured(project, number)
        assert (found.task, found.author) == ("foam", "Ada")
        assert [(row.name, row.setting) for row in found.rows] == [
            ("filters", "all"), ("filters", "none"), ("yours", "paper, changed")]  # fmt: skip
        assert found.place_of(own) == 2
        assert found.place_of(PLAIN.replace(preset="best")) == 0
        assert found.place_of(preset("best")) is None
        assert project.tracks.edits_since(found.labels, ("foam",)) == 0
        (summary,) = project.runs.summaries(KIND)
        assert summary.digest == {"title": "foam", "tested": 3}
        with pytest.raises(InputError, match="There is no run 9"):
            load_measured(project, 9)
        other = project.runs.add(
            "evaluate", Provenance(settings={}, seed=0, labels=(), versions={}), result={}
        )
        with pytest.raises(InputError, match="no measurement"):
            load_measured(project, other)
        for result in ({}, {"rows": [{}], "settings": [{}]}, {"rows": 3}):
            damaged = project.runs.add(
                KIND,
                Provenance(settings={"choice": {}}, seed=0, labels=(), versions={}),
                result=result,
            )
            with pytest.raises(InputError, match="damaged; measure again"):
                load_measured(project, damaged)


def test_own_settings_among_the_usual_ones_are_not_measured_twice(tmp_path):
    path = make_labelled_project(tmp_path / "study.forcelab")
    number = finish(measure_and_store(path, "foam", "Ada", PLAIN.replace(preset="mine"), FEW[:1]))
    with Project.open(path) as project:
        assert len(load_measured(project, number).rows) == 1


def test_tasks_of_a_project(tmp_path, monkeypatch):
    monkeypatch.setattr(recognition, "QUICK", FEW[:1])
    path = make_labelled_project(tmp_path / "study.forcelab")
    with Project.open(path) as project:
        assert main_coder(project, "foam") == "Ada"
        table = finish(measure_tasks(project, (), quick=True))
        assert table.sizes[0].startswith("foam, 3 demonstrations, ")
        assert [row.setting for row in table.rows] == ["all"]
        assert table.rows[0].pareto
        cells = table.cells(table.sizes[0])
        assert cells[1][cells[0].index("accuracy")] == f"{table.rows[0].further['accuracy']:.3f}"
        assert not project.runs.summaries()
        with pytest.raises(InputError, match="'pen'"):
            finish(measure_tasks(project, ("pen",), quick=True))
        both = finish(measure_tasks(project, ("pen", "foam"), quick=True))
        assert "'pen'" in both.rows[0].refusal
        assert both.rows[1].point is not None
