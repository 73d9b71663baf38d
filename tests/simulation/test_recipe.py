"""Recipes: read strictly, and numbers drawn out of their ranges."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from forcelab import resources
from forcelab.errors import InputError
from forcelab.simulation.scene import TASKS
from forcelab.simulation.tasks import scene_of
from forcelab.simulation.tasks.recipe import FURTHEST, Recipe, recipe

SCENE = {
    "jaws": {"mass": 0.05},
    "body": {"shape": "block", "mass": 0.02, "half_width": 0.02, "stiffness": 500.0},
}
positive = st.floats(1e-6, 1e6)


def of_hand(**hand):
    return Recipe("foam", ("still",), SCENE, hand)


def drawn_grip(low, high, rng):
    return of_hand(grip=[low, high]).drawn_hand(rng, ("grip",))["grip"]


def of_parts(**parts):
    return Recipe("foam", ("still",), {**SCENE, **parts}, {})


@pytest.fixture
def rewritten(tmp_path, monkeypatch):
    """Rewrites a task's recipe in a copy of the assets, for as long as the test lasts."""
    folder = tmp_path / "assets"
    shutil.copytree(resources.asset("tasks", "foam.toml").parent, folder / "tasks")
    monkeypatch.setattr(resources, "FOLDERS", (folder,))

    def rewrite(old, new, task="foam"):
        path = folder / "tasks" / f"{task}.toml"
        text = path.read_text("utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), "utf-8")
        recipe.cache_clear()

    recipe.cache_clear()
    yield rewrite
    recipe.cache_clear()


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


def test_a_number_without_a_range_is_that_number():
    drawn = of_hand(grip=3, lift=0.02).drawn_hand(np.random.default_rng(1), ("lift", "grip"))
    assert drawn == {"grip": 3.0, "lift": 0.02}


def test_the_same_stream_gives_the_same_scene_and_another_one_another():
    first, again, second = (
        recipe("stylus").drawn_scene(np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert first == again
    assert first != second


@pytest.mark.parametrize("task", TASKS)
def test_every_number_of_every_task_is_drawn_within_what_its_recipe_states(task):
    written = recipe(task)
    ranges = {name: value for name, value in written.hand.items() if isinstance(value, list)}
    assert ranges
    for seed in range(20):
        drawn = written.drawn_hand(np.random.default_rng(seed), tuple(written.hand))
        assert drawn.keys() == written.hand.keys()
        for name, (low, high) in ranges.items():
            assert low * (low / high) ** 0.25 <= drawn[name] * (1 + 1e-9)
            assert drawn[name] <= high * (high / low) ** 0.25 * (1 + 1e-9)


# What is refused

WRONG = {
    "an unknown part": ("[hand]", "[foot]\nsize = 1.0\n[hand]", "foot"),
    "an unknown number of a part": ("[jaws]", "[jaws]\nteeth = 3", "teeth"),
    "an unknown number of a part in a part": ("pads = {", "pads = { rubber = 1,", "rubber"),
    "an unknown number of the hand": ("[hand]", "[hand]\nfingers = 5", "fingers"),
    "a part that is a number": ("actions =", "holder = 3\nactions =", "holder"),
    "a missing part": ("[body]", "[bodies]", "body"),
    "a missing number of a part": ("half_width = 0.02", "", "half_width"),
    "a missing number of the hand": ("grip =", "grasp =", "gr"),
    "a hand that is a number": ("[hand]", "hand = 3\n[hands]", "hand"),
    "a missing hand": ("[hand]", "[arm.hand]", "hand"),
    "missing actions": ("actions =", "verbs =", "actions"),
    "a reversed range": ("grip = [", "grip = [90.0, 3.0] #", "grip"),
    "a range from zero": ("grip = [", "grip = [0.0, 3.0] #", "grip"),
    "a range from below zero": ("lift = [", "lift = [-1.0, 3.0] #", "lift"),
    "a range to infinity": ("lift = [", "lift = [1.0, inf] #", "lift"),
    "a range of one": ("lift = [", "lift = [1.0] #", "lift"),
    "a range of three": ("lift = [", "lift = [1.0, 2.0, 3.0] #", "lift"),
    "a number beyond all bounds": ("lift = [", "lift = inf #", "lift"),
    "text for a number": ("grip = [", 'grip = "firm" #', "grip"),
    "a reversed range of a part": ("\nstiffness = [", "\nstiffness = [9e5, 3.0] #", "stiffness"),
    "a negative number of a part": ("mass = 0.25", "mass = -0.25", "mass"),
}


@pytest.mark.parametrize(("old", "new", "named"), WRONG.values(), ids=WRONG)
def test_a_recipe_with_something_wrong_is_refused_with_one_sentence(rewritten, old, new, named):
    rewritten(old, new)
    with pytest.raises(InputError) as refusal:
        scene_of("foam", 0, 1)
    sentence = str(refusal.value)
    assert named in sentence
    assert sentence.endswith(".")
    assert "\n" not in sentence


def test_the_sentence_names_the_file(rewritten):
    rewritten("[jaws]", "[jaws]\nteeth = 3")
    with pytest.raises(InputError, match=r"foam\.toml"):
        scene_of("foam", 0, 1)


def test_another_task_is_not_hurt_by_a_wrong_recipe(rewritten):
    rewritten("[jaws]", "[jaws]\nteeth = 3")
    assert scene_of("marker", 0, 1).task == "marker"
