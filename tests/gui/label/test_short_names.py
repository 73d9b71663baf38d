"""Names of actions in narrow segments."""

from itertools import combinations

import pytest

from forcelab.gui.label.track_painting import abbreviations, short_name

STYLUS = ("still", "grab", "pull", "slip", "slip transition", "slipped", "release")


def test_a_name_is_cut_to_what_fits_but_not_to_nothing(app):
    names = ("slip transition",)
    whole, wide = short_name("slip transition", names, 12.0, 500)
    assert whole == "slip transition"
    for room in range(500):
        name, width = short_name("slip transition", names, 12.0, room)
        assert width <= max(room, 0)
        if room >= 12:
            assert name.startswith("s")
        if room >= wide:
            assert name == whole
    assert short_name("slip transition", names, 12.0, 3) == ("", 0.0)
    assert short_name("x", ("x",), 12.0, 100)[0] == "x"


@pytest.mark.parametrize("room", range(4, 120, 3))
def test_no_two_actions_are_shortened_to_the_same(app, room):
    short = [short_name(name, STYLUS, 12.0, room)[0] for name in STYLUS]
    for (one, other), (a, b) in zip(combinations(STYLUS, 2), combinations(short, 2), strict=True):
        assert not a or a != b, (one, other, a)


def test_a_beginning_that_another_name_has_does_not_stand_for_a_longer_one(app):
    seen = {short_name("slip transition", STYLUS, 12.0, room)[0] for room in range(8, 110)}
    assert not {"sl", "s", "sli…", "slip…"} & seen
    assert any(short.startswith("s…t") for short in seen)


def test_an_action_that_is_added_leaves_the_signs_of_the_others():
    before = abbreviations(STYLUS[:4])
    after = abbreviations(STYLUS)
    assert {name: pair[0] for name, pair in before.items()} == {
        name: after[name][0] for name in before
    }
    assert after["slip"][0] == "sl"
    assert after["slipped"][0] == "sp"
