from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from forcelab.errors import InputError
from forcelab.vocabulary import COLOURS, KEYS, Action, Vocabulary, joined

names = st.text(min_size=1, max_size=6).filter(str.strip)
vocabularies = st.lists(names, max_size=45).map(lambda found: Vocabulary().with_actions(*found))

SMALL = Vocabulary().with_actions("grab", "hold", "pull")


@given(vocabularies, st.lists(names, max_size=5))
def test_adding_actions_never_changes_the_others(vocabulary, new):
    grown = vocabulary.with_actions(*new)
    assert grown.actions[: len(vocabulary)] == vocabulary.actions
    assert grown.names == tuple(dict.fromkeys([*vocabulary.names, *new]))
    assert grown.with_actions(*new) == grown


@given(vocabularies.filter(len), st.data())
def test_removing_an_action_never_changes_the_others(vocabulary, data):
    name = data.draw(st.sampled_from(vocabulary.names))
    fewer = vocabulary.removed(name)
    assert name not in fewer
    assert set(fewer) == set(vocabulary) - {vocabulary[name]}
    # What it had is the first that is free again.
    assert set(fewer.with_actions(name)) == set(vocabulary)


@given(vocabularies)
def test_no_two_actions_look_alike_or_share_a_key(vocabulary):
    assert len({action.look for action in vocabulary}) == len(vocabulary)
    keys = [action.key for action in vocabulary if action.key]
    assert len(set(keys)) == len(keys) == min(len(vocabulary), len(KEYS))


def test_the_eight_colours_come_first_plain_then_textured():
    vocabulary = Vocabulary().with_actions(*(f"action {n}" for n in range(20)))
    looks = [action.look for action in vocabulary]
    assert looks[:8] == [(colour, 0) for colour in COLOURS]
    assert looks[8:16] == [(colour, 1) for colour in COLOURS]
    assert looks[16:] == [(colour, 2) for colour in COLOURS[:4]]
    assert sorted(COLOURS) == sorted(
        # Okabe and Ito, Color Universal Design, 2008.
        ["#000000", "#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7"]
    )


def test_keys_are_digits_then_letters_without_those_that_mean_something():
    vocabulary = Vocabulary().with_actions(*(f"action {n}" for n in range(40)))
    keys = [action.key for action in vocabulary]
    assert "".join(keys) == "123456789abcdefhijmopqrstuvwxyz"
    assert keys[31:] == [""] * 9


def test_a_vocabulary_is_looked_up_by_name():
    assert SMALL["hold"].name == "hold"
    assert "hold" in SMALL
    assert "slip" not in SMALL
    assert [action.name for action in SMALL] == ["grab", "hold", "pull"]
    with pytest.raises(KeyError, match="slip"):
        SMALL["slip"]


def test_a_new_key_changes_that_action_only():
    changed = SMALL.rebound("hold", "h")
    assert changed["hold"] == Action("hold", SMALL["hold"].colour, "h")
    assert (changed["grab"], changed["pull"]) == (SMALL["grab"], SMALL["pull"])
    assert changed.names == SMALL.names
    assert SMALL.rebound("hold", "2") == SMALL
    assert SMALL.rebound("hold", "").rebound("pull", "2")["pull"].key == "2"


def test_a_new_colour_changes_that_action_only_and_never_copies_a_look():
    changed = SMALL.recoloured("hold", "#AABBCC")
    assert changed["hold"] == Action("hold", "#aabbcc", "2")
    assert (changed["grab"], changed["pull"]) == (SMALL["grab"], SMALL["pull"])
    alike = SMALL.recoloured("hold", SMALL["grab"].colour)
    assert alike["hold"].look == (SMALL["grab"].colour, 1)
    assert alike.recoloured("hold", SMALL["grab"].colour) == alike


