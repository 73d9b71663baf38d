"""``forcelab actions``: the glossary on the command line."""

import cv2

from forcelab.terms import glossary


def test_every_action_is_told_with_a_picture_that_is_there(forcelab):
    output = forcelab("actions", "--json").json
    assert [entry["action"] for entry in output] == [described.action for described in glossary()]
    for entry in output:
        assert cv2.imread(entry["picture"]).shape == (180, 648, 3)


def test_one_action_is_told_alone_with_how_to_decide(forcelab):
    out = forcelab("actions", "slip").out
    assert out.startswith("slip: ")
    assert "starts" in out
    assert "unlike" in out
    assert "twist" not in out


def test_an_action_that_is_none_is_refused_with_those_there_are(forcelab):
    sentence = forcelab("actions", "dance").wrong_word
    assert sentence.startswith("forcelab: There is no 'dance' in the glossary; it has ")
    assert "slip transition" in sentence
