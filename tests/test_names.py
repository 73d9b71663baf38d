"""Names that people type twice, and not quite alike."""

from forcelab.text import name_alike, tidy_name


def test_names_are_alike_that_differ_by_case_or_spaces_alone() -> None:
    known = ["Ines", "slip  transition"]
    assert name_alike("ines", known) == name_alike(" Ines", known) == "Ines"
    assert name_alike("Slip transition", known) == "slip  transition"
    assert name_alike("Ines", known) is None  # that one itself
    assert name_alike("Inez", known) is None
    assert tidy_name(" Ines\t") == "Ines"
