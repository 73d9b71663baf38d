"""``forcelab evaluate``."""

import csv
import errno
import json
from pathlib import Path

import pytest
from factories import FAST_OPTIONS, SYNTHETIC_ACTIONS

from forcelab.labels import Segment
from forcelab.project import Project
from forcelab.recognition import groups

SCORES = {
    "name", "accuracy", "balanced_accuracy", "coverage", "kappa", "edit", "f1",
    "f1_labelled", "boundaries_found", "boundary_ms", "boundary_labelled_ms", "confusion", "events",
}  # fmt: skip


def test_json_holds_settings_scores_and_run_times(forcelab, project, tmp_path):
    file = tmp_path / "scores.json"
    result = forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS, "--json", file)
    assert result.status == 0
    content = json.loads(file.read_text())
    assert {"preset", "settings", "seed", "versions", "labels", "seconds"} <= set(content)
    assert content["preset"] == "paper"
    assert content["settings"]["max_scale"] == 64
    assert content["labels"] == ["still", "grab", "hold", "release"]
    assert set(content["seconds"]) == {"features", "fit", "predict", "filter"}
    for which in ("raw", "filtered"):
        assert set(content[which]) == {"pooled", "demonstrations", "intervals"}
        single = content[which]["demonstrations"]
        assert [scores["name"] for scores in single] == [f"foam-0{i}" for i in (1, 2, 3, 4)]
        for scores in [content[which]["pooled"], *single]:
            assert set(scores) == SCORES
            assert 0.5 < scores["accuracy"] <= 1
            assert set(scores["f1"]) == {"10", "25", "50"}
            assert set(scores["boundary_ms"]) == {"median", "p90"}
            assert [len(row) for row in scores["confusion"]] == [5] * 4
    # The raw prediction labels everything; the filters leave some of it out.
    assert content["raw"]["pooled"]["coverage"] == 1
    assert content["filtered"]["pooled"]["coverage"] < 1
    # Below the pooled scores stand the intervals that the file holds.
    low, high = content["raw"]["intervals"]["accuracy"]
    assert low <= content["raw"]["pooled"]["accuracy"] <= high
    line = next(line for line in result.out.splitlines() if line.startswith("95 % interval "))
    assert line.split()[3] == f"{100 * low:.1f}–{100 * high:.1f}"
    lines = result.out.split("mostly taken for\n")[1].splitlines()
    for i, action in enumerate(content["labels"]):
        confusions = (content[which]["pooled"]["confusion"][i] for which in ("raw", "filtered"))
        shares = [f"{100 * counts[i] / sum(counts):.1f}" for counts in confusions]
        assert lines[i].split()[:3] == [action, *shares]


def test_a_table_holds_every_score_of_every_demonstration(forcelab, project, tmp_path):
    words = ["--table", tmp_path / "scores.csv", "--json", "-"]
    result = forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS, *words)
    assert result.err == ""
    content = result.json  # which alone stands on standard output
    rows = list(csv.DictReader((tmp_path / "scores.csv").read_text("utf-8").splitlines()))
    assert [row["row"] for row in rows[:7]] == ["demonstration"] * 4 + ["pooled", "lower", "upper"]
    assert [row["stage"] for row in rows] == ["raw"] * 7 + ["filtered"] * 7
    for stage, first in (("raw", 0), ("filtered", 7)):
        each = [*content[stage]["demonstrations"], content[stage]["pooled"]]
        for row, scores in zip(rows[first:], each, strict=False):
            assert float(row["accuracy"]) == scores["accuracy"]
            assert float(row["f1.50"]) == scores["f1"]["50"]
            assert float(row["events.merge.count"]) == scores["events"]["merge"]["count"]
        ends = [float(row["edit"]) for row in rows[first + 5 : first + 7]]
        assert ends == content[stage]["intervals"]["edit"]
    refused = forcelab("evaluate", project, *FAST_OPTIONS, "--table", tmp_path / "scores.xls")
    assert refused.sentence.endswith("name it 'scores.csv'.\n")


