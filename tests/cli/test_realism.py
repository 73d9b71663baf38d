"""``forcelab realism``."""

import json
from dataclasses import replace

import pytest
from synthetic import synthetic_set

from forcelab.cli import comparing
from forcelab.labels import Track
from forcelab.measure import beside
from forcelab.merging import MergeMap
from forcelab.project import Incoming, Project
from forcelab.recognition.presets import preset

#: Settings with which leaving one of a few demonstrations out takes a tenth of a second.
QUICK = preset("paper").replace(classifier="naive-bayes", max_scale=64)
LABELLED = 3


def coded(task, seed, count=LABELLED, coder="coder", rate=100.0):
    """Synthetic demonstrations of a task with one coder's labels."""
    return [
        Incoming(replace(demonstration, task=task), (Track(coder, segments),))
        for demonstration, segments in synthetic_set(count, rate, task, seed)
    ]


def project_of(path, given):
    with Project.create(path) as project:
        project.add_all(given)
    return path


@pytest.fixture
def asked(monkeypatch):
    """Synthetic demonstrations instead of simulated ones; holds what was to be simulated."""
    calls = []

    def producing(orders, scratch, jobs):
        calls.append(orders)
        task = orders[0].origin.task
        yield from ()
        return tuple(coded(task, 50, len(orders), orders[0].coders[0]))

    def quickly(simulated, real, jobs):
        return recognition(simulated, real, QUICK)

    recognition = beside.recognition
    monkeypatch.setattr(beside, "producing", producing)
    monkeypatch.setattr(beside, "recognition", quickly)
    monkeypatch.setattr(comparing, "cpu_count", lambda: 1)
    return calls


@pytest.fixture
def real(tmp_path):
    """Labelled foam, one demonstration that nobody labelled, and a task nobody can simulate.

    One coder's grabs are spelled as in the published recordings.
    """
    unlabelled = replace(coded("foam", 40, 1)[0], tracks=())
    first, *others = coded("foam", 1)
    spelled = MergeMap({"grab": "grab_soft"}).apply_segments(first.tracks[0].segments)
    first = replace(first, tracks=(Track("coder", spelled),))
    given = [first, *others, unlabelled, *coded("sponge", 20)]
    return project_of(tmp_path / "real.forcelab", given)


def test_what_is_labelled_and_can_be_simulated_is_compared(forcelab, asked, real):
    (foam,) = forcelab("realism", real, "--count", "4", "--seed", "5", "--json", "-").json
    assert (foam["task"], foam["simulated"], foam["real"]) == ("foam", 4, LABELLED)
    rows = {row["name"]: row for row in foam["rows"]}
    grab = rows["grab: segments"]
    assert (grab["simulated"], grab["real"], grab["ratio"], grab["alike"]) == (1, 1, 1, True)
    duration = rows["duration"]
    assert duration["ratio"] == pytest.approx(duration["simulated"] / duration["real"])
    assert rows["filtered: accuracy"]["real"] > 0.5
    (orders,) = asked
    assert [str(order.origin) for order in orders] == [
        f"simulated: task foam, seed 5, number {number}, 1000 Hz" for number in (1, 2, 3, 4)
    ]
    assert not any(order.video for order in orders)


def test_the_tables_mark_what_is_more_than_a_factor_of_two_apart(forcelab, asked, tmp_path):
    strong = [
        replace(
            one, demonstration=replace(one.demonstration, signals=5 * one.demonstration.signals)
        )
        for one in coded("foam", 50)
    ]
    project, file = project_of(tmp_path / "lab.forcelab", strong), tmp_path / "figures.json"
    said = forcelab("realism", project, "--count", LABELLED, "--json", file)
    first, _, *table, blank, last = said.out.splitlines()
    assert first == "foam: 3 simulated demonstrations beside 3 real"
    assert (blank, last) == ("", "! marks what is more than a factor of 2 apart.")
    rows = json.loads(file.read_text())[0]["rows"]
    assert [line.startswith("!") for line in table] == [not row["alike"] for row in rows]
    (grip,) = (line for line in table if "grab: normal force of sensor 1, peak" in line)
    assert grip.startswith("!")
    assert grip.endswith("  0.20")
    assert any(line.startswith("   duration") for line in table)


def test_taps_are_cut_off_the_simulated_side(asked, real):
    demonstration, segments = synthetic_set(1, 100.0)[0]
    cut = beside._task_only(demonstration, segments[1:-1])
    assert cut.times[0] == pytest.approx(segments[1].start - beside.LEAD, abs=0.01)
    assert cut.times[-1] == pytest.approx(segments[-2].end + beside.LEAD, abs=0.01)
    assert len(cut.signals) == len(cut.times) < len(demonstration.times)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--count", "0"], "2 simulated demonstrations or more, not 0"),
        (["--count", "1"], "2 simulated demonstrations or more, not 1"),
        (["--count", "1001"], "not 1001"),
        (["--seed", "-1"], "not -1"),
        (["--author", "Ada"], "there are labels of coder"),
    ],
)
def test_a_wrong_option_is_refused_before_the_work(forcelab, asked, real, words, sentence):
    assert sentence in forcelab("realism", real, *words).sentence
    assert asked == []


def test_json_into_the_project_is_refused_before_the_work(forcelab, asked, real):
    assert "write elsewhere" in forcelab("realism", real, "--json", real / "rows.json").sentence
    assert asked == []


def columns_of(one, names):
    """A demonstration with some of its channels only."""
    d = one.demonstration
    kept = [number for number, channel in enumerate(d.channels) if channel.name in names]
    channels = tuple(d.channels[number] for number in kept)
    return replace(one, demonstration=replace(d, signals=d.signals[:, kept], channels=channels))


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (coded("sponge", 1), "no labelled demonstration of a task that can be simulated (LEGO,"),
        ([replace(one, tracks=()) for one in coded("foam", 1)], "no labelled demonstration"),
        (coded("foam", 1, count=1), "too few labelled demonstrations of the task 'foam', 1;"),
        ([*coded("foam", 1), *coded("foam", 9, coder="Ada")], "coder, Ada; say whose to use (--a"),
        ([columns_of(one, {"fz1"}) for one in coded("foam", 1)], "no 3-axis force sensor"),
    ],
)
def test_what_cannot_be_compared_is_refused_before_the_work(
    forcelab, asked, tmp_path, given, sentence
):
    project = project_of(tmp_path / "lab.forcelab", given)
    assert sentence in forcelab("realism", project).sentence
    assert asked == []


def test_of_several_coders_the_one_that_is_named_is_compared(forcelab, asked, tmp_path):
    given = [*coded("foam", 1), *coded("foam", 9, count=2, coder="Ada")]
    project = project_of(tmp_path / "lab.forcelab", given)
    said = forcelab("realism", project, "--author", "Ada", "--count", "2", "--json", "-")
    assert [one["real"] for one in said.json] == [2]
