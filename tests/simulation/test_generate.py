"""Demonstrations from tasks and seeds: the same ones again, each by itself, with their truth."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from factories import perform_grips
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.clock import ClockMap
from forcelab.errors import InputError
from forcelab.jobs import finish
from forcelab.simulation import generate
from forcelab.simulation.generate import Order, produce_demonstrations
from forcelab.simulation.origin import MOST, RATES, Origin, origins, task_named
from forcelab.simulation.scene import TASKS
from forcelab.simulation.tasks import RATE
from forcelab.terms import glossary


def produce(orders, tmp_path, jobs=1):
    """The demonstrations of some orders, each call in a folder of its own."""
    scratch = tmp_path / str(len(list(tmp_path.iterdir())))
    scratch.mkdir()
    return finish(produce_demonstrations(orders, scratch, jobs))


def unfilmed(*numbers, task="foam", seed=3, rate=1000.0):
    return [Order(Origin(task, seed, number, rate), video=False) for number in numbers]


@pytest.fixture
def quick(monkeypatch):
    """Brief performances instead of the mechanics."""
    monkeypatch.setattr(generate, "perform_job", perform_grips)


# Where they come from


@given(
    st.sampled_from(TASKS),
    st.integers(0, 2**32 - 1),
    st.integers(1, 10**6),
    st.floats(*RATES),
)
@settings(max_examples=50)
def test_a_source_tells_all_that_is_needed_to_make_a_demonstration_again(task, seed, number, rate):
    origin = Origin(task, seed, number, rate)
    assert Origin.parsed(str(origin)) == origin


def test_a_source_is_one_readable_line():
    source = "simulated: task foam, seed 3, number 2, 1000 Hz"
    assert str(Origin("foam", 3, 2)) == source
    assert Origin("foam", 3, 2).name == "foam-3-02"


@pytest.mark.parametrize(
    "source",
    [
        "",
        "foam-01.csv",
        "simulated: task foam, seed 3, number 2, 1000 Hz ",
        "simulated: task Foam, seed 3, number 2, 1000 Hz",
        "simulated: task sponge, seed 3, number 2, 1000 Hz",
        "simulated: task foam, seed 03, number 2, 1000 Hz",
        "simulated: task foam, seed 3, number 0, 1000 Hz",
        "simulated: task foam, seed 3, number 2, 1000.0 Hz",
        "simulated: task foam, seed 3, number 2, 1 Hz",
        "simulated: task foam, seed 3, number \N{ARABIC-INDIC DIGIT TWO}, 1000 Hz",
        f"simulated: task foam, seed {2**32}, number 2, 1000 Hz",
    ],
)
def test_any_other_source_is_not_taken_for_a_simulation(source):
    assert Origin.parsed(source) is None


def test_what_cannot_be_simulated_is_refused_with_what_can():
    assert task_named("lego") == "LEGO"
    with pytest.raises(InputError, match=r"'sponge'.*LEGO, cartridge, stylus, marker, foam\.$"):
        task_named("sponge")
    with pytest.raises(InputError, match="seed"):
        origins("foam", 1, -1, 1000.0)
    with pytest.raises(InputError, match="Hz"):
        origins("foam", 1, 0, float("nan"))
    for count in (0, MOST + 1):
        with pytest.raises(InputError, match="at one go"):
            origins("foam", count, 0, 1000.0)


def test_the_fastest_recording_is_as_fast_as_the_motion():
    assert RATES[1] == RATE


# What comes out


def test_the_mechanics_give_the_same_number_alone_and_among_others(tmp_path):
    alone = produce(unfilmed(2, seed=68), tmp_path)  # of short demonstrations
    among = produce(unfilmed(1, 2, seed=68), tmp_path, jobs=2)
    assert among[1] == alone[0]
    assert among[1].truth == alone[0].truth
    assert among[0] != among[1]
    for incoming in among:
        assert 3.0 < incoming.demonstration.duration < 9.0
        assert -20.0 < incoming.demonstration.signals[:, 2].min() < -1.0
        assert {name for *_, name in incoming.truth["actions"]} >= {"still", "grab", "release"}


def test_every_demonstration_is_its_own_whatever_the_others_are(quick, tmp_path):
    orders = [*unfilmed(7, 2, 1), *unfilmed(2, task="LEGO"), *unfilmed(2, seed=4)]
    every = produce(orders, tmp_path)
    assert [incoming.source for incoming in every] == [str(order.origin) for order in orders]
    assert [produce([order], tmp_path)[0] for order in reversed(orders)] == list(reversed(every))
    # Brief performances do not depend on the task: noise and offsets do.
    assert len({incoming.demonstration.id for incoming in every}) == 5


def test_a_video_changes_neither_forces_nor_labels(quick, tmp_path):
    (filmed,) = produce([Order(Origin("foam", 3, 1))], tmp_path)
    (not_filmed,) = produce(unfilmed(1), tmp_path)
    assert filmed.demonstration.id == not_filmed.demonstration.id
    assert filmed.tracks == not_filmed.tracks
    assert not_filmed.demonstration.video is None
    assert "video" not in not_filmed.truth


def test_a_coder_labels_the_same_with_and_without_the_other(quick, tmp_path):
    both, incoming = (
        produce([Order(Origin("foam", 3, 1), coders, video=False)], tmp_path)[0]
        for coders in (("Ines", "Tomas"), ("Tomas",))
    )
    assert [track.author for track in both.tracks] == ["Ines", "Tomas"]
    assert incoming.tracks == both.tracks[1:]
    (nobody,) = produce([Order(Origin("foam", 3, 1), (), video=False)], tmp_path)
    assert nobody.tracks == ()


def test_another_rate_records_the_same_motion_with_the_same_tongs(quick, tmp_path):
    fine, coarse = (produce(unfilmed(1, rate=rate), tmp_path)[0] for rate in (1000.0, 500.0))
    assert fine.truth["actions"] == coarse.truth["actions"]
    assert fine.tracks == coarse.tracks
    incoming, other = fine.demonstration, coarse.demonstration
    assert other.period == pytest.approx(0.002)
    resampled = np.interp(other.times, incoming.times, incoming.signals[:, 2])
    # The same gain to well below the 5 % by which devices differ.
    slope = np.polyfit(resampled, other.signals[:, 2], 1)[0]
    assert slope == pytest.approx(1.0, abs=0.01)


def test_videos_are_the_same_bytes_and_their_truth_counts_every_frame(quick, tmp_path):
    orders = [Order(Origin("foam", 3, 1)), Order(Origin("foam", 3, 2), synchronised=False)]
    once, again = produce(orders, tmp_path), produce(orders, tmp_path)
    for incoming, other in zip(once, again, strict=True):
        file = incoming.demonstration.video.path
        assert file.read_bytes() == other.demonstration.video.path.read_bytes()
        reader = cv2.VideoCapture(str(file))
        assert reader.get(cv2.CAP_PROP_FRAME_COUNT) == len(incoming.truth["video"]["frames"])
        reader.release()
        assert np.all(np.diff(incoming.truth["video"]["frames"]) > 0)
    clocks = [
        ClockMap(incoming.truth["video"]["offset"], incoming.truth["video"]["rate"])
        for incoming in once
    ]
    assert once[0].demonstration.video.clock == clocks[0]
    assert once[1].demonstration.video.clock == ClockMap() != clocks[1]


def test_the_truth_says_what_the_coders_got_wrong(quick, tmp_path):
    every = produce(unfilmed(*range(1, 13)), tmp_path)
    actions = every[0].truth["actions"]
    assert [name for *_, name in actions] == ["still", "grab", "hold", "release", "still"]
    mistakes = [wrong for incoming in every for wrong in incoming.truth["mistakes"]["Tomas"]]
    assert mistakes  # of sixty short segments he overlooks or confuses some
    assert all([start, end, name] in actions for start, end, name, _ in mistakes)
    faultless = [incoming for incoming in every if not incoming.truth["mistakes"]["Ines"]]
    assert faultless
    for incoming in faultless:
        assert [s.action for s in incoming.tracks[0].segments] == [name for *_, name in actions]


def test_an_action_looks_the_same_in_every_task(quick, tmp_path):
    orders = [order for task in TASKS for order in unfilmed(1, task=task)]
    looks_by_action = {}
    for incoming in produce(orders, tmp_path):
        for action in incoming.vocabulary:
            assert looks_by_action.setdefault(action.name, action.look) == action.look
    assert looks_by_action.keys() == {entry.action for entry in glossary()}


def test_nothing_is_begun_before_it_is_asked_for_and_progress_reaches_the_end(quick, tmp_path):
    job = produce_demonstrations(unfilmed(1, 2), tmp_path)
    steps = [next(job)]
    assert steps[0].done == 0
    assert list(tmp_path.iterdir()) == []
    steps += job
    assert [step.done for step in steps] == sorted(step.done for step in steps)
    assert steps[-1].done == steps[-1].total == 3