def test_every_task_is_evaluated_by_itself_and_gets_a_figure(forcelab, project, tmp_path):
    words = [*FAST_OPTIONS, "--json", "-", "--figure", tmp_path / "p.png"]
    evaluations = forcelab("evaluate", project, *words).json["evaluations"]
    assert [e["title"] for e in evaluations] == ["foam", "sponge"]
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["p-foam.png", "p-sponge.png"]
    assert [len(e["raw"]["demonstrations"]) for e in evaluations] == [4, 2]


def test_joined_tasks_can_keep_their_actions_apart(forcelab, project):
    both = ["--task", "foam", "--task", "sponge", *FAST_OPTIONS, "--json", "-"]
    joined = forcelab("evaluate", project, *both).json
    assert len(joined["raw"]["demonstrations"]) == 6
    assert joined["labels"] == ["still", "grab", "hold", "release"]
    apart = forcelab("evaluate", project, *both, "--apart").json
    names = ["still", "grab", "hold", "release"]
    assert apart["labels"] == [f"{a}_{t}" for t in ("foam", "sponge") for a in names]


def test_every_other_task_is_trained_on_when_only_the_tested_one_is_named(
    forcelab, project, recordings
):
    content = forcelab(
        "evaluate", project, "--test-task", "sponge", *FAST_OPTIONS, "--json", "-"
    ).json
    assert content["title"] == "foam → sponge"
    assert [s["name"] for s in content["raw"]["demonstrations"]] == ["sponge-11", "sponge-12"]
    assert len(content["trained_on"]) == 4
    assert not set(content["trained_on"]) & set(content["tested"])
    names = [path.stem for path in recordings.glob("foam-*.csv")]
    forcelab("remove", project, *names, "--yes")
    sentence = forcelab("evaluate", project, "--test-task", "sponge", *FAST_OPTIONS).sentence
    assert "has no task but 'sponge', so there is none to train on" in sentence


def test_a_task_that_cannot_be_evaluated_does_not_keep_the_others(forcelab, project, recordings):
    forcelab("import", project, recordings / "foam-01.csv", "--task", "lonely")
    result = forcelab("evaluate", project, *FAST_OPTIONS)
    assert result.status == 0
    assert "foam:" in result.out
    assert result.err == (
        "forcelab: Task 'lonely' was left out: Leaving one demonstration out needs two labelled "
        "ones; there is 1.\n"
    )
    content = forcelab("evaluate", project, *FAST_OPTIONS, "--json", "-").json
    assert [e["title"] for e in content["evaluations"]] == ["foam", "sponge"]
    assert "lonely" in content["remarks"][0]
    assert (
        "two labelled" in forcelab("evaluate", project, "--task", "lonely", *FAST_OPTIONS).sentence
    )


def test_figures_have_the_colours_of_the_window(forcelab, project, tmp_path, monkeypatch):
    from forcelab.gui.figures.pairs import TimelinePairs
    from forcelab.review.run_result import action_styles, latest_run

    drawn = []
    monkeypatch.setattr(TimelinePairs, "save", lambda figure, _path: drawn.append(figure))
    with Project.open(project) as opened:
        # What one learns from looks otherwise than what it is tested on.
        opened.actions.set_vocabulary(
            "foam", opened.actions.vocabulary("foam").recoloured("hold", "#112233")
        )
        words = ["--task", "foam", "--test-task", "sponge", "--figure", tmp_path / "f.svg"]
        words += FAST_OPTIONS
        assert forcelab("evaluate", project, *words).status == 0
        vocabulary = action_styles(opened, latest_run(opened))
    assert vocabulary["hold"].colour != "#112233"
    assert {a.name: a.look for a in drawn[0].vocabulary} == {a.name: a.look for a in vocabulary}


def test_what_a_preset_switches_on_can_be_switched_off(forcelab, project):
    words = ["evaluate", project, "--task", "sponge", *FAST_OPTIONS, "--json", "-"]
    best = ["--preset", "best", "--no-peaks", "--no-calibrated", "--decoder", "filters"]
    used = forcelab(*words, *best).json["settings"]
    assert (used["peaks"], used["calibrated"], used["balanced"]) == (False, False, False)
    used = forcelab(*words, "--preset", "fast", "--peaks").json["settings"]
    assert (used["peaks"], used["calibrated"]) == (True, False)