def test_a_new_name_changes_that_action_only_and_keeps_its_place():
    changed = SMALL.renamed("hold", "keep")
    assert changed.names == ("grab", "keep", "pull")
    assert changed["keep"] == Action("keep", SMALL["hold"].colour, "2")
    assert (changed["grab"], changed["pull"]) == (SMALL["grab"], SMALL["pull"])
    assert SMALL.renamed("hold", "hold") == SMALL


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda: SMALL.rebound("hold", "1"), "'1' paints 'grab'; give 'grab' another key"),
        (lambda: SMALL.rebound("hold", "k"), "'k' cannot paint 'hold'"),
        (lambda: SMALL.rebound("hold", "H"), "'H' cannot paint 'hold'"),
        (lambda: SMALL.rebound("hold", "0"), "'0' cannot paint 'hold'"),
        (lambda: SMALL.rebound("hold", "12"), "'12' cannot paint 'hold'"),
        (lambda: SMALL.rebound("slip", "s"), "no action 'slip'; the vocabulary has grab, hold"),
        (lambda: SMALL.recoloured("hold", "red"), "must look like #e69f00, not 'red'"),
        (lambda: SMALL.recoloured("hold", "#123456\n"), "must look like"),
        (lambda: SMALL.recoloured("slip", "#ffffff"), "no action 'slip'"),
        (lambda: SMALL.renamed("slip", "x"), "no action 'slip'"),
        (lambda: SMALL.renamed("hold", "grab"), "two actions called 'grab'"),
        (lambda: SMALL.renamed("hold", " "), "needs a name"),
        (lambda: SMALL.removed("slip"), "no action 'slip'"),
        (lambda: Vocabulary().removed("slip"), "the vocabulary has no actions"),
        (lambda: SMALL.with_actions(" "), "needs a name"),
        (lambda: Action("grab", "#ffffff", "1", -1), "texture of 'grab' is -1"),
        (lambda: Vocabulary((*SMALL, Action("grab", "#ffffff", ""))), "two actions called 'grab'"),
        (lambda: Vocabulary((*SMALL, Action("x", "#ffffff", "2"))), "have the key '2'"),
        (lambda: Vocabulary((*SMALL, Action("x", COLOURS[0], ""))), "'grab' and 'x' look the same"),
    ],
)
def test_what_is_no_vocabulary_is_refused_with_a_sentence(change, sentence):
    with pytest.raises(InputError, match=sentence):
        change()


@given(vocabularies)
def test_a_vocabulary_comes_back_from_json_as_it_was(vocabulary):
    text = json.dumps(vocabulary.to_json())
    assert Vocabulary.from_json(json.loads(text)) == vocabulary


GOOD = {"name": "grab", "colour": "#0072b2", "key": "1", "texture": 0}


@pytest.mark.parametrize(
    ("items", "sentence"),
    [
        ({"grab": GOOD}, "must be a list of actions"),
        (None, "must be a list of actions"),
        (["grab"], "Action 1 of the vocabulary"),
        ([GOOD, {**GOOD, "name": "hold", "texture": True}], "Action 2 of the vocabulary"),
        ([{**GOOD, "texture": 0.0}], "Action 1"),
        ([{**GOOD, "name": None}], "Action 1"),
        ([{**GOOD, "size": 3}], "Action 1"),
        ([{"name": "grab"}], "Action 1"),
        ([{**GOOD, "colour": "blue"}], "must look like"),
        ([GOOD, GOOD], "two actions called 'grab'"),
    ],
)
def test_json_that_is_no_vocabulary_is_refused_with_a_sentence(items, sentence):
    with pytest.raises(InputError, match=sentence):
        Vocabulary.from_json(items)


def test_an_action_can_be_added_with_the_look_that_it_has_elsewhere():
    elsewhere = Vocabulary().with_actions("grab", "twist", "tear")
    here = Vocabulary().with_actions("slip", "pull")  # blue and vermilion, as grab and twist
    found = here.with_actions("new", "tear", "twist", like=elsewhere)
    assert found["tear"].look == elsewhere["tear"].look
    assert found["twist"].look == (COLOURS[4], 0)  # plain, though 'pull' has its colour here
    assert found["new"].look == (COLOURS[3], 0)  # the first that is nowhere else
    assert [action.key for action in found] == ["1", "2", "3", "4", "5"]


