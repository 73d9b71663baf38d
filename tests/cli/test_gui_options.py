"""What no window can show is refused before there is one."""

import pytest

from forcelab.cli import main


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--at", "nan"), "'nan' is no time in seconds"),
        (("--at", "soon"), "'soon' is no time in seconds"),
        (("--span", "inf"), "'inf' is no time in seconds"),
        (("--span", "0"), "'0' is no length of time above 0 s"),
        (("--size", "99999x800"), "'99999x800' is too large; 8192 pixels are the most"),
    ],
)
def test_what_no_window_can_show_is_a_wrong_command_line(words, told, capsys):
    assert main(["gui", *words]) == 2
    assert told in capsys.readouterr().err
