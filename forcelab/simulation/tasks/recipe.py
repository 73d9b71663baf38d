"""Recipes: what defines a task's scene and how people do it, read from ``assets/tasks``."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from typing import Any, NoReturn, get_args, get_type_hints

import numpy as np

from forcelab.errors import InputError
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
        try:
            scene = _built(Scene, {"task": self.task, **self.scene}, rng, self.file)
        except InputError as error:
            if self.file in str(error):
                raise
            raise InputError(f"'{self.file}': {error}") from error
        assert isinstance(scene, Scene)
        return scene

    def drawn_hand(self, rng: np.random.Generator, needed: Collection[str]) -> dict[str, float]:
        """How the hand does it this time.

        `needed`: every number that the task's choreography asks for.
        """
        for name in sorted(set(self.hand) ^ set(needed)):
            problem = "lacks" if name in needed else "has no use for"
            raise InputError(f"'{self.file}' {problem} '{name}' under [hand].")
        return {
            name: _number(value, rng, f"'{self.file}': hand.{name}")
            for name, value in self.hand.items()
        }

    @property
    def file(self) -> str:
        return _file(self.task)


@cache
def recipe(task: Task) -> Recipe:
    table = read_toml(_file(task))
    actions, hand = table.pop("actions", None), table.pop("hand", None)
    if not (isinstance(actions, list) and all(isinstance(a, str) for a in actions) and actions):
        raise InputError(f"'{_file(task)}' needs a list 'actions' of the task's actions.")
    if not isinstance(hand, dict):
        raise InputError(f"'{_file(task)}' needs a table [hand] of how people do it.")
    return Recipe(task=task, actions=tuple(actions), hand=hand, scene=table)


def _file(task: Task) -> str:
    """Where a task's recipe is among the assets."""
    return f"tasks/{task.lower()}.toml"


def _number(value: Any, rng: np.random.Generator, where: str) -> float:
    """A number as it is written, or one out of the range that is."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and np.isfinite(value):
        return float(value)
    ends = (
        [end for end in value if isinstance(end, (int, float))] if isinstance(value, list) else []
    )
    if len(ends) != 2 or len(value) != 2 or not 0 < ends[0] < ends[1] < np.inf:
        raise InputError(f"{where} must be a number or a range [low, high] with 0 < low < high.")
    low, high = ends
    middle, half = np.log(low * high) / 2.0, np.log(high / low) / 2.0
    out = np.clip(rng.normal() / EIGHT_IN_TEN, -FURTHEST, FURTHEST)
    return float(np.exp(middle + half * out))


def _built(kind: type, table: Mapping[str, Any], rng: np.random.Generator, where: str) -> object:
    """A part of a scene from its table; parts within it are tables of their own."""
    hints = get_type_hints(kind)
    known = {field.name: field for field in fields(kind)}
    values: dict[str, Any] = {}
    for name, field in known.items():
        if name not in table and field.default is MISSING:
            _refuse(where, f"there must be a '{name}' in {kind.__name__}")
    for name, value in table.items():
        if name not in known:
            _refuse(where, f"there is no '{name}' in {kind.__name__}")
        parts = [k for k in (hints[name], *get_args(hints[name])) if is_dataclass(k)]
        if parts:
            if not isinstance(value, dict):
                _refuse(where, f"'{name}' must be a table")
            part = parts[0]
            assert isinstance(part, type)
            values[name] = _built(part, value, rng, where)
        elif hints[name] is float:
            values[name] = _number(value, rng, f"'{where}': {kind.__name__}.{name}")
        else:
            values[name] = tuple(value) if isinstance(value, list) else value
    return kind(**values)


def _refuse(where: str, problem: str) -> NoReturn:
    """Say what is wrong with a recipe."""
    raise InputError(f"'{where}': {problem}.")