def test_no_two_outputs_of_several_tasks_share_a_file(forcelab, project, tmp_path):
    words = ["--figure", tmp_path / "u.png", "--json", tmp_path / "u-foam.png"]
    assert "two outputs" in forcelab("evaluate", project, *FAST_OPTIONS, *words).sentence
    assert not list(tmp_path.glob("*.png"))


def test_a_project_that_may_only_be_read_is_evaluated_all_the_same(forcelab, project, monkeypatch):
    monkeypatch.setattr("forcelab.project.database.os.access", lambda *_: False)
    result = forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS)
    assert result.status == 0
    assert "The result was not kept: '" in result.err
    assert result.err.endswith("may only be read here; copy it to where you may write.\n")


def test_a_task_named_twice_is_one_task(forcelab, project):
    words = ["--task", "foam", "--task", "foam", *FAST_OPTIONS, "--json", "-"]
    twice = forcelab("evaluate", project, *words).json
    assert [scores["name"] for scores in twice["raw"]["demonstrations"]] == [
        f"foam-0{i}" for i in (1, 2, 3, 4)
    ]


def test_testing_on_what_was_trained_on_is_refused(forcelab, project):
    words = ["--task", "foam", "--test-task", "foam", *FAST_OPTIONS]
    assert "is trained on" in forcelab("evaluate", project, *words).sentence


def test_outputs_are_checked_before_the_work(forcelab, project, tmp_path):
    nowhere, twice = tmp_path / "none" / "x.json", tmp_path / "a.png"
    inside, spelling = project / "project.sqlite", tmp_path / "map.json"
    spelling.write_text("{}")
    for words, says in [
        (["--json", nowhere], "folder does not exist"),
        (["--figure", twice, "--confusion", twice], "two outputs"),
        (["--json", inside], "what is read here"),
        (["--json", spelling, "--merge", spelling], "what is read here"),
        (["--test-task", "sponge", "--apart"], "join or merge"),
        (["--json", tmp_path], "is a folder"),
    ]:
        assert (
            says in forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS, *words).sentence
        )
    with Project.open(project) as opened:
        assert opened.runs.all() == ()


def test_remarks_tell_what_does_not_fit(forcelab, project, tmp_path):
    spelling = tmp_path / "map.json"
    spelling.write_text('{"nonsense": "grab"}')
    with Project.open(project) as opened:
        opened.demonstrations.rename(opened.demonstrations.id_of("foam-01"), "foam\x1b[1m")
    words = ["--task", "foam", *FAST_OPTIONS, "--max-scale", "1024", "--merge", spelling]
    result = forcelab("evaluate", project, *words)
    assert r"The largest scale, 1024 samples, is longer than foam\x1b[1m and 3 more" in result.out
    assert result.err == "forcelab: The merge map names what nobody labelled: nonsense.\n"


def test_a_damaged_array_is_told_before_the_work(forcelab, project):
    with Project.open(project) as opened:
        id_ = opened.demonstrations.infos("foam")[0].id
    file = project / "demonstrations" / id_ / "signals.npy"
    content = bytearray(file.read_bytes())
    content[-3] ^= 1
    file.write_bytes(content)
    assert "'foam-01'" in forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS).sentence


def test_figures_of_joined_tasks_keep_the_colours_of_the_vocabulary(forcelab, project):
    with Project.open(project) as opened:
        vocabulary = opened.actions.vocabulary("foam").recoloured("hold", "#123456")
        opened.actions.set_vocabulary("foam", vocabulary)
    both = ["--task", "foam", "--task", "sponge", *FAST_OPTIONS]
    assert "#123456" in forcelab("evaluate", project, *both, "--figure", "-").out


