"""Comparing two runs: over what both tested, with the scores that the runs hold."""

from dataclasses import replace

import pytest
from factories import random_run_result, run_result

from forcelab.label_map import MergeMap
from forcelab.recognition.intervals import difference_intervals
from forcelab.recognition.metrics import count_segments, look_up, pool
from forcelab.recognition.settings import Settings
from forcelab.review.run_comparison import compare_runs, settings_that_differ

ACTIONS = ("grab", "hold", "release")


def counted(result, ids):
    return [
        count_segments(d.human, d.predicted, result.actions)
        for id_ in ids
        for d in result.tested
        if d.id == id_
    ]


def test_pooled_scores_are_those_of_the_runs_where_both_tested_the_same():
    old, new = random_run_result("abcd", ACTIONS), random_run_result("abcd", ACTIONS, right=0.9)
    found = compare_runs(old, new)
    assert tuple(mine.id for mine, _ in found.pairs) == ("a", "b", "c", "d")
    for stage in ("raw", "filtered"):
        assert found.pooled[stage] == (old.scores[stage]["pooled"], new.scores[stage]["pooled"])
        listed = [item.scores[stage] for item in new.tested]
        assert [yours.scores[stage] for _, yours in found.pairs] == listed


def test_what_only_one_run_tested_is_left_out_of_both():
    old, new = random_run_result("abcd", ACTIONS), random_run_result("dcxb", ACTIONS, seed=1)
    found = compare_runs(old, new)
    assert tuple(mine.id for mine, _ in found.pairs) == ("b", "c", "d")
    expected = [pool("pooled", counted(run, "bcd")).to_json() for run in (old, new)]
    assert list(found.pooled["filtered"]) == expected
    paired = difference_intervals(counted(old, "bcd"), counted(new, "bcd"), old.settings.seed)
    assert found.intervals["filtered"] == paired
    low, high = paired["accuracy"]
    between = look_up(expected[1], "accuracy") - look_up(expected[0], "accuracy")
    assert low <= between <= high


def test_runs_with_nothing_in_common_have_no_scores():
    found = compare_runs(random_run_result("ab", ACTIONS), random_run_result("cd", ACTIONS))
    assert found.pairs == ()
    assert found.pooled["filtered"][1] == {}
    assert "needs 3 demonstrations" in found.intervals["filtered"].reason


def test_only_settings_that_differ_are_listed():
    old = random_run_result("ab", ACTIONS)
    assert settings_that_differ(old, old) == ()
    new = replace(old, settings=Settings(median=None, seed=7), author="Bob")
    assert settings_that_differ(old, new) == (
        ("median", "10", "–"),
        ("seed", "0", "7"),
        ("coder", "Ada", "Bob"),
    )


def test_settings_that_differ_are_written_as_text():
    old = random_run_result("ab", ACTIONS)
    changed = old.settings.replace(merge=MergeMap({"grap": "grab"}), phase=False)
    new = replace(old, settings=changed, tasks=("foam", "soft"), test_task="pen")
    different = {name: values for name, *values in settings_that_differ(old, new)}
    assert different["phase"] == ["yes", "no"]
    assert different["merge"] == ["–", "grap → grab"]
    assert different["tasks"][1] == "foam + soft"
    assert different["test task"] == ["–", "pen"]


def test_labels_that_changed_between_the_runs_are_named():
    old = random_run_result("abc", ACTIONS)
    changed = replace(old.tested[1], human=old.tested[1].human[:-1])
    new = run_result([old.tested[0], changed, old.tested[2]], ACTIONS)
    assert [result.id for result in compare_runs(old, new).relabelled] == ["b"]
    assert compare_runs(old, old).relabelled == ()


@pytest.mark.parametrize("number", [1, 2])
def test_few_demonstrations_are_compared_without_an_interval(number):
    ids = "ab"[:number]
    found = compare_runs(random_run_result(ids, ACTIONS), random_run_result(ids, ACTIONS, seed=2))
    assert found.intervals["filtered"]["accuracy"] is None
    assert found.pooled["filtered"][0]["accuracy"] is not None
