"""Names that people type twice, and not quite alike."""

from forcelab.text import left_out, name_alike, tidy_name, unique_names


def test_names_are_alike_that_differ_by_case_or_spaces_alone() -> None:
    known = ["Ines", "slip  transition"]
    assert name_alike("ines", known) == name_alike(" Ines", known) == "Ines"
    assert name_alike("Slip transition", known) == "slip  transition"
    assert name_alike("Ines", known) is None  # that one itself
    assert name_alike("Inez", known) is None
    assert tidy_name(" Ines\t") == "Ines"


def test_names_that_repeat_get_numbers_that_no_other_has() -> None:
    assert unique_names(["fx", "fx", "fx 2", "fx", "t"]) == ["fx", "fx 3", "fx 2", "fx 4", "t"]
    assert len(set(unique_names(["a"] * 60_000))) == 60_000  # at once


def test_what_was_left_out_is_counted_by_its_noun() -> None:
    assert left_out(1, "state without length") == "1 state without length was left out"
    assert left_out(2, "result of the type 'x'") == "2 results of the type 'x' were left out"
    assert left_out(2, "point event") == "2 point events were left out"
