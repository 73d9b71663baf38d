"""The vocabulary: which actions there are, how they look and which key paints them.

Each task has its own. Colour, texture and key are stored with the action, never derived: it keeps
them for as long as it is in the vocabulary, under another name too, as coders learn them by heart.
New actions get their keys in the order of the task, 1, 2, 3, ...; textures only once the task has
no plain colour left. Keys can start at 1 in every task, since one task is labelled at a time;
colours of several tasks are seen side by side, in pairs, matrices and figures. So an action has the
colour that it has in the project's other tasks, and a colour stands for one action throughout the
project for as long as the eight suffice. Where that would need a texture, the task gets another
plain colour instead: what is labelled now must be told apart at a glance.

Spellings that differ between coders are brought together by a merge map
(:mod:`forcelab.label_map`) when a recogniser is trained or scored; stored labels keep the coder's.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from itertools import count

from forcelab.errors import InputError
from forcelab.labels import check_action_name

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

    Examples
    --------
    >>> vocabulary = forcelab.Vocabulary().with_actions("grab", "hold")
    >>> [(action.name, action.key) for action in vocabulary]
    [('grab', '1'), ('hold', '2')]
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

    def with_actions(
        self, *names: str, like: Iterable[Action] = (), keys: Mapping[str, str] | None = None
    ) -> Vocabulary:
        """Add the actions that are missing, at the end; the others stay exactly as they are.

        A new action gets the look of the first action of its name in `like` whose look is free.
        Otherwise it gets a plain colour that nothing has, here or in `like`; then one that nothing
        has here; then the eight with texture 1, and so on. Its key is the first that is free, or
        none when all are taken.

        Parameters
        ----------
        *names : str
        like : iterable of Action
            How actions look elsewhere, such as in the project's other tasks.
        keys : mapping of str to str, optional
            Keys of new actions by name, where these are free.

        Raises
        ------
        InputError
            If a name is blank, or a key is none.
        """
        new = [name for name in dict.fromkeys(names) if name not in self]
        looks = {action.look for action in self.actions}
        given: dict[str, tuple[str, int]] = {}
        elsewhere = tuple(like)
        # First all that look as they do elsewhere, so that no new one takes what they need.
        for action in elsewhere:
            if action.name in new and action.name not in given and action.look not in looks:
                given[action.name] = action.look
                looks.add(action.look)
        taken = {action.key for action in self.actions}
        bound: dict[str, str] = {}
        for name in new:
            key = (keys or {}).get(name, "")
            if key and key not in taken:
                bound[name] = key
                taken.add(key)
        actions = list(self.actions)
        for name in new:
            if name not in given:
                given[name] = _free_look(looks, {action.look for action in elsewhere})
                looks.add(given[name])
            if name not in bound:
                bound[name] = _free_key(taken)
                taken.add(bound[name])
            colour, texture = given[name]
            actions.append(Action(name, colour, bound[name], texture))
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
        """Give an action another colour (``"#rrggbb"``), plain unless another action has that.

        Then it gets the first texture that is free.

        Raises
        ------
        InputError
            If the action is not known or the colour is none.
        """
        old = self._known(name)
        action = replace(old, colour=colour)
        taken = {other.look for other in self.actions if other is not old}
        texture = next(t for t in count() if (action.colour, t) not in taken)
        return self._replaced(old, replace(action, texture=texture))

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
    colour and differ in texture; one whose key is taken gets the first that is free. With `apart`
    they get their task as a suffix, as ``grab_foam``.
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


def _free_look(
    taken: Collection[tuple[str, int]], elsewhere: Collection[tuple[str, int]] = ()
) -> tuple[str, int]:
    """The first colour and texture that nothing has; a plain colour also `elsewhere`, if any is."""
    plain = ((colour, 0) for colour in COLOURS)
    looks = ((colour, texture) for texture in count() for colour in COLOURS)
    unused = (look for look in plain if look not in taken and look not in elsewhere)
    return next(unused, None) or next(look for look in looks if look not in taken)


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
