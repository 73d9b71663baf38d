"""What the README shows is what happens, and it keeps to what is in a clone."""

import re
from fnmatch import fnmatch
from pathlib import Path

from make_assets import ASSETS, assets
from make_guide import DOCUMENTS, GUIDE, README, ROOT

TEXT = README.read_text("utf-8")


def test_ci_runs_the_readme_command_for_tests():
    runs = [line for line in TEXT.splitlines() if line.startswith(".ci/setup")]
    assert len(runs) == 2
    assert runs[1].startswith(".ci/setup test && ")
    assert (ROOT / ".ci" / "run").stat().st_mode & 0o111


def test_the_readme_is_short_as_the_guide_has_the_rest():
    assert len(TEXT.splitlines()) < 250


def test_the_example_recordings_are_what_the_generator_makes():
    found = {path.name: path.read_text("utf-8") for path in Path(ASSETS).glob("*.csv")}
    assert found == assets()


def test_what_the_commands_write_into_a_clone_is_ignored():
    """Somebody who tries them all has no new file to commit."""
    ignored = [line.strip("/") for line in (ROOT / ".gitignore").read_text("utf-8").splitlines()]
    text = "\n".join(document.read_text("utf-8") for document in DOCUMENTS)
    commands = re.findall(r"^(?:\$|\.ci/setup|  forcelab) .*|`.*?\bforcelab .*?`", text, re.M)
    named = re.findall(
        r"(?:--(?:screenshot|figure|confusion|json|out)|[>])\s+([\w.-]+)(?![\w.{}/-])",
        "\n".join(commands),
    )
    named += re.findall(r"[\w-]+\.forcelab\b", "\n".join(commands))
    assert {"sample.png", "window.png", "ports.json", "tongs.skops", "labels"} <= set(named)
    for name in named:
        if name.isupper():
            continue  # such as DIR, which stands for any
        places = (name, f"{name}/")
        assert any(fnmatch(place, rule) for place in places for rule in ignored), name


def test_the_results_are_those_that_the_guide_shows_with_their_intervals():
    guide = (GUIDE / "method.md").read_text("utf-8")
    rows = re.findall(
        r"^\| (`[a-z]+`).*?\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", TEXT, re.M
    )
    assert len(rows) >= 4
    for preset, *scores in rows:
        shown = re.search(rf"^\| {preset} \|(.*\(.*–.*)$", guide, re.M)[1].split("|")
        assert [cell.split()[0] for cell in shown[:4]] == scores, preset
