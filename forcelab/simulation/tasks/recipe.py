"""Recipes: what defines a task's scene and how people do it, read from ``assets/tasks``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from functools import cache
from typing import Any, get_args, get_type_hints

import numpy as np

from forcelab.resources import read_toml
from forcelab.simulation.scene import Scene, Task

#: Standard deviations from the median to the ends of a range that eight in ten lie in.
EIGHT_IN_TEN = 1.2816
#: No number is further out than this many times half the range's width, in the logarithm.
FURTHEST = 1.5


@dataclass(frozen=True)
class Recipe:
    """A task as it is written down.

    A number is written as such or as a range ``[low, high]`` that eight in ten demonstrations lie
    in: log-normal about the geometric mean of its ends, and cut at :data:`FURTHEST`.
    """

    task: Task
    actions: tuple[str, ...]  # every action of the task, in the order of the vocabulary
    scene: Mapping[str, Any]  # the parts of the scene and their numbers
    hand: Mapping[str, Any]  # how people do it: durations in s, forces in N, ways in m

    def drawn_scene(self, rng: np.random.Generator) -> Scene:
        """A scene with numbers of its own."""
        scene = _built(Scene, {"task": self.task, **self.scene}, rng)
        assert isinstance(scene, Scene)
        return scene

    def drawn_hand(self, rng: np.random.Generator) -> dict[str, float]:
        """How the hand does it this time."""
        return {name: _number(value, rng) for name, value in self.hand.items()}


@cache
def recipe(task: Task) -> Recipe:
    table = read_toml("tasks", f"{task.lower()}.toml")
    actions, hand = table.pop("actions"), table.pop("hand")
    return Recipe(task, tuple(actions), scene=table, hand=hand)


def _number(value: Any, rng: np.random.Generator) -> float:
    """A number as it is written, or one out of the range that is."""
    if not isinstance(value, list):
        return float(value)
    low, high = value
    middle, half = np.log(low * high) / 2.0, np.log(high / low) / 2.0
    out = np.clip(rng.normal() / EIGHT_IN_TEN, -FURTHEST, FURTHEST)
    return float(np.exp(middle + half * out))


def _built(kind: type, table: Mapping[str, Any], rng: np.random.Generator) -> object:
    """A part of a scene from its table; parts within it are tables of their own."""
    hints = get_type_hints(kind)
    values: dict[str, Any] = {}
    for name, value in table.items():
        parts = [k for k in (hints[name], *get_args(hints[name])) if is_dataclass(k)]
        if parts:
            part = parts[0]
            assert isinstance(part, type)
            values[name] = _built(part, value, rng)
        elif hints[name] is float:
            values[name] = _number(value, rng)
        else:
            values[name] = tuple(value) if isinstance(value, list) else value
    return kind(**values)