def test_another_coders_labels_are_learnt_from_and_what_they_change_is_printed(
    forcelab, project, tmp_path
):
    with Project.open(project) as store:
        for info in store.demonstrations.infos("foam")[2:]:
            track = store.tracks.get(info.id, "coder").segments
            store.tracks.edit(info.id, "coder", track, (), "cleared")
            store.tracks.edit(info.id, "Ben", (), track, "made")
    words = ["--task", "foam", "--author", "coder", *FAST_OPTIONS]
    alone = forcelab("evaluate", project, *words, "--json", "-").json
    result = forcelab("evaluate", project, *words, "--also-from", "Ben", "--json", "-")
    assert [scores["name"] for scores in result.json["raw"]["demonstrations"]] == [
        "foam-01", "foam-02",
    ]  # fmt: skip
    assert result.json["alone"] == alone["filtered"]
    assert len(result.json["trained_on"]) == 4
    printed = forcelab("evaluate", project, *words, "--also-from", "Ben").out
    assert "Own labels alone: accuracy" in printed
    assert "Also learnt from 2 demonstrations that another coder labelled" in printed
    refused = forcelab("evaluate", project, *words, "--also-from", "Zoe")
    assert refused.status == 1
    assert refused.err == "forcelab: 'Zoe' cannot be learnt from as well: no such coder.\n"
    file = tmp_path / "both.skops"
    trained = forcelab("train", project, *words[:-2], "--also-from", "Ben", "--out", file)
    assert "learnt from 4 demonstrations" in trained.out


def test_spellings_are_merged_before_tasks_are_kept_apart_and_stored_labels_stay(
    forcelab, project, tmp_path
):
    spelling = tmp_path / "map.json"
    spelling.write_text('{"grab": "move", "release": "move"}')
    both = ["--task", "foam", "--task", "sponge", "--apart", "--merge", spelling, *FAST_OPTIONS]
    labels = forcelab("evaluate", project, *both, "--json", "-").json["labels"]
    assert labels == [f"{a}_{t}" for t in ("foam", "sponge") for a in ("still", "move", "hold")]
    with Project.open(project) as opened:
        first = opened.demonstrations.infos("foam")[0].id
        assert opened.tracks.get(first, "coder").actions == ("still", "grab", "hold", "release")


def test_the_run_is_kept_with_all_that_repeats_it(forcelab, project):
    content = forcelab(
        "evaluate", project, "--task", "foam", *FAST_OPTIONS, "--seed", "7", "--json", "-"
    ).json
    with Project.open(project) as opened:
        (run,) = opened.runs.all()
        ids = {info.id for info in opened.demonstrations.infos("foam")}
    assert content.items() <= run.result.items()
    assert run.seed == 7
    assert set(run.demonstrations) == ids
    assert run.settings["classifier"] == "naive-bayes"
    assert run.settings["choice"]["tasks"] == ["foam"]
    # Whose labels, and how old they were: an edit since then can be seen.
    assert {used.author for used in run.labels} == {"coder"}
    with Project.open(project) as opened:
        assert all(opened.tracks.head(u.demonstration, u.author) == u.edit for u in run.labels)
        first = run.labels[0]
        segments = opened.tracks.get(first.demonstration, "coder").segments
        opened.tracks.edit(first.demonstration, "coder", segments, segments[1:], "erased")
        assert opened.tracks.head(first.demonstration, "coder") > first.edit
    # The predictions themselves are there to be looked at again.
    assert run.result["tracks"][0]["raw"][0][2] in SYNTHETIC_ACTIONS


def test_accepted_proposals_among_the_tested_labels_are_remarked_on(forcelab, project):
    words = ["evaluate", project, "--task", "foam", *FAST_OPTIONS]
    assert "proposed by a recogniser" not in forcelab(*words).out
    with Project.open(project) as opened:
        first, *others = (info.id for info in opened.demonstrations.infos("foam"))
        labels = opened.tracks.get(first, "coder").segments
        count = sum(len(opened.tracks.get(id_, "coder").segments) for id_ in (first, *others))
        opened.tracks.edit(first, "coder", labels, (), "erased")
        opened.tracks.edit(first, "coder", (), labels, "accepted", proposed_by="model paper 1")
        moved = (*labels[:-1], Segment(labels[-1].start, labels[-1].end - 0.01, labels[-1].action))
        opened.tracks.edit(first, "coder", labels, moved, "moved")
    sentence = f"{len(labels) - 1} of {count} tested segments ("
    assert sentence in forcelab(*words).out
    (remark,) = forcelab(*words, "--json", "-").json["remarks"]
    assert remark.startswith(sentence)
    assert "accepted unchanged, which makes scores too high" in remark


