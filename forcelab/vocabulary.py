"""The vocabulary: which actions there are, how they look and which key paints them.

An action keeps its colour, texture and key for as long as it is in the vocabulary, under another
name too: coders learn them by heart. Spellings that differ between coders are brought together by a
merge map (:mod:`forcelab.label_map`) when a recogniser is trained or scored; stored labels keep the
coder's.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import count

from forcelab.errors import InputError
from forcelab.labels import check_action_name

__all__ = ["COLOURS", "KEYS", "Action", "Vocabulary", "joined"]

#: The eight colours of Okabe and Ito (Color Universal Design, 2008), which stay apart for every
#: kind of colour vision. Of all orders this one keeps neighbours furthest apart for normal and
#: simulated colour-blind vision (CIE76 38 at least); black is last, as it looks like text.
COLOURS = (
    "#0072b2",  # blue
    "#d55e00",  # vermilion
    "#56b4e9",  # sky blue
    "#e69f00",  # orange
    "#009e73",  # bluish green
    "#f0e442",  # yellow
    "#cc79a7",  # reddish purple
    "#000000",  # black
)

#: Keys that paint an action, in the order in which they are given out. Left out are those with a
#: meaning of their own: 0 (normal speed), g (accept), k and l (previous, next segment), n (next
#: thing to review).
KEYS = "123456789abcdefhijmopqrstuvwxyz"


#: No task has more actions; nobody could tell them apart.
MOST_ACTIONS = 1000


@dataclass(frozen=True, slots=True)
class Action:
    """One action: its name, its look and its key.

    Parameters
    ----------
    name : str
        Such as ``"grab"``; not blank.
    colour : str
        ``"#rrggbb"``; stored in lower case.
    key : str
        One of :data:`KEYS`, or empty where no key was left.
    texture : int
        0 is plain; 1, 2, ... tell actions of the same colour apart.

    Raises
    ------
    InputError
        If the name is blank, or colour, key or texture is none.
    """

    name: str
    colour: str
    key: str
    texture: int = 0

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise InputError("An action needs a name.")
        if not re.fullmatch(r"#[0-9a-fA-F]{6}", self.colour):
            raise InputError(
                f"The colour of '{self.name}' must look like #e69f00, not '{self.colour}'."
            )
        object.__setattr__(self, "colour", self.colour.lower())
        if self.key and (len(self.key) != 1 or self.key not in KEYS):
            raise InputError(
                f"The key '{self.key}' cannot paint '{self.name}'; use one of {' '.join(KEYS)}."
            )
        if self.texture < 0:
            raise InputError(f"The texture of '{self.name}' is {self.texture}; count from 0.")

    @property
    def look(self) -> tuple[str, int]:
        """Colour and texture, which no other action of a vocabulary shares."""
        return self.colour, self.texture


def _first_twice(values: Iterable[object]) -> object | None:
    """The first value that is a repetition, if any."""
    previous = set()
    for value in values:
        if value in previous:
            return value
        previous.add(value)
    return None


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """The actions a project knows: distinct in name, in look and, where they have one, in key.

    Parameters
    ----------
    actions : iterable of Action
        In the order in which they are listed on screen.

    Raises
    ------
    InputError
        If two actions share a name, a key, or colour and texture.
    """

    actions: tuple[Action, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "actions", tuple(self.actions))
        if (name := _first_twice(self.names)) is not None:
            raise InputError(f"There are two actions called '{name}'; rename or remove one.")
        if (key := _first_twice(a.key for a in self.actions if a.key)) is not None:
            raise InputError(f"Two actions have the key '{key}'; give one of them another key.")
        if (look := _first_twice(a.look for a in self.actions)) is not None:
            first, second, *_ = (a.name for a in self.actions if a.look == look)
            raise InputError(f"'{first}' and '{second}' look the same; give one another colour.")

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the actions, in order."""
        return tuple(action.name for action in self.actions)

    def __getitem__(self, name: str) -> Action:
        for action in self.actions:
            if action.name == name:
                return action
        raise KeyError(name)

    def __contains__(self, name: object) -> bool:
        return name in self.names

    def __len__(self) -> int:
        return len(self.actions)

    def __iter__(self) -> Iterator[Action]:
        return iter(self.actions)

    def with_actions(self, *names: str, like: Iterable[Action] = ()) -> Vocabulary:
        """Add the actions that are missing, at the end; the others stay exactly as they are.

        A new action gets the first look and the first key that are free: the eight colours plain,
        then the eight with texture 1, and so on; no key when all are taken. Where an action of
        that name is in `like` and its look is free, it gets that one.

        Raises
        ------
        InputError
            If a name is blank.
        """
        actions = list(self.actions)
        known = set(self.names)
        styles = {action.look for action in actions}
        keys = {action.key for action in actions}
        preferred = {action.name: action.look for action in like}
        for name in names:
            if name in known:
                continue
            look = preferred.get(name)
            colour, texture = _free_look(styles) if look is None or look in styles else look
            key = _free_key(keys)
            actions.append(Action(name, colour, key, texture))
            known.add(name)
            styles.add((colour, texture))
            keys.add(key)
        return Vocabulary(tuple(actions))

    def rebound(self, name: str, key: str) -> Vocabulary:
        """Give an action another key, or none with ``""``.

        Raises
        ------
        InputError
            If the action is not known, or the key means something else or paints another action.
        """
        action = self._known(name)
        for other in self.actions:
            if key and other.key == key and other is not action:
                raise InputError(
                    f"The key '{key}' paints '{other.name}'; give '{other.name}' another key first."
                )
        return self._replaced(action, replace(action, key=key))

    def recoloured(self, name: str, colour: str) -> Vocabulary:
        """Give an action another colour (``"#rrggbb"``).

        It keeps its texture, unless another action has that look: then it gets the first texture
        that is free.

        Raises
        ------
        InputError
            If the action is not known or the colour is none.
        """
        old = self._known(name)
        action = replace(old, colour=colour)
        taken = {other.look for other in self.actions if other.name != name}
        if action.look in taken:
            texture = next(t for t in count() if (action.colour, t) not in taken)
            action = replace(action, texture=texture)
        return self._replaced(old, action)

    def renamed(self, name: str, new: str) -> Vocabulary:
        """Give an action another name; its look, its key and its place stay.

        Labels with the old name are not changed: to look as before they need an action of it.

        Raises
        ------
        InputError
            If the action is not known, or the new name is blank, another action's or says that
            there is none.
        """
        old = self._known(name)
        check_action_name(new)
        return self._replaced(old, replace(old, name=new))

    def removed(self, name: str) -> Vocabulary:
        """Take an action out; the others keep their looks and keys.

        Raises
        ------
        InputError
            If the action is not known.
        """
        gone = self._known(name)
        return Vocabulary(tuple(action for action in self.actions if action is not gone))

    def to_json(self) -> list[dict[str, str | int]]:
        """The actions as a list of objects with ``name``, ``colour``, ``key``, ``texture``."""
        return [asdict(action) for action in self.actions]

    @classmethod
    def from_json(cls, items: object) -> Vocabulary:
        """Build a vocabulary from what :meth:`to_json` gave.

        Parameters
        ----------
        items : object
            As parsed from JSON.

        Raises
        ------
        InputError
            If it is anything but a list of complete, valid actions.
        """
        if not isinstance(items, list):
            raise InputError("A vocabulary must be a list of actions.")
        if len(items) > MOST_ACTIONS:
            raise InputError(
                f"A vocabulary has up to {MOST_ACTIONS:,} actions, not {len(items):,}."
            )
        return cls(tuple(_action(item, number) for number, item in enumerate(items, 1)))

    def _known(self, name: str) -> Action:
        """The action called `name`."""
        if name not in self:
            known = ", ".join(self.names) or "no actions"
            raise InputError(f"There is no action '{name}'; the vocabulary has {known}.")
        return self[name]

    def _replaced(self, old: Action, new: Action) -> Vocabulary:
        """The same vocabulary with another action in the place of one."""
        return Vocabulary(tuple(new if action is old else action for action in self.actions))


