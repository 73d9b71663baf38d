"""Recipes: numbers drawn out of their ranges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab.simulation.scene import TASKS
from forcelab.simulation.tasks.choreography import Choreography
from forcelab.simulation.tasks.plays import PLAYS
from forcelab.simulation.tasks.recipe import FURTHEST, Recipe, recipe

SCENE = {
    "jaws": {"mass": 0.05},
    "body": {"shape": "block", "mass": 0.02, "half_width": 0.02, "stiffness": 500.0},
}
positive = st.floats(1e-6, 1e6)


def of_hand(**hand):
    return Recipe("foam", ("still",), SCENE, hand)


def drawn_grip(low, high, rng):
    return of_hand(grip=[low, high]).drawn_hand(rng)["grip"]


def of_parts(**parts):
    return Recipe("foam", ("still",), {**SCENE, **parts}, {})


@pytest.mark.parametrize("task", TASKS)
def test_every_task_has_a_recipe_whose_actions_are_named_once(task):
    actions = recipe(task).actions
    assert len(set(actions)) == len(actions) >= 4
    assert {"still", "grab"} <= set(actions)


# Numbers


@settings(max_examples=60)
@given(positive, st.floats(1.001, 50.0), st.integers(0, 2**32))
def test_a_number_is_drawn_from_within_its_range_or_a_quarter_of_its_width_beyond(low, by, seed):
    high = low * by
    drawn = drawn_grip(low, high, np.random.default_rng(seed))
    beyond = by ** (0.5 * (FURTHEST - 1.0))
    assert low / beyond * (1 - 1e-9) <= drawn <= high * beyond * (1 + 1e-9)


def test_eight_in_ten_numbers_lie_in_the_range_and_as_many_below_as_above():
    rng = np.random.default_rng(0)
    drawn = np.array([drawn_grip(2.0, 8.0, rng) for _ in range(4000)])
    # Three standard deviations of a share of 0.8 and of 0.1 among 4000.
    assert np.mean((drawn >= 2.0) & (drawn <= 8.0)) == pytest.approx(0.8, abs=0.019)
    assert np.mean(drawn < 2.0) == pytest.approx(0.1, abs=0.0143)
    assert np.median(drawn) == pytest.approx(4.0, rel=0.05)


def test_ranges_of_a_scene_are_drawn_from_too_also_in_parts_of_parts():
    hard = of_parts(
        body={**SCENE["body"], "stiffness": [400, 650]},
        arm={"axes": ["y", "z"], "pads": {"static": [1.0, 1.2], "kinetic": 0.8}},
    )
    scenes = [hard.drawn_scene(np.random.default_rng(seed)) for seed in range(30)]
    stiffness = [scene.body.stiffness for scene in scenes]
    static = [scene.arm.pads.static for scene in scenes]
    assert 300 < min(stiffness) < 500 < max(stiffness) < 800
    assert 0.9 < min(static) < 1.1 < max(static) < 1.3
    assert {scene.arm.pads.kinetic for scene in scenes} == {0.8}
    assert {scene.arm.axes for scene in scenes} == {("y", "z")}


@pytest.mark.parametrize("task", TASKS)
def test_every_number_of_every_task_is_drawn_within_what_its_recipe_states(task):
    written = recipe(task)
    ranges = {name: value for name, value in written.hand.items() if isinstance(value, list)}
    assert ranges
    for seed in range(20):
        drawn = written.drawn_hand(np.random.default_rng(seed))
        assert drawn.keys() == written.hand.keys()
        for name, (low, high) in ranges.items():
            assert low * (low / high) ** 0.25 <= drawn[name] * (1 + 1e-9)
            assert drawn[name] <= high * (high / low) ** 0.25 * (1 + 1e-9)


@pytest.mark.parametrize("task", TASKS)
def test_a_play_asks_for_every_number_of_its_recipe(task):
    asked = set()

    class Hand(dict):
        def __getitem__(self, name):
            asked.add(name)
            return super().__getitem__(name)

    for seed in range(10):
        rng = np.random.default_rng(seed)
        scene = recipe(task).drawn_scene(rng)
        play = Choreography(scene, Hand(recipe(task).drawn_hand(rng)), rng, taps=True)
        PLAYS[task](play)
        play.end()
        play.values()
    assert asked == recipe(task).hand.keys()
