"""The glossary tells a coder what each action is, completely and in plain sentences."""

import re

import pytest

from forcelab import resources
from forcelab.terms import Entry, glossary
from forcelab.vocabulary import Vocabulary

#: The actions of the paper's tasks.
ACTIONS = (
    *("still", "grab", "hold", "search", "insert", "release", "pull"),
    *("slip", "slip transition", "slipped", "twist"),
)
GOOD = {
    "sentence": "The jaws close.",
    "starts": "A jaw touches.",
    "ends": "The grip is firm.",
    "unlike": "Not hold.",
    "picture": "actions/grab.png",
}


@pytest.fixture
def written(tmp_path, monkeypatch):
    """Put a glossary of these tables, values as in TOML, in the place of the program's own."""
    monkeypatch.setattr(resources, "FOLDERS", (tmp_path,))

    def write(tables):
        lines = []
        for action, values in tables.items():
            lines.append(f'["{action}"]')
            lines += [f"{name} = {_toml(value)}" for name, value in values.items()]
        (tmp_path / "actions.toml").write_text("\n".join(lines), "utf-8")

    return write


def _toml(value):
    return '"' + value.replace("\n", "\\n") + '"' if isinstance(value, str) else str(value).lower()


def test_every_action_of_the_tasks_is_explained():
    assert tuple(entry.action for entry in glossary()) == ACTIONS
    assert Vocabulary().with_actions(*(entry.action for entry in glossary())).names == ACTIONS


def test_every_entry_is_short_and_says_what_it_is_not():
    for entry in glossary():
        texts = (entry.sentence, entry.starts, entry.ends, entry.unlike)
        assert all(re.fullmatch(r"[A-Z][^\n]*\.", text) for text in texts), entry.action
        # A line of a tool tip.
        assert max(map(len, texts)) <= 100, entry.action
        assert entry.sentence.count(".") == 1
        others = re.findall(r"Not ([a-z ]+)[:.]", entry.unlike)
        assert others, entry.action
        assert {entry.action} | set(others) <= set(ACTIONS)
        assert entry.action not in others


def test_entries_keep_the_order_of_the_file(written):
    written({"twist": GOOD, "slip transition": GOOD, "grab": GOOD})
    assert [entry.action for entry in glossary()] == ["twist", "slip transition", "grab"]
    assert glossary()[2] == Entry("grab", *GOOD.values())