def test_the_same_seed_gives_the_same_scores_and_another_gives_others(forcelab, project):
    words = ["evaluate", project, "--task", "sponge", "--max-scale", "16", "--stride", "16"]
    words += ["--classifier", "extra-trees", "--jobs", "1", "--json", "-"]
    first, again, other = (forcelab(*words, "--seed", seed).json for seed in (3, 3, 4))
    for content in (first, again):
        del content["seconds"]
    assert first == again
    assert first["raw"] != other["raw"]


def test_figures_are_drawn_in_the_format_of_their_suffix(forcelab, project, tmp_path):
    for first, second in (("svg", "pdf"), ("pdf", "png")):
        pairs, confusion = tmp_path / f"pairs.{first}", tmp_path / f"confusion.{second}"
        words = ["--task", "foam", *FAST_OPTIONS, "--figure", pairs, "--confusion", confusion]
        assert forcelab("evaluate", project, *words).status == 0
        for file in (pairs, confusion):
            start = {".svg": b"<?xml", ".pdf": b"%PDF", ".png": b"\x89PNG"}[file.suffix]
            assert file.read_bytes().startswith(start)


@pytest.mark.parametrize("option", ["--figure", "--table", "--json"])
def test_scores_are_told_though_the_disk_is_full(forcelab, project, tmp_path, monkeypatch, option):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    name = tmp_path / {"--figure": "f.svg", "--table": "t.csv", "--json": "j.json"}[option]
    result = forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS, option, name)
    assert result.status == 1
    assert f"'{name}' cannot be written (No space left on device)" in result.err
    assert "pooled" in result.out


def test_filters_can_be_switched_off_one_by_one(forcelab, project):
    off = {
        name: forcelab(
            "evaluate", project, "--task", "foam", *FAST_OPTIONS, "--json", "-",
            *[word for other in ("threshold", "median", "drop") if other != name
              for word in (f"--{other}", "off")],
        ).json
        for name in ("threshold", "median", "drop", "none of them")
    }  # fmt: skip
    bare = off.pop("none of them")
    assert bare["filtered"] == bare["raw"]
    changed = [content["filtered"]["pooled"]["confusion"] for content in off.values()]
    assert all(confusion != bare["raw"]["pooled"]["confusion"] for confusion in changed)
    # Only a median never unlabels anything that no neighbour left unlabelled.
    assert off["median"]["filtered"]["pooled"]["coverage"] == 1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--task", "chess"], "no task 'chess'; choose from foam, sponge"),
        (["--channels", "torque"], "normal 1"),
        (["--author", "nobody"], "coder"),
        (["--merge", "missing.json"], "missing.json"),
        (["--figure", "pairs.gif"], ".svg"),
    ],
)
def test_what_does_not_fit_the_project_is_one_sentence_with_the_cure(
    forcelab, project, words, says
):
    options = [*FAST_OPTIONS, *words]
    assert says in forcelab("evaluate", project, "--task", "foam", *options).sentence


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--classifier", "oracle"], "naive-bayes"),
        (["--classifier", "naive-bayse"], "did you mean 'naive-bayes'?"),
        (["--preset", "magic"], "paper"),
        (["--preset", "papr"], "did you mean 'paper'?"),
        (["--wavelet", "daubechies"], "haar"),
        (["--stride", "0"], "stride"),
        (["--median", "wide"], "'off'"),
        (["--windows", "0.1,wide"], "seconds"),
        (["--max-scale", "1"], "at least min_scale, which is 2 samples, not 1"),
        (["--jobs", "0"], "--jobs"),
        (["--folds", "1"], "--folds"),
    ],
)
def test_a_setting_that_cannot_be_is_a_wrong_command_line(forcelab, project, words, says):
    options = [*FAST_OPTIONS, *words]
    assert says in forcelab("evaluate", project, "--task", "foam", *options).wrong_word


def test_two_coders_must_be_told_apart(forcelab, project, recordings):
    for task, name in (("foam", "foam-01"), ("sponge", "sponge-11")):
        forcelab("import", project, recordings / f"{name}.csv", "--author", "Ada", "--task", task)
    sentence = forcelab("evaluate", project, *FAST_OPTIONS).sentence
    # Of all tasks at once.
    assert sentence == "forcelab: There are labels of coder, Ada; say whose to use (--author).\n"
    words = ["evaluate", project, "--task", "foam", *FAST_OPTIONS]
    assert "coder, Ada; say whose to use (--author)." in forcelab(*words).sentence
    assert forcelab(*words, "--author", "coder").status == 0