tasks = st.lists(st.lists(st.sampled_from("abcdefghijklmnop"), max_size=10), max_size=5)


def grown(tasks):
    """Tasks whose actions were added one by one, each as the project's others look."""
    vocabularies = []
    for actions in tasks:
        like = [a for other in vocabularies for a in other if a.texture == 0]
        vocabulary = Vocabulary()
        for name in actions:
            vocabulary = vocabulary.with_actions(name, like=like)
        vocabularies.append(vocabulary)
    return vocabularies


@given(tasks)
def test_each_task_counts_its_keys_from_one_and_has_textures_only_without_a_colour_left(tasks):
    for vocabulary in grown(tasks):
        assert [action.key for action in vocabulary] == list(KEYS[: len(vocabulary)])
        plain = [action for action in vocabulary if action.texture == 0]
        assert len(plain) == min(len(vocabulary), len(COLOURS))


@given(tasks)
def test_a_colour_means_one_action_in_all_tasks_while_the_eight_suffice(tasks):
    looks = {}
    names = list(dict.fromkeys(name for actions in tasks for name in actions))
    for vocabulary in grown([[n for n in actions if n in names[:8]] for actions in tasks]):
        for action in vocabulary:
            assert looks.setdefault(action.name, action.look) == action.look
    assert len(set(looks.values())) == len(looks)


@given(vocabularies, st.lists(names, min_size=1, max_size=12), vocabularies)
def test_actions_added_together_leave_each_other_the_looks_from_elsewhere(here, new, elsewhere):
    found = here.with_actions(*new, like=elsewhere)
    taken = {action.look for action in here}
    for action in elsewhere:
        if action.name in new and action.name not in here and action.look not in taken:
            assert found[action.name].look == action.look


@given(vocabularies.filter(len), st.data())
def test_another_colour_is_plain_unless_an_action_of_the_task_has_it(vocabulary, data):
    name = data.draw(st.sampled_from(vocabulary.names))
    colour = data.draw(st.sampled_from((*COLOURS, "#123456")))
    changed = vocabulary.recoloured(name, colour)
    others = {action.look for action in vocabulary.removed(name)}
    assert (changed[name].texture == 0) == ((colour, 0) not in others)
    assert changed[name].key == vocabulary[name].key
    assert changed.removed(name) == vocabulary.removed(name)


def test_keys_that_are_wished_for_are_given_where_they_are_free():
    grown = SMALL.with_actions("new", "slip", "twist", keys={"slip": "4", "twist": "1", "new": ""})
    assert [action.key for action in grown] == ["1", "2", "3", "5", "4", "6"]


def test_tasks_together_keep_the_first_ones_looks_and_share_no_look_or_key():
    soft = Vocabulary().with_actions("still", "grab", "hold")
    hard = Vocabulary().with_actions("still", "insert", "grab")
    both = joined({"soft": soft, "hard": hard})
    assert both.actions[:3] == soft.actions
    assert both.names == ("still", "grab", "hold", "insert")
    assert both["insert"].colour == hard["insert"].colour
    assert both["insert"].texture == 1  # 'grab' has that colour here
    assert both["insert"].key == KEYS[3]
    apart = joined({"soft": soft, "hard": hard}, apart=True)
    assert [a.look for a in apart.actions[:3]] == [a.look for a in soft]
    assert apart.names[3:] == ("still_hard", "insert_hard", "grab_hard")
    assert apart["still_hard"].colour == soft["still"].colour


def test_no_action_is_renamed_to_what_says_that_there_is_none():
    with pytest.raises(InputError, match="cannot be called 'Unlabelled'"):
        SMALL.renamed("grab", "Unlabelled")