def joined(tasks: Mapping[str, Vocabulary], *, apart: bool = False) -> Vocabulary:
    """The actions of several tasks together, those of the first exactly as they are there.

    Of a name that several have, the first one's look counts. Two actions of the same look keep the
    colour and differ in texture; one whose key is taken gets the first that is free.

    Parameters
    ----------
    tasks : mapping of str to Vocabulary
    apart : bool
        Whether actions get their task as a suffix, as ``grab_foam``.
    """
    actions: list[Action] = []
    for task, vocabulary in tasks.items():
        for action in vocabulary:
            name = f"{action.name}_{task}" if apart else action.name
            if any(other.name == name for other in actions):
                continue
            looks = {other.look for other in actions}
            texture = next(t for t in count(action.texture) if (action.colour, t) not in looks)
            keys = {other.key for other in actions}
            key = action.key if action.key not in keys else _free_key(keys)
            actions.append(replace(action, name=name, key=key, texture=texture))
    return Vocabulary(tuple(actions))


def _free_key(keys: Collection[str]) -> str:
    """The first key that is free; "" where none is."""
    return next((key for key in KEYS if key not in keys), "")


def _free_look(taken: set[tuple[str, int]]) -> tuple[str, int]:
    """The first colour and texture that nothing has."""
    looks = ((colour, texture) for texture in count() for colour in COLOURS)
    return next(look for look in looks if look not in taken)


def _action(item: object, number: int) -> Action:
    """The `number`-th action of a vocabulary in JSON."""
    kinds = {"name": str, "colour": str, "key": str, "texture": int}
    # type() and not isinstance(): true and false are no textures.
    if not isinstance(item, dict) or {k: type(v) for k, v in item.items()} != kinds:
        raise InputError(
            f"Action {number} of the vocabulary must have exactly the strings name, colour and key "
            f"and the whole number texture."
        )
    return Action(**item)
