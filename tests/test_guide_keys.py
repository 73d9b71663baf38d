"""Keys, menus and buttons in the guide are those of the program."""

import re
from pathlib import Path

import pytest

from forcelab.gui.commands import COMMANDS

ROOT = Path(__file__).resolve().parents[1]
GUIDE = ROOT / "assets" / "guide"
PAGES = sorted(GUIDE.glob("*.md"))
#: The pages in which what is bold is on the screen, but for words that begin a paragraph.
SHOWING = (
    "index",
    "first-hour-sample",
    "first-hour-own",
    "label",
    "review",
    "capture",
    "questions",
)
KEYS = {command.text: command.keys for command in COMMANDS}
MENUS = {f"{command.group} > {command.text}" for command in COMMANDS} | {
    f"{menu} > {entry}"
    for menu, entries in {"File": ["Open recent"], "View": ["Panels", "Theme"]}.items()
    for entry in entries
}
CHORD = re.compile(r"(?<![\w+])(?:(?:Ctrl|Shift|Alt)\+)+(?:\w+|[-=+,.])|\bF\d{1,2}\b(?!@)")
#: What a terminal knows, and not the window.
TERMINAL = {"Ctrl+C", "Ctrl+Break"}
#: What the mouse does while such a key is held.
GESTURES = ("click", "drag", "wheel")


def prose(page):
    """A page's text in one line, without its blocks of code."""
    return " ".join(re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.S).split())


@pytest.fixture(scope="module")
def shown():
    """Every text in the sources of the window, without what is filled in."""
    texts = []
    for path in (ROOT / "forcelab" / "gui").rglob("*.py"):
        code = re.sub(r'""".*?"""', "", path.read_text("utf-8"), flags=re.S)
        code = re.sub(r'"\s*\n\s*f?"', "", re.sub(r"\{[^{}\n]*\}", "", code))
        texts += re.findall(r'"([^"\n]+)"', code.replace("&", ""))
    return "\n".join(texts)


@pytest.mark.parametrize("page", SHOWING)
def test_what_is_bold_is_on_the_screen(page, shown):
    bold = re.findall(r"\*\*([^*]+)\*\*", prose(GUIDE / f"{page}.md"))
    names = {name for text in bold for name in text.split(" > ") if not text.endswith((".", ":"))}
    assert names
    assert {name for name in names if name not in shown} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_keys_and_menus_of_a_page_are_those_of_the_program(page):
    text = prose(page)
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


def test_menus_that_messages_send_to_are_those_of_the_program():
    code = "\n".join(path.read_text("utf-8") for path in (ROOT / "forcelab").rglob("*.py"))
    code = re.sub(r'"\s*\n\s*f?"', "", code)
    groups = "|".join({command.group for command in COMMANDS})
    sent = re.findall(rf"\b(?:{groups}) > [^\"\n]+", code)
    assert sent
    entries = tuple(path.rstrip("…") for path in MENUS)
    assert [path for path in sent if not path.startswith(entries)] == []
