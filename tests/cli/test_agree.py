"""``forcelab agree``: figures of coders, and the places where they differ."""

import pytest

from forcelab.labels import Segment
from forcelab.project import Project


@pytest.fixture
def coded(project):
    """Ann labels foam as the recordings say, but starts everything 30 ms later."""
    with Project.open(project) as opened:
        for info in opened.demonstrations.infos("foam"):
            segments = opened.tracks.get(info.id, "coder").segments
            late = tuple(Segment(s.start + 0.03, s.end, s.action) for s in segments)
            if info.name.endswith("01"):  # and takes one action for another
                late = (*late[:2], Segment(late[2].start, late[2].end, "grab"), *late[3:])
            opened.tracks.edit(info.id, "Ann", (), late, "made")
    return project


def test_the_figures_and_the_worst_place(forcelab, coded):
    result = forcelab("agree", coded)
    assert result.status == 0
    assert "Ann / coder" in result.out
    assert "almost perfect" in result.out or "substantial" in result.out
    found = forcelab("agree", coded, "--json").json
    (pair,) = found["pairs"]
    assert pair["demonstrations"] == 4
    assert pair["boundaries"]["within_ms"]["50"] == 1.0
    assert pair["kappa_interval"][0] < pair["kappa"] <= pair["kappa_interval"][1]
    assert pair["by_action"]["still"] == pytest.approx(1.0)
    worst = pair["places"]["apart"][0]
    assert (worst["name"], worst["first"], worst["second"]) == ("foam-01", "grab", "hold")
    assert worst["name"] in result.out
    assert found["fleiss_kappa"] == pytest.approx(pair["kappa"], abs=0.01)
    assert found["counts"] == {"Ann": {"foam": 4}, "coder": {"foam": 4, "sponge": 2}}


def test_names_cannot_steer_the_terminal(forcelab, coded):
    with Project.open(coded) as opened:
        info = opened.demonstrations.info(opened.demonstrations.id_of("foam-01"))
        opened.demonstrations.rename(info.id, "foam\x1b[31m")
        opened.tracks.edit(info.id, "Bob\n\x1b[1m", (), (Segment(0.0, 1.0, "a\nb"),), "made")
    result = forcelab("agree", coded).out
    assert "\x1b" not in result
    assert r"foam\x1b[31m" in result
    assert r"Ann / Bob\n\x1b[1m" in result.splitlines()
    assert r"agreement by action, %: a\nb " in result


def test_one_coder_who_labelled_twice(forcelab, coded):
    found = forcelab("agree", coded, "--same", "coder", "Ann", "--json").json
    assert found["pairs"] == []
    assert found["repeated"][0]["coders"] == ["coder", "Ann"]
    assert "labelling twice" in forcelab("agree", coded, "--same", "coder", "Ann").out


def test_only_some_coders_and_one_task(forcelab, coded):
    assert forcelab("agree", coded, "--task", "foam", "--authors", "coder", "Ann").status == 0
    sentence = forcelab("agree", coded, "--task", "sponge").sentence
    assert "forcelab assign" in sentence
    assert "no coder 'Bob'" in forcelab("agree", coded, "--authors", "Bob", "Ann").sentence
    assert "no task 'x'" in forcelab("agree", coded, "--task", "x").sentence
