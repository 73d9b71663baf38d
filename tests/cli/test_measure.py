"""``forcelab measure``."""

import json
import re

import pytest
from factories import BAYES_SETTINGS, make_labelled_project

from forcelab.errors import InputError
from forcelab.jobs import Progress
from forcelab.measure import contact, cwt, recognition
from forcelab.measure.recognition import Variant
from forcelab.measure.rows import Row, Table, with_front

ROWS = with_front(
    [
        Row(name, f"tolerance {e:g} N", size, "Radau, tolerance 1 uN", e, t, t / 50, 10**6 * i,
            {"largest (N)": 3 * e})
        for size in ("foam, 6 lanes x 1 s", "snap, 6 lanes x 1 s")
        for i, (name, e, t) in enumerate((("explicit", 1e-2, 0.1), ("Radau", 1e-4, 12.0)), 1)
    ]
    + [Row("LSODA", "tolerance 1 mN", "snap, 6 lanes x 1 s", "Radau, tolerance 1 uN",
           refusal="It takes more than 9 steps.")]
)  # fmt: skip
TABLE = Table("Contact mechanics", "error (N rms)", "CPU s per simulated s", ROWS)


@pytest.fixture
def quick_flags(monkeypatch):
    """The measurement replaced by a ready table; holds what it was asked for."""
    calls = []

    def tabulate(*, quick=False):
        calls.append(quick)
        yield Progress(0, 1, "springs")
        return TABLE

    monkeypatch.setattr(contact, "tabulate", tabulate)
    return calls


def test_the_table_has_every_row_aligned_under_its_unit(forcelab, quick_flags):
    result = forcelab("measure", "contact")
    assert (result.status, result.err, quick_flags) == (0, "", [False])
    blocks = result.out.strip().split("\n\n")
    assert len(blocks) == 3
    for block in blocks[1:]:
        title, header, *lines = block.splitlines()
        assert title in TABLE.sizes
        ends = [match.end() for match in re.finditer(r"\S+( \S+)*", header)]
        for line in (line for line in lines if line.startswith("*")):
            cells = list(re.finditer(r"\S+( \S+)*", line))
            # Numbers end where their header ends.
            assert [cell.end() for cell in cells][3:] == ends[2:]
            assert re.fullmatch(r"\d\.\d\de-\d\d", cells[3].group())
    assert "0.100" in blocks[1]
    assert "12.0" in blocks[1]
    assert "Error against Radau, tolerance 1 uN." in blocks[1]


def test_refused_rows_are_shown_with_their_sentence(forcelab, quick_flags):
    result = forcelab("measure", "contact")
    assert re.search(r"^ +LSODA +tolerance 1 mN +refused$", result.out, re.M)
    assert "Refused: LSODA, tolerance 1 mN: It takes more than 9 steps." in result.out


def test_json_and_figure_are_written(forcelab, quick_flags, tmp_path):
    file, figure = tmp_path / "rows.json", tmp_path / "front.svg"
    result = forcelab("measure", "contact", "--json", file, "--figure", figure)
    assert result.status == 0
    assert "foam, 6 lanes x 1 s" in result.out
    content = json.loads(file.read_text())
    assert tuple(Row(**row) for row in content["rows"]) == ROWS
    assert {"machine", "versions"} <= set(content)
    assert "cartridge" not in figure.read_text()
    assert "snap, 6 lanes x 1 s" in figure.read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["front.svg", "rows.json"]


def test_json_on_standard_output_is_nothing_but_json(forcelab, quick_flags):
    result = forcelab("measure", "contact", "--json", "-")
    assert len(result.json["rows"]) == 5
    assert result.err == ""


def test_quick_is_passed_on(forcelab, quick_flags):
    assert forcelab("measure", "contact", "--quick").status == 0
    assert quick_flags == [True]


@pytest.mark.parametrize(
    ("option", "file", "words"),
    [
        ("--json", "missing/rows.json", "its folder does not exist"),
        ("--json", "", "is a folder"),
        ("--figure", "missing/front.svg", "its folder does not exist"),
        ("--figure", "front.jpg", ".svg, .pdf or .png"),
    ],
)
def test_a_file_that_cannot_be_written_is_told_before_anything_is_measured(
    forcelab, quick_flags, tmp_path, option, file, words
):
    result = forcelab("measure", "contact", option, tmp_path / file)
    assert words in result.sentence
    assert quick_flags == []


