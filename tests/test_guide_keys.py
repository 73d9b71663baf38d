"""A key or a menu in the guide is one of the program."""

import re
from pathlib import Path

import pytest

from forcelab.gui.commands import COMMANDS

GUIDE = Path(__file__).resolve().parents[1] / "assets" / "guide"
PAGES = sorted(GUIDE.glob("*.md"))
KEYS = {command.text: command.keys for command in COMMANDS}
MENUS = {f"{command.group} > {command.text}" for command in COMMANDS} | {
    f"{menu} > {entry}"
    for menu, entries in {"File": ["Open recent"], "View": ["Panels", "Theme"]}.items()
    for entry in entries
}
CHORD = re.compile(r"(?<![\w+])(?:(?:Ctrl|Shift|Alt)\+)+(?:\w+|[-=+,.])|\bF\d{1,2}\b(?!@)")
#: What a terminal knows, and not the window.
TERMINAL = {"Ctrl+C"}
#: What the mouse does while such a key is held.
GESTURES = ("click", "drag", "wheel")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_keys_and_menus_of_a_page_are_those_of_the_program(page):
    text = " ".join(re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.S).split())
    chords = {key for key in CHORD.findall(text) if not key.endswith(GESTURES)}
    assert chords - {key for keys in KEYS.values() for key in keys} - TERMINAL == set()
    paths = re.findall(r"\*\*(\w+ > [^*]+)\*\*", text)
    assert {" > ".join(path.split(" > ")[:2]) for path in paths} - MENUS == set()


def test_the_table_of_keys_names_each_command_with_its_key():
    text = (GUIDE / "label.md").read_text("utf-8").split("\n## Keys\n")[1].split("\n## ")[0]
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("| ")]
    named = {name: key.strip("`") for row in rows[1:] for name, key in _pairs(row)}
    assert named["Split the segment at the cursor"] == "Ctrl+B"
    assert {name: key for name, key in named.items() if key not in KEYS.get(name, ())} == {}


def _pairs(row):
    """The commands of a row and their keys."""
    names, keys = row[0].split(", "), row[1].split(", ")
    return zip(names, keys, strict=True) if keys != ["its key"] else ()
