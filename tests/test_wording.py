import pytest

from forcelab.text import counted, listed, there_are, unknown_word


@pytest.mark.parametrize(
    ("number", "text"), [(0, "0 runs"), (1, "1 run"), (2, "2 runs"), (60_080, "60,080 runs")]
)
def test_a_number_and_its_noun_agree(number, text):
    assert counted(number, "run") == text


def test_how_many_there_are_ends_a_sentence():
    assert [there_are(n) for n in range(3)] == ["there are none", "there is 1", "there are 2"]


def test_of_many_names_the_first_are_told():
    assert [listed("abcd"[:n], 3) for n in (2, 3, 4)] == ["a, b", "a, b, c", "a, b, c and 1 more"]


def test_of_an_unknown_word_the_nearest_known_one_is_offered():
    known = ("fast", "best")
    assert unknown_word("preset", "bset", known) == (
        "There is no preset 'bset'; did you mean 'best'? Choose from fast, best."
    )
    assert unknown_word("preset", 7, known) == "There is no preset '7'; choose from fast, best."