def test_one_file_for_both_outputs_is_refused(forcelab, quick_flags, tmp_path):
    path = tmp_path / "both.svg"
    result = forcelab("measure", "contact", "--json", path, "--figure", path)
    assert "two outputs" in result.sentence
    assert quick_flags == []


def test_something_else_to_measure_is_refused_with_what_there_is(forcelab):
    complaint = forcelab("measure", "weather").wrong_word
    assert "weather" in complaint
    assert "contact" in complaint


@pytest.fixture
def project(tmp_path, monkeypatch):
    monkeypatch.setattr(recognition, "QUICK", (Variant("preset", "cheap", BAYES_SETTINGS),))
    return make_labelled_project(tmp_path / "study.forcelab", labelled=2, bare=0)


def test_recognition_is_measured_on_a_project_that_stays_as_it_is(
    forcelab, project, tmp_path, monkeypatch
):
    few = (*recognition.QUICK, Variant("filters", "none", BAYES_SETTINGS.replace(median=None)))
    monkeypatch.setattr(recognition, "QUICK", few)
    file, figure = tmp_path / "rows.json", tmp_path / "front.svg"
    result = forcelab(
        "measure", "recognition", project, "--quick", "--json", file, "--figure", figure
    )
    assert (result.status, result.err) == (0, "")
    assert "foam, 2 demonstrations" in result.out
    assert "F1@50" in result.out
    content = json.loads(file.read_text())
    assert [Row(**row).setting for row in content["rows"]] == ["cheap", "none"]
    assert "cheap" in figure.read_text()
    assert "No runs" in forcelab("runs", project).out


@pytest.mark.parametrize(
    ("what", "words", "sentence"),
    [
        ("contact", ["study.forcelab"], "PROJECT goes with 'recognition', not with 'contact'"),
        ("contact", ["--task", "x"], "--task goes with 'recognition'"),
        ("contact", ["--thorough"], "--thorough goes with 'recognition'"),
    ],
)
def test_what_does_not_go_together_is_refused_before_the_work(
    forcelab, quick_flags, what, words, sentence
):
    assert sentence in forcelab("measure", what, *words).wrong_word
    assert quick_flags == []


def test_one_task_and_one_coder_can_be_asked_for(forcelab, project):
    result = forcelab("measure", "recognition", project, "--quick", "--task", "pen")
    assert "'pen'" in result.sentence
    result = forcelab("measure", "recognition", project, "--quick", "--author", "Bo")
    assert "'Bo' has labelled nothing here" in result.sentence


def test_without_a_project_it_is_the_sample_project(forcelab, project, monkeypatch):
    from forcelab.gui import project_actions

    monkeypatch.setattr(project_actions, "sample_place", lambda: project)
    result = forcelab("measure", "recognition", "--quick", "--thorough")
    assert "foam, 2 demonstrations" in result.out


def test_a_sample_project_that_is_not_there_is_made_for_as_long_as_needed(
    forcelab, project, monkeypatch, tmp_path
):
    from forcelab import sample
    from forcelab.gui import project_actions

    places = []

    def making(path):
        places.append(path)
        yield Progress(0, 1, "making")
        make_labelled_project(path, labelled=2, bare=0)

    monkeypatch.setattr(sample, "make_sample_job", making)
    monkeypatch.setattr(project_actions, "sample_place", lambda: tmp_path / "sample.forcelab")
    assert "foam, 2 demonstrations" in forcelab("measure", "recognition", "--quick").out
    assert not places[0].exists()
    assert not (tmp_path / "sample.forcelab").exists()


def test_all_measures_everything_and_names_what_it_skips(
    forcelab, monkeypatch, quick_flags, tmp_path
):
    from forcelab.cli.commands import measure

    def refusing(*, quick):
        yield Progress(0, 1, "streaming")
        raise InputError("There is no transform.")

    monkeypatch.setattr(cwt, "tabulate", refusing)
    monkeypatch.setattr(
        measure, "MODULES", {name: measure.MODULES[name] for name in ("contact", "cwt")}
    )
    file = tmp_path / "all.json"
    result = forcelab("measure", "all", "--quick", "--json", file)
    assert result.status == 0
    assert quick_flags == [True]
    assert "foam, 6 lanes x 1 s" in result.out
    assert "Skipped: cwt: There is no transform." in result.out
    content = json.loads(file.read_text())
    assert list(content["tables"]) == ["contact"]
    assert set(content["skipped"]) == {"cwt"}
    result = forcelab("measure", "all", "--figure", tmp_path / "all.svg")
    assert "no figure of 'all'" in result.wrong_word