def test_models_are_never_trained_on(forcelab, project):
    with Project.open(project) as opened:
        for info in opened.demonstrations.infos():
            segments = opened.tracks.get(info.id, "coder").segments[:2]
            opened.tracks.edit(info.id, "robot", (), segments, "predicted", kind="predict")
    assert forcelab("evaluate", project, "--task", "foam", *FAST_OPTIONS).status == 0
    assert (
        "'robot' has labelled nothing"
        in forcelab("evaluate", project, *FAST_OPTIONS, "--author", "robot").sentence
    )


def test_a_task_is_adapted_to_another_with_scores_with_and_without(forcelab, project):
    words = ["--train-task", "foam", "--test-task", "sponge", "--adapt", *FAST_OPTIONS]
    result = forcelab("evaluate", project, *words)
    assert "Without adaptation: accuracy" in result.out
    assert (
        "Adapted to the training demonstrations without labels: no sensor is swapped" in result.out
    )
    content = forcelab("evaluate", project, *words, "--json", "-").json
    assert 0 <= content["unadapted"]["pooled"]["accuracy"] <= 1
    assert "With adaptation the result is kept as no run" in result.err
    with Project.open(project) as opened:
        assert not opened.runs.summaries("evaluate")
    assert (
        "choose"
        in forcelab("evaluate", project, "--task", "foam", "--adapt", *FAST_OPTIONS).sentence
    )


@pytest.mark.parametrize(
    ("words", "folds"), [((), 2), (("--folds", "0"), 0), (("--folds", "3"), 3)]
)
def test_many_demonstrations_are_left_out_in_groups_unless_it_is_said(
    forcelab, project, monkeypatch, words, folds
):
    monkeypatch.setattr(groups, "MANY", 2)
    monkeypatch.setattr(groups, "GROUPS", 2)
    command = ["evaluate", project, "--task", "foam", *FAST_OPTIONS, *words]
    content = forcelab(*command, "--json", "-").json
    assert len(content["tested"]) == 4
    remarks = [remark for remark in content["remarks"] if "groups" in remark]
    assert remarks == ([f"Left out in {folds} groups of up to 2."] if folds else [])
    with Project.open(project) as opened:
        (run,) = opened.runs.summaries("evaluate")
    assert run.settings["choice"]["folds"] == folds  # which a review trains again


def test_a_stream_is_left_out_in_groups_too(forcelab, project):
    words = ["evaluate", project, "--task", "foam", *FAST_OPTIONS, "--stride", "10", "--json", "-"]
    words += ["--latency", "0.5"]
    halves = forcelab(*words, "--folds", "2").json
    assert "Left out in 2 groups of up to 2." in halves["remarks"]
    assert len(set(halves["tested"])) == 4
    assert halves["filtered"]["pooled"]["accuracy"] > 0.5
    assert "from 0 to 600, not 1e+09" in forcelab(*words, "--latency", "1e9").sentence


def test_people_are_told_apart_by_the_names_of_their_demonstrations(forcelab, project):
    words = ["evaluate", project, "--task", "foam", *FAST_OPTIONS]
    content = forcelab(*words, "--test-names", "*-01", "--json", "-").json
    assert len(content["tested"]) == 1
    assert set(content["tested"]).isdisjoint(content["trained_on"])
    assert content["title"] == "foam → *-01"
    assert "matches no demonstration" in forcelab(*words, "--test-names", "bob-*").sentence
    assert "matches every demonstration" in forcelab(*words, "--test-names", "*").sentence
    both = ["--test-names", "*-01", "--test-task", "sponge"]
    assert "not on both" in forcelab(*words, *both).sentence
    late = ["--test-names", "*-01", "--latency", "0.1"]
    assert "demonstrations are left out in turn" in forcelab(*words, *late).sentence


def test_a_stride_beyond_all_samples_is_a_wrong_word(forcelab, project):
    result = forcelab("evaluate", project, "--stride", 2**64)
    assert "must be a whole number from 1 to 2^31 - 1, not" in result.wrong_word
